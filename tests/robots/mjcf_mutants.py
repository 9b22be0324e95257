"""Mutants of an MJCF file that has most elements of MuJoCo's grammar: one attribute at a time is added or changed."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import mujoco
import numpy as np

from eomgen.products.robots.mjcf.coverage import STATUSES, key_of_path
from tests.oracles.evaluation import Array

#: A file with one element or more of each kind that a mutant is made of.
_TEXT = """<mujoco model="m">
  <compiler angle="degree"><lengthrange/></compiler>
  <option><flag contact="disable"/></option>
  <size/><statistic/>
  <visual><global/><quality/><headlight/><map/><scale/><rgba/></visual>
  <default>
    <mesh/><texture/><material><layer role="rgb" texture="tx"/></material>
    <joint damping="0.05"/><geom density="900"/><site/><camera/><light/><pair/><equality/><tendon/>
    <default class="general"><general/></default><default class="motor"><motor/></default>
    <default class="position"><position/></default><default class="velocity"><velocity/></default>
    <default class="intvelocity"><intvelocity/></default><default class="orientation"><orientation/></default>
    <default class="pid"><pid/></default><default class="damper"><damper/></default>
    <default class="cylinder"><cylinder/></default><default class="muscle"><muscle/></default>
    <default class="adhesion"><adhesion/></default>
    <default class="dcmotor"><dcmotor motorconst="0.1" resistance="1"/></default>
  </default>
  <asset>
    <mesh name="me" vertex="0 0 0 0.1 0 0 0 0.1 0 0 0 0.1"/>
    <texture name="tx" type="2d" builtin="flat" width="4" height="4"/>
    <material name="ma"><layer role="rgb" texture="tx"/></material>
    <hfield name="hf" nrow="2" ncol="2" size="1 1 0.1 0.1" elevation="0 1 0 1"/>
  </asset>
  <worldbody>
    <body name="u">
      <joint name="a" axis="0 1 0" stiffness="1" damping="0.2"/><joint name="c" type="slide" axis="1 0 0"/>
      <geom name="k" type="box" size="0.1 0.2 0.3"/><site name="p" pos="0.1 0.2 0"/>
      <body name="l" pos="0.5 0 0">
        <inertial mass="2" pos="0.1 0.02 0.03" diaginertia="0.1 0.12 0.14"/>
        <joint name="b" axis="0 1 0.5"/><site name="s"/>
        <frame pos="0 0.1 0"><body name="w" pos="0 0.4 0"><joint name="d" type="ball"/><geom size="0.1"/>
          <geom type="mesh" mesh="me"/></body></frame>
      </body>
    </body>
    <body name="f" pos="1 1 1"><freejoint name="free"/><geom size="0.1" pos="0.1 0 0"/>
      <geom name="o" size="0.2" pos="-0.2 0 0"/><site name="e" pos="0.3 0.1 0"/></body>
    <replicate count="2" sep="x">
      <body name="n" pos="0 0 3"><joint name="g" axis="1 0 0"/><geom size="0.1"/></body></replicate>
    <geom type="hfield" hfield="hf" name="ground" pos="0 0 -3"/><light pos="0 0 3"/><camera name="ca" pos="0 -3 0"/>
    <body name="t" mocap="true"/><site name="h"/>
  </worldbody>
  <contact><pair geom1="k" geom2="o"/><exclude body1="u" body2="f"/></contact>
  <tendon><fixed name="t" stiffness="1"><joint joint="a" coef="1"/><joint joint="b" coef="-2"/></fixed>
    <spatial name="r" stiffness="2"><site site="s"/><geom geom="o"/><site site="e"/><pulley divisor="2"/>
    <site site="e"/>
    <site site="h"/></spatial></tendon>
  <equality><connect site1="p" site2="e"/><weld body1="l" body2="f"/><joint joint1="a" joint2="b"/>
    <tendon tendon1="t"/></equality>
  <actuator>
    <general class="general" name="g" tendon="t"/><motor class="motor" name="m" joint="a"/>
    <position class="position" name="p" joint="b"/><velocity class="velocity" name="v" joint="c"/>
    <intvelocity class="intvelocity" name="i" joint="a" actrange="-9 9"/>
    <orientation class="orientation" name="q" joint="d" kp="2"/><pid class="pid" name="pid" joint="b" kp="2" ki="1"/>
    <damper class="damper" name="da" joint="a" ctrlrange="0 1"/><cylinder class="cylinder" name="cy" joint="b"/>
    <muscle class="muscle" name="x" tendon="r" lengthrange="0.3 1.5"/>
    <adhesion class="adhesion" name="ad" body="f" ctrlrange="0 1"/>
    <dcmotor class="dcmotor" name="dc" joint="a" motorconst="0.1" resistance="1" inductance="0.1"/>
    <motor name="z" site="s" gear="1 0 0 0 0 1"/>
  </actuator>
  <sensor>
    <touch site="s"/><accelerometer site="s"/><velocimeter site="s"/><gyro site="s"/><force site="s"/><torque site="s"/>
    <magnetometer site="s"/><rangefinder site="s"/><jointpos joint="a"/><jointvel joint="b"/><tendonpos tendon="r"/>
    <tendonvel tendon="t"/><actuatorpos actuator="m"/><actuatorvel actuator="m"/><actuatorfrc actuator="m"/>
    <jointactuatorfrc joint="a"/><tendonactuatorfrc tendon="t"/><ballquat joint="d"/><ballangvel joint="d"/>
    <framepos objtype="site" objname="s"/><framequat objtype="site" objname="s"/>
    <framexaxis objtype="site" objname="s"/>
    <frameyaxis objtype="site" objname="s"/><framezaxis objtype="site" objname="s"/>
    <framelinvel objtype="site" objname="s"/><frameangvel objtype="site" objname="s"/>
    <framelinacc objtype="site" objname="s"/><frameangacc objtype="site" objname="s"/><subtreecom body="u"/>
    <subtreelinvel body="u"/><subtreeangmom body="u"/><insidesite site="s" objtype="site" objname="e"/>
    <distance geom1="k" geom2="o"/><normal geom1="k" geom2="o"/><fromto geom1="k" geom2="o"/><contact geom1="k"/>
    <e_potential/><e_kinetic/><clock/><user dim="1"/><camprojection site="s" camera="ca"/>
  </sensor>
  <custom><numeric name="nu" data="1"/><text name="te" data="a"/>
    <tuple name="tu"><element objtype="body" objname="u" prm="1"/></tuple></custom>
  <keyframe><key name="ke"/></keyframe>
</mujoco>"""


def _with_names(text: str) -> str:
    """Return a file with names of all sensors."""
    root = ET.fromstring(text)
    for index, sensor in enumerate(root.find("sensor") or ()):
        sensor.set("name", f"sensor_{index}")
    return ET.tostring(root, encoding="unicode")


BASE = _with_names(_TEXT)
#: Elements that are not in the file, and why.
ABSENT = {
    "extension": "plugins are refused as a whole",
    "plugin": "plugins are refused as a whole",
    "flex": "soft bodies are refused as a whole",
    "skin": "pictures alone",
    "asset/model": "another file, whose elements MuJoCo attaches",
    "body/attach": "another file, whose elements MuJoCo attaches",
    "jointlimit": "limits are left out with a note without --limits",
    "tendonlimit": "limits of tendons are left out with a note",
    "tactile": "contact is left out with a note",
}
#: Numbers to try, by their count; 0 stands for an unknown count.
_NUMBERS = {
    0: ("0.3", "0.3 0.2", "0.3 -0.2 0.4", "true", "zyx"),
    1: ("0.3", "2"),
    2: ("0.3 0.2", "-0.2 0.4"),
    3: ("0.3 -0.2 0.4", "0.2 0.1 0.3"),
    4: ("0.9 0.1 0.3 0.2",),
    5: ("0.2 0.1 0.3 0.2 0.4",),
    6: ("0.4 0.3 0.2 0.01 0.02 0.03",),
    7: ("0.3 0.2 0.4 0.1 0.2 0.1 0.3",),
    10: ("0.3 0.2 0.4 0.1 0.2 0.1 0.3 0.2 0.1 0.1", "0.3"),
}
#: Attributes that name elements only, or files; a file that MuJoCo lacks is refused by its compiler.
_NAMES = ("name", "class", "childclass", "file", "meshdir", "texturedir", "assetdir")


@cache
def types() -> dict[str, str]:
    """Return the types of attributes that MuJoCo's reference has, by anchor: ``[none, ellipsoid]``, ``real(3)``."""
    page = Path(mujoco.__file__).parent / "doc" / "XMLreference.rst"
    if not page.exists():
        return {}
    row = r"^\.\. _([a-z_0-9-]+):\n\n:at:`[^`]*`: :at-val:`(\[[^\]]*\]|[a-z]+(?:\(\d+\))?)"
    return dict(re.findall(row, page.read_text(encoding="utf-8"), re.MULTILINE))


def type_of(key: str, attribute: str) -> str:
    """Return the type of an attribute; empty if it is not known. Defaults have the types of their elements."""
    name = key.partition("/")[2] if key.startswith("default/") else ""
    sections = ("body", "actuator", "asset", "tendon", "contact", "equality") if name else ()
    anchors = [f"{key.replace('/', '-')}", *(f"{section}-{name}" for section in sections)]
    return next((kind for anchor in anchors if (kind := types().get(f"{anchor}-{attribute}"))), "")


def elements(root: ET.Element) -> dict[str, ET.Element]:
    """Return the first element of each key below a root."""
    result: dict[str, ET.Element] = {"mujoco": root}
    waiting = [("", child) for child in root]
    while waiting:
        path, element = waiting.pop(0)
        own = f"{path}/{element.tag}" if path else element.tag
        result.setdefault(key_of_path(own), element)
        waiting = [*((own, child) for child in element), *waiting]
    return result


def values(key: str, attribute: str) -> tuple[str, ...]:
    """Return values to try: all keywords, numbers, or names of the file."""
    kind = type_of(key, attribute)
    if kind.startswith("["):
        return tuple(word.strip() for word in kind[1:-1].split(","))
    names = tuple(sorted(set(re.findall(r'name="(\w+)"', BASE))))
    if kind == "string":
        return (*names, "zyx")
    count = int(re.sub(r"\D", "", kind) or 1) if kind else 0
    return (*_NUMBERS.get(count, _NUMBERS[0]), *(() if kind else names))


def base(key: str) -> str:
    """Return the file of which mutants of an element are made: with equalities for these alone, since a scene is
    assembled before its equations are compared, and with sensors for elements on which they alone depend."""
    root = ET.fromstring(BASE)
    measured = key.startswith(("sensor", "body/site", "default/site", "body/camera", "default/camera", "option"))
    for tag, needed in (("equality", "equality" in key), ("sensor", measured)):
        section = root.find(tag)
        if section is not None and not needed:
            root.remove(section)
    return ET.tostring(root, encoding="unicode")


def mutants(key: str) -> Iterator[tuple[str, str, str]]:
    """Yield attribute, value and text of the mutants of an element, of each attribute the ones that MuJoCo takes up to
    the first that changes its equations, all keywords, and at most six."""
    original = base(key)
    own = equations(original)
    if own is None:
        raise ValueError("MuJoCo does not compile the file")
    for attribute in STATUSES[key]:
        if attribute in _NAMES:
            continue
        taken = 0
        several = type_of(key, attribute).startswith("[")
        for value in values(key, attribute):
            root = ET.fromstring(original)
            element = elements(root)[key]
            if element.get(attribute) == value:
                continue
            element.set(attribute, value)
            text = ET.tostring(root, encoding="unicode")
            theirs = equations(text)
            if theirs is None:
                continue
            taken += 1
            changed = theirs.shape != own.shape or not np.allclose(theirs, own, rtol=1e-9, atol=1e-12, equal_nan=True)
            if changed:
                yield attribute, value, text
            if taken == 6 or (changed and not several):
                break


def equations(text: str, seed: int = 3) -> Array | None:
    """Return the equations of a file at a random state in one array; None if MuJoCo refuses the file."""
    try:
        spec = mujoco.MjSpec.from_string(text)
        spec.compiler.fusestatic = False
        return _numbers(spec.compile(), seed)
    except (ValueError, mujoco.FatalError):
        return None


def _numbers(model: mujoco.MjModel, seed: int) -> Array:
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    for numbers, low in ((data.qpos, -0.7), (data.qvel, -1.0), (data.ctrl, 0.0), (data.act, 0.1)):
        numbers[:] = rng.uniform(low, 1.0, len(numbers))
    mujoco.mj_normalizeQuat(model, data.qpos)
    for stage in (mujoco.mj_fwdPosition, mujoco.mj_fwdVelocity, mujoco.mj_fwdActuation):
        stage(model, data)
    data.qacc[:] = rng.uniform(-1.0, 1.0, model.nv)
    for stage in (mujoco.mj_rnePostConstraint, mujoco.mj_sensorPos, mujoco.mj_sensorVel, mujoco.mj_sensorAcc):
        stage(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    forces = (data.qfrc_bias, data.qfrc_passive, data.qfrc_actuator, data.act_dot, data.sensordata)
    keys = (model.key_qpos, model.key_qvel, model.key_act, model.key_ctrl, model.key_mpos, model.key_mquat)
    parts = (M, *forces, model.qpos0, data.efc_J, data.efc_pos, *keys)
    return np.concatenate([np.ravel(part) for part in parts])
