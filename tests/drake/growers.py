"""Drake's growers: covers and single regions, as pairs (A, b) in the scene's order of coordinates."""

import numpy as np
from pydrake.common import Parallelism, RandomGenerator
from pydrake.geometry.optimization import HPolyhedron, Hyperellipsoid, IrisNp, IrisOptions
from pydrake.planning import (
    IrisFromCliqueCoverOptions,
    IrisInConfigurationSpaceFromCliqueCover,
    IrisNp2,
    IrisNp2Options,
    IrisZo,
    IrisZoOptions,
    MaxCliqueSolverViaGreedy,
)

METHODS = ("iris-np", "iris-np2", "iris-zo")


def options(method, margin, threads, seed, max_iterations):
    """Options of one grower at (ε, δ) = (0.01, 0.05), Drake's defaults elsewhere."""
    if method == "iris-np":
        made = IrisOptions()
        made.iteration_limit, made.random_seed, made.configuration_space_margin = max_iterations, seed, margin
        return made
    made = IrisNp2Options() if method == "iris-np2" else IrisZoOptions()
    sampled = made.sampled_iris_options
    sampled.epsilon, sampled.delta = 0.01, 0.05
    sampled.max_iterations, sampled.random_seed, sampled.configuration_space_margin = max_iterations, seed, margin
    sampled.parallelism = Parallelism(threads)
    return made


def cover(scene, method, coverage, margin, threads, seed):
    """A clique cover; one iteration a region, as Drake's own default for covers has it."""
    made = IrisFromCliqueCoverOptions()
    made.coverage_termination_threshold = coverage
    made.num_points_per_coverage_check = 4000
    made.parallelism = Parallelism(threads)
    made.iris_options = options(method, margin, threads, seed, 1)
    regions = IrisInConfigurationSpaceFromCliqueCover(
        checker=scene.checker,
        options=made,
        generator=RandomGenerator(seed),
        sets=[],
        max_clique_solver=MaxCliqueSolverViaGreedy(),
    )
    return [in_order(scene, region) for region in regions]


def single(scene, method, q, radius, margin, threads, seed):
    """A region around `q`, by up to three iterations, within `radius` of it in each coordinate if that is positive."""
    q = scene.to_drake(q[None])[0]
    plant = scene.checker.plant()
    lower, upper = plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()
    if radius > 0:
        lower, upper = np.maximum(lower, q - radius), np.minimum(upper, q + radius)
    limits = HPolyhedron.MakeBox(lower, upper)
    made = options(method, margin, threads, seed, 3)
    if method == "iris-np":
        made.bounding_region = limits
        context = scene.checker.plant_context()
        plant.SetPositions(context, q)
        return in_order(scene, IrisNp(plant, context, made))
    start = Hyperellipsoid.MakeHypersphere(0.01, q)
    grow = IrisNp2 if method == "iris-np2" else IrisZo
    return in_order(scene, grow(scene.checker, start, limits, made))


def in_order(scene, region):
    return region.A()[:, scene.order], region.b()


def mean_half_axis(region):
    """Geometric mean of the half-axes of the largest inscribed ellipsoid, radians: the n-th root of its volume."""
    A = HPolyhedron(*region).MaximumVolumeInscribedEllipsoid().A()
    return float(np.exp(-np.linalg.slogdet(A)[1] / len(A)))
