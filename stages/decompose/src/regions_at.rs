//! Single regions around given configurations or along given segments, instead of a cover.

use convex_sets::Hyperrectangle;
use nalgebra::DVector;
use wire::Region;

use crate::anchors::contain_exactly;
use crate::coordinates::Coordinates;
use crate::domain::Domain;
use crate::grow::{Growing, GrowthJob};
use crate::grower::Growth;
use crate::options::Options;
use crate::problem::{Anchor, Problem, ProblemError};
use crate::seed::Seed;
use crate::sink::Sink;
use crate::streams::Streams;

/// A straight segment that a region must contain.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// What it is, for messages.
    pub name: String,
    /// Its ends [n each].
    pub ends: [DVector<f64>; 2],
}

/// The configuration of `n` coordinates written as `q0,q1,…`.
pub fn parse_configuration(text: &str, n: usize) -> Result<DVector<f64>, ProblemError> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|number| number.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    match numbers {
        Some(numbers) if numbers.len() == n => Ok(DVector::from_vec(numbers)),
        _ => Err(ProblemError::Configuration { text: text.to_owned(), expected: n }),
    }
}

impl Segment {
    /// The segment written as `q0,q1,…;q0,q1,…`.
    pub fn parse(text: &str, n: usize) -> Result<Self, ProblemError> {
        let mut ends = text.split(';').map(|end| parse_configuration(end, n));
        match (ends.next(), ends.next(), ends.next()) {
            (Some(end_0), Some(end_1), None) => Ok(Self { name: text.to_owned(), ends: [end_0?, end_1?] }),
            _ => Err(ProblemError::Segment { text: text.to_owned(), expected: n }),
        }
    }

    /// Its ends as configurations that must be free.
    pub fn anchors(&self) -> [Anchor; 2] {
        self.ends.clone().map(|q| Anchor { name: self.name.clone(), q })
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
    let around = problem.anchors.iter().map(|anchor| vec![&anchor.q]).collect();
    single_regions(problem, options, seed, sink, is_stopped, around)
}

/// One region along each of `segments`, which are free; otherwise as [`regions_at`].
pub fn regions_along<S: Sink>(
    problem: &Problem<'_>,
    segments: &[Segment],
    options: &Options,
    seed: u64,
    sink: &mut S,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Region>, S::Error> {
    let around = segments.iter().map(|segment| segment.ends.iter().collect()).collect();
    single_regions(problem, options, seed, sink, is_stopped, around)
}

/// One region for each entry of `inside`: one point, or both ends of a segment.
fn single_regions<S: Sink>(
    problem: &Problem<'_>,
    options: &Options,
    seed: u64,
    sink: &mut S,
    is_stopped: &(dyn Fn() -> bool + Sync),
    inside: Vec<Vec<&DVector<f64>>>,
) -> Result<Vec<Region>, S::Error> {
    let coordinates = Coordinates::new(problem.limits.clone(), &problem.relevant);
    let growing = Growing { growth: Growth::new(options), threads: options.threads, is_stopped };
    let mut streams = Streams::new(seed);
    let mut regions = Vec::new();
    for (idx, points) in inside.into_iter().enumerate() {
        let bounds = coordinates.project_box(&box_around(problem, &points, options.domain_radius));
        let domain = Domain::new(&coordinates, problem.free, &problem.displacement, &bounds);
        let point = |q: &DVector<f64>| domain.u_from_q(q.as_slice());
        let (seed, method) = match points.as_slice() {
            [end_0, end_1] => (Seed::segment(point(end_0), point(end_1)), "iris-zo along a given segment"),
            [q] => (Seed::ball(point(q)), "iris-zo at a given configuration"),
            _ => continue,
        };
        let job = [GrowthJob { domain: &domain, seed, method }];
        let drafts = growing.drafts(&job, &mut streams);
        for grown in growing.refined(&job, &drafts, &[0], &mut streams) {
            let mut polyhedron = grown.polyhedron;
            for q in &points {
                contain_exactly(&mut polyhedron, q.as_slice());
            }
            let region = Region {
                id: idx as u64,
                parent: None,
                polyhedron,
                center: grown.center,
                method: grown.method,
                certified: false,
                margin: options.configuration_margin,
            };
            sink.region(&region)?;
            regions.push(region);
            sink.progress(regions.len(), 0.0, "");
        }
    }
    Ok(regions)
}

/// The part of the joint box within `radius` of the box around `points`; all of it if `radius` is 0.
fn box_around(problem: &Problem<'_>, points: &[&DVector<f64>], radius: f64) -> Hyperrectangle {
    let Hyperrectangle { mut lower, mut upper } = problem.limits.clone();
    if radius > 0.0 {
        let least = points.iter().skip(1).fold(points[0].clone(), |least, q| least.inf(q));
        let most = points.iter().skip(1).fold(points[0].clone(), |most, q| most.sup(q));
        lower = least.add_scalar(-radius).sup(&lower);
        upper = most.add_scalar(radius).inf(&upper);
    }
    Hyperrectangle { lower, upper }
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

    #[test]
    fn segments_as_text() {
        let segment = Segment::parse("1,2;-3, 4", 2).unwrap();
        assert_eq!(segment.ends, [DVector::from_vec(vec![1.0, 2.0]), DVector::from_vec(vec![-3.0, 4.0])]);
        for wrong in ["1,2", "1,2;3", "1,2;3,4;5,6", "", ";"] {
            assert!(Segment::parse(wrong, 2).is_err(), "{wrong}");
        }
    }
}
