//! A first path, whose length bounds what is worth looking at: Dijkstra's algorithm over points of the overlaps, then
//! the restriction, then vertices left out and put in while that shortens it.

use crate::leaf_graph::{Contact, LeafGraph};
use crate::path::Path;
use crate::restriction::shortest_through;
use convex_sets::HPolyhedron;
use nalgebra::DVector;

/// A path from the start to `g` through overlaps that a path may use; `None` if these do not connect the two, or if
/// what was found could not be verified.
pub fn first_path(graph: &LeafGraph, g: &DVector<f64>, free: &[Option<HPolyhedron>]) -> Option<Path> {
    let vertices = dijkstra(graph)?;
    let path = shortest_through(graph, &vertices, g, free)?;
    Some(locally_shortest(graph, vertices, path, g, free))
}

/// A path gains less than this share of its length by the last step of the local search. Erring side: a larger value
/// ends the search with a longer path.
const TOL_PROGRESS: f64 = 1e-6;

/// `path` through `vertices`, made shorter by the regions that hold a bend: put between the two that meet there, each
/// may cut the corner. Where none does, the path is as short as its neighbors in the union of all regions.
pub fn locally_shortest(
    graph: &LeafGraph,
    vertices: Vec<usize>,
    path: Path,
    g: &DVector<f64>,
    free: &[Option<HPolyhedron>],
) -> Path {
    let (mut vertices, mut path) = shortened(graph, vertices, path, g, free);
    'again: loop {
        let enough = path.length() * (1.0 - TOL_PROGRESS);
        for position in 1..vertices.len() {
            let bend = graph.frame.u_of(&path.points[position]);
            for between in 0..graph.vertices.len() {
                let joins = |v: usize| graph.usable(v, between).is_some();
                if vertices.contains(&between)
                    || !joins(vertices[position - 1])
                    || !joins(vertices[position])
                    || !graph.vertices[between].polytope.contains(&bend, TOL_BEND)
                {
                    continue;
                }
                let mut more = vertices.clone();
                more.insert(position, between);
                if let Some(shorter) = shortest_through(graph, &more, g, free)
                    && shorter.length() < enough
                {
                    (vertices, path) = (more, shorter);
                    continue 'again;
                }
            }
        }
        return shortened(graph, vertices, path, g, free).1;
    }
}

/// How far outside of a face a bend may lie to count as held, in units of u. Erring side: a smaller value leaves
/// corners that could be cut.
const TOL_BEND: f64 = 1e-6;

/// Drops vertices one at a time, the first that shortens the path or keeps its length.
fn shortened(
    graph: &LeafGraph,
    mut vertices: Vec<usize>,
    mut path: Path,
    g: &DVector<f64>,
    free: &[Option<HPolyhedron>],
) -> (Vec<usize>, Path) {
    'again: while vertices.len() > 1 {
        for dropped in 0..vertices.len() {
            let mut fewer = vertices.clone();
            fewer.remove(dropped);
            let joined = graph.vertices[fewer[0]].start == Contact::Inside
                && graph.vertices[fewer[fewer.len() - 1]].goal == Contact::Inside;
            if !joined {
                continue;
            }
            if let Some(shorter) = shortest_through(graph, &fewer, g, free)
                && shorter.length() <= path.length()
            {
                (vertices, path) = (fewer, shorter);
                continue 'again;
            }
        }
        break;
    }
    (vertices, path)
}

/// A pass from `from` into `to` through a point of their overlap.
struct Pass {
    from: usize,
    to: usize,
    at: DVector<f64>,
    length: f64,
    previous: Option<usize>,
    done: bool,
}

/// Vertices along the shortest chain of straight lines through the overlaps' points.
fn dijkstra(graph: &LeafGraph) -> Option<Vec<usize>> {
    let inside = |contact: Contact| contact == Contact::Inside;
    let starts = |v: usize| inside(graph.vertices[v].start);
    let goals = |v: usize| inside(graph.vertices[v].goal);
    if let Some(v) = (0..graph.vertices.len()).find(|&v| starts(v) && goals(v)) {
        return Some(vec![v]);
    }
    let origin = DVector::zeros(graph.frame.dimension());
    let mut passes: Vec<Pass> = Vec::new();
    for &(a, b) in graph.overlaps.keys() {
        let Some(at) = graph.usable(a, b) else { continue };
        for (from, to) in [(a, b), (b, a)] {
            let length = if starts(from) { graph.frame.distance(at, &origin) } else { f64::INFINITY };
            passes.push(Pass { from, to, at: at.clone(), length, previous: None, done: false });
        }
    }
    let mut best: Option<(f64, usize)> = None;
    loop {
        let open = (0..passes.len()).filter(|&p| !passes[p].done && passes[p].length.is_finite());
        let Some(next) = open.min_by(|&a, &b| passes[a].length.total_cmp(&passes[b].length)) else { break };
        passes[next].done = true;
        let (to, at, length) = (passes[next].to, passes[next].at.clone(), passes[next].length);
        if best.is_some_and(|(best_length, _)| length >= best_length) {
            break;
        }
        if goals(to) {
            let total = length + graph.frame.distance(&at, &graph.u_goal);
            if best.is_none_or(|(best_length, _)| total < best_length) {
                best = Some((total, next));
            }
        }
        for pass in passes.iter_mut().filter(|pass| pass.from == to && !pass.done) {
            let total = length + graph.frame.distance(&at, &pass.at);
            if total < pass.length {
                pass.length = total;
                pass.previous = Some(next);
            }
        }
    }
    let mut pass_idx = best?.1;
    let mut vertices = vec![passes[pass_idx].to];
    loop {
        vertices.push(passes[pass_idx].from);
        match passes[pass_idx].previous {
            Some(previous) => pass_idx = previous,
            None => break,
        }
    }
    vertices.reverse();
    Some(without_loops(vertices))
}

/// The walk with everything between two visits of a vertex left out.
fn without_loops(walk: Vec<usize>) -> Vec<usize> {
    let mut path: Vec<usize> = Vec::new();
    for v in walk {
        match path.iter().position(|&earlier| earlier == v) {
            Some(position) => path.truncate(position + 1),
            None => path.push(v),
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_are_left_out() {
        assert_eq!(without_loops(vec![0, 1, 2, 1, 3]), [0, 1, 3]);
        assert_eq!(without_loops(vec![0, 1, 0, 2]), [0, 2]);
    }
}
