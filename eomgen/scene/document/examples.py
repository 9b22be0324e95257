"""Examples of values for a key that has a value of a wrong kind."""

from __future__ import annotations

import math
from collections.abc import Mapping

from eomgen.base.text import is_legal, shown
from eomgen.scene.reading.key_metadata import added_keys
from eomgen.scene.reading.rotation_schema import is_matrix, plain_angles

#: Examples by key.
_BY_KEY: Mapping[str, str] = {
    "friction": "friction = { coulomb = 0.3, velocity = 0.01 }",
    "limits": "limits = { lower = -1, upper = 1, stiffness = 1e5 }",
    "initial": "initial = { position = 0.1 }",
    "gravity": "gravity = [0, 0, -9.81]",
    "mass": "mass = 1.0",
    "center_of_mass": "center_of_mass = [0, 0, 0]",
    "inertia": "inertia = [0.1, 0.1, 0.1]",
    "axis": "axis = [0, 0, 1]",
    "position": "position = [0, 0, 0]",
    "rotation": 'rotation = [{ axis = "z", angle = "30 deg" }]',
    "orientation": "orientation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
    "tunable": "tunable = true",
    "mimic": 'mimic = { joint = "...", multiplier = 1 }',
    "position_gains": "position_gains = { JOINT = 400 }",
    "velocity_gains": "velocity_gains = { JOINT = 30 }",
    "signal_gains": "signal_gains = { SIGNAL = 1 }",
    "position_weights": "position_weights = { JOINT = 1 }",
    "velocity_weights": "velocity_weights = { JOINT = 1 }",
    "signals": 'signals = { error = "1 - q.joint" }',
}
#: Examples of an entry of a section, behind its name.
_ENTRIES: Mapping[str, str] = {
    "bodies": "{ mass = 1.0, inertia = [0.1, 0.1, 0.1] }",
    "inputs": '{ formula = "sin(t)" }',
    "curves": "{ points = [[0, 0], [1, 1]] }",
    "points": '{ body = "...", position = [0, 0, 0] }',
    "efforts": '{ joint = "...", effort = "..." }',
    "outputs": '{ formula = "..." }, or { position = "POINT" }',
    "events": '{ when = "...", action = "..." }',
    "states": '{ rate = "..." }',
}
#: Values of keys that have to be there, by table and key.
_REQUIRED: Mapping[tuple[str, str], str] = {
    ("", "format"): "1",
    ("limits", "stiffness"): "1e5",
    ("friction", "velocity"): "0.01",
    ("friction", "coulomb"): "0.3",
    ("wave", "period"): "0.5",
}
_AXES = ("[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]")
_FILES = (".csv", ".txt", ".dat", ".tsv")
#: Sections whose ``first`` and ``second`` are names of points.
_BETWEEN_POINTS = ("springs",)


def example(location: tuple[str | int, ...], given: object) -> str:
    """Return an example of a value for a place that has a wrong one; empty without an example."""
    last, section = str(location[-1]), str(location[0])
    if last == "gravity" and isinstance(given, int | float) and not isinstance(given, bool):
        return f"gravity = [0, 0, {-abs(given):g}]"
    if last == "rotation" and plain_angles(given):
        in_degrees = any(abs(angle) > 2.0 * math.pi for angle in given)
        angles = [f'"{angle:g} deg"' if in_degrees else f"{angle:g}" for angle in given]
        every = zip(_AXES, given, angles, strict=True)
        turns = [f"{{ axis = {axis}, angle = {text} }}" for axis, angle, text in every if angle]
        return f"rotation = [{', '.join(turns)}]" if turns else "no rotation"
    if last == "rotation" and is_matrix(given):
        return "orientation, which is a matrix, in place of rotation"
    if last == "mimic" and isinstance(given, str):
        return f"mimic = {{ joint = {quoted(given)}, multiplier = 1 }}"
    if row := next((row for row in added_keys(section) if location == (row.section, row.added)), None):
        return row.example(given)
    if location == ("parameters",):
        return "[parameters] and a line for each: NAME = 1.0"
    of_parameters = section == "parameters" and len(location) > 1
    if of_parameters and isinstance(given, str) and last in ("value", str(location[1])):
        return f"a number; the formula {quoted(given)} stands where {location[1]} is used"
    if len(location) == 1 and section in _ENTRIES and not isinstance(given, dict):
        return f"[{section}.NAME] and its keys, a table for each"
    if last in ("table", "file") and is_file(given):
        return f"table = {{ file = {quoted(given)} }}"
    if len(location) == 2 and is_legal(last) and section in _ENTRIES:
        if section in ("inputs", "curves") and is_file(given):
            return f"{last} = {{ table = {{ file = {quoted(given)} }} }}"
        if section == "inputs" and isinstance(given, str | int | float):
            return f"{last} = {{ formula = {quoted(str(given))} }}"
        return f"{last} = {_ENTRIES[section]}"
    if section in _BETWEEN_POINTS and last in ("first", "second"):
        return f'{last} = "NAME", and [points.NAME] with its body and position'
    return _BY_KEY.get(last, "")


def required(location: tuple[str | int, ...]) -> str:
    """Return an example of a line for a missing key."""
    last, table = str(location[-1]), str(location[-2]) if len(location) > 1 else ""
    added = {row.added: row.required for row in added_keys(str(location[0]))}.get(table, {})
    return f"{last} = {added.get(last) or _REQUIRED.get((table, last), '...')}"


def is_file(given: object) -> bool:
    """Return whether a value is the name of a file with a table."""
    return isinstance(given, str) and given.lower().endswith(_FILES)


def quoted(given: object) -> str:
    """Return a value as a scene file writes it."""
    return f'"{shown(given)[1:-1]}"' if isinstance(given, str) else f"{given}"
