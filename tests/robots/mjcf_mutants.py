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
_TEXT = Path(__file__).with_name("most_elements.xml").read_text(encoding="utf-8")


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
