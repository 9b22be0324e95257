"""MJCF: loads of a converted file as generalized forces, with places and velocities of MuJoCo, are MuJoCo's forces; and
each part that no scene has is refused or noted."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.products.robots.mjcf.conversion import mjcf_data

INERTIAL = '<inertial pos="0.05 0.02 0" mass="1" diaginertia="0.01 0.02 0.025"/>'


def machine(
    rest: str = "",
    joint: str = "",
    second: str = 'type="slide" axis="1 0 0"',
    third: str = 'axis="1 0 0"',
    head: str = "",
    body: str = "",
    lifted: str = "",
) -> str:
    """Return a hinge a with a slide b on it, and a joint c beside, with sites s, u, v and w, under names p, r and f;
    ``rest`` begins in line 8."""
    return f"""<mujoco>{head}<worldbody><site name="w" pos="0.2 0.1 0.4"/>
  <body name="p" euler="10 20 30" {body}><joint name="a" axis="0 1 0.2" {joint}/>{INERTIAL}
    <site name="s" pos="0.1 0.05 0" euler="10 20 30"/>
    <body name="r" pos="0.2 0 0"><joint name="b" {second}/>{INERTIAL}
      <site name="u" pos="0.1 -0.1 0.2" euler="40 10 0"/></body></body>
  <body name="f" pos="0.3 0.1 0.2" {lifted}><joint name="c" {third}/>{INERTIAL}<site name="v" pos="0.1 0 0.05"/></body>
  </worldbody>
  {rest}</mujoco>"""


def drives(*texts: str) -> str:
    return f"<actuator>{' '.join(texts)}</actuator>"


class Formulas(dict[str, Any]):
    """Names in formulas of a scene at a state of MuJoCo; definitions are evaluated when they are needed."""

    def __init__(self, data: Mapping[str, Any], model: Any, state: Any) -> None:
        super().__init__({name: getattr(math, name) for name in ("sin", "cos", "sqrt", "exp", "atan2", "pi")})
        self.data, self.model, self.state = data, model, state
        places = {name: self.jacobian(entry["body"], entry["position"]) for name, entry in data["points"].items()}
        self["position"] = SimpleNamespace(**{name: place for name, (place, _, _) in places.items()})
        self["velocity"] = SimpleNamespace(**{name: J @ state.qvel for name, (_, J, _) in places.items()})
        spins = {name: self.jacobian(name, [0.0, 0.0, 0.0])[2] @ state.qvel for name in data["bodies"]}
        self["angular_velocity"] = SimpleNamespace(**spins)
        joints = {model.joint(k).name: model.joint(k) for k in range(model.njnt)}
        for letter, values, starts in (("q", state.qpos, "qposadr"), ("v", state.qvel, "dofadr")):
            sizes = {name: {1: 4 if letter == "q" else 3}.get(int(item.type[0]), 1) for name, item in joints.items()}
            found = {name: values[getattr(item, starts)[0] :][: sizes[name]] for name, item in joints.items()}
            self[letter] = SimpleNamespace(**{name: x if len(x) > 1 else float(x[0]) for name, x in found.items()})
        self |= dict(zip(data.get("inputs", {}), state.ctrl, strict=True))
        self |= dict(zip(data.get("states", {}), state.act, strict=True))

    def __missing__(self, name: str) -> Any:
        if name not in self.data.get("definitions", {}):  # a word of Python
            raise KeyError(name)
        self[name] = self.value(self.data["definitions"][name]["formula"])
        return self[name]

    def value(self, formula: Any) -> float:
        return float(eval(formula, {"max": max, "min": min, "abs": abs}, self)) if isinstance(formula, str) else formula

    def jacobian(self, body: str, point: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the place of a point of a body, and the Jacobians of its velocity and of the spin."""
        number = 0 if body == "base" else self.model.body(body).id
        place = self.state.xpos[number] + self.state.xmat[number].reshape(3, 3) @ np.array(point, dtype=float)
        J, R = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        mujoco.mj_jac(self.model, self.state, J, R, place, number)
        return place, J, R

    def forces(self) -> np.ndarray:
        """Return the generalized forces of all loads and efforts."""
        result = np.zeros(self.model.nv)
        for entry in self.data.get("forces", {}).values():
            _, J, R = self.jacobian(entry["body"], entry.get("point", [0.0, 0.0, 0.0]))
            turn = np.eye(3)
            if entry.get("axes") == "body":
                turn = self.state.xmat[self.model.body(entry["body"]).id].reshape(3, 3)
            for key, jacobian in (("force", J), ("torque", R)):
                if key in entry:
                    result += jacobian.T @ turn @ [self.value(part) for part in entry[key]]
        for entry in self.data.get("efforts", {}).values():
            result[self.model.joint(entry["joint"]).dofadr[0] + entry.get("index", 0)] += self.value(entry["effort"])
        return result


def compared(text: str, part: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the forces of the converted file and MuJoCo's ``part``, at some states and controls; hold the rates of
    internal states to the rates of activations."""
    data: dict[str, Any] = {"points": {}, **mjcf_data(text).data}
    model = mujoco.MjModel.from_xml_string(text)
    # of a DC motor MuJoCo takes the current at the end of its step
    model.actuator_actearly[model.actuator_dyntype == mujoco.mjtDyn.mjDYN_DCMOTOR] = 0
    state, random = mujoco.MjData(model), np.random.default_rng(4)
    mine, theirs = [], []
    for _ in range(6):
        for numbers in (state.qpos, state.qvel, state.ctrl, state.act):
            numbers[:] = random.uniform(-0.8, 0.8, len(numbers))
        mujoco.mj_normalizeQuat(model, state.qpos)
        mujoco.mj_forward(model, state)
        formulas = Formulas(data, model, state)
        rates = [formulas.value(entry["rate"]) for entry in data.get("states", {}).values()]
        np.testing.assert_allclose(rates, state.act_dot, rtol=1e-11, atol=1e-12)
        mine.append(formulas.forces())
        theirs.append(getattr(state, part).copy())
    return np.array(mine), np.array(theirs)


AFFINE = 'biastype="affine" biasprm="0.1 -0.7 -0.2"'
DRIVES = {
    "places of sites": '<position site="s" refsite="v" kp="3" kv="0.4" gear="1 2 0.5 0 0 0"/>',
    "turns of sites": '<position site="s" refsite="v" kp="3" kv="0.4" gear="0 0 0 0.3 -0.2 1"/>',
    "one chain": f'<general site="u" refsite="s" {AFFINE} gainprm="2" gear="0 1 0 1 2 3"/>',
    "a site of the world": '<motor site="u" refsite="w" gear="1 2 3 1 2 3"/>',
    "a site": '<damper site="s" kv="3" gear="1 2 3 4 5 6" ctrlrange="0 1"/>',
    "a slider": '<position cranksite="s" slidersite="v" cranklength="3" kp="3" kv="2" gear="2"/>',
    "a short rod": '<motor cranksite="s" slidersite="w" cranklength="0.1"/>',
    "servos": '<position joint="a" kp="20" kv="3" gear="2" forcerange="-4 3"/><velocity joint="b" kv="5"/>',
    "gains": f'<general joint="a" gaintype="affine" gainprm="2 3 4" {AFFINE} ctrlrange="-0.3 0.2"/>',
    "activations": '<general joint="b" dyntype="filter" dynprm="0.1" gainprm="3"/><intvelocity joint="a" kp="20"/>',
    "pid": """<pid joint="a" kp="3" kv="0.4" input="pos vel ff" ki="2" imax="0.3" slewmax="0.5" forcerange="-2 2"/>
      <pid joint="b" kp="3" kv="0.4" ki="2"/><pid joint="b" input="vel" kv="2"/>""",
    "dcmotor": """<dcmotor joint="a" motorconst="0.1 0.2" resistance="2"/><dcmotor joint="a" gear="3" motorconst="0.3"
      resistance="2" inductance="0.1" thermal="2 3 0 0.004 25 20" lugre="100 2 0.3 0.5 0.1" cogging="0.1 7 0.3"
      saturation="0.2 0 5"/><dcmotor joint="b" motorconst="0.3" resistance="2" input="pos vel ff voltage"
      controller="5 2 0.3 4 0.2 3" thermal="2 3 0 0.004 25 20"/>""",
    "a muscle": '<muscle joint="a" lengthrange="-2 2" force="50" timeconst="0.01 0.04" tausmooth="5"/>',
}  # fmt: skip  # a table


@pytest.mark.parametrize("name", DRIVES)
def test_forces_of_drives_are_mujoco_s(name: str) -> None:
    mine, theirs = compared(machine(drives(DRIVES[name])), "qfrc_actuator")
    np.testing.assert_allclose(mine, theirs, atol=1e-12 * np.abs(theirs).max())
    assert np.count_nonzero(theirs) >= 3


def test_all_drives_of_a_joint_are_within_its_range() -> None:
    both = drives('<motor joint="a"/>', '<position joint="a" kp="7" kv="2"/>')
    mine, theirs = compared(machine(both, joint='actuatorfrcrange="-0.5 0.4"'), "qfrc_actuator")
    np.testing.assert_allclose(mine, theirs, atol=1e-13)
    assert {-0.5, 0.4} & set(theirs[:, 0])


SO3 = 'gaintype="so3" biastype="so3" biasprm="0.1 -2 -0.3"'
BALLS = {
    "servo": '<position joint="c" kp="3" kv="0.4" gear="1 2 0.5"/>',
    "in the parent": '<motor jointinparent="c" gear="1 2 3"/>',
    "vector": '<orientation joint="c" kp="3" kv="0.4" forcerange="0 1"/>',
    "quaternion": '<orientation joint="c" input="quat" kp="2"/>',
    "integral": f'<general joint="c" {SO3} dyntype="integrator" gainprm="2"/>',
}


@pytest.mark.parametrize("name", BALLS)
def test_forces_of_drives_of_balls_are_mujoco_s(name: str) -> None:
    mine, theirs = compared(machine(drives(BALLS[name]), third='type="ball"'), "qfrc_actuator")
    np.testing.assert_allclose(mine, theirs, atol=1e-12)
    assert np.count_nonzero(theirs) >= 9


MEDIUM = '<option density="1.2" viscosity="0.3" wind="1 -2 0.5"/>'


@pytest.mark.parametrize("geom", ["sphere", "capsule", "cylinder", "ellipsoid", "none"])
def test_forces_of_a_medium_on_each_shape_are_mujoco_s(geom: str) -> None:
    """Of ``none`` the box with the inertia of the body."""
    shape = 'sphere" fluidshape="none' if geom == "none" else f'{geom}" fluidshape="ellipsoid'
    text = f"""<mujoco>{MEDIUM}<worldbody><body name="p"><joint name="a" type="ball"/>{INERTIAL}
      <geom type="{shape}" size="0.1 0.07 0.2" pos="0.3 0.1 0" euler="10 20 30" mass="0"
      fluidcoef="0.4 0.3 1.2 0.9 1.1"/></body></worldbody></mujoco>"""
    mine, theirs = compared(text, "qfrc_fluid")
    np.testing.assert_allclose(mine, theirs, rtol=1e-11, atol=1e-12)
    assert np.all(np.abs(theirs).max(axis=0) > 0.0)


# -- refusals and notes ------------------------------------------------------------------------------------------------


PARTS = tomllib.loads(Path(__file__).with_name("parts_of_mjcf.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", PARTS)
def test_parts_that_no_scene_has_are_refused_or_noted(name: str) -> None:
    additions = dict(PARTS[name])
    message, note = additions.pop("message", ""), additions.pop("note", "")
    mocap = additions.pop("mocap", False)
    if message:
        with pytest.raises(DescriptionError) as caught:
            mjcf_data(machine(**additions), mocap=mocap)
        assert message in str(caught.value)
    else:
        notes = mjcf_data(machine(**additions), mocap=mocap).notes
        assert any(note in said for said in notes), notes


def test_a_keyframe_gives_coordinates_controls_and_activations() -> None:
    acts = '<motor name="m" joint="a"/><general name="n" joint="b" dyntype="integrator"/>'
    key = '<keyframe><key name="k" qpos="0.1 0.2 0.3" qvel="1 2 3" ctrl="0.4 0" act="0.6"/></keyframe>'
    data = mjcf_data(machine(drives(acts) + key), keyframe="k").data
    starts = [data["joints"][name]["initial"] for name in "abc"]
    assert [entry["position"] + entry["velocity"] for entry in starts] == [[0.1, 1.0], [0.2, 2.0], [0.3, 3.0]]
    assert data["inputs"]["m"]["formula"] == 0.4 and "formula" not in data["inputs"]["n"]
    assert data["states"]["n_activation"]["initial"] == 0.6


@pytest.mark.parametrize("reference", ["0.02 1", "0.05 0.4", "-300 -20"])
def test_stops_are_as_hard_as_mujoco_s(reference: str) -> None:
    """Beyond the width of the curve of impedance, of a joint that feels its mass alone."""
    solver = f'solreflimit="{reference}" solimplimit="0.9 0.9 0.001 0.5 2"'
    text = f"""<mujoco><option gravity="0 0 0"/><worldbody><body name="p"><joint name="a" type="slide" axis="1 0 0"
      range="-1 0.5" {solver}/>{INERTIAL}</body></worldbody></mujoco>"""
    limits = mjcf_data(text, limits=True).data["joints"]["a"]["limits"]
    assert (limits["lower"], limits["upper"]) == (-1.0, 0.5)
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = 1e-4  # MuJoCo takes no time constant below two steps
    state = mujoco.MjData(model)
    forces = []
    for speed in (0.0, 1e-3):
        state.qpos[0], state.qvel[0] = 0.502, speed
        mujoco.mj_forward(model, state)
        forces.append(-state.qfrc_constraint[0])
    assert limits["stiffness"] == pytest.approx(forces[0] / 0.002, rel=1e-9)
    assert limits["damping"] == pytest.approx((forces[1] - forces[0]) / 1e-3, rel=1e-9)
