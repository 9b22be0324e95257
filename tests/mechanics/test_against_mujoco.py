"""Against MuJoCo: forward and inverse dynamics of five scenes with springs, dampers, armature, a moving base and a
loop."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from eomgen.lie import product
from eomgen.mechanics.derive import derive
from eomgen.scene.builder import SceneBuilder
from eomgen.system.system import System
from tests.models.cache import shared_cache
from tests.oracles.evaluation import Array, Evaluate, relative_error, tape_evaluator
from tests.oracles.mujoco_oracle import Engine, set_coordinates
from tests.oracles.states import on_base, random_states

__all__ = ["shared_cache"]

STATES = 30
SKEW = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]


def flying_tree() -> SceneBuilder:
    """A free body that carries an arm on a ball joint, and on that a forearm on a sprung and geared hinge."""
    builder = SceneBuilder("flying_tree", gravity=[0.5, -1.0, -9.81])
    builder.body("trunk", 3.0, center_of_mass=[0.05, -0.02, 0.1], inertia=[0.2, 0.3, 0.25, 0.01, -0.02, 0.03])
    builder.body("arm", 1.2, center_of_mass=[0.2, 0.01, 0.0], inertia=[0.01, 0.05, 0.05, 0.001, 0.002, -0.003])
    builder.body("forearm", 0.8, center_of_mass=[0.0, 0.15, 0.02], inertia=[0.02, 0.004, 0.02])
    builder.joint("root", "free", "base", "trunk").joint(
        "shoulder", "spherical", "trunk", "arm", position=[0.1, 0.2, 0.3]
    )
    spring = {"stiffness": 9.0, "rest": 0.4, "damping": 0.7, "rotor_inertia": 0.05}
    return builder.joint(
        "elbow", "revolute", "arm", "forearm", axis=[0.2, 1, -0.5], position=[0.4, 0, 0], orientation=SKEW, **spring
    )


def strut() -> SceneBuilder:
    """A boom and a carriage on it, tied to the ground and to one another by springs and dampers between points."""
    builder = SceneBuilder("strut").body("boom", 4.0, center_of_mass=[0.5, 0, 0.02], inertia=[0.05, 0.4, 0.4])
    builder.body("carriage", 1.5, center_of_mass=[0, 0.1, 0.05], inertia=[0.02, 0.01, 0.02])
    builder.joint("luff", "revolute", "base", "boom", axis=[0, -1, 0], position=[0, 0, 1], damping=0.3)
    builder.joint(
        "run", "prismatic", "boom", "carriage", axis=[1, 0.2, 0], position=[0.3, 0, 0], orientation=SKEW, damping=2.0
    )
    builder.point("mast", "base", [-0.4, 0.1, 1.8])
    builder.point("tip", "boom", [1.0, 0.05, 0.0]).point("hook", "carriage", [0, 0.1, -0.2])
    builder.spring("stay", "mast", "tip", stiffness=150.0, damping=12.0, length=1.1)
    return builder.spring("brace", "hook", "mast", stiffness=80.0, damping=5.0, length=0.6)


def torsion() -> SceneBuilder:
    """A branching shaft train: springs on joints and between them, geared rotors."""
    builder = SceneBuilder("torsion", gravity=[0, 3.0, -9.0])
    shafts = (("base", [1, 0, 0]), ("shaft0", [0.8, 0, 0.6]), ("shaft0", [0, 1, 0]), ("shaft2", [1, 1, 1]))
    for k, (parent, axis) in enumerate(shafts):
        center, inertia = [0.1, 0.02 * k, 0.05], [0.02, 0.03, 0.04, 0.0, 0.005, 0.0]
        builder.body(f"shaft{k}", 1.0 + 0.3 * k, center_of_mass=center, inertia=inertia)
        joint = {"stiffness": 4.0 + k, "damping": 0.2 * k, "rest": 0.1 * k - 0.2, "rotor_inertia": 0.1 * (k % 2)}
        builder.joint(f"bearing{k}", "revolute", parent, f"shaft{k}", axis=axis, position=[0.3, 0.1 * k, 0], **joint)
    builder.torsion_spring("coupling", "bearing1", "bearing3", stiffness=25.0, damping=0.8, rest=0.3)
    return builder.torsion_spring("tail", "bearing2", stiffness=6.0, damping=0.4, rest=-0.5)


def excavator() -> SceneBuilder:
    """A slewing and sliding arm with a ball at its end, for a base that shakes and turns."""
    builder = SceneBuilder("excavator")
    builder.body("boom", 2.0, center_of_mass=[0.3, 0, 0], inertia=[0.02, 0.1, 0.1])
    builder.body("stick", 1.0, center_of_mass=[0, 0, -0.2], inertia=[0.04, 0.04, 0.01])
    builder.body("bucket", 0.7, center_of_mass=[0.02, 0.05, -0.1], inertia=[0.01, 0.008, 0.012, 0.001, 0.0, 0.002])
    spring = {"stiffness": 30.0, "rest": 0.2, "damping": 1.5}
    builder.joint(
        "luff", "revolute", "base", "boom", axis=[0, 1, 0], position=[0.1, 0, 0.5], rotor_inertia=0.2, **spring
    )
    builder.joint(
        "reach", "prismatic", "boom", "stick", axis=[1, 0, 0], position=[0.6, 0, 0], orientation=SKEW, damping=3.0
    )
    builder.joint("grip", "spherical", "stick", "bucket", position=[0, 0, -0.4])
    builder.point("anchor", "base", [0.2, 0.3, 1.0]).point("ear", "bucket", [0, 0.1, 0])
    return builder.spring("ram", "anchor", "ear", stiffness=60.0, damping=4.0, length=0.5)


def loop() -> SceneBuilder:
    """A spatial four-bar with sprung joints, its last pin a ball."""
    builder = SceneBuilder("loop").body("crank", 1.0, center_of_mass=[0.1, 0, 0], inertia=[0.01, 0.02, 0.02])
    builder.body("coupler", 2.0, center_of_mass=[0.4, 0.02, 0], inertia=[0.02, 0.1, 0.1])
    builder.body("rocker", 1.5, center_of_mass=[0, 0, 0.3], inertia=[0.05, 0.05, 0.01])
    builder.joint("motor", "revolute", "base", "crank", axis=[0, 1, 0.1], damping=0.2, rotor_inertia=0.03)
    builder.joint("knee", "spherical", "crank", "coupler", position=[0.25, 0, 0])
    builder.joint(
        "pivot", "revolute", "base", "rocker", axis=[0, 1, 0], position=[0.9, 0, -0.2], stiffness=5.0, damping=0.5
    )
    builder.point("end", "coupler", [0.8, 0, 0]).point("top", "rocker", [0, 0, 0.6])
    return builder.constraint("pin", "spherical", "end", "top")


FREE: dict[str, Callable[[], SceneBuilder]] = {"flying_tree": flying_tree, "strut": strut, "torsion": torsion}


@pytest.mark.parametrize("name", FREE)
def test_forward_and_inverse_dynamics(name: str, rng: np.random.Generator) -> None:
    scene = FREE[name]().build()
    system = derive(scene, ["forward_dynamics", "inverse_dynamics"])
    evaluate, engine = tape_evaluator(system), Engine.of(scene, system)
    state = random_states(system, STATES, rng)
    pairs = [(q, v, a) for q, v, a in zip(state["q"], state["v"], state["a"], strict=True)]
    inverse = np.array([engine.inverse(*pair) for pair in pairs])
    assert relative_error(evaluate("inverse_dynamics", state)["tau"], inverse) <= 1e-11
    forward = np.array([engine.forward(q, v) for q, v, _ in pairs])
    assert relative_error(evaluate("forward_dynamics", state)["vdot"], forward) <= 1e-10


CARRIER = "".join(
    f'<joint name="{name}" type="{kind}" axis="{axis}"/>'
    for name, kind, axis in (
        ("surge", "slide", "1 0 0"),
        ("sway", "slide", "0 1 0"),
        ("heave", "slide", "0 0 1"),
        ("yaw", "hinge", "0 0 1"),
        ("roll", "hinge", "1 0 0"),
    )
)


def carrier_motion(t: float) -> dict[str, tuple[float, float, float]]:
    """Return position, velocity and acceleration of the carrier's joints: the formulas of the base and their
    derivatives."""
    s, c = np.sin, np.cos
    return {
        "surge": (0.3 * s(2 * t), 0.6 * c(2 * t), -1.2 * s(2 * t)),
        "sway": (0.1 * t * t, 0.2 * t, 0.2),
        "heave": (0.2 * c(3 * t), -0.6 * s(3 * t), -1.8 * c(3 * t)),
        "yaw": (0.5 * t + 0.4 * s(t), 0.5 + 0.4 * c(t), -0.4 * s(t)),
        "roll": (0.7 * s(1.5 * t), 1.05 * c(1.5 * t), -1.575 * s(1.5 * t)),
    }


def test_on_a_moving_base(rng: np.random.Generator) -> None:
    """The base is a carrier in MuJoCo, whose motion is prescribed through inverse dynamics; ours needs no mass for
    it."""
    builder = excavator()
    builder.base(
        ["0.3 * sin(2 * t)", "0.1 * t**2", "0.2 * cos(3 * t)"],
        [([0, 0, 1], "0.5 * t + 0.4 * sin(t)"), ([1, 0, 0], "0.7 * sin(1.5 * t)")],
    )
    scene = builder.build()
    system = derive(scene, ["forward_dynamics", "inverse_dynamics"])
    evaluate, engine = tape_evaluator(system), Engine.of(scene, system, carrier=CARRIER)
    state = on_base(evaluate, random_states(system, STATES, rng))
    tau, vdot = evaluate("inverse_dynamics", state)["tau"], evaluate("forward_dynamics", state)["vdot"]
    needed, left = [], []
    for q, v, a, free, t in zip(state["q"], state["v"], state["a"], vdot, state["t"][:, 0], strict=True):
        set_coordinates(engine, carrier_motion(t))
        needed.append(engine.inverse(q, v, a))
        set_coordinates(engine, carrier_motion(t))
        left.append(engine.inverse(q, v, free))
    assert relative_error(tau, np.array(needed)) <= 1e-11
    assert np.abs(left).max() <= 1e-10 * np.abs(needed).max()  # the accelerations of ours need no further force there


def test_a_closed_loop(rng: np.random.Generator) -> None:
    """MuJoCo's own connections are soft, so the equations of the loop are put together of its M, forces and
    Jacobians."""
    scene = loop().build()
    terms = ["mass", "coupling", "force", "constraint_jacobian", "constraint_bias"]
    system = derive(scene, [*terms, "constraint"])
    evaluate, engine = tape_evaluator(system), Engine.of(scene, system)
    state = _closed(system, evaluate, rng)
    found = {name: evaluate(term, state)[name] for term, name in zip(terms, ("M", "h", "Q", "B", "g"), strict=True)}
    ours, theirs = [], []
    for k in range(STATES):
        ours.append(_constrained(found["M"][k], found["Q"][k] - found["h"][k], found["B"][k], -found["g"][k]))
        q, v = state["q"][k], state["v"][k]
        engine.place(q, v, np.zeros(system.nv))
        mujoco.mj_forward(engine.model, engine.data)
        M = np.zeros((system.nv, system.nv))
        mujoco.mj_fullM(engine.model, engine.data, M)
        jacobians, drifts = zip(*(_site(engine, name) for name in ("end", "top")), strict=True)
        J, drift = jacobians[0] - jacobians[1], drifts[0] - drifts[1]
        acceleration = _constrained(M, engine.data.qfrc_passive - engine.data.qfrc_bias, J, -drift)
        theirs.append(engine.generalized(q, acceleration))  # no free joint here: only the order of components changes
    assert relative_error(np.array(ours), np.array(theirs)) <= 1e-10


def _closed(system: System, evaluate: Evaluate, rng: np.random.Generator) -> dict[str, Array]:
    """Return states that close the loop, and whose velocities keep it closed: rows differ by factors where it is
    open."""
    states = []
    while len(states) < STATES:
        q = np.concatenate([rng.uniform(-0.6, 0.6, 1), [1.0, 0.0, 0.0, 0.0], rng.uniform(-0.6, 0.6, 1)])
        for _ in range(30):
            B = evaluate("constraint_jacobian", {"q": q})["B"]
            gap = evaluate("constraint", {"q": q})["Phi"]
            q = product.update(system.factors, q, -np.linalg.pinv(B) @ gap)
        v = rng.uniform(-2.0, 2.0, system.nv)
        v -= np.linalg.pinv(B) @ (B @ v)
        if np.abs(gap).max() < 1e-14:
            states.append((q, v))
    q, v = (np.array(parts) for parts in zip(*states, strict=True))
    return {"q": q, "v": v}


def _constrained(M: Array, right: Array, J: Array, rate: Array) -> Array:
    """Solve M a + J^T lam = right, J a = rate for a."""
    rows = len(J)
    matrix = np.block([[M, J.T], [J, np.zeros((rows, rows))]])
    solution: Array = np.linalg.solve(matrix, np.concatenate([right, rate]))[: len(M)]
    return solution


def _site(engine: Engine, name: str) -> tuple[Array, Array]:
    """Return the Jacobian of a site's position, and the part of its acceleration that is quadratic in velocities."""
    model, data = engine.model, engine.data
    site = model.site(name)
    body, J, rate = int(site.bodyid[0]), np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, J, None, site.id)
    mujoco.mj_jacDot(model, data, rate, None, data.site_xpos[site.id], body)
    return J, rate @ data.qvel
