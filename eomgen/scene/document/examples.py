"""Examples of what a key holds where something else stands, and keys that are called otherwise elsewhere."""

from __future__ import annotations

from collections.abc import Collection, Mapping

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
_FILES = (".csv", ".txt", ".dat", ".tsv")
#: Sections whose ``first`` and ``second`` are names of points.
_BETWEEN_POINTS = ("springs",)
#: What keys are called elsewhere; the first of the names that a table has is meant.
_KEYS: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("dt", "time_step", "timestep", "step_size", "h"), ("step", "sample")),
    **dict.fromkeys(("t_end", "tend", "end", "end_time", "stop_time", "t_final"), ("duration",)),
    **dict.fromkeys(("integrator", "solver"), ("method",)),
    **dict.fromkeys(("com", "cog", "cg", "centre_of_mass", "center"), ("center_of_mass",)),
    **dict.fromkeys(("I", "J", "inertia_tensor", "moments"), ("inertia",)),
    **dict.fromkeys(("m",), ("mass",)),
    **dict.fromkeys(("k", "spring_constant"), ("stiffness",)),
    **dict.fromkeys(("c", "d", "damper"), ("damping",)),
    **dict.fromkeys(("l0", "length0", "rest_length", "free_length", "natural_length"), ("length",)),
    **dict.fromkeys(("body1", "from", "point1", "a", "start"), ("first", "parent")),
    **dict.fromkeys(("body2", "to", "point2", "b", "end"), ("second", "child")),
    **dict.fromkeys(("pos", "origin", "xyz", "location"), ("position",)),
    **dict.fromkeys(("angle", "q", "q0", "x", "value0"), ("position",)),
    **dict.fromkeys(("rate", "v", "v0", "speed", "omega"), ("velocity",)),
    **dict.fromkeys(("rpy", "orientation", "euler"), ("rotation", "orientation")),
    **dict.fromkeys(("torque", "force", "value"), ("effort", "formula")),
    **dict.fromkeys(("expression", "function", "law"), ("formula",)),
    **dict.fromkeys(("period", "ts", "sample_time"), ("sample",)),
    **dict.fromkeys(("condition", "trigger", "guard"), ("when",)),
    **dict.fromkeys(("units",), ("unit",)),
}


def key_meant(name: str, keys: Collection[str], given: object) -> str:
    """Return which key, or keys, are called otherwise elsewhere; empty where none is."""
    if "table" in keys and (name in ("file", "csv", "path", "data", "filename") or _is_file(given)):
        return f"table = {{ file = {_quoted(given)} }}"
    if name in ("x", "y", "z") and "position" in keys and isinstance(given, str | int | float):
        entries = ", ".join(_quoted(given) if axis == name else "0" for axis in "xyz")
        return f"position = [{entries}]"
    meant = _KEYS.get(name, _KEYS.get(name.lower(), ()))
    return next((key for key in meant if key in keys), "")


def example(location: tuple[str | int, ...], given: object) -> str:
    """Return what may stand at a place where something else does; empty where there is no example."""
    last, section = str(location[-1]), str(location[0])
    if last == "gravity" and isinstance(given, int | float) and not isinstance(given, bool):
        return f"gravity = [0, 0, {-abs(given):g}]"
    if last in ("table", "file") and _is_file(given):
        return f"table = {{ file = {_quoted(given)} }}"
    if len(location) == 2 and is_legal(last) and section in _ENTRIES:
        if section in ("inputs", "curves") and _is_file(given):
            return f"{last} = {{ table = {{ file = {_quoted(given)} }} }}"
        if section == "inputs" and isinstance(given, str | int | float):
            return f"{last} = {{ formula = {_quoted(str(given))} }}"
        return f"{last} = {_ENTRIES[section]}"
    if section in _BETWEEN_POINTS and last in ("first", "second"):
        return f'{last} = "NAME", and [points.NAME] with its body and position'
    return _BY_KEY.get(last, "")


def _is_file(given: object) -> bool:
    return isinstance(given, str) and given.lower().endswith(_FILES)


def _quoted(given: object) -> str:
    return f'"{shown(given)[1:-1]}"' if isinstance(given, str) else f"{given}"
