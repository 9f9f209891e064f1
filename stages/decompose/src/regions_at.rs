//! Single regions around given configurations, instead of a cover.

use convex_sets::Hyperrectangle;
use nalgebra::DVector;
use wire::Region;

use crate::anchors::contain_exactly;
use crate::coordinates::Coordinates;
use crate::cover::Sink;
use crate::domain::Domain;
use crate::grow::{Growing, GrowthJob};
use crate::iris_zo::{Growth, Seed};
use crate::options::Options;
use crate::problem::{Problem, ProblemError};
use crate::streams::Streams;

/// The configuration of `n` coordinates written as `q0,q1,…`.
pub fn parse_configuration(text: &str, n: usize) -> Result<DVector<f64>, ProblemError> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|number| number.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    match numbers {
        Some(numbers) if numbers.len() == n => Ok(DVector::from_vec(numbers)),
        _ => Err(ProblemError::Configuration { text: text.to_owned(), expected: n }),
    }
}

/// One region around each anchor of `problem`, inside the box of half-width `options.domain_radius` around it if
/// that is positive; handed to `sink` in the order of the anchors. An anchor without a region is missing in the
/// result.
pub fn regions_at<S: Sink>(
    problem: &Problem<'_>,
    options: &Options,
    seed: u64,
    sink: &mut S,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Region>, S::Error> {
    let coordinates = Coordinates::new(problem.limits.clone(), &problem.relevant);
    let growing = Growing {
        growth: Growth {
            epsilon: options.epsilon,
            delta: options.delta,
            margin: options.configuration_margin,
            max_iterations: options.max_iterations,
        },
        threads: options.threads,
        is_stopped,
    };
    let domains: Vec<Domain<'_>> = problem
        .anchors
        .iter()
        .map(|anchor| {
            let Hyperrectangle { mut lower, mut upper } = problem.limits.clone();
            if options.domain_radius > 0.0 {
                lower = anchor.q.add_scalar(-options.domain_radius).sup(&lower);
                upper = anchor.q.add_scalar(options.domain_radius).inf(&upper);
            }
            let bounds = coordinates.project_box(&Hyperrectangle { lower, upper });
            Domain::new(&coordinates, problem.free, &problem.displacement, &bounds)
        })
        .collect();
    let jobs: Vec<GrowthJob<'_, '_>> = problem
        .anchors
        .iter()
        .zip(&domains)
        .map(|(anchor, domain)| GrowthJob {
            domain,
            seed: Seed::ball(domain.u_from_q(anchor.q.as_slice())),
            method: "iris-zo at a given configuration",
        })
        .collect();
    let mut streams = Streams::new(seed);
    let mut regions = Vec::new();
    for (job_idx, job) in jobs.iter().enumerate() {
        let alone = std::slice::from_ref(job);
        let drafts = growing.drafts(alone, &mut streams);
        for grown in growing.refined(alone, &drafts, &[0], &mut streams) {
            let mut polyhedron = grown.polyhedron;
            contain_exactly(&mut polyhedron, problem.anchors[job_idx].q.as_slice());
            let region = Region {
                id: job_idx as u64,
                parent: None,
                polyhedron,
                center: grown.center,
                method: grown.method.to_owned(),
                certified: false,
                margin: options.configuration_margin,
            };
            sink.region(&region)?;
            regions.push(region);
        }
    }
    Ok(regions)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn configurations_as_text() {
        assert_eq!(parse_configuration("1,-2.5, 3", 3), Ok(DVector::from_vec(vec![1.0, -2.5, 3.0])));
        for wrong in ["1,2", "1,2,x", "1,2,inf", ""] {
            assert!(parse_configuration(wrong, 3).is_err(), "{wrong}");
        }
    }
}
