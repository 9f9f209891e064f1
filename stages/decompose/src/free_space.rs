//! What is free.

use collision::{CollisionChecker, EdgeOutcome};

use crate::pairs::Pairs;
use crate::provable::Bodies;

/// An oracle for CS_free.
pub trait FreeSpace: Sync {
    /// Whether `q` is free.
    fn is_free(&self, q: &[f64]) -> bool;

    /// Whether the straight edge from `q_0` to `q_1` is free; by samples unless the oracle knows better. It only
    /// chooses seeds, so a wrong answer costs quality, not correctness.
    fn edge_is_free(&self, q_0: &[f64], q_1: &[f64]) -> bool {
        // Halves first: a blocked edge is mostly blocked around its middle.
        let mut step = 64;
        let mut q = vec![0.0; q_0.len()];
        while step >= 1 {
            for k in (step..128).step_by(2 * step) {
                let t = k as f64 / 128.0;
                q.iter_mut().zip(q_0.iter().zip(q_1)).for_each(|(q, (a, b))| *q = a + t * (b - a));
                if !self.is_free(&q) {
                    return false;
                }
            }
            step /= 2;
        }
        true
    }

    /// The pairs of bodies behind it, if it knows them.
    fn pairs(&self) -> Option<&dyn Pairs> {
        None
    }

    /// The bodies behind it, if it knows them: certificates are about bodies.
    fn bodies(&self) -> Option<&Bodies<'_>> {
        None
    }
}

impl FreeSpace for CollisionChecker {
    fn is_free(&self, q: &[f64]) -> bool {
        CollisionChecker::is_free(self, q)
    }

    fn edge_is_free(&self, q_0: &[f64], q_1: &[f64]) -> bool {
        matches!(CollisionChecker::edge_is_free(self, q_0, q_1), EdgeOutcome::Free)
    }

    fn pairs(&self) -> Option<&dyn Pairs> {
        Some(self)
    }
}

/// CS_free as a predicate.
pub struct FreeWhere<F>(pub F);

impl<F: Fn(&[f64]) -> bool + Sync> FreeSpace for FreeWhere<F> {
    fn is_free(&self, q: &[f64]) -> bool {
        (self.0)(q)
    }
}
