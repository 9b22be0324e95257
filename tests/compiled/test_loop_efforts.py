"""Inverse dynamics through loops against MuJoCo: its inertia matrix, forces and Jacobians of equality constraints.

MuJoCo closes loops by constraints that give way, so its own accelerations are not compared: configurations are brought
onto its constraints by Newton, velocities and accelerations along them come from its Jacobians (whose rate is a central
difference along the motion), and the efforts are the solution of [S, J^T] (tau, lam) = M a + bias - passive.
"""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np
import pytest
from scipy.linalg import null_space

import eomgen
from eomgen.scene.scene import Scene
from tests.oracles.evaluation import Array

OPTION = '<mujoco><compiler angle="radian" inertiafromgeom="false"/><option jacobian="dense" gravity="0 0 -9.81"/>'
#: mass, centre of mass, inertia about it of each link of the five-bar, and its length.
LINKS = {
    "left": (1.2, (0.12, 0.01, 0.02), (0.01, 0.02, 0.03), 0.3),
    "left_arm": (0.8, (0.2, 0.0, -0.01), (0.02, 0.03, 0.015), 0.5),
    "right": (1.1, (0.1, -0.02, 0.01), (0.012, 0.02, 0.03), 0.35),
    "right_arm": (0.9, (0.25, 0.01, 0.0), (0.02, 0.028, 0.014), 0.45),
}
#: Joints of the five-bar by name: parent, place, initial angle about -y, rad.
HINGES = {
    "left": ("", (-0.2, 0.0, 0.0), 2.1), "left_arm": ("left", (0.3, 0.0, 0.0), -1.4),
    "right": ("", (0.2, 0.0, 0.0), 0.9), "right_arm": ("right", (0.35, 0.0, 0.0), 1.3),
}  # fmt: skip  # a table


def five_bar() -> Scene:
    """Return two arms in the x-z plane that meet in a ball; its second row repeats what the hinges say."""
    builder = eomgen.SceneBuilder("five_bar")
    for name, (mass, center, inertia, _) in LINKS.items():
        builder.body(name, mass, center_of_mass=center, inertia=inertia)
        parent, place, angle = HINGES[name]
        builder.joint(
            name, "revolute", parent or "base", name, axis=[0, -1, 0], position=place, initial={"position": angle}
        )
    ends = [{"body": f"{side}_arm", "position": [LINKS[f"{side}_arm"][3], 0, 0]} for side in ("left", "right")]
    return builder.constraint("meet", "spherical", *ends).build()


def words(values: object) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))


def body(name: str, place: object, turn: object, joints: str, mass: float, center: object, inertia: object) -> str:
    """Return a body without its end; an inertia has three or six numbers."""
    kind = "diaginertia" if len(inertia) == 3 else "fullinertia"
    inertial = f'<inertial mass="{mass!r}" pos="{words(center)}" {kind}="{words(inertia)}"/>'
    return f'<body name="{name}" pos="{words(place)}" quat="{words(turn)}">{joints}{inertial}'


def five_bar_mjcf() -> str:
    def link(name: str, inside: str) -> str:
        mass, center, inertia, _ = LINKS[name]
        joint = f'<joint name="{name}" axis="0 -1 0"/>'
        return body(name, HINGES[name][1], (1, 0, 0, 0), joint, mass, center, inertia) + f"{inside}</body>"

    tree = "".join(link(side, link(f"{side}_arm", "")) for side in ("left", "right"))
    sites = [
        f'<site name="{side}" pos="{words((LINKS[f"{side}_arm"][3], 0, 0))}"/></body></body>'
        for side in ("left", "right")
    ]
    for side, site in zip(("left", "right"), sites, strict=True):
        head, tail = tree.split(f'<body name="{side}_arm"', 1)
        tree = f'{head}<body name="{side}_arm"' + tail.replace("</body></body>", site, 1)
    return f'{OPTION}<worldbody>{tree}</worldbody><equality><connect site1="left" site2="right"/></equality></mujoco>'


class Engine:
    """MuJoCo's terms at states on its equality constraints."""

    def __init__(self, text: str) -> None:
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.nv = self.model.nv

    def jacobian(self, q: Array) -> Array:
        self.data.qpos, self.data.qvel = q, 0.0
        mujoco.mj_forward(self.model, self.data)
        return self.data.efc_J.reshape(-1, self.nv)[: self.data.ne].copy()

    def along(self, q: Array, v: Array, time: float) -> Array:
        moved = q.copy()
        mujoco.mj_integratePos(self.model, moved, v, time)
        return moved

    def closed(self, q: Array) -> Array:
        for _ in range(20):
            J = self.jacobian(q)
            q = self.along(q, -np.linalg.pinv(J, rcond=1e-9) @ self.data.efc_pos[: self.data.ne], 1.0)
        assert np.abs(self.data.efc_pos[: self.data.ne]).max() <= 1e-12
        return q

    def motion(self, q: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        """Return a random velocity and acceleration along the constraints; dJ/dt v by differences."""
        J = self.jacobian(q)
        Z = null_space(J, rcond=1e-9)
        v = Z @ rng.normal(size=Z.shape[1])

        def drift(step: float) -> Array:
            ahead, behind = (self.jacobian(self.along(q, v, sign * step)) @ v for sign in (1.0, -1.0))
            return (ahead - behind) / (2 * step)

        rate = (4.0 * drift(1e-3) - drift(2e-3)) / 3.0
        return v, Z @ rng.normal(size=Z.shape[1]) - np.linalg.pinv(J, rcond=1e-9) @ rate

    def efforts(self, q: Array, v: Array, a: Array, places: list[int]) -> Array:
        """Return the efforts at some velocity components, least in norm."""
        J = self.jacobian(q)
        self.data.qpos, self.data.qvel = q, v
        mujoco.mj_forward(self.model, self.data)
        inertia = np.zeros(self.nv)
        mujoco.mj_mulM(self.model, self.data, inertia, a)
        S = np.eye(self.nv)[:, places]
        needed = inertia + self.data.qfrc_bias - self.data.qfrc_passive
        Z = null_space(J, rcond=1e-9)
        found, *_ = np.linalg.lstsq(Z.T @ S, Z.T @ needed, rcond=1e-10)
        assert np.abs(Z.T @ (S @ found - needed)).max() <= 1e-9 * np.abs(needed).max()
        return found


@cache
def built() -> eomgen.Model:
    terms = ["residual", "force", "constraint", "constraint_jacobian", "constraint_bias", "inverse_dynamics"]
    return eomgen.build(five_bar(), terms=terms, profile="quick")


def translated(model: eomgen.Model, engine: Engine, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
    """Return a state of MuJoCo as eomgen has it; joints have the same names."""
    own_q, own_v, own_a = np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.nv)
    for factor in model.factors:
        joint = engine.model.joint(factor.name)
        at_q, at_v = int(joint.qposadr[0]), int(joint.dofadr[0])
        own_q[factor.q], own_v[factor.v], own_a[factor.v] = q[at_q], v[at_v], a[at_v]
    return own_q, own_v, own_a


@pytest.mark.parametrize("actuators", [["left", "right"], ["left", "right", "right_arm"]])
def test_efforts_are_those_of_mujoco(actuators: list[str], rng: np.random.Generator) -> None:
    engine, model = Engine(five_bar_mjcf()), built()
    start = engine.model.qpos0.copy()
    for joint, (_, _, angle) in HINGES.items():
        start[engine.model.joint(joint).qposadr[0]] = angle
    places = [int(engine.model.joint(joint).dofadr[0]) for joint in actuators]
    for _ in range(4):
        q = engine.closed(engine.along(start, rng.normal(size=engine.nv), 0.1))
        v, a = engine.motion(q, rng)
        expected = engine.efforts(q, v, a, places)
        found = model.actuator_efforts(*translated(model, engine, q, v, a), actuators)
        assert found.unique == (len(actuators) == 2)
        np.testing.assert_allclose(found.efforts, expected, atol=1e-8 * np.abs(expected).max())
