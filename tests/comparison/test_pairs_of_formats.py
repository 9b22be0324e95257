"""One arm as a scene, URDF, MJCF, SDF and System of SymPy: equal in all pairs."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from string import Template
from typing import Any, NamedTuple

import numpy as np
import pytest
import sympy
from scipy.spatial.transform import Rotation
from sympy.physics import mechanics as me

import eomgen


class Values(NamedTuple):
    """Numbers of the arm; each difference changes one.

    Angles are roll, pitch and yaw, of joints against the parents, and of the lower arm's inertia against its frame.
    """

    mass: float = 2.0
    center: tuple[float, ...] = (0.02, 0.0, 0.25)
    products: tuple[float, ...] = (0.003, 0.001, -0.002)
    inertia: tuple[float, ...] = (0.04, 0.03, 0.014)
    turned: tuple[float, ...] = (0.3, 0.2, 0.1)
    axis: tuple[float, ...] = (0.0, 1.0, 0.0)
    elbow: tuple[float, ...] = (0.6, 0.8, 0.0)
    place: tuple[float, ...] = (0.05, 0.0, 0.5)
    angles: tuple[float, ...] = (0.1, 0.0, 0.2)
    damping: float = 0.3
    coulomb: float = 0.2
    lower: float = -1.2


def turn(angles: Any) -> Any:
    """Return the axes (3, 3) of roll, pitch and yaw."""
    return Rotation.from_euler("xyz", angles).as_matrix()


def entries_of_lower(v: Values) -> list[float]:
    """Return xx, yy, zz, xy, xz, yz of the lower arm in the axes of its frame."""
    tensor = turn(v.turned) @ np.diag(v.inertia) @ turn(v.turned).T
    return [float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def text_of(ending: str, v: Values) -> str:
    """Return the file of the arm, by the words of its numbers, of all and of each row or component."""
    rows = {"rows": turn(v.angles), "entries": entries_of_lower(v)}
    separator, words = ", " if ending == ".toml" else " ", {}
    for name, values in (v._asdict() | rows).items():
        each = [separator.join(f"{x:.17g}" for x in np.ravel(row)) for row in np.atleast_1d(values)]
        words |= {name: separator.join(each)} | {f"{name}_{k}": word for k, word in enumerate(each, 1)}
    text = Template(Path(__file__).with_name(f"arm_with_words{ending}").read_text(encoding="utf-8")).substitute(words)
    return text.replace("friction = { coulomb = 0, velocity = 0.01 }\n", "")  # no scene has dry friction of zero


def along(frame: Any, components: Any) -> Any:
    """Return a vector of SymPy."""
    return sum((x * axis for x, axis in zip(components, frame, strict=True)), me.Vector(0))


@cache
def of_sympy(v: Values) -> Any:
    """Return the arm's equations from a System: each body has its frame at the mass centre."""
    base = me.RigidBody("base_link")
    system = me.System.from_newtonian(base)
    parent, center_of_parent = base, np.zeros(3)
    for name, mass, center, entries, joint, place, angles, axis in (
        ("upper", 3.0, v.center, (0.08, 0.07, 0.03, *v.products), "shoulder", (0, 0, 0.3), v.angles, v.axis),
        ("lower", v.mass, (0, 0.01, 0.2), entries_of_lower(v), "elbow", v.place, (0.2, -0.4, 0.3), v.elbow),
        ("slide", 0.5, (0, 0, 0.05), (0.001, 0.002, 0.0012, 0, 0, 0), "wrist", (0, 0.02, 0.4), (0, 0.1, 0), (0, 0, 1)),
    ):  # fmt: skip  # a table
        xx, yy, zz, xy, xz, yz = entries
        frame, middle = me.ReferenceFrame(name), me.Point(f"{name}_center")
        body = me.RigidBody(name, middle, frame, mass, (me.inertia(frame, xx, yy, zz, xy, yz, xz), middle))
        placed = me.ReferenceFrame(f"{joint}_frame")
        placed.orient_explicit(parent.frame, sympy.Matrix(turn(angles)))
        kind = me.PrismaticJoint if joint == "wrist" else me.PinJoint
        q, u = me.dynamicsymbols(f"{joint} u_{joint}")
        system.add_joints(
            kind(
                joint, parent, body, q, u,
                along(parent.frame, np.array(place) - center_of_parent), along(frame, -np.array(center)),
                parent_interframe=placed, joint_axis=along(placed, axis),
            )
        )  # fmt: skip  # arguments by place
        parent, center_of_parent = body, np.array(center)
    system.apply_uniform_gravity(-9.81 * base.z)
    shoulder, elbow, wrist = system.joints
    dry = v.coulomb * sympy.tanh(shoulder.speeds[0] / 0.01)
    for joint, torque in ((shoulder, dry), (elbow, v.damping * elbow.speeds[0])):
        system.add_actuators(me.TorqueActuator(-torque, joint.joint_axis, joint.child, joint.parent))
    axis = wrist.joint_axis
    system.add_loads((wrist.child.masscenter, -4 * wrist.speeds[0] * axis))
    system.add_loads((wrist.parent.masscenter, 4 * wrist.speeds[0] * axis))
    lever = wrist.child.masscenter.pos_from(wrist.parent.masscenter)
    system.add_loads((wrist.parent.frame, lever.cross(4 * wrist.speeds[0] * axis)))
    return eomgen.from_sympy(system, name="arm")


FORMATS = (".toml", ".urdf", ".xml", ".sdf")


def described(folder: Path, ending: str, name: str, values: Values) -> Any:
    """Return the file, or the equations, of the arm."""
    if ending == "sympy":
        return of_sympy(values)
    path = folder / f"{name}{ending}"
    path.write_text(text_of(ending, values), encoding="utf-8")
    return path


PAIRS = [(one, other) for one in FORMATS for other in (*FORMATS, "sympy")]


@pytest.mark.slow
def test_the_arm_is_equal_in_all_pairs_of_formats(tmp_path: Path) -> None:
    """To 1e-12 in the equations at random states, in 20 pairs."""
    for pair in PAIRS:
        first, second = (described(tmp_path, ending, name, Values()) for ending, name in zip(pair, "ab", strict=True))
        comparison = eomgen.compare(first, second, states=2, tolerance=1e-9)
        assert comparison.equal, (pair, str(comparison))
        assert max(comparison.errors.values()) < 1e-12, (pair, comparison.errors)
