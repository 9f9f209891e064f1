//! The continuous relaxation of a node: a convex programme whose value bounds the cost of every plan of the node.
//!
//! Each waypoint x_i may lie in the sets j of `allowed[i]`. Their union is replaced by its convex hull in perspective
//! form, x_i = Σ_j x_ij, A_j x_ij ≤ b_j z_ij, Σ_j z_ij = 1, z ≥ 0. A segment stays in one connected region, so both ends
//! weigh each region the same and keep their forms *region by region*:
//!
//! ```text
//! Σ_{j ∈ r} z_ij = Σ_{j ∈ r} z_{i+1,j}        F Σ_{j ∈ r} x_ij = F Σ_{j ∈ r} x_{i+1,j}        for each region r
//! ```
//!
//! This is the hull of the union over r of the pairs, so what a single grasp can do at most holds in the relaxation
//! already. With one set a waypoint it is the programme itself (thesis 2, Eq. 5.8 with regions fixed). A node that is not
//! *refined* first tries polytopes around many sets instead of the sets ([`crate::hull`]): smaller, hardly weaker.

use crate::hull::{Hulls, sets};
use crate::instance::{Instance, WaypointSet};
use crate::kept_system::mode_of_segment;
use crate::node::Node;
use conic::{Affine, ConicError, ConicProgram, Settings, safe_farkas, safe_lower_bound, solve};
use manipulation::PathMode;
use nalgebra::DVector;
use std::collections::BTreeSet;

/// What a relaxation says of its node.
#[derive(Debug, Clone)]
pub enum Relaxed {
    /// Proven to hold no plan.
    Infeasible,
    /// No plan of the node costs less than `lower_bound` (proven; -∞ if nothing is).
    Bounded {
        /// The proven bound.
        lower_bound: f64,
        /// Values of x_0 … x_{2ℓ+1} and weights, if the solver has a solution.
        point: Option<RelaxedPoint>,
    },
}

/// Solution of a relaxation.
#[derive(Debug, Clone)]
pub struct RelaxedPoint {
    /// x_0 … x_{2ℓ+1}.
    pub x: Vec<DVector<f64>>,
    /// z_ij, in the order of `allowed[i]`; sets that one block stands for share its weight.
    pub weights: Vec<Vec<f64>>,
}

/// A variable block of one waypoint and one set.
struct Part {
    region_idx: usize,
    first: usize,
    /// Variable of z_ij; `None` if it is the constant 1.
    weight: Option<usize>,
}

/// One waypoint's variables.
struct WaypointVariables {
    first: usize,
    parts: Vec<Part>,
}

struct Builder<'a> {
    instance: &'a Instance<'a>,
    program: ConicProgram,
    lower: Vec<f64>,
    upper: Vec<f64>,
    waypoints: Vec<WaypointVariables>,
}

/// Solves the relaxation of `node`.
pub fn relax(instance: &Instance, hulls: &mut Hulls, node: &Node) -> Result<Relaxed, ConicError> {
    let mut builder = Builder::new(instance);
    let last = node.allowed.len() - 1;
    for (waypoint_idx, allowed) in node.allowed.iter().enumerate() {
        if waypoint_idx == 0 || waypoint_idx == last {
            let q = if waypoint_idx == 0 { &instance.start } else { &instance.goal };
            builder.add_end(q, allowed[0]);
        } else if node.is_refined {
            builder.add_waypoint(&sets(instance, allowed).cloned().collect::<Vec<_>>());
        } else {
            builder.add_waypoint(&hulls.blocks(instance, allowed));
        }
    }
    for segment_idx in 0..node.allowed.len() - 1 {
        builder.add_segment(segment_idx);
    }
    for &(segment_idx, cut_idx, exit_idx) in &node.exits {
        builder.add_exit(segment_idx, cut_idx, exit_idx);
    }
    builder.solve(node)
}

impl<'a> Builder<'a> {
    fn new(instance: &'a Instance<'a>) -> Self {
        Self {
            instance,
            program: ConicProgram::new(0),
            lower: Vec::new(),
            upper: Vec::new(),
            waypoints: Vec::new(),
        }
    }

    fn add_variables(&mut self, lower: &[f64], upper: &[f64]) -> usize {
        self.lower.extend_from_slice(lower);
        self.upper.extend_from_slice(upper);
        self.program.add_variables(lower.len())
    }

    /// An end of the chain, given; `region_idx` is one of its regions, all of which share their connected region.
    fn add_end(&mut self, q: &DVector<f64>, region_idx: usize) {
        let first = self.add_variables(q.as_slice(), q.as_slice());
        for k in 0..q.len() {
            self.program.add_equality(vec![(first + k, 1.0)], q[k]);
        }
        let part = Part { region_idx, first, weight: None };
        self.waypoints.push(WaypointVariables { first, parts: vec![part] });
    }

    /// A waypoint in the hull of `sets`, of which there is at least one.
    fn add_waypoint(&mut self, sets: &[WaypointSet]) {
        let n = self.instance.manipulation.dim();
        let least = |k: usize| sets.iter().map(|set| set.outer.lower[k]).fold(f64::INFINITY, f64::min);
        let most = |k: usize| sets.iter().map(|set| set.outer.upper[k]).fold(f64::NEG_INFINITY, f64::max);
        let lower: Vec<f64> = (0..n).map(least).collect();
        let upper: Vec<f64> = (0..n).map(most).collect();
        let first = self.add_variables(&lower, &upper);
        let mut parts = Vec::with_capacity(sets.len());
        for set in sets {
            let (part_first, weight) = if sets.len() == 1 {
                (first, None)
            } else {
                let zero_low: Vec<f64> = set.outer.lower.iter().map(|x| x.min(0.0)).collect();
                let zero_high: Vec<f64> = set.outer.upper.iter().map(|x| x.max(0.0)).collect();
                let part_first = self.add_variables(&zero_low, &zero_high);
                let weight = self.add_variables(&[0.0], &[1.0]);
                self.program.add_less_equal(vec![(weight, -1.0)], 0.0);
                (part_first, Some(weight))
            };
            let P = &set.polytope;
            for row_idx in 0..P.n_faces() {
                let mut terms: Vec<(usize, f64)> = (0..n)
                    .filter(|&k| P.A[(row_idx, k)] != 0.0)
                    .map(|k| (part_first + k, P.A[(row_idx, k)]))
                    .collect();
                let rhs = match weight {
                    None => P.b[row_idx],
                    Some(weight) => {
                        terms.push((weight, -P.b[row_idx]));
                        0.0
                    }
                };
                self.program.add_less_equal(terms, rhs);
            }
            parts.push(Part { region_idx: set.region_idx, first: part_first, weight });
        }
        if sets.len() > 1 {
            self.program.add_equality(parts.iter().filter_map(|p| p.weight).map(|w| (w, 1.0)).collect(), 1.0);
            for k in 0..n {
                let mut terms: Vec<(usize, f64)> = parts.iter().map(|part| (part.first + k, 1.0)).collect();
                terms.push((first + k, -1.0));
                self.program.add_equality(terms, 0.0);
            }
        }
        self.waypoints.push(WaypointVariables { first, parts });
    }

    /// Cost and equations of segment (x_i, x_{i+1}).
    fn add_segment(&mut self, segment_idx: usize) {
        let instance = self.instance;
        let mode = mode_of_segment(segment_idx);
        let n = instance.manipulation.dim();
        let (from, to) = (&self.waypoints[segment_idx], &self.waypoints[segment_idx + 1]);
        for k in 0..n {
            // ½ · 2 · (x_{i+1,k} - x_{i,k})², Eq. 5.7.
            let step = Affine::new(vec![(to.first + k, 1.0), (from.first + k, -1.0)], 0.0);
            self.program.add_square_cost(2.0, step);
        }
        let classes: BTreeSet<Option<usize>> =
            from.parts.iter().chain(&to.parts).map(|part| instance.class(mode, part.region_idx)).collect();
        let F = instance.manipulation.kept_forms(mode);
        let single = classes.len() == 1;
        for (class_idx, &class) in classes.iter().enumerate() {
            let members = |waypoint: &WaypointVariables| -> Vec<(usize, Option<usize>)> {
                if single {
                    return vec![(waypoint.first, None)];
                }
                let of_class = |part: &&Part| instance.class(mode, part.region_idx) == class;
                waypoint.parts.iter().filter(of_class).map(|part| (part.first, part.weight)).collect()
            };
            let sides = [(members(from), 1.0), (members(to), -1.0)];
            for form in F.row_iter() {
                let mut terms = Vec::new();
                for (parts, sign) in &sides {
                    for &(first, _) in parts {
                        terms.extend((0..n).filter(|&k| form[k] != 0.0).map(|k| (first + k, sign * form[k])));
                    }
                }
                self.program.add_equality(terms, 0.0);
            }
            // The weights sum to 1 on both sides, so the last class follows from the others.
            if !single && class_idx + 1 < classes.len() {
                let mut terms = Vec::new();
                let mut constant = 0.0;
                for (parts, sign) in &sides {
                    for &(_, weight) in parts {
                        match weight {
                            Some(weight) => terms.push((weight, *sign)),
                            None => constant += sign,
                        }
                    }
                }
                self.program.add_equality(terms, -constant);
            }
        }
    }

    /// A point y of the exit's overlap in the leaf of the segment: F y = F x_i.
    fn add_exit(&mut self, segment_idx: usize, cut_idx: usize, exit_idx: usize) {
        let manipulation = self.instance.manipulation;
        let cut = &self.instance.cuts[cut_idx];
        let P = &cut.exits[exit_idx].polytope;
        let joint_box = &manipulation.joint_box;
        let y = self.add_variables(joint_box.lower.as_slice(), joint_box.upper.as_slice());
        let x = self.waypoints[segment_idx].first;
        add_polytope(&mut self.program, P, y);
        add_same_leaf(&mut self.program, manipulation.kept_forms(cut.mode), x, y);
    }

    fn solve(self, node: &Node) -> Result<Relaxed, ConicError> {
        let solution = solve(&self.program, &Settings::default())?;
        // Whatever the status: only the inequality counts.
        if !solution.status.has_solution()
            && safe_farkas(&self.program, &solution.y, &self.lower, &self.upper)
        {
            return Ok(Relaxed::Infeasible);
        }
        let lower_bound = safe_lower_bound(&self.program, &solution.y, &solution.x, &self.lower, &self.upper);
        let is_usable = solution.status.has_solution() && solution.x.iter().all(|x| x.is_finite());
        let point = is_usable.then(|| RelaxedPoint {
            x: self
                .waypoints
                .iter()
                .map(|w| {
                    DVector::from_column_slice(
                        &solution.x[w.first..w.first + self.instance.manipulation.dim()],
                    )
                })
                .collect(),
            weights: self
                .waypoints
                .iter()
                .zip(&node.allowed)
                .map(|(waypoint, allowed)| {
                    allowed.iter().map(|&idx| self.weight_of(waypoint, idx, &solution.x)).collect()
                })
                .collect(),
        });
        // Squares are not negative, whatever the multipliers say.
        Ok(Relaxed::Bounded { lower_bound: lower_bound.max(0.0), point })
    }
}

impl Builder<'_> {
    /// Weight of the part that stands for region `idx`: its own, or the block of its connected regions.
    fn weight_of(&self, waypoint: &WaypointVariables, idx: usize, x: &[f64]) -> f64 {
        let classes = |idx: usize| {
            (self.instance.class(PathMode::Transfer, idx), self.instance.class(PathMode::Transit, idx))
        };
        let own = waypoint.parts.iter().find(|part| part.region_idx == idx);
        let part =
            own.or_else(|| waypoint.parts.iter().find(|part| classes(part.region_idx) == classes(idx)));
        part.map_or(0.0, |part| part.weight.map_or(1.0, |z| x[z]))
    }
}

/// Rows `A x ≤ b` for the variables from `first` on.
pub fn add_polytope(program: &mut ConicProgram, P: &convex_sets::HPolyhedron, first: usize) {
    for row_idx in 0..P.n_faces() {
        let row = P.A.row(row_idx);
        let terms = (0..row.len()).filter(|&k| row[k] != 0.0).map(|k| (first + k, row[k])).collect();
        program.add_less_equal(terms, P.b[row_idx]);
    }
}

/// Rows `F x = F y` for the variables from `x` and `y` on.
pub fn add_same_leaf(program: &mut ConicProgram, F: &nalgebra::DMatrix<f64>, x: usize, y: usize) {
    for form in F.row_iter() {
        let kept = || (0..form.len()).filter(|&k| form[k] != 0.0);
        let terms = kept().map(|k| (x + k, form[k])).chain(kept().map(|k| (y + k, -form[k]))).collect();
        program.add_equality(terms, 0.0);
    }
}
