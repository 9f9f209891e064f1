"""A scene folder as a Drake collision checker: same bodies, same limits, same pairs."""

import itertools
import tomllib
from pathlib import Path

import numpy as np
from pydrake.geometry import Box, Capsule, CollisionFilterDeclaration, Cylinder, GeometrySet, Role, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import CoulombFriction
from pydrake.multibody.tree import SpatialInertia
from pydrake.planning import RobotDiagramBuilder, SceneGraphCollisionChecker


class DrakeScene:
    """A scene, its checker, and the order of its coordinates.

    `coordinates`: names in the scene's order. `order[j]`: position in Drake's q of coordinate j of the scene.
    `lower`, `upper`: limits in the scene's order. `pairs`: pairs of bodies that count.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        self.toml = tomllib.loads((self.folder / "scene.toml").read_text())
        builder = RobotDiagramBuilder(time_step=0.0)
        self.plant = plant = builder.plant()
        plant.set_adjacent_bodies_collision_filters(False)  # the scene's own rule is applied below
        parser = builder.parser()
        parser.SetAutoRenaming(True)
        bodies, instances = {}, []
        for model in self.toml["model"]:
            (instance,) = parser.AddModels(str(self.folder / model["urdf"]))
            instances.append(instance)
            links = [plant.get_body(idx) for idx in plant.GetBodyIndices(instance)]
            children = {plant.get_joint(j).child_body().index() for j in plant.GetJointIndices(instance)}
            (root,) = [link for link in links if link.index() not in children]
            plant.WeldFrames(plant.world_frame(), root.body_frame(), pose(model))
            bodies |= {f"{model['name']}/{link.name()}": link for link in links}
        for obstacle in self.toml.get("obstacle", []):
            instance = plant.AddModelInstance(obstacle["name"])
            mass = SpatialInertia.SolidSphereWithMass(1.0, 0.1)
            body = plant.AddRigidBody(obstacle["name"], instance, mass)
            plant.WeldFrames(plant.world_frame(), body.body_frame(), pose(obstacle))
            plant.RegisterCollisionGeometry(
                body, RigidTransform(), shape(obstacle), obstacle["name"], CoulombFriction(1.0, 1.0)
            )
            bodies[obstacle["name"]] = body
        plant.Finalize()
        self._limit()
        self.pairs = self._pairs(bodies)
        self._filter(builder.scene_graph(), bodies)
        self.coordinates = self.toml["coordinates"]["order"]
        joints = {plant.get_joint(j).name(): plant.get_joint(j) for j in plant.GetJointIndices()}
        self.order = np.array([joints[name.split("/")[-1]].position_start() for name in self.coordinates])
        self.lower = plant.GetPositionLowerLimits()[self.order]
        self.upper = plant.GetPositionUpperLimits()[self.order]
        # A metre of a finger counts as ten radians; only edges of visibility graphs use it.
        weights = np.ones(plant.num_positions())
        for joint in joints.values():
            if joint.num_positions() == 1 and joint.type_name() == "prismatic":
                weights[joint.position_start()] = 10.0
        self.checker = SceneGraphCollisionChecker(
            model=builder.Build(),
            robot_model_instances=instances,
            edge_step_size=0.02,
            configuration_distance_function=lambda a, b: float(np.linalg.norm(weights * (a - b))),
        )

    def _limit(self):
        for name, (low, high) in self.toml["coordinates"].get("limits", {}).items():
            joint = self.plant.GetJointByName(name.split("/")[-1])
            joint.set_position_limits([low], [high])

    def _pairs(self, bodies):
        """Two links count unless a joint joins them, both are fixed to each other, or the scene excludes them."""
        welded = {body.index(): set(b.index() for b in self.plant.GetBodiesWeldedTo(body)) for body in bodies.values()}
        joined = set()
        for idx in self.plant.GetJointIndices():
            joint = self.plant.get_joint(idx)
            joined.add(frozenset((joint.parent_body().index(), joint.child_body().index())))
        excluded = {frozenset(pair) for pair in self.toml.get("collision", {}).get("exclude", [])}
        shapes = lambda body: self.plant.GetCollisionGeometriesForBody(body)
        return [
            (a, b)
            for a, b in itertools.combinations(sorted(bodies), 2)
            if frozenset((a, b)) not in excluded
            and frozenset((bodies[a].index(), bodies[b].index())) not in joined
            and bodies[b].index() not in welded[bodies[a].index()]
            and shapes(bodies[a])
            and shapes(bodies[b])
        ]

    def _filter(self, scene_graph, bodies):
        manager = scene_graph.collision_filter_manager()
        geometries = {
            name: GeometrySet(self.plant.GetCollisionGeometriesForBody(body)) for name, body in bodies.items()
        }
        for a, b in itertools.combinations(sorted(bodies), 2):
            if (a, b) not in self.pairs:
                declaration = CollisionFilterDeclaration().ExcludeBetween(geometries[a], geometries[b])
                manager.Apply(declaration)
        inspector = scene_graph.model_inspector()
        self.n_geometry_pairs = len(inspector.GetCollisionCandidates())

    def to_drake(self, q):
        """Configurations [m, n] of the scene in Drake's order."""
        drake = np.zeros_like(q)
        drake[:, self.order] = q
        return drake

    def is_free(self, q):
        """Verdicts [m] for configurations [m, n] of the scene."""
        return np.array(self.checker.CheckConfigsCollisionFree(self.to_drake(q)), dtype=bool)

    def clearance(self, q):
        """Least signed distance at one configuration of the scene, metres."""
        found = self.checker.CalcRobotClearance(self.to_drake(q[None])[0], 0.01).distances()
        return min(found, default=0.01)


def pose(table):
    return RigidTransform(RollPitchYaw(table.get("rpy", [0.0] * 3)), table.get("xyz", [0.0] * 3))


def shape(obstacle):
    if "box" in obstacle:
        return Box(*obstacle["box"]["size"])
    if "sphere" in obstacle:
        return Sphere(obstacle["sphere"]["radius"])
    kind = "cylinder" if "cylinder" in obstacle else "capsule"
    made = Cylinder if kind == "cylinder" else Capsule
    return made(obstacle[kind]["radius"], obstacle[kind]["length"])
