//! Whether an artefact keeps its own rules: shapes, finite numbers, unit rows, unique ids, a centre inside.
//!
//! Other programs write artefacts too, so a reader checks before it computes.

use crate::artefact::{LeafCut, PlanFile, Region, RegionsFile, Segment};
use std::collections::BTreeSet;

/// How far the norm of a row of `A` may be from 1. Erring side: a row of another norm would scale distances.
pub const TOL_UNIT_ROW: f64 = 1e-9;

/// Largest id: ids travel as 64-bit floats in some languages and in segments.
pub const MAX_ID: u64 = 1 << 53;

/// A rule that is broken: field, value, what is expected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field} = {value}: expected {expected}")]
pub struct Violation {
    /// The field, as in `regions[3].A[2][0]`.
    pub field: String,
    /// Its value.
    pub value: String,
    /// What it should be.
    pub expected: String,
}

impl Violation {
    pub(crate) fn new(
        field: impl Into<String>,
        value: impl ToString,
        expected: impl Into<String>,
    ) -> Violation {
        Violation { field: field.into(), value: value.to_string(), expected: expected.into() }
    }

    /// The same violation of a field within `outer`.
    pub(crate) fn within(mut self, outer: &str) -> Violation {
        self.field = format!("{outer}.{}", self.field);
        self
    }
}

/// A vector of `dim` finite numbers.
pub fn vector(field: &str, values: &[f64], dim: usize) -> Result<(), Violation> {
    if values.len() != dim {
        return Err(Violation::new(format!("length of {field}"), values.len(), dim.to_string()));
    }
    match values.iter().position(|value| !value.is_finite()) {
        Some(i) => Err(Violation::new(format!("{field}[{i}]"), values[i], "a finite number")),
        None => Ok(()),
    }
}

/// A region of `dim` coordinates.
pub fn region(region: &Region, dim: usize) -> Result<(), Violation> {
    if region.id > MAX_ID {
        return Err(Violation::new("id", region.id, "at most 2^53"));
    }
    if region.A.is_empty() {
        return Err(Violation::new("length of A", 0, "at least one row: the joint limits are rows too"));
    }
    vector("b", &region.b, region.A.len())?;
    vector("center", &region.center, dim)?;
    if !region.margin.is_finite() {
        return Err(Violation::new("margin", region.margin, "a finite number"));
    }
    for (face_idx, row) in region.A.iter().enumerate() {
        vector(&format!("A[{face_idx}]"), row, dim)?;
        let norm = row.iter().map(|a| a * a).sum::<f64>().sqrt();
        if (norm - 1.0).abs() > TOL_UNIT_ROW {
            return Err(Violation::new(format!("norm of A[{face_idx}]"), norm, "1"));
        }
        let slack = region.b[face_idx] - row.iter().zip(&region.center).map(|(a, c)| a * c).sum::<f64>();
        if slack <= 0.0 {
            return Err(Violation::new(
                format!("b[{face_idx}] - A[{face_idx}] center"),
                slack,
                "more than 0: the center is strictly inside",
            ));
        }
    }
    Ok(())
}

/// A file of regions over the coordinates of that name.
pub fn regions(file: &RegionsFile, coordinates: &[String]) -> Result<(), Violation> {
    if file.coordinates != coordinates {
        let expected = format!("those of the scene, [{}]", coordinates.join(", "));
        return Err(Violation::new("coordinates", format!("[{}]", file.coordinates.join(", ")), expected));
    }
    let mut ids = BTreeSet::new();
    for (position, item) in file.regions.iter().enumerate() {
        let place = format!("regions[{position}]");
        region(item, coordinates.len()).map_err(|violation| violation.within(&place))?;
        if !ids.insert(item.id) {
            return Err(Violation::new(format!("{place}.id"), item.id, "an id that no other region has"));
        }
    }
    Ok(())
}

/// A plan over `dim` coordinates.
pub fn plan(plan: &PlanFile, dim: usize) -> Result<(), Violation> {
    let Some(n_grasps) = plan.n_grasps else { return Ok(()) };
    // A start that already is the goal is a plan of one configuration and no motion, or of two equal ones.
    let Some(configurations) = &plan.configurations else {
        return Err(Violation::new("configurations", "null", "a list, since n_grasps is a number"));
    };
    if n_grasps > 0 && configurations.len() != 2 * n_grasps + 2 {
        let expected = format!("2 n_grasps + 2 = {}", 2 * n_grasps + 2);
        return Err(Violation::new("length of configurations", configurations.len(), expected));
    }
    for (i, configuration) in configurations.iter().enumerate() {
        vector(&format!("configurations[{i}]"), configuration, dim)?;
    }
    let n_modes = plan.modes.as_ref().map_or(0, Vec::len);
    if n_modes + 1 != configurations.len().max(1) {
        let expected = "one less than configurations";
        return Err(Violation::new("length of modes", n_modes, expected));
    }
    let n_regions = plan.regions.as_ref().map_or(0, Vec::len);
    if n_regions != configurations.len() {
        return Err(Violation::new("length of regions", n_regions, configurations.len().to_string()));
    }
    Ok(())
}

/// A segment over `dim` coordinates.
pub fn segment(segment: &Segment, dim: usize) -> Result<(), Violation> {
    if segment.regions.len() != segment.pieces.len() {
        let expected = format!("{}, one a piece", segment.pieces.len());
        return Err(Violation::new("length of regions", segment.regions.len(), expected));
    }
    for (i, piece) in segment.pieces.iter().enumerate() {
        if piece.len() < 2 {
            return Err(Violation::new(
                format!("length of pieces[{i}]"),
                piece.len(),
                "at least 2 control points",
            ));
        }
        for (j, point) in piece.iter().enumerate() {
            vector(&format!("pieces[{i}][{j}]"), point, dim)?;
        }
    }
    vector("[length, lower_bound]", &[segment.length, segment.lower_bound], 2)
}

/// A cut over the regions with these ids.
pub fn cut(cut: &LeafCut, known: &BTreeSet<u64>) -> Result<(), Violation> {
    let ends = cut.exits.iter().flat_map(|exit| [exit.0, exit.1]);
    match cut.reached.iter().copied().chain(ends).find(|id| !known.contains(id)) {
        Some(id) => Err(Violation::new("region of a cut", id, "the id of a certified region")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The square [-1, 1]².
    fn square() -> Region {
        Region {
            id: 3,
            parent: None,
            A: vec![vec![1.0, 0.0], vec![0.0, 1.0], vec![-1.0, 0.0], vec![0.0, -1.0]],
            b: vec![1.0; 4],
            center: vec![0.0, 0.0],
            method: "box".into(),
            certified: false,
            margin: 0.0,
        }
    }

    #[track_caller]
    fn check(change: impl Fn(&mut Region), field: &str) {
        let mut broken = square();
        change(&mut broken);
        let violation = region(&broken, 2).unwrap_err();
        assert!(violation.field.contains(field), "{violation}");
    }

    #[test]
    fn a_square_is_a_region() {
        region(&square(), 2).unwrap();
        assert!(region(&square(), 3).is_err());
    }

    #[test]
    fn each_broken_rule_names_its_field() {
        check(|r| r.A[1][1] = f64::NAN, "A[1][1]");
        check(|r| r.b[2] = f64::INFINITY, "b[2]");
        check(|r| r.A[1][1] = 2.0, "norm of A[1]");
        check(|r| r.center[0] = 1.0, "center");
        check(|r| r.b.truncate(3), "length of b");
        check(|r| r.A.clear(), "length of A");
        check(|r| r.id = u64::MAX, "id");
        check(|r| r.margin = f64::NAN, "margin");
    }

    #[test]
    fn ids_are_unique_and_coordinates_are_the_scene_s() {
        let names = vec!["x".to_string(), "y".to_string()];
        let file =
            RegionsFile { coordinates: names.clone(), regions: vec![square(), square()], coverage: None };
        assert!(regions(&file, &names).unwrap_err().field.contains("regions[1].id"));
        let one = RegionsFile { regions: vec![square()], ..file };
        regions(&one, &names).unwrap();
        assert_eq!(regions(&one, &["y".into(), "x".into()]).unwrap_err().field, "coordinates");
    }

    #[test]
    fn a_cut_over_other_regions_is_refused() {
        let example = LeafCut { mode: crate::artefact::Mode::Transit, reached: vec![1], exits: vec![(1, 2)] };
        assert!(cut(&example, &BTreeSet::from([1, 2])).is_ok());
        assert!(cut(&example, &BTreeSet::from([1])).is_err());
    }
}
