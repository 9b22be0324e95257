"""Conversion of MJCF to a scene, from the model that MuJoCo compiles: its defaults, frames, meshes and mass properties
are resolved there and are not computed again."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.messages import listed, nearest, shown
from eomgen.errors import DescriptionError, Problem
from eomgen.products.robots.conversion import Conversion
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.products.robots.mjcf.actuators import convert_actuators
from eomgen.products.robots.mjcf.compiled import compile_model, elements_of, mujoco_module
from eomgen.products.robots.mjcf.coverage import note_unknown_attributes
from eomgen.products.robots.mjcf.draft import MjcfDraft
from eomgen.products.robots.mjcf.equalities import convert_equalities
from eomgen.products.robots.mjcf.fluid import convert_fluid
from eomgen.products.robots.mjcf.sensors import convert_sensors
from eomgen.products.robots.mjcf.shapes import convert_geoms
from eomgen.products.robots.mjcf.tendons import add_pulls, convert_tendons
from eomgen.products.robots.mjcf.tree import BodyReader, add_forces
from eomgen.scene.reading.report import Report
from eomgen.scene.sources.source import ConvertedScene, OptionError

#: Sections of the entries that efforts and forces act on.
_OWNERS = {"joint": "joints", "body": "bodies"}
#: Kinds of names with the elements that have them in a file, and an array of each in the compiled model.
_NAMED = {
    "body": {"body": "body_parentid", "site": "site_bodyid"},
    "joint": {"joint": "jnt_type"},
    "signal": {"actuator": "actuator_trntype"},
    "constraint": {"equality": "eq_type"},
    "output": {"sensor": "sensor_type"},
}
#: A word in the text of a section, but not the end of a key.
_WORD = re.compile(r"[A-Za-z_]\w*\b(?!': )")


def mjcf_data(
    text: str,
    *,
    file: str = "model.xml",
    strict: bool = False,
    path: Path | None = None,
    limits: bool = False,
    friction: bool = False,
    keyframe: str = "",
    mocap: bool = False,
    included: bool = False,
) -> ConvertedScene:
    """Return an MJCF file in the form of a scene file, with notes on all that is left out.

    Parameters
    ----------
    text : str
        Of the file, for the lines of its elements.
    file : str
        Its name in messages.
    strict : bool
        Refuse elements that would be left out with a note.
    path : Path, optional
        The file; without it MuJoCo compiles the text, which then names no other files.
    limits, friction : bool
        Take limits of position as stops, and dry friction.
    keyframe : str
        Name or number of the keyframe at the start.
    mocap : bool
        Move mocap bodies by motions from outside.
    included : bool
        Keep the mass of links on the base as a body, for a scene that includes the file on a base that may move.

    Raises
    ------
    DescriptionError, OptionError, UsageError
    """
    mujoco = mujoco_module()
    elements = elements_of(text, file, path)
    model, warnings = compile_model(text, file, path, elements)
    draft = MjcfDraft(Report(file, {}), {}, mujoco=mujoco, model=model, elements=elements)
    draft.moving_targets, draft.folder = mocap, None if path is None else path.parent
    draft.included = included
    for kind, objects in _NAMED.items():
        for word, count in objects.items():
            draft.keep(kind, (draft.element_name(word, index) for index in range(len(getattr(model, count)))))
    draft.key = _keyframe(draft, keyframe, file)
    draft.qpos = np.array(model.qpos0 if draft.key < 0 else model.key_qpos[draft.key])
    draft.qvel = np.zeros(model.nv) if draft.key < 0 else np.array(model.key_qvel[draft.key])
    draft.lines["gravity"] = str(elements.first("option", file))
    try:
        with np.errstate(all="ignore"):  # the scene refuses numbers without a value
            reader = BodyReader(draft)
            bodies = reader.draft(_name_of(mujoco, model) or "model", [*elements.liberties, *warnings])
            conversion = Conversion(bodies, draft, limits=limits, friction=friction)
            conversion.connect({})
            conversion.convert(actuated=False)
            draft.places = {body: conversion.places[(), key] for body, key in reader.keys.items()}
            add_forces(draft)
            convert_tendons(draft)
            convert_equalities(draft)
            convert_actuators(draft)
            add_pulls(draft)
            convert_fluid(draft)
            convert_sensors(draft)
            convert_geoms(draft)
    except (ArithmeticError, np.linalg.LinAlgError):
        fault = "a number is too large or too small to calculate with [E2167]"
        raise DescriptionError(Problem(file, fault, "masses, inertias and lengths between 1e-100 and 1e100")) from None
    _refuse_other_physics(draft)
    _add_lines(draft)
    _drop_unused_definitions(draft.data)
    _note_the_rest(draft)
    note_unknown_attributes(draft)
    return conversion.result(strict=strict)


def _name_of(mujoco: Any, model: Any) -> str:
    return bytes(model.names[: bytes(model.names).index(b"\0")]).decode("utf-8", "replace")


def _keyframe(draft: MjcfDraft, wanted: str, file: str) -> int:
    """Return the number of the keyframe ``wanted`` by name or number; -1 without a wish, with a note if the file has
    keyframes. Raises OptionError for a keyframe that the file lacks."""
    count = int(draft.model.nkey)
    names = [draft.element_name("key", index) or str(index) for index in range(count)]
    if not wanted:
        if count:
            note = "the start is the configuration of the file"
            draft.notes.append(f"{note}; keyframe=... is one of {listed(names)} [W0162]")
        return -1
    if wanted not in names:
        fault = f"{file} has no keyframe {shown(wanted)} [E1925]"
        raise OptionError("keyframe", fault, nearest(wanted, names) or "no keyframe")
    return names.index(wanted)


def _refuse_other_physics(draft: MjcfDraft) -> None:
    """Report soft bodies (flex) and plugins of MuJoCo, which no scene has and which change the motion."""
    model, elements = draft.model, draft.elements
    for count, tag, name in ((model.nflex, "flex", "flex (a soft body)"), (model.nplugin, "plugin", "plugin")):
        if count:
            location = elements.first(tag, draft.report.file)
            draft.refuse(location, "", f"a {name} is not supported [E1926]", "the file without it")


def _add_lines(draft: MjcfDraft) -> None:
    """Give efforts and forces without a line of the file the line of their joint or body."""
    for section in ("efforts", "forces"):
        for name, entry in draft.data.get(section, {}).items():
            owner = next(f"{kind}.{entry[word]}" for word, kind in _OWNERS.items() if word in entry)
            if owner in draft.lines:
                draft.lines.setdefault(f"{section}.{name}", draft.lines[owner])


def _drop_unused_definitions(data: dict[str, Any]) -> None:
    """Remove from ``data``, in place, the definitions that no formula outside of the definitions uses, directly or by
    others."""
    definitions = data.get("definitions", {})
    waiting = [repr(section) for key, section in data.items() if key != "definitions"]
    used: set[str] = set()
    while waiting:
        for word in _WORD.findall(waiting.pop()):
            if word in definitions and word not in used:
                used.add(word)
                waiting.append(definitions[word]["formula"])
    for name in definitions.keys() - used:
        del definitions[name]
    if not definitions:
        data.pop("definitions", None)


def _note_the_rest(draft: MjcfDraft) -> None:
    """Note contact as not modelled, of geoms that can collide and of explicit pairs, unless the file switches contact
    off."""
    model, file = draft.model, draft.report.file
    touching = np.flatnonzero((model.geom_contype != 0) | (model.geom_conaffinity != 0))
    if len(touching) > 1 and not draft.is_disabled("CONTACT"):
        location = draft.place("geom", int(touching[0]), model.ngeom)
        draft.leave_out(location, f"not modelled: contact ({len(touching)} geoms) [W0151]")
    if model.npair and not draft.is_disabled("CONTACT"):
        draft.leave_out(ElementPlace(file, 1), f"not modelled: contact of {model.npair} pairs [W0152]")
