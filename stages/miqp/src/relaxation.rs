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
//! already. The solver's word counts for nothing: its multipliers are handed to the inequality of `proof.bin`
//! ([`crate::proof`]), and what that gives is the bound. With one set a waypoint it is the programme itself (thesis 2, Eq. 5.8 with regions fixed). A node that is not
//! *refined* first tries polytopes around many sets instead of the sets ([`crate::hull`]): smaller, hardly weaker.

use crate::hull::{Hulls, sets};
use crate::instance::{Instance, WaypointSet};
use crate::kept_system::mode_of_segment;
use crate::node::Node;
use crate::proof::{KnownSupports, Multipliers, evaluate};
use conic::{Affine, ConicError, ConicProgram, Settings, Solution, solve};
use manipulation::PathMode;
use nalgebra::DVector;
use std::collections::{BTreeMap, BTreeSet};

/// What a relaxation says of its node.
#[derive(Debug, Clone)]
pub enum Relaxed {
    /// Proven to hold no plan, by these multipliers.
    Infeasible(Multipliers),
    /// No plan of the node costs less than `lower_bound` (proven; 0 if nothing is).
    Bounded {
        /// The proven bound.
        lower_bound: f64,
        /// Multipliers that prove it.
        multipliers: Multipliers,
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
    waypoints: Vec<WaypointVariables>,
    /// For each segment and class the first of the rows of the kept forms.
    form_rows: Vec<Vec<(Option<usize>, usize)>>,
    /// For each exit the first of the rows of the kept forms.
    exit_rows: Vec<(usize, usize)>,
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
            waypoints: Vec::new(),
            form_rows: Vec::new(),
            exit_rows: Vec::new(),
        }
    }

    /// An end of the chain, given; `region_idx` is one of its regions, all of which share their connected region.
    fn add_end(&mut self, q: &DVector<f64>, region_idx: usize) {
        let first = self.program.add_variables(q.len());
        for k in 0..q.len() {
            self.program.add_equality(vec![(first + k, 1.0)], q[k]);
        }
        let part = Part { region_idx, first, weight: None };
        self.waypoints.push(WaypointVariables { first, parts: vec![part] });
    }

    /// A waypoint in the hull of `sets`, of which there is at least one.
    fn add_waypoint(&mut self, sets: &[WaypointSet]) {
        let n = self.instance.manipulation.dim();
        let first = self.program.add_variables(n);
        let mut parts = Vec::with_capacity(sets.len());
        for set in sets {
            let (part_first, weight) = if sets.len() == 1 {
                (first, None)
            } else {
                let part_first = self.program.add_variables(n);
                let weight = self.program.add_variables(1);
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
        let mut form_rows = Vec::with_capacity(classes.len());
        for (class_idx, &class) in classes.iter().enumerate() {
            let members = |waypoint: &WaypointVariables| -> Vec<(usize, Option<usize>)> {
                if single {
                    return vec![(waypoint.first, None)];
                }
                let of_class = |part: &&Part| instance.class(mode, part.region_idx) == class;
                waypoint.parts.iter().filter(of_class).map(|part| (part.first, part.weight)).collect()
            };
            let sides = [(members(from), 1.0), (members(to), -1.0)];
            form_rows.push((class, self.program.n_rows()));
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
        self.form_rows.push(form_rows);
    }

    /// A point y of the exit's overlap in the leaf of the segment: F y = F x_i.
    fn add_exit(&mut self, segment_idx: usize, cut_idx: usize, exit_idx: usize) {
        let manipulation = self.instance.manipulation;
        let cut = &self.instance.cuts[cut_idx];
        let P = &cut.exits[exit_idx].polytope;
        let y = self.program.add_variables(manipulation.dim());
        let x = self.waypoints[segment_idx].first;
        add_polytope(&mut self.program, P, y);
        let n_forms = manipulation.kept_forms(cut.mode).nrows();
        self.exit_rows.push((self.program.n_rows(), n_forms));
        add_same_leaf(&mut self.program, manipulation.kept_forms(cut.mode), x, y);
    }

    fn solve(self, node: &Node) -> Result<Relaxed, ConicError> {
        let solution = solve(&self.program, &Settings::default())?;
        let n = self.instance.manipulation.dim();
        let waypoint = |w: &WaypointVariables| DVector::from_column_slice(&solution.x[w.first..w.first + n]);
        // Whatever the status: only the inequality counts.
        let mut best = (0.0, Multipliers::default());
        for is_farkas in [!solution.status.has_solution(), false] {
            let multipliers = self.multipliers(&solution, is_farkas);
            let mut known = KnownSupports::new();
            let value = evaluate(self.instance, &node.allowed, &node.exits, &multipliers, &mut known);
            if value.bound == f64::INFINITY {
                return Ok(Relaxed::Infeasible(multipliers));
            }
            if value.bound > best.0 {
                best = (value.bound, multipliers);
            }
            if solution.status.has_solution() {
                break;
            }
        }
        let (lower_bound, multipliers) = best;
        let is_usable = solution.status.has_solution() && solution.x.iter().all(|x| x.is_finite());
        let point = is_usable.then(|| RelaxedPoint {
            x: self.waypoints.iter().map(waypoint).collect(),
            weights: self
                .waypoints
                .iter()
                .zip(&node.allowed)
                .map(|(waypoint, allowed)| {
                    allowed.iter().map(|&idx| self.weight_of(waypoint, idx, &solution.x)).collect()
                })
                .collect(),
        });
        Ok(Relaxed::Bounded { lower_bound, multipliers, point })
    }
}

impl Builder<'_> {
    /// The multipliers of steps, kept forms and exits; without steps if they are meant to prove that there is no plan.
    fn multipliers(&self, solution: &Solution, is_farkas: bool) -> Multipliers {
        let number = |values: &[f64], idx: usize| {
            values.get(idx).copied().filter(|value| value.is_finite()).unwrap_or(0.0)
        };
        let n = self.instance.manipulation.dim();
        // Rows are F x_i - F x_{i+1} = 0, terms of the inequality μ·F (x_{i+1} - x_i).
        let kept = |first: usize, n_forms: usize| -> Vec<f64> {
            (first..first + n_forms).map(|row| -number(&solution.y, row)).collect()
        };
        let segments = self.form_rows.iter().enumerate().map(|(segment_idx, rows)| {
            let n_forms = self.instance.manipulation.kept_forms(mode_of_segment(segment_idx)).nrows();
            let of_class = |&(class, first): &(Option<usize>, usize)| Some((class?, kept(first, n_forms)));
            rows.iter().filter_map(of_class).collect::<BTreeMap<_, _>>()
        });
        let steps = self.waypoints.windows(2).map(|pair| {
            let x = |w: &WaypointVariables, k: usize| number(&solution.x, w.first + k);
            DVector::from_fn(n, |k, _| x(&pair[1], k) - x(&pair[0], k))
        });
        Multipliers {
            steps: if is_farkas { Vec::new() } else { steps.collect() },
            segments: segments.collect(),
            exits: self.exit_rows.iter().map(|&(first, n_forms)| kept(first, n_forms)).collect(),
        }
    }

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
