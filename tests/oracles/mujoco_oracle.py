"""MuJoCo as a second engine: scenes written as MJCF, states and accelerations in its conventions.

MuJoCo's free joints hold the position before the quaternion, and velocities linear in world axes before angular in body
axes. Its smooth forces, ``qfrc_passive`` and ``qfrc_bias``, are compared; never its time step, which treats dampers
implicitly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE, WORLD
from eomgen.system.system import System
from tests.oracles.evaluation import Array
from tests.oracles.formulas import value_of
from tests.oracles.states import rotation_of

KINDS = {"revolute": "hinge", "prismatic": "slide", "spherical": "ball", "free": "free"}


def _numbers(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _element(tag: str, **attributes: object) -> str:
    return f"<{tag} {' '.join(f'{key}={quoteattr(str(value))}' for key, value in attributes.items())}/>"


def mjcf(scene: Scene, *, carrier: str = "") -> str:
    """Return a scene without formula forces as MJCF; ``carrier`` are the joints of a body that takes the base's
    place."""

    def vector(formulas: Sequence[object]) -> list[float]:
        return [value_of(formula, {}) for formula in formulas]

    def sites(body: str) -> str:
        own = [point for point in scene.points if point.body == body]
        return "".join(_element("site", name=point.name, pos=_numbers(vector(point.position))) for point in own)

    def joint_of(joint: Joint) -> str:
        if joint.type in ("fixed", "free"):
            return f"<freejoint name={quoteattr(joint.name)}/>" if joint.type == "free" else ""
        attributes: dict[str, object] = {"name": joint.name, "type": KINDS[joint.type], "pos": "0 0 0"}
        if joint.type != "spherical":
            attributes |= {"axis": _numbers(joint.axis), "armature": value_of(joint.rotor_inertia, {})}
            attributes |= {"stiffness": value_of(joint.stiffness, {}), "springref": value_of(joint.rest, {})}
            attributes |= {"damping": value_of(joint.damping, {})}
        return _element("joint", **attributes)

    def bodies(parent: str) -> str:
        text = ""
        for body, joint in zip(scene.bodies, scene.joints, strict=True):
            if joint.parent == parent:
                inertial = _element(
                    "inertial",
                    pos=_numbers(vector(body.center_of_mass)),
                    mass=value_of(body.mass, {}),
                    fullinertia=_numbers(vector(body.inertia)),
                )
                w, x, y, z = np.roll(Rotation.from_matrix(joint.orientation).as_quat(), 1)
                place = f'pos="{_numbers(vector(joint.position))}" quat="{_numbers((w, x, y, z))}"'
                inside = joint_of(joint) + inertial + sites(body.name) + bodies(body.name)
                text += f"<body name={quoteattr(body.name)} {place}>{inside}</body>"
        return text

    tree = bodies(BASE) + sites(BASE)
    if carrier:
        tree = f'<body name="carrier">{carrier}<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{tree}</body>'
    tendons = ""
    for spring in scene.springs:
        law = {"stiffness": value_of(spring.stiffness, {}), "damping": value_of(spring.damping, {})}
        law["springlength"] = value_of(spring.length, {})
        head = _element("spatial", name=spring.name, **law)[:-2]
        tendons += f"{head}>{_element('site', site=spring.first)}{_element('site', site=spring.second)}</spatial>"
    for torsion in scene.torsion_springs:
        law = {"stiffness": value_of(torsion.stiffness, {}), "damping": value_of(torsion.damping, {})}
        law["springlength"] = value_of(torsion.rest, {})
        ends = _element("joint", joint=torsion.first, coef=1)
        ends += _element("joint", joint=torsion.second, coef=-1) if torsion.second else ""
        tendons += f"{_element('fixed', name=torsion.name, **law)[:-2]}>{ends}</fixed>"
    gravity = _numbers(vector(scene.gravity))
    return (
        f'<mujoco><compiler angle="radian" inertiafromgeom="false"/><option gravity="{gravity}" integrator="RK4"/>'
        f"<worldbody>{sites(WORLD)}{tree}</worldbody><tendon>{tendons}</tendon></mujoco>"
    )


@dataclass
class Engine:
    """A scene in MuJoCo, with translations of its states."""

    system: System
    model: mujoco.MjModel
    data: mujoco.MjData

    @classmethod
    def of(cls, scene: Scene, system: System, *, carrier: str = "") -> Engine:
        model = mujoco.MjModel.from_xml_string(mjcf(scene, carrier=carrier))
        return cls(system, model, mujoco.MjData(model))

    def dofs(self, name: str) -> slice:
        start = int(self.model.joint(name).dofadr[0])
        factor = next(factor for factor in self.system.factors if factor.name == name)
        return slice(start, start + factor.v_size)

    def place(self, q: Array, v: Array, a: Array) -> None:
        """Put one state with its accelerations into MuJoCo's data."""
        for factor in self.system.factors:
            at_q, at_v = int(self.model.joint(factor.name).qposadr[0]), self.dofs(factor.name)
            own_q = q[factor.q_start : factor.q_start + factor.q_size]
            own_v, own_a = (values[factor.v_start : factor.v_start + factor.v_size] for values in (v, a))
            if factor.group == "SE3":
                own_q = np.concatenate([own_q[4:], own_q[:4]])
                own_v, own_a = _to_world(q, factor.q_start, own_v, own_a)
            self.data.qpos[at_q : at_q + factor.q_size] = own_q
            self.data.qvel[at_v], self.data.qacc[at_v] = own_v, own_a

    def generalized(self, q: Array, forces: Array) -> Array:
        """Return MuJoCo's generalized forces in the order and the axes of eomgen."""
        found = np.empty(self.system.nv)
        for factor in self.system.factors:
            own = forces[self.dofs(factor.name)]
            if factor.group == "SE3":
                R = rotation_of(q[factor.q_start : factor.q_start + 4])
                own = np.concatenate([own[3:], R.T @ own[:3]])
            found[factor.v_start : factor.v_start + factor.v_size] = own
        return found

    def inverse(self, q: Array, v: Array, a: Array) -> Array:
        """Return the generalized forces that a motion needs."""
        self.place(q, v, a)
        mujoco.mj_inverse(self.model, self.data)
        return self.generalized(q, self.data.qfrc_inverse)

    def forward(self, q: Array, v: Array) -> Array:
        """Return the accelerations under springs, dampers and gravity, as time derivatives of eomgen's v."""
        self.place(q, v, np.zeros_like(v))
        mujoco.mj_forward(self.model, self.data)
        found = np.empty(self.system.nv)
        for factor in self.system.factors:
            own = self.data.qacc[self.dofs(factor.name)].copy()
            if factor.group == "SE3":
                R = rotation_of(q[factor.q_start : factor.q_start + 4])
                omega, linear = v[factor.v_start : factor.v_start + 3], v[factor.v_start + 3 : factor.v_start + 6]
                own = np.concatenate([own[3:], R.T @ own[:3] - np.cross(omega, linear)])
            found[factor.v_start : factor.v_start + factor.v_size] = own
        return found


def _to_world(q: Array, start: int, v: Array, a: Array) -> tuple[Array, Array]:
    """Return velocity and acceleration of a free joint as MuJoCo has them: linear in world axes, then angular in body
    axes."""
    R = rotation_of(q[start : start + 4])
    return np.concatenate([R @ v[3:], v[:3]]), np.concatenate([R @ (a[3:] + np.cross(v[:3], v[3:])), a[:3]])


def set_coordinates(engine: Engine, values: Mapping[str, tuple[float, float, float]]) -> None:
    """Set position, velocity and acceleration of single joints by name: those of the carrier."""
    for name, (position, velocity, acceleration) in values.items():
        joint = engine.model.joint(name)
        engine.data.qpos[joint.qposadr[0]], engine.data.qvel[joint.dofadr[0]] = position, velocity
        engine.data.qacc[joint.dofadr[0]] = acceleration
