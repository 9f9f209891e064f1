"""Regions as pairs (A, b), and what one judge finds in them."""

import json
import math

import numpy as np
from pydrake.geometry.optimization import HPolyhedron


def read(path):
    """The regions of a regions.json."""
    return [(np.array(r["A"]), np.array(r["b"])) for r in json.loads(path.read_text())["regions"]]


def n_faces(regions):
    """Faces that no other face implies, joint limits included."""
    return sum(HPolyhedron(A, b).ReduceInequalities().b().size for A, b in regions)


def covered(regions, q):
    """Whether some region contains each of the configurations [m, n]."""
    inside = np.zeros(len(q), dtype=bool)
    for A, b in regions:
        inside |= np.all(q @ A.T <= b, axis=1)
    return inside


def interval(n_hits, n):
    """Share with its 95 % Wilson interval, as text."""
    z, share = 1.959964, n_hits / n
    center = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    return f"{share:.4f} [{max(center - half, 0):.4f}, {min(center + half, 1):.4f}]"


def walk(A, b, n_samples, rng, n_mixing=20):
    """Nearly uniform points [m, n] of a bounded polyhedron: hit-and-run from its Chebyshev centre, with 100 walkers."""
    start = HPolyhedron(A, b).MaximumVolumeInscribedEllipsoid()
    shape = np.linalg.inv(start.A())
    q = np.tile(start.center(), (100, 1))
    found = []
    while len(found) * 100 < n_samples:
        for _ in range(n_mixing):
            d = rng.standard_normal(q.shape) @ shape.T
            speed, slack = d @ A.T, np.maximum(b - q @ A.T, 0.0)
            with np.errstate(divide="ignore", invalid="ignore"):
                t = slack / speed
            high = np.min(np.where(speed > 0, t, np.inf), axis=1)
            low = np.max(np.where(speed < 0, t, -np.inf), axis=1)
            q = q + (low + (high - low) * rng.random(len(q)))[:, None] * d
        found.append(q)
    return np.concatenate(found)[:n_samples]


class Judge:
    """Drake's collision checker over fixed samples, the same for everyone's regions."""

    def __init__(self, scene, n_samples, rng):
        self.scene, self.rng = scene, rng
        self.sets = {"CS_free": self._free(scene.lower, scene.upper, n_samples)}
        tasks = list(scene.toml.get("task", {}).values())
        if tasks:
            lower, upper = scene.lower.copy(), scene.upper.copy()
            for name, (low, high) in tasks[0]["grasp"]["bounds"].items():
                j = scene.coordinates.index(name)
                lower[j], upper[j] = low, high
            self.sets["CG_free"] = self._free(lower, upper, n_samples)

    def _free(self, lower, upper, n_samples):
        free = []
        while sum(map(len, free)) < n_samples:
            q = lower + (upper - lower) * self.rng.random((n_samples, len(lower)))
            free.append(q[self.scene.is_free(q)])
        return np.concatenate(free)[:n_samples]

    def coverage(self, regions, name):
        q = self.sets.get(name)
        return "" if q is None else interval(int(covered(regions, q).sum()), len(q))

    def collisions(self, regions, n_samples):
        """Share of samples in collision, `n_samples` of each region, and the deepest, as text."""
        q = np.concatenate([walk(A, b, n_samples, self.rng) for A, b in regions])
        hit = q[~self.scene.is_free(q)]
        if not len(hit):
            return f"0 of {len(q)}"
        deepest = -min(self.scene.clearance(q) for q in hit[:2000])
        return f"{len(hit) / len(q):.1e}, {1e3 * deepest:.3f} mm"
