//! The equations that join the waypoints (thesis 2, Eq. 5.5a to 5.5c), solved exactly.
//!
//! Unknowns are the coordinates of x_1 … x_{2ℓ}; x_0 and x_{2ℓ+1} are given. Transit: F_transit x_{2i} = F_transit
//! x_{2i+1}; transfer: F_transfer x_{2i+1} = F_transfer x_{2i+2}. Elimination over the rationals leaves free unknowns
//! and writes the others as `constant + Σ coefficient · free`. Free unknowns are snapped to a binary grid, so that for
//! forms with coefficients ±1 every waypoint is a double and kept forms are equal exactly.

use crate::exact::{nearest, rational};
use manipulation::{Manipulation, PathMode};
use nalgebra::DVector;
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use std::collections::BTreeMap;

/// Spacing of the grid of free unknowns, 2⁻⁴⁰: finer than any margin, and sums of such numbers are exact.
const GRID: f64 = 1.0 / (1u64 << 40) as f64;

/// `Σ coefficient · unknown = constant`.
#[derive(Debug, Clone)]
struct Equation {
    terms: BTreeMap<usize, BigRational>,
    constant: BigRational,
}

/// An unknown that the equations determine.
#[derive(Debug, Clone)]
struct Dependent {
    unknown: usize,
    constant: BigRational,
    terms: BTreeMap<usize, BigRational>,
}

/// The solved system for one ℓ.
#[derive(Debug, Clone)]
pub struct KeptSystem {
    n: usize,
    n_waypoints: usize,
    /// Position in `dependents`, for each unknown that is one.
    dependent_of: Vec<Option<usize>>,
    dependents: Vec<Dependent>,
    /// Whether the equations contradict each other.
    contradictory: bool,
}

impl KeptSystem {
    /// The system of `n_grasps` grasps from `start` to `goal`.
    pub fn new(
        manipulation: &Manipulation,
        start: &DVector<f64>,
        goal: &DVector<f64>,
        n_grasps: usize,
    ) -> Self {
        let n = manipulation.dim();
        let n_waypoints = 2 * n_grasps;
        let reach: Vec<f64> = (0..n)
            .map(|k| manipulation.joint_box.lower[k].abs().max(manipulation.joint_box.upper[k].abs()))
            .collect();
        let mut system = Self {
            n,
            n_waypoints,
            dependent_of: vec![None; n * n_waypoints],
            dependents: Vec::new(),
            contradictory: false,
        };
        for segment_idx in 0..=n_waypoints {
            let mode = mode_of_segment(segment_idx);
            for form in manipulation.kept_forms(mode).row_iter() {
                let mut equation = Equation { terms: BTreeMap::new(), constant: BigRational::zero() };
                for (waypoint_idx, sign) in [(segment_idx, 1.0), (segment_idx + 1, -1.0)] {
                    for k in (0..n).filter(|&k| form[k] != 0.0) {
                        let coefficient = rational(sign * form[k]);
                        if waypoint_idx == 0 {
                            equation.constant -= coefficient * rational(start[k]);
                        } else if waypoint_idx == n_waypoints + 1 {
                            equation.constant -= coefficient * rational(goal[k]);
                        } else {
                            equation.terms.insert((waypoint_idx - 1) * n + k, coefficient);
                        }
                    }
                }
                system.add(equation, &reach);
            }
        }
        system.back_substitute();
        system
    }

    /// Whether no choice of the unknowns satisfies the equations.
    pub fn is_contradictory(&self) -> bool {
        self.contradictory
    }

    /// Whether coordinate `k` of waypoint `waypoint_idx` (1 … 2ℓ) is determined by start and goal alone.
    pub fn is_fixed(&self, waypoint_idx: usize, k: usize) -> bool {
        self.dependent_of[(waypoint_idx - 1) * self.n + k]
            .is_some_and(|dependent_idx| self.dependents[dependent_idx].terms.is_empty())
    }

    /// Waypoints x_1 … x_{2ℓ} near `near` that satisfy the equations: exactly wherever the determined values are
    /// doubles, else with each rounded to the nearest double.
    pub fn snap(&self, near: &[DVector<f64>]) -> Vec<DVector<f64>> {
        let value = |unknown: usize| (near[unknown / self.n][unknown % self.n] / GRID).round() * GRID;
        (0..self.n_waypoints)
            .map(|idx| {
                DVector::from_fn(self.n, |k, _| {
                    let unknown = idx * self.n + k;
                    match self.dependent_of[unknown] {
                        None => value(unknown),
                        Some(dependent_idx) => {
                            let dependent = &self.dependents[dependent_idx];
                            let sum = dependent
                                .terms
                                .iter()
                                .fold(dependent.constant.clone(), |sum, (&free, coefficient)| {
                                    sum + coefficient * rational(value(free))
                                });
                            nearest(&sum)
                        }
                    }
                })
            })
            .collect()
    }

    /// Adds an equation, reduced by those that are there; a new pivot, if any unknown remains.
    fn add(&mut self, mut equation: Equation, reach: &[f64]) {
        // A substituted term may bring in a later pivot again, so reduce until none is left.
        while let Some((&unknown, dependent_idx)) = equation.terms.iter().find_map(|(unknown, _)| {
            self.dependent_of[*unknown].map(|dependent_idx| (unknown, dependent_idx))
        }) {
            let Some(factor) = equation.terms.remove(&unknown) else { break };
            let dependent = &self.dependents[dependent_idx];
            equation.constant -= &factor * &dependent.constant;
            add_multiple(&mut equation.terms, &factor, &dependent.terms);
        }
        // Pivots of ±1 keep coefficients integer; a coordinate of small reach holds finer fractions as a double.
        let pivot = equation
            .terms
            .iter()
            .min_by(|(a, x), (b, y)| {
                let is_unit = |x: &BigRational| !x.abs().is_one();
                is_unit(x)
                    .cmp(&is_unit(y))
                    .then(reach[**a % self.n].total_cmp(&reach[**b % self.n]))
                    .then(b.cmp(a))
            })
            .map(|(&unknown, coefficient)| (unknown, coefficient.clone()));
        match pivot {
            None => self.contradictory |= !equation.constant.is_zero(),
            Some((unknown, coefficient)) => {
                equation.terms.remove(&unknown);
                let terms =
                    equation.terms.into_iter().map(|(idx, value)| (idx, -value / &coefficient)).collect();
                self.dependent_of[unknown] = Some(self.dependents.len());
                self.dependents.push(Dependent { unknown, constant: equation.constant / coefficient, terms });
            }
        }
    }

    /// Writes every dependent unknown in free ones only: a dependent refers to later pivots at most.
    fn back_substitute(&mut self) {
        for dependent_idx in (0..self.dependents.len()).rev() {
            let mut dependent = self.dependents[dependent_idx].clone();
            let pivots: Vec<(usize, usize)> = dependent
                .terms
                .keys()
                .filter_map(|&unknown| self.dependent_of[unknown].map(|later| (unknown, later)))
                .collect();
            for (unknown, later) in pivots {
                if let Some(factor) = dependent.terms.remove(&unknown) {
                    dependent.constant += &factor * &self.dependents[later].constant;
                    add_multiple(&mut dependent.terms, &factor, &self.dependents[later].terms);
                }
            }
            self.dependents[dependent_idx] = dependent;
        }
        debug_assert!(
            self.dependents.iter().enumerate().all(|(k, d)| self.dependent_of[d.unknown] == Some(k))
        );
    }
}

/// Mode of segment (x_i, x_{i+1}): transits and transfers alternate, a transit comes first.
pub fn mode_of_segment(segment_idx: usize) -> PathMode {
    if segment_idx.is_multiple_of(2) { PathMode::Transit } else { PathMode::Transfer }
}

fn add_multiple(
    terms: &mut BTreeMap<usize, BigRational>,
    factor: &BigRational,
    others: &BTreeMap<usize, BigRational>,
) {
    for (&unknown, coefficient) in others {
        let sum = terms.remove(&unknown).unwrap_or_else(BigRational::zero) + factor * coefficient;
        if !sum.is_zero() {
            terms.insert(unknown, sum);
        }
    }
}
