"""Scenes with constraints made by dataclasses, their exact solutions, and the way to compile their steppers."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.target import generate_files, generate_interface
from eomgen.formula.nodes import Number, Operation, Symbol
from eomgen.integrators.families.register import Method
from eomgen.integrators.stepper_data import method_data
from eomgen.mechanics.derive import derive
from eomgen.scene.bodies.model import Base, Body
from eomgen.scene.joints.model import Constraint, Frame, Joint
from eomgen.scene.rotations import Rotation
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from tests.integrators.stepper_models import Stepper, rotation, skew

#: What a stepper of a constrained scene calls, and what the oracle needs besides.
TERMS = (
    "residual", "partials", "forward_dynamics", "equations", "iteration", "jacobian_values", "mass",
    "constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian", "constraint_size",
)  # fmt: skip  # a table

FAST = (0.0, 150.0, -4.61538)


def numbers(values: Sequence[float]) -> tuple[Number, ...]:
    return tuple(Number(float(value)) for value in values)


def heavy_top(group: str = "R3xSO3", omega: Sequence[float] = FAST, coordinates: str = "absolute") -> Scene:
    """Return the heavy top of Bruls and Cardona 2010 on a ball joint at the origin; lam belongs to Phi = X - R^T x."""
    body = Body("top", Number(15.0), numbers((0, 1, 0)), numbers((0.234375, 0.46875, 0.234375, 0, 0, 0)))
    joint = Joint("pivot", "spherical", "base", "top", initial_position=(1.0, 0, 0, 0), initial_velocity=tuple(omega))
    return Scene("top", (body,), (joint,), coordinates=coordinates, groups={"top": group}, content=b"top")


@cache
def top_solution(omega: Sequence[float] = FAST, duration: float = 1.0):
    """Return t -> (R, x, Omega, lam) by DOP853 on SO(3)."""
    J, X = np.diag([15.234375, 0.46875, 15.234375]), np.array([0.0, 1, 0])
    mass, gravity = 15.0, np.array([0.0, 0, -9.81])

    def omega_dot(R, w):
        return np.linalg.solve(J, mass * np.cross(X, R.T @ gravity) - np.cross(w, J @ w))

    def rates(t, y):
        R, w = y[:9].reshape(3, 3), y[9:]
        return np.concatenate([(R @ skew(w)).ravel(), omega_dot(R, w)])

    start = np.concatenate([np.eye(3).ravel(), omega])
    found = solve_ivp(rates, (0.0, duration), start, method="DOP853", rtol=3e-14, atol=1e-13, dense_output=True)

    def at(t):
        y = found.sol(t)
        R, w = y[:9].reshape(3, 3), y[9:]
        local = np.cross(omega_dot(R, w), X) + np.cross(w, np.cross(w, X))
        return R, R @ X, w, mass * (local - R.T @ gravity)

    return at


def top_errors(rows: np.ndarray, omega: Sequence[float] = FAST) -> np.ndarray:
    """Return the largest errors of rotation angle, position, Omega and lam over rows (t, q, v, vdot, lam) of an
    absolute top."""
    exact, worst = top_solution(tuple(omega), 1.0), np.zeros(4)
    for row in rows:
        R, x, w, lam = exact(row[0])
        turn = rotation(row[1:5]).T @ R
        angle = np.arccos(np.clip((np.trace(turn) - 1.0) / 2.0, -1.0, 1.0))
        now = [angle, *(np.linalg.norm(d) for d in (row[5:8] - x, row[8:11] - w, row[-3:] - lam))]
        worst = np.maximum(worst, now)
    return worst


def chain(count: int, coordinates: str = "joint", group: str = "SE3") -> Scene:
    """Return bodies on hinges whose axes alternate."""
    bodies, joints = [], []
    for k in range(count):
        inertia = numbers((0.02, 0.03, 0.01, 0, 0, 0))
        bodies.append(Body(f"b{k}", Number(1.0 + 0.1 * (k % 3)), numbers((0.1, 0.02, -0.25)), inertia))
        parent, place = ("base", (0, 0, 0)) if k == 0 else (f"b{k - 1}", (0, 0, -0.5))
        axis = (0.0, 1.0, 0.0) if k % 2 == 0 else (1.0, 0.0, 0.0)
        start = {"initial_position": (0.3,), "initial_velocity": (0.5,)}
        joints.append(Joint(f"j{k}", "revolute", parent, f"b{k}", axis=axis, position=numbers(place), **start))
    groups = {body.name: group for body in bodies}
    return Scene("chain", tuple(bodies), tuple(joints), coordinates=coordinates, groups=groups, content=b"chain")


def two_links(coordinates: str = "absolute", base: Base | None = None) -> Scene:
    """Return a ball joint with a hinge, one body on R3xSO3 and one on SE3, a spring and a damper in the hinge."""
    first = Body("b1", Number(3.0), numbers((0, 1, 0)), numbers((0.25, 0.3, 0.35, 0, 0, 0)))
    second = Body("b2", Number(2.0), numbers((0.3, 0.1, 0)), numbers((0.02, 0.05, 0.04, 0.001, 0, 0)))
    ball = Joint("j1", "spherical", "base", "b1", initial_position=(1.0, 0, 0, 0), initial_velocity=(0.5, 3.0, -1.0))
    place = {"axis": (0.6, 0, 0.8), "position": numbers((0.1, 1.5, 0.2))}
    forces = {"stiffness": Number(20.0), "damping": Number(0.3)}
    hinge = Joint("j2", "revolute", "b1", "b2", initial_position=(0.3,), initial_velocity=(2.0,), **place, **forces)
    given = {"coordinates": coordinates, "groups": {"b1": "R3xSO3"}, "base": base}
    return Scene("links", (first, second), (ball, hinge), content=b"links", **given)


def shaking_base() -> Base:
    t = Symbol("time")
    sine = Operation("sin", (Operation("mul", (Number(3.0), t)),))
    turn = Rotation((0.0, 0.0, 1.0), Operation("mul", (Number(0.7), t)))
    return Base((sine, Number(0.0), Operation("mul", (Number(0.5), t))), (turn,))


def rolling_disc() -> Scene:
    """Return a free disc that rolls on the ground: one holonomic row and two at velocity level."""
    disc = Body("disc", Number(2.0), numbers((0, 0, 0)), numbers((0.01, 0.01, 0.02, 0, 0, 0)))
    tilted = (np.cos(np.pi / 4 + 0.1), np.sin(np.pi / 4 + 0.1), 0.0, 0.0)
    height = 0.1 * np.sin(np.pi / 2 + 0.2)
    start, rates = (*map(float, tilted), 0.0, 0.0, float(height)), (0.0, 0.3, 8.0, 0.0, 0.0, 0.0)
    free = Joint("free", "free", "base", "disc", initial_position=start, initial_velocity=rates)
    ground = Constraint("ground", "rolling", Frame("base"), Frame("disc"), radius=Number(0.1))
    return Scene("disc", (disc,), (free,), constraints=(ground,), content=b"disc")


_FLAGS = ("-std=c99", "-O0", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off", "-fPIC", "-shared")


class SceneStepper(Stepper):
    """A compiled stepper that knows its System."""

    system: System

    def start(self, **settings: float):
        """Start at the scene's initial state with the tolerances of the published runs."""
        return self.initialize(np.array(self.system.initial_q), np.array(self.system.initial_v), **settings)


def compile_scene(
    folder: Path,
    scene: Scene,
    method: Method,
    step: float = 1e-3,
    flags: Sequence[str] = _FLAGS,
    edits: Mapping[str, str] | None = None,
) -> SceneStepper:
    """Derive, render, compile under the strictest warnings, and open; ``edits`` replace texts of the stepper."""
    system = derive(scene, TERMS)
    program = to_program(system, method_data(method, system, step))
    files = generate_files(program)
    files |= generate_interface(program, files)
    folder.mkdir(parents=True, exist_ok=True)
    for old, new in (edits or {}).items():
        assert old in files[f"{scene.name}_step.c"]
        files[f"{scene.name}_step.c"] = files[f"{scene.name}_step.c"].replace(old, new)
    for name, text in files.items():
        (folder / name).write_text(text)
    library = folder / "model.so"
    sources = [str(folder / name) for name in files if name.endswith(".c") and name != "main.c"]
    finished = subprocess.run(
        ["gcc", *flags, *sources, "-o", str(library), "-lm"], capture_output=True, text=True, check=False
    )
    assert finished.returncode == 0, finished.stderr[:4000]
    stepper = SceneStepper(ctypes.CDLL(str(library)), program, [parameter.value for parameter in system.parameters])
    stepper.system = system
    return stepper
