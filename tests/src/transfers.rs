//! How far single transfers can turn the bottle cap inside given regions, by clipping lines.

use ipc_types::artefact::{Region, RegionsFile};

/// The longest free interval of the gripper's angle in the grasp band of both bottle caps (dense collision checks by
/// an independent engine).
pub const LONGEST_FREE: (f64, f64) = (0.3598, 1.0);
/// Leaves that are tried across the band of each finger.
const N_LEAVES: usize = 9;

/// Length of the longest piece of [`LONGEST_FREE`] that overlapping regions cover along one transfer: cap and gripper
/// turn together, the fingers stay where they are in the grasp band.
pub fn longest_transfer(regions: &RegionsFile) -> f64 {
    let n = regions.coordinates.len();
    let leaf = |k: usize| (k as f64 + 0.5) / N_LEAVES as f64;
    let mut longest: f64 = 0.0;
    for left in 0..N_LEAVES {
        for right in 0..if n == 4 { N_LEAVES } else { 1 } {
            let mut q = vec![0.0, 0.0, -0.025 + 1e-3 * leaf(left)];
            q.extend((n == 4).then_some(0.024 + 1e-3 * leaf(right)));
            longest = longest.max(longest_piece(&regions.regions, &q));
        }
    }
    longest
}

/// The longest piece along q + t (1, 1, 0, …), t in [`LONGEST_FREE`], that overlapping regions cover.
fn longest_piece(regions: &[Region], q: &[f64]) -> f64 {
    let mut pieces: Vec<(f64, f64)> = regions.iter().filter_map(|region| clip(region, q)).collect();
    pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut longest: f64 = 0.0;
    let mut current: Option<(f64, f64)> = None;
    for (from, to) in pieces {
        let (start, end) = match current {
            Some((start, end)) if from < end => (start, end.max(to)),
            _ => (from, to),
        };
        current = Some((start, end));
        longest = longest.max(end - start);
    }
    longest
}

fn clip(region: &Region, q: &[f64]) -> Option<(f64, f64)> {
    let (mut low, mut high) = LONGEST_FREE;
    for (a, b) in region.A.iter().zip(&region.b) {
        let slack = b - a.iter().zip(q).map(|(a, q)| a * q).sum::<f64>();
        let speed = a[0] + a[1];
        if speed > 0.0 {
            high = high.min(slack / speed);
        } else if speed < 0.0 {
            low = low.max(slack / speed);
        } else if slack < 0.0 {
            return None;
        }
    }
    (low < high).then_some((low, high))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slab(id: u64, low: f64, high: f64) -> Region {
        let (A, b) = (vec![vec![0.0, 1.0, 0.0], vec![0.0, -1.0, 0.0]], vec![high, -low]);
        let center = vec![0.0, 0.5 * (low + high), 0.0];
        Region { id, parent: None, A, b, center, method: String::new(), certified: true, margin: 0.0 }
    }

    #[test]
    fn pieces_count_only_where_they_overlap() {
        let file = |regions| RegionsFile {
            coordinates: ["cap", "gripper", "left_finger"].map(str::to_owned).to_vec(),
            regions,
            coverage: None,
        };
        let joined = file(vec![slab(0, 0.0, 0.5), slab(1, 0.45, 0.8)]);
        assert!((longest_transfer(&joined) - (0.8 - 0.3598)).abs() < 1e-12);
        let apart = file(vec![slab(0, 0.0, 0.5), slab(1, 0.51, 0.8)]);
        assert!((longest_transfer(&apart) - 0.29).abs() < 1e-12);
        assert_eq!(longest_transfer(&file(Vec::new())), 0.0);
    }
}
