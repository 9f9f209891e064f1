//! Options of the stage.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

use crate::grower::Method;
use crate::problem::ProblemError;

/// How to decompose; all of it is part of what makes a run repeatable.
#[derive(Debug, Clone, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// How regions grow.
    #[arg(long, value_enum, default_value_t = Method::IrisZo)]
    pub method: Method,
    /// Cover CS_free and nothing else, whether or not the scene has a task: `--coverage` is then the share that certified
    /// regions must cover. With --region-at and --domain-radius: CS_free in the box around that one configuration.
    #[arg(long, num_args = 0..=1, default_value_t = false, default_missing_value = "true", action = clap::ArgAction::Set)]
    pub cover: bool,
    /// Share of CS_free and of CP_free to cover; the lower end of the 95 % interval must reach it.
    #[arg(long, default_value_t = 0.99)]
    pub coverage: f64,
    /// Share of CG_free to cover, in the same sense.
    #[arg(long, default_value_t = 0.99)]
    pub grasp_coverage: f64,
    /// Share to cover of the longest free chord of a transfer leaf inside CG: it bounds how far one grasp can
    /// move the object.
    #[arg(long, default_value_t = 0.998)]
    pub chord_coverage: f64,
    /// Share of each set that must still be covered after certification, or more regions are grown.
    #[arg(long, default_value_t = 0.975)]
    pub certified_coverage: f64,
    /// The same for CG_free.
    #[arg(long, default_value_t = 0.97)]
    pub certified_grasp_coverage: f64,
    /// The same for the longest free chord.
    #[arg(long, default_value_t = 0.994)]
    pub certified_chord_coverage: f64,
    /// Share of a region that may be in collision; of no account for IRIS and C-IRIS. Smaller: fewer cuts by certification, more samples.
    #[arg(long, default_value_t = 5e-3)]
    pub epsilon: f64,
    /// Probability with which a region may miss epsilon.
    #[arg(long, default_value_t = 0.05)]
    pub delta: f64,
    /// Distance in metres of displacement that faces keep from the collisions that placed them. Larger: fewer
    /// faces and collisions, less volume; the grasp band is a millimetre.
    #[arg(long, default_value_t = 2e-6)]
    pub configuration_margin: f64,
    /// Faces of a region beside those of its domain. Smaller: simpler regions, less volume: when they are spent, faces
    /// move inwards instead.
    #[arg(long, default_value_t = 150)]
    pub max_faces: usize,
    /// IRIS-NP: starts in a row without a collision after which a pair is done. Larger: fewer missed collisions.
    #[arg(long, default_value_t = 5)]
    pub max_failures: usize,
    /// C-IRIS: most alternations between multipliers and faces. Larger: more volume, more time.
    #[arg(long, default_value_t = 20)]
    pub c_iris_iterations: usize,
    /// C-IRIS: growth of the ellipsoid's volume, as a share, below which the margin falls. Smaller: more volume, more
    /// time.
    #[arg(long, default_value_t = 0.01)]
    pub c_iris_growth: f64,
    /// C-IRIS: the margin, metres, that multipliers are sought for at first; it falls when growth is slow.
    #[arg(long, default_value_t = 0.1)]
    pub c_iris_margin: f64,
    /// Alternations of separation and inscribed ellipsoid for each region.
    #[arg(long, default_value_t = 4)]
    pub max_iterations: usize,
    /// Rounds in which certification guides growth: its cuts stay, the other faces are placed anew, and of all rounds the
    /// largest polytope that was certified is the candidate. 0: growth does not ask. 1: no growth after the first
    /// certification.
    #[arg(long, default_value_t = 0)]
    pub certify_growth: usize,
    /// Free samples from which coverage is estimated, of each set.
    #[arg(long, default_value_t = 4000)]
    pub coverage_samples: usize,
    /// Uncovered samples of a visibility graph. Larger: better cliques, quadratic in time.
    #[arg(long, default_value_t = 100)]
    pub visibility_samples: usize,
    /// Cliques are the largest there are while at most this many samples are left of a visibility graph, and greedy
    /// with swaps while there are more. Larger: better cliques, more time on dense graphs.
    #[arg(long, default_value_t = 40)]
    pub max_exact_clique: usize,
    /// Rounds of visibility graph, clique cover and growth.
    #[arg(long, default_value_t = 20)]
    pub max_rounds: usize,
    /// Most regions.
    #[arg(long, default_value_t = 400)]
    pub max_regions: usize,
    /// Rounds of growth after certification left a target unmet.
    #[arg(long, default_value_t = 4)]
    pub max_feedback_rounds: usize,
    /// Threads; the result does not depend on them.
    #[arg(long, default_value_t = 1)]
    pub threads: usize,
    /// Grow one region around each of these configurations, and nothing else. Comma-separated coordinates;
    /// repeat for more, or put `;` between them.
    #[arg(long, value_name = "Q0,Q1,…", allow_hyphen_values = true, value_delimiter = ';')]
    pub region_at: Vec<String>,
    /// Grow one region that contains each of these segments, and nothing else. Both ends, each as in --region-at;
    /// repeat for more.
    #[arg(long, value_name = "Q0,Q1,…;Q0,Q1,…", allow_hyphen_values = true)]
    pub region_along: Vec<String>,
    /// With --region-at and --region-along: half-width of the box, radians or metres, that each region stays in; 0 is
    /// no box.
    #[arg(long, default_value_t = 0.0)]
    pub domain_radius: f64,
    /// Begin with the regions of this run directory, whose scene may have been a little different: what is still free
    /// is kept as it is, the rest grows again.
    #[arg(long, value_name = "RUN")]
    pub extend: Option<PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::IrisZo,
            cover: false,
            coverage: 0.99,
            grasp_coverage: 0.99,
            chord_coverage: 0.998,
            certified_coverage: 0.975,
            certified_grasp_coverage: 0.97,
            certified_chord_coverage: 0.994,
            epsilon: 5e-3,
            delta: 0.05,
            configuration_margin: 2e-6,
            max_faces: 150,
            max_failures: 5,
            c_iris_iterations: 20,
            c_iris_growth: 0.01,
            c_iris_margin: 0.1,
            max_iterations: 4,
            certify_growth: 0,
            coverage_samples: 4000,
            visibility_samples: 100,
            max_exact_clique: 40,
            max_rounds: 20,
            max_regions: 400,
            max_feedback_rounds: 4,
            threads: 1,
            region_at: Vec::new(),
            region_along: Vec::new(),
            domain_radius: 0.0,
            extend: None,
        }
    }
}

impl Options {
    /// Whether all values are in their ranges.
    pub fn check(&self) -> Result<(), ProblemError> {
        let shares = [
            ("coverage", self.coverage),
            ("grasp-coverage", self.grasp_coverage),
            ("chord-coverage", self.chord_coverage),
            ("certified-coverage", self.certified_coverage),
            ("certified-grasp-coverage", self.certified_grasp_coverage),
            ("certified-chord-coverage", self.certified_chord_coverage),
        ];
        for (name, value) in shares {
            if !(0.0..=1.0).contains(&value) {
                return Err(ProblemError::Option { name, value, expected: "a share from 0 to 1" });
            }
        }
        for (name, value) in [("epsilon", self.epsilon), ("delta", self.delta)] {
            if !(1e-6..=0.5).contains(&value) {
                return Err(ProblemError::Option { name, value, expected: "a probability from 1e-6 to 0.5" });
            }
        }
        for (name, value) in [
            ("configuration-margin", self.configuration_margin),
            ("domain-radius", self.domain_radius),
            ("c-iris-growth", self.c_iris_growth),
            ("c-iris-margin", self.c_iris_margin),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(ProblemError::Option { name, value, expected: "a finite number, 0 or more" });
            }
        }
        let counts = [
            ("coverage-samples", self.coverage_samples),
            ("visibility-samples", self.visibility_samples),
            ("max-regions", self.max_regions),
            ("max-faces", self.max_faces),
        ];
        for (name, value) in counts {
            if value == 0 {
                return Err(ProblemError::Option { name, value: 0.0, expected: "1 or more" });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The command line and `Default` agree.
    #[test]
    fn defaults() {
        use clap::{Args, FromArgMatches};
        let command = Options::augment_args(clap::Command::new("regrasp-decompose"));
        let parsed = Options::from_arg_matches(&command.get_matches_from(["regrasp-decompose"])).unwrap();
        assert_eq!(parsed, Options::default());
        assert_eq!(parsed.check(), Ok(()));
        for words in [["--cover"].as_slice(), &["--cover", "true"], &["--cover", "--max-rounds", "3"]] {
            let words = ["regrasp-decompose"].iter().chain(words);
            let command = Options::augment_args(clap::Command::new("regrasp-decompose"));
            assert!(Options::from_arg_matches(&command.get_matches_from(words)).unwrap().cover);
        }
    }

    #[test]
    fn values_out_of_range_are_refused() {
        for wrong in [
            Options { coverage: 1.1, ..Options::default() },
            Options { epsilon: 0.0, ..Options::default() },
            Options { delta: f64::NAN, ..Options::default() },
            Options { domain_radius: f64::INFINITY, ..Options::default() },
            Options { max_regions: 0, ..Options::default() },
            Options { max_faces: 0, ..Options::default() },
            Options { c_iris_margin: -0.1, ..Options::default() },
            Options { c_iris_growth: f64::NAN, ..Options::default() },
        ] {
            assert!(wrong.check().is_err(), "{wrong:?}");
        }
    }
}
