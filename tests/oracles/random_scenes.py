"""Random scenes: trees with every joint type, skew axes and offsets, fixed joints and massless bodies in between."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from eomgen.formula.nodes import Formula, Number, Symbol
from eomgen.scene.bodies.model import Base, Body
from eomgen.scene.forces.forces import Effort, Force
from eomgen.scene.forces.springs import Spring, TorsionSpring
from eomgen.scene.joint_types import JOINTS, JointType
from eomgen.scene.joints.model import Coefficients, Joint, Mimic
from eomgen.scene.rotations import Rotation
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE, Point
from eomgen.system.signals import Input, Output, Parameter
from tests.models.elements import elements_with
from tests.oracles.evaluation import Array
from tests.oracles.formulas import TIME, call, number, parameter, plus, rigid_body, times, vector
from tests.oracles.robots import body_of_masses
from tests.oracles.states import random_unit_quaternions, rotation_of

NUMBERS = ("revolute", "prismatic", "helical", "cylindrical", "universal", "planar")


def _triple(values: Array) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])


def _rows(matrix: Array) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(row[0]), float(row[1]), float(row[2])) for row in matrix)


class _Maker:
    def __init__(self, seed: int, links: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.links = links
        self.bodies: list[Body] = []
        self.joints: list[Joint] = []
        self.parameters: list[Parameter] = []

    def maybe_tunable(self, value: float, chance: float) -> Formula:
        """Return the number itself, or half of it plus a tunable parameter worth the other half."""
        if self.rng.uniform() > chance:
            return number(value)
        name = f"p{len(self.parameters)}"
        self.parameters.append(Parameter(name, 0.5 * float(value), tunable=True))
        return plus(number(0.5 * value), parameter(name))

    def axis(self) -> tuple[float, float, float]:
        if self.rng.uniform() < 0.5:
            axis = np.zeros(3)
            axis[self.rng.integers(3)] = self.rng.choice([-1.0, 1.0])
        else:
            axis = self.rng.normal(size=3)
            axis /= np.linalg.norm(axis)
        return float(axis[0]), float(axis[1]), float(axis[2])

    def body(self, name: str, massless: bool, tunable: float) -> Body:
        if massless:
            return rigid_body(name, 0.0)
        if self.rng.uniform() < 0.35:
            return self.body_of_revolution(name)
        masses, places = self.rng.uniform(0.1, 0.8, 6), self.rng.uniform(-0.4, 0.4, (6, 3))
        made = body_of_masses(name, masses, places)
        assert isinstance(made.mass, Number)
        center = vector([self.maybe_tunable(item.value, 0.5 * tunable) for item in made.center_of_mass])  # type: ignore[union-attr]
        return replace(made, mass=self.maybe_tunable(made.mass.value, tunable), center_of_mass=center)

    def body_of_revolution(self, name: str) -> Body:
        """Return a ball, rod or disc about a coordinate axis, its centre on that axis: equal and vanishing second
        moments."""
        axis = self.rng.integers(3)
        center = np.zeros(3)
        center[axis] = self.rng.choice([0.0, 0.3])
        inertia = np.full(3, 0.05)
        inertia[axis] = self.rng.choice([0.05, 0.02, 0.1])
        return rigid_body(name, 0.8, center.tolist(), [*inertia.tolist(), 0.0, 0.0, 0.0])

    def joint(self, name: str, kind: JointType, parent: str, child: str, tunable: float) -> Joint:
        orientation = np.eye(3) if self.rng.uniform() < 0.4 else rotation_of(random_unit_quaternions(self.rng, 1))[0]
        position = vector([self.maybe_tunable(value, 0.5 * tunable) for value in self.rng.uniform(-0.6, 0.6, 3)])
        geared, size = kind in NUMBERS and self.rng.uniform() < 0.4, JOINTS[kind].v_size
        rotors = tuple(
            number(self.rng.uniform(0.0, 0.05) if geared else 0.0) for _ in range(size if kind in NUMBERS else 1)
        )
        neutral = {"spherical": (1.0, 0.0, 0.0, 0.0), "free": (1.0, *([0.0] * 6))}.get(kind, (0.0,) * size)
        axis = np.array(self.axis())
        across = np.cross(axis, self.rng.normal(size=3) if np.max(np.abs(axis)) < 1.0 else np.roll(axis, 1))
        across = across / np.linalg.norm(across)
        pitch = (
            self.maybe_tunable(float(self.rng.uniform(-0.3, 0.3)), 0.5 * tunable) if kind == "helical" else number(0.0)
        )
        return Joint(
            name,
            kind,
            parent,
            child,
            axis=_triple(axis),
            position=position,
            orientation=_rows(orientation),
            rotor_inertia=rotors if len(rotors) > 1 else rotors[0] if rotors else number(0.0),
            pitch=pitch,
            second_axis=_triple(across),
            initial_position=neutral,
            initial_velocity=(0.0,) * size,
        )

    def tree(self, tunable: float) -> None:
        moving = 0
        parents = [BASE]
        after_massless = False
        while moving < self.links or after_massless:
            k = len(self.bodies)
            kinds: list[JointType] = ["revolute", "revolute", "prismatic"]
            if not after_massless:
                kinds += ["helical", "cylindrical", "universal", "planar", "spherical", "free", "fixed"]
            kind = kinds[self.rng.integers(len(kinds))]
            parent = self.bodies[-1].name if after_massless else str(parents[self.rng.integers(len(parents))])
            massless = not after_massless and kind in ("revolute", "prismatic") and self.rng.uniform() < 0.25
            self.bodies.append(self.body(f"body{k}", massless, 0.0 if massless else tunable))
            self.joints.append(self.joint(f"joint{k}", kind, parent, f"body{k}", tunable))
            if not massless:
                parents.append(f"body{k}")
            after_massless = massless
            moving += kind != "fixed"

    def joint_names(self, kind: str) -> list[str]:
        return [joint.name for joint in self.joints if joint.type == kind]

    def random_vector(self) -> tuple[Formula, Formula, Formula]:
        return vector(self.rng.uniform(-0.5, 0.5, 3).tolist())

    def somewhere(self) -> str:
        return str(self.rng.choice([BASE, *(body.name for body in self.bodies)]))


def random_scene(seed: int, links: int = 4, *, tunable: float = 0.0) -> Scene:
    """Return a random tree under skew gravity, nothing else acting on it."""
    maker = _Maker(seed, links)
    maker.tree(tunable)
    gravity = maker.rng.uniform(-9.0, 9.0, 3).tolist()
    return Scene(
        f"random_{seed}",
        tuple(maker.bodies),
        tuple(maker.joints),
        gravity=vector(gravity),
        parameters=tuple(maker.parameters),
    )


def shaking_base(rng: np.random.Generator, *, turning: bool = True) -> Base:
    """Return a base that translates along all axes and turns about coordinate and skew axes."""

    def swing() -> Formula:
        phase = plus(times(float(rng.uniform(0.5, 3.0)), TIME), number(rng.uniform(0.0, 3.0)))
        return times(float(rng.uniform(0.2, 1.0)), call("sin", phase))

    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    skew = (float(axis[0]), float(axis[1]), float(axis[2]))
    turns = (
        Rotation((0.0, 0.0, 1.0), swing()),
        Rotation(skew, swing()),
        Rotation((-1.0, 0.0, 0.0), plus(swing(), TIME)),
    )
    return Base(vector([swing(), plus(swing(), TIME), swing()]), turns if turning else ())


def with_base(scene: Scene, seed: int, *, turning: bool = True) -> Scene:
    return replace(scene, base=shaking_base(np.random.default_rng(seed), turning=turning))


def with_loads(scene: Scene, seed: int) -> Scene:
    """Return the scene with springs, dampers, actuators, forces by formula and efforts, all of them active."""
    maker = _Maker(seed, 0)
    maker.bodies, maker.joints = list(scene.bodies), list(scene.joints)
    rng = maker.rng
    points = tuple(Point(f"point{k}", maker.somewhere(), maker.random_vector()) for k in range(4))
    tip = Point("tip", scene.bodies[-1].name, maker.random_vector())
    ground = Point("ground", BASE, vector((1.5, -2.0, 2.5)))
    anchored = Spring(
        "anchored", "ground", "tip", number(30.0), number(1.5), number(1.0), times(2.0, Symbol("input", "pull"))
    )
    between = Spring(
        "between", "tip", "point0", number(12.0), number(0.4), number(0.3), call("sin", Symbol("rate", "anchored"))
    )
    loose = points[0].body == tip.body  # such a spring has no work to do, which is fine

    def each(joint: Joint, low: float, high: float) -> Coefficients:
        values = tuple(number(rng.uniform(low, high)) for _ in range(joint.kind.v_size))
        return values if len(values) > 1 else values[0]

    joints = tuple(
        (
            replace(joint, stiffness=each(joint, 1, 9), damping=each(joint, 0.1, 2), rest=each(joint, -1, 1))
            if joint.type in NUMBERS and rng.uniform() < 0.6
            else joint
        )
        for joint in scene.joints
    )
    revolute = maker.joint_names("revolute")
    torsion = (
        (
            TorsionSpring(
                "torsion", revolute[0], revolute[-1] if len(revolute) > 1 else "", number(4.0), number(0.6), number(0.2)
            ),
        )
        if revolute
        else ()
    )
    driven = [joint for joint in scene.joints if joint.type != "fixed"][-1]
    effort = Effort(
        "motor",
        driven.name,
        plus(Symbol("input", "pull"), times(-0.7, Symbol("v", driven.name, 0))),
        driven.kind.v_size - 1,
    )
    wind = vector(
        [
            times(-0.3, Symbol("velocity", "tip", 0)),
            call("cos", TIME),
            times(0.5, call("tanh", Symbol("position", "tip", 2))),
        ]
    )
    twisting = vector([times(0.2, TIME), Symbol("length", "anchored"), number(-0.4)])
    forces = (
        Force("wind", tip.body, tip.position, wind, vector((0.1, -0.2, 0.3)), "world"),
        Force("thrust", scene.bodies[0].name, maker.random_vector(), vector((0.5, 1.0, -0.7)), twisting, "body"),
    )
    return replace(
        scene,
        joints=joints,
        points=(*points, tip, ground),
        inputs=(Input("pull"),),
        elements=elements_with(
            scene,
            springs=(anchored,) if loose else (anchored, between),
            torsion_springs=torsion,
            forces=forces,
            efforts=(effort,),
        ),
    )


def with_mimics(scene: Scene, seed: int) -> Scene:
    """Return the scene with every joint of one coordinate but the last one following that one, or one that follows
    it."""
    rng = np.random.default_rng(seed)
    single = [joint.name for joint in scene.joints if joint.kind.sizes == (1, 1)]
    followed = dict(itertools.pairwise(single))
    joints = tuple(
        (
            replace(
                joint,
                mimic=Mimic(followed[joint.name], number(rng.uniform(-2.0, 2.0)), number(rng.uniform(-1.0, 1.0))),
                initial_position=(),
                initial_velocity=(),
            )
            if joint.name in followed
            else joint
        )
        for joint in scene.joints
    )
    return replace(scene, joints=joints)


def point_outputs(scene: Scene) -> Scene:
    """Return the scene with position, velocity and acceleration of its points as outputs."""
    outputs = tuple(
        Output(f"{kind}_{point.name}", tuple(Symbol(kind, point.name, k) for k in range(3)))
        for point in scene.points
        for kind in ("position", "velocity", "acceleration")
    )
    return replace(scene, outputs=outputs)
