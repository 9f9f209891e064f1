"""Regions of this project beside those of Drake's IRIS clique cover: same scenes, same machine, one judge.

See README.md in this folder.
"""

import argparse
import json
import os
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

try:
    import pydrake  # noqa: F401
except ImportError:
    print("skipped: the package drake is not installed; pip install -r tests/drake/requirements.txt")
    sys.exit(0)

import logging

import numpy as np

logging.getLogger("drake").setLevel(logging.WARNING)

import growers
import ours
from kept import kept
from plant import DrakeScene
from regions import Judge, n_faces, read

SEEDS = {
    "above shelf": (0.000064, 0.471953, -0.000149, -0.671673, 0.000185, 0.42617, 1.570692),
    "top shelf": (-0.000155, 0.397273, 0.00022, -1.367476, 0.000247, -0.192952, 1.570469),
    "centre shelf": (-0.000176, 0.683028, 0.000245, -1.647823, 0.000021, -0.759055, 1.570626),
    "left bin": (1.332666, 0.786593, 0.362338, -1.491653, -0.319251, 0.921732, 1.79119),
    "right bin": (-1.332462, 0.786648, -0.362656, -1.491653, 0.319534, 0.921783, 1.350209),
    "C": (0.0, 0.2, 0.0, -2.09, 0.0, -0.3, 1.5707963267948966),
    "L": (0.8, 0.7, 0.0, -1.6, 0.0, 0.0, 1.5707963267948966),
    "R": (-0.8, 0.7, 0.0, -1.6, 0.0, 0.0, 1.5707963267948966),
}


def agreement(scene, rng, n_samples=5000):
    """Verdicts of both engines on the same configurations; a difference away from contact ends the comparison."""
    q = scene.lower + (scene.upper - scene.lower) * rng.random((n_samples, len(scene.lower)))
    theirs, mine = scene.is_free(q), np.array(ours.verdicts(scene.folder, q))
    differ = q[theirs != mine]
    far = [q for q in differ if abs(scene.clearance(q)) > 1e-5]
    note(
        f"{scene.folder.name}: {scene.n_geometry_pairs} pairs of shapes, {mine.mean():.4f} free; verdicts differ on "
        f"{len(differ)} of {n_samples} configurations, on {len(far)} of them farther than 0.01 mm from contact"
    )
    if far:
        raise SystemExit(f"the engines judge different scenes: {far[0]}")


def covers(name, args, rng):
    """Covers of a reference scene, ours first."""
    scene = DrakeScene(ours.PROJECT / "scenes" / name)
    agreement(scene, rng)
    judge = Judge(scene, args.samples, rng)
    rows = []

    def row(who, cost, regions):
        line = dict(
            who=who,
            wall=cost.wall,
            cpu=cost.cpu,
            regions=len(regions),
            faces=n_faces(regions),
            CS_free=judge.coverage(regions, "CS_free"),
            CG_free=judge.coverage(regions, "CG_free"),
            collisions=judge.collisions(regions, args.samples_per_region),
            load=cost.load,
        )
        rows.append(line)
        note(json.dumps(line))

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        with ours.Cost() as grown:
            candidates = ours.decompose(
                scene.folder, out, "--coverage", args.coverage, "--threads", args.threads, "--seed", args.seed
            )
        row("regrasp, candidates", grown, read(candidates))
        with ours.Cost() as certified:
            proven = ours.certify(scene.folder, out, "--workers", args.threads)
        row("regrasp, certified", certified.after(grown), read(proven))
    for method in args.methods:
        what = dict(scene=name, method=method, coverage=args.coverage, margin=args.margin)
        grow = lambda: growers.cover(scene, method, args.coverage, args.margin, args.threads, args.seed)
        cost, regions = kept(args.keep, what | conditions(args, scene), grow)
        row(f"Drake, {method}", cost, regions)
    table(f"{name}, coverage {args.coverage}", rows)


def singles(args, rng):
    """Single regions of the arm around the seeds of its scene."""
    scene = DrakeScene(ours.PROJECT / "scenes" / "iiwa14-shelf")
    agreement(scene, rng)
    judge = Judge(scene, args.samples, rng)
    rows = []
    for seed_name in args.arm_seeds:
        q = np.array(SEEDS[seed_name])

        def row(who, cost, region):
            line = dict(
                seed=seed_name,
                who=who,
                wall=cost.wall,
                cpu=cost.cpu,
                faces=n_faces([region]),
                mean_half_axis=growers.mean_half_axis(region),
                CS_free=judge.coverage([region], "CS_free"),
                collisions=judge.collisions([region], args.samples_per_region * 10),
                load=cost.load,
            )
            rows.append(line)
            note(json.dumps(line))

        for method in args.our_arm_methods:
            with tempfile.TemporaryDirectory() as folder:
                out, at = Path(folder), ",".join(map(repr, map(float, q)))
                test = ("--epsilon", 0.01, "--delta", 0.05, "--threads", args.threads, "--seed", args.seed)
                box = ("--domain-radius", args.arm_radius)
                with ours.Cost() as grown:
                    file = ours.decompose(scene.folder, out, "--method", method, "--region-at", at, *test, *box)
                row(f"regrasp, {method}", grown, read(file)[0])
                if args.certify_arm:
                    with ours.Cost() as certified:
                        proven = ours.certify(scene.folder, out, "--workers", args.threads)
                    for region in read(proven):
                        row(f"regrasp, {method}, certified", certified.after(grown), region)
        for method in args.arm_methods:
            what = dict(scene=scene.folder.name, method=method, margin=args.arm_margin, radius=args.arm_radius, q=list(q))
            grow = lambda: [
                growers.single(scene, method, q, args.arm_radius, args.arm_margin, args.threads, args.seed)
            ]
            cost, regions = kept(args.keep, what | conditions(args, scene), grow)
            row(f"Drake, {method}", cost, regions[0])
    radius = f", within ±{args.arm_radius} rad" if args.arm_radius else ""
    table(f"iiwa14-shelf, single regions at (0.01, 0.05){radius}", rows)


def conditions(args, scene):
    """What else Drake's regions depend on."""
    return dict(threads=args.threads, seed=args.seed, drake=version("drake"), files=ours.digest(scene.folder))


def note(text):
    print(text, file=sys.stderr, flush=True)


def table(title, rows):
    """Rows as a Markdown table on standard output."""
    keys = list(rows[0])
    text = lambda value: f"{value:.3g}" if isinstance(value, float) else str(value)
    print(f"\n{title}\n\n| {' | '.join(keys)} |\n|{' --- |' * len(keys)}")
    for line in rows:
        print(f"| {' | '.join(text(line[key]) for key in keys)} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="*", default=["bottle-cap-3dof", "bottle-cap-4dof", "iiwa14-shelf"])
    parser.add_argument("--methods", nargs="*", default=list(growers.METHODS), help="of Drake's covers")
    parser.add_argument("--arm-methods", nargs="*", default=list(growers.METHODS), help="of Drake's single regions")
    parser.add_argument("--our-arm-methods", nargs="*", default=["iris-zo", "iris-np2"], help="of our single regions")
    parser.add_argument("--certify-arm", action="store_true", help="certify our single regions as well")
    parser.add_argument("--arm-radius", type=float, default=0.0, help="half-width of the box of single regions; 0: none")
    parser.add_argument("--keep", type=Path, help="folder: what Drake grows is kept there, and read in the next run")
    parser.add_argument("--arm-seeds", nargs="*", default=list(SEEDS))
    parser.add_argument("--coverage", type=float, default=0.99)
    parser.add_argument("--margin", type=float, default=1e-4, help="Drake's configuration-space margin of covers")
    parser.add_argument("--arm-margin", type=float, default=1e-2, help="the same of single regions; Drake's default")
    parser.add_argument("--threads", type=int, default=2, help="of both programs")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--samples", type=int, default=20000, help="free samples of each set")
    parser.add_argument("--samples-per-region", type=int, default=2000)
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    print(f"drake {version('drake')}, {os.cpu_count()} cores, {args.threads} threads, seed {args.seed}")
    for name in args.scenes:
        if name == "iiwa14-shelf":
            singles(args, rng)
        else:
            covers(name, args, rng)


if __name__ == "__main__":
    main()
