"""Examples of what a key holds where something else stands."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.scene.reading.rotation_schema import plain_angles
from eomgen.text import is_legal, shown

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
_AXES = ("[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]")
_FILES = (".csv", ".txt", ".dat", ".tsv")
#: Sections whose ``first`` and ``second`` are names of points.
_BETWEEN_POINTS = ("springs",)


def example(location: tuple[str | int, ...], given: object) -> str:
    """Return what may stand at a place where something else does; empty where there is no example."""
    last, section = str(location[-1]), str(location[0])
    if last == "gravity" and isinstance(given, int | float) and not isinstance(given, bool):
        return f"gravity = [0, 0, {-abs(given):g}]"
    if last == "rotation" and plain_angles(given):
        turns = [f"{{ axis = {axis}, angle = {angle:g} }}" for axis, angle in zip(_AXES, given, strict=True) if angle]
        return f"rotation = [{', '.join(turns)}]" if turns else "no rotation"
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


def is_file(given: object) -> bool:
    """Return whether what stands there is the name of a table's file."""
    return isinstance(given, str) and given.lower().endswith(_FILES)


def quoted(given: object) -> str:
    """Return what stands there as a scene file writes it."""
    return f'"{shown(given)[1:-1]}"' if isinstance(given, str) else f"{given}"
