"""Constrained scenes for tests: every type of constraint, absolute states from poses, accelerations from the KKT
system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation as Turn

from eomgen.formula.nodes import Formula, Symbol
from eomgen.scene.bodies.model import Body
from eomgen.scene.joints.model import Constraint, Frame
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE
from eomgen.system.system import System
from tests.oracles import direct_kinematics
from tests.oracles.evaluation import Array, Evaluate
from tests.oracles.formulas import TIME, call, number, plus, rigid_body, times, vector
from tests.oracles.robots import body_of_masses
from tests.oracles.states import STEP, displaced, random_unit_quaternions, rotation_of

#: How many freedoms each type leaves, positions only.
FREEDOMS = {
    "spherical": 3,
    "revolute": 1,
    "universal": 2,
    "cylindrical": 2,
    "helical": 1,
    "prismatic": 1,
    "planar": 3,
    "fixed": 0,
    "distance": 5,
    "point_on_line": 4,
    "orientation": 3,
    "rolling": 5,
    "sliding": 5,
    "formula": 5,
}
DRIVEN = ("revolute", "prismatic", "cylindrical")
SEMI_AXES, TUBE = (0.5, 0.3, 0.2), 0.15
#: Beginning of the names of shapes on a surface z = h(x, y) in place of the plane.
HILL = "hill "


def frame(rng: np.random.Generator, body: str) -> Frame:
    """Return a skew frame somewhere in a body."""
    R = rotation_of(random_unit_quaternions(rng, 1))[0]
    rows = tuple((float(row[0]), float(row[1]), float(row[2])) for row in R)
    return Frame(body, vector(rng.uniform(-0.7, 0.7, 3).tolist()), rows)


def drive_of_time() -> Formula:
    return plus(times(0.4, call("sin", times(1.7, TIME))), times(0.3, TIME))


def constraint(
    rng: np.random.Generator,
    kind: str,
    first: str,
    second: str,
    *,
    driven: bool = False,
    shape: str = "disc",
    name: str = "loop",
) -> Constraint:
    """Return a constraint between skew frames of two bodies, or of a body and the base."""
    return Constraint(
        name,
        kind,
        frame(rng, first),
        frame(rng, second),
        drive=drive_of_time() if driven else None,  # type: ignore[arg-type]
        length=number(1.3),
        radius=number(0.45),
        shape=shape.removeprefix(HILL),  # type: ignore[arg-type]  # literals
        surface=_hill() if shape.startswith(HILL) else None,
        pitch=number(-0.3),
        semi_axes=vector(SEMI_AXES),
        tube_radius=number(TUBE),
        equation=_on_a_moving_surface() if kind == "formula" else None,
    )


def _on_a_moving_surface() -> Formula:
    """Return z - 0.4 x y - 0.1 sin(2 y + t), in m."""
    x, y, z = (Symbol("local", "position", k) for k in range(3))
    return z - 0.4 * x * y - 0.1 * call("sin", plus(times(2.0, y), TIME))


def _hill() -> Formula:
    """Return 0.05 x y + 0.01 sin(x), in m."""
    x, y = (Symbol("local", "position", k) for k in range(2))
    return 0.05 * x * y + 0.01 * call("sin", x)


def _on_hill(x: float | complex, y: float | complex) -> Array:
    """Return the centre of a sphere that touches the hill at (x, y)."""
    normal = np.array([-0.05 * y - 0.01 * np.cos(x), -0.05 * x, 1.0])
    normal = normal / np.sqrt(normal @ normal)
    place = np.array([x, y, 0.05 * x * y + 0.01 * np.sin(x)])
    return place + 0.45 * normal


def variants() -> list[tuple[str, bool, str]]:
    """Return (type, driven, shape) of everything that a constraint can be."""
    plain = [(kind, False, "disc") for kind in FREEDOMS]
    rolling = [("rolling", False, shape) for shape in ("sphere", "ellipsoid", "torus", HILL + "sphere")]
    return [*plain, *((kind, True, "disc") for kind in DRIVEN), *rolling]


def weighty(scene: Scene, seed: int) -> Scene:
    """Return the scene with mass in every body and without rotor inertia, as absolute coordinates need it."""
    rng = np.random.default_rng(seed)

    def heavy(body: Body) -> Body:
        if body.mass != number(0.0):
            return body
        return body_of_masses(body.name, rng.uniform(0.1, 0.8, 6), rng.uniform(-0.4, 0.4, (6, 3)))

    joints = tuple(replace(joint, rotor_inertia=number(0.0)) for joint in scene.joints)
    return replace(scene, bodies=tuple(heavy(body) for body in scene.bodies), joints=joints)


def small_body(name: str) -> Body:
    return rigid_body(name, 1.4, [0.1, -0.2, 0.15], [0.3, 0.25, 0.35, 0.02, -0.03, 0.01])


def mixed_groups(scene: Scene) -> dict[str, str]:
    """Return R^3 x SO(3) for every second body."""
    return {body.name: "R3xSO3" for body in scene.bodies[::2]}


def kkt(evaluate: Evaluate, state: Mapping[str, Array]) -> dict[str, Array]:
    """Return the state with accelerations and multipliers: M a + B^T lam = -r(a = 0, lam = 0), B a = -g."""
    count, nv = state["v"].shape
    names = ("constraint_jacobian", "constraint_bias", "mass")
    B, g, M = (next(iter(evaluate(name, state).values())) for name in names)
    rows = B.shape[-2]
    rest = evaluate("residual", {**state, "a": np.zeros((count, nv)), "lam": np.zeros((count, rows))})["r"]
    matrix = np.zeros((count, nv + rows, nv + rows))
    matrix[:, :nv, :nv], matrix[:, :nv, nv:], matrix[:, nv:, :nv] = M, np.swapaxes(B, 1, 2), B
    found = np.linalg.solve(
        matrix, -np.concatenate([rest, np.broadcast_to(g, (count, rows))], axis=1)[..., np.newaxis]
    )[..., 0]
    return {**state, "a": found[:, :nv], "lam": found[:, nv:]}


def on_constraints(evaluate: Evaluate, state: Mapping[str, Array]) -> dict[str, Array]:
    """Return the state with the nearest velocity that the constraints allow."""
    B, w = evaluate("constraint_jacobian", state)["B"], evaluate("constraint_velocity", state)["w"]
    correction = np.linalg.pinv(B) @ w[..., np.newaxis]
    return {**state, "v": state["v"] - correction[..., 0]}


def _rigid_groups(scene: Scene) -> dict[str, list[str]]:
    """Return for each moving body the bodies that fixed joints hang on it, itself included."""
    host, groups = {BASE: BASE}, dict[str, list[str]]()
    for joint in scene.joints:
        host[joint.child] = host[joint.parent] if joint.type == "fixed" else joint.child
        groups.setdefault(host[joint.child], []).append(joint.child)
    groups.pop(BASE, None)
    return groups


def absolute_state(
    scene: Scene, joint: System, absolute: System, state: Mapping[str, Array], at_joint: Evaluate
) -> dict[str, Array]:
    """Return q and v of absolute bodies for a state in joint coordinates: poses multiplied out, moved by a complex
    step."""
    base = None
    if scene.base is not None:
        struct = at_joint("base", {**state, "t": state["t"] + 1j * STEP})["base"]
        base = rotation_of(struct[..., :4]), struct[..., 4:7]
    poses = direct_kinematics.poses(scene, displaced(joint.factors, state["q"], 1j * STEP * state["v"]), base)
    data = {name: (mass, center) for name, mass, center, _ in direct_kinematics.body_data(scene)}
    count = len(state["q"])
    q, v = np.zeros((count, absolute.nq)), np.zeros((count, absolute.nv))
    groups = _rigid_groups(scene)
    for factor in absolute.factors:
        name, _, part = factor.name.partition(".")
        R = poses[name][0]
        total = sum(data[member][0] for member in groups[name])
        moments = [data[member][0] * (poses[member][1] + poses[member][0] @ data[member][1]) for member in groups[name]]
        x = sum(moments[1:], start=moments[0]) / total
        spin = np.swapaxes(R.real, 1, 2) @ (R.imag / STEP)
        omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        quaternion = np.roll(Turn.from_matrix(R.real).as_quat(), 1, axis=1)
        velocity = x.imag / STEP
        match part:
            case "position":
                place, speed = x.real, velocity
            case "orientation":
                place, speed = quaternion, omega
            case _:
                place = np.concatenate([quaternion, x.real], axis=1)
                speed = np.concatenate([omega, np.einsum("nji,nj->ni", R.real, velocity)], axis=1)
        q[:, factor.q_start : factor.q_start + factor.q_size] = place
        v[:, factor.v_start : factor.v_start + factor.v_size] = speed
    return {**state, "q": q, "v": v}


def turn_about(axis: int, angle: float | complex) -> Array:
    """Return the rotation matrix about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    rest = [k for k in range(3) if k != axis] if axis != 1 else [2, 0]
    R = np.eye(3, dtype=type(c * 1.0)) + 0 * c
    i, j = rest
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = -s, s
    return R


def freely_displaced(
    kind: str, s: Sequence[float | complex], t: float, driven: bool, shape: str
) -> tuple[Array, Array]:
    """Return pose (rotation, position) of the second frame in the first for free displacements s, as the type is
    meant."""
    z = np.array([0.0, 0.0, 1.0])
    prescribed = 0.4 * np.sin(1.7 * t) + 0.3 * t
    anyhow = turn_about(2, s[0]) @ turn_about(0, s[1]) @ turn_about(1, s[2]) if len(s) >= 3 else np.eye(3)
    match kind:
        case "spherical":
            return anyhow, 0.0 * z
        case "revolute":
            return turn_about(2, prescribed if driven else s[0]), 0.0 * z
        case "universal":
            return turn_about(0, s[0]) @ turn_about(1, s[1]), 0.0 * z
        case "cylindrical":
            return turn_about(2, s[0]), (prescribed if driven else s[1]) * z
        case "helical":  # several turns: the travel counts them
            return turn_about(2, 6.0 * s[0]), -0.3 * 6.0 * s[0] * z
        case "prismatic":
            return np.eye(3), (prescribed if driven else s[0]) * z
        case "planar":
            return turn_about(2, s[0]), np.array([s[1], s[2], 0.0])
        case "fixed":
            return np.eye(3), 0.0 * z
        case "distance":
            return anyhow, 1.3 * turn_about(2, s[3]) @ turn_about(0, s[4]) @ z
        case "point_on_line":
            return anyhow, s[3] * z
        case "orientation":
            return np.eye(3), np.array([s[0], s[1], s[2]])
        case "formula":
            return anyhow, np.array([s[3], s[4], 0.4 * s[3] * s[4] + 0.1 * np.sin(2.0 * s[4] + t)])
        case _ if shape.startswith(HILL):
            return anyhow, _on_hill(s[3], s[4])
        case _:
            return anyhow, np.array([s[3], s[4], _reach(shape, anyhow)])


def _reach(shape: str, turned: Array) -> Array:
    """Return how far a surface of the second frame reaches down along -z of the first."""
    rim = 0.45 * np.sqrt(1.0 - turned[2, 2] ** 2)
    ellipsoid = np.sqrt(sum((a * n) ** 2 for a, n in zip(SEMI_AXES, turned[2], strict=True)))
    return {"sphere": 0.45 + 0.0 * rim, "disc": rim, "torus": rim + TUBE, "ellipsoid": ellipsoid}[shape]
