"""Validation of nested data entry by entry; faults in the words of the scene file: unknown and missing keys, wrong
types, with a hint: the key as it is called here, or an example of a value. Invalid entries are reported and skipped.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Annotated, Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError

from eomgen.base.messages import is_legal, key_of, nearest, shown
from eomgen.base.products import fault_of_absent, rows_of
from eomgen.formula.units.parser import is_quantity
from eomgen.scene.document.schema import SceneDocument, document_for, section_keys
from eomgen.scene.joint_types import JOINTS_ELSEWHERE
from eomgen.scene.reading.key_metadata import ForeignKeys, added_keys, meaning_of
from eomgen.scene.reading.kinds import FaultyText, describe, is_matrix, is_plain_number, plain_angles
from eomgen.scene.reading.report import Report
from eomgen.system.terms import nearest_term

Read = TypeVar("Read", bound=BaseModel)
#: Keys and numbers of entries of lists on the way to a value.
Location = tuple[str | int, ...]
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
    "rotation": 'rotation = [{ axis = [0, 0, 1], angle = "30 deg" }]',
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
#: Examples of an entry of a section, after the name of the section.
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
    ("limits", "stiffness"): "1e5",
    ("friction", "velocity"): "0.01",
    ("wave", "period"): "0.5",
}
_AXIS_VECTORS = ("[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]")
_FILES = (".csv", ".txt", ".dat", ".tsv")
#: Sections whose ``first`` and ``second`` are names of points.
_BETWEEN_POINTS = ("springs",)


def example(location: Location, value: object) -> str:
    """Return an example of the right value for the key at a location whose value is wrong, ``value``; empty without an
    example."""
    last, section = str(location[-1]), str(location[0])
    if rewritten := _rewritten(last, value):
        return rewritten
    if row := next((row for row in added_keys(section) if location == (row.section, row.added)), None):
        return row.example(value)
    if location == ("parameters",):
        return "[parameters] and a line for each: NAME = 1.0"
    of_parameter = section == "parameters" and len(location) > 1 and last in ("value", str(location[1]))
    if of_parameter and isinstance(value, str):
        return f"a number; the formula {quote(value)} stands where {shown(str(location[1]))[1:-1]} is used"
    if len(location) == 1 and section in _ENTRIES and not isinstance(value, dict):
        return f"[{section}.NAME] and its keys, a table for each"
    if last in ("table", "file") and is_file(value):
        return f"table = {{ file = {quote(value)} }}"
    if len(location) == 2 and is_legal(last) and section in _ENTRIES:
        return _entry(section, last, value)
    if section in _BETWEEN_POINTS and last in ("first", "second"):
        return f'{last} = "NAME", and [points.NAME] with its body and position'
    return _BY_KEY.get(last, "")


def _rewritten(key: str, value: object) -> str:
    """Return a value of another form in the form of a scene file: gravity as a number, rotations as angles or a matrix,
    the joint of a mimic relation alone; else an empty text."""
    if key == "gravity" and is_plain_number(value):
        return f"gravity = [0, 0, {-abs(value):g}]"
    if key == "rotation" and plain_angles(value):
        in_degrees = any(abs(angle) > 2.0 * math.pi for angle in value)
        angles = [f'"{angle:g} deg"' if in_degrees else f"{angle:g}" for angle in value]
        every = zip(_AXIS_VECTORS, value, angles, strict=True)
        turns = [f"{{ axis = {axis}, angle = {text} }}" for axis, angle, text in every if angle]
        return f"rotation = [{', '.join(turns)}]" if turns else "no rotation"
    if key == "rotation" and is_matrix(value):
        return "orientation, which is a matrix, in place of rotation"
    if key == "acceleration":  # of the base; of an output it is a name
        return 'acceleration = ["quake(t)", 0, 0], with quake in [curves]'
    if key == "mimic" and isinstance(value, str):
        return f"mimic = {{ joint = {quote(value)}, multiplier = 1 }}"
    return ""


def _entry(section: str, name: str, value: object) -> str:
    """Return an example of an entry of a section as a line of a file; from its ``value`` if this is a file's name
    or a formula."""
    if section in ("inputs", "curves") and is_file(value):
        return f"{name} = {{ table = {{ file = {quote(value)} }} }}"
    if section == "inputs" and isinstance(value, str | int | float):
        return f"{name} = {{ formula = {quote(str(value))} }}"
    return f"{name} = {_ENTRIES[section]}"


def example_of_missing_key(location: Location) -> str:
    """Return an example of a line for a missing key."""
    last, table = str(location[-1]), str(location[-2]) if len(location) > 1 else ""
    added = {row.added: row.required for row in added_keys(str(location[0]))}.get(table, {})
    return f"{last} = {added.get(last) or _REQUIRED.get((table, last), '...')}"


def is_file(value: object) -> bool:
    """Return whether a value is the name of a file with a table."""
    return isinstance(value, str) and value.lower().endswith(_FILES)


def quote(value: object) -> str:
    """Return a value in the notation of a scene file."""
    return f'"{shown(value)[1:-1]}"' if isinstance(value, str) else f"{value}"


#: Names of keys in other tools; the first of the keys that a table has is meant.
KEYS_ELSEWHERE: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("dt", "time_step", "timestep", "step_size", "h"), ("step", "sample")),
    **dict.fromkeys(("t_end", "tend", "end", "end_time", "stop_time", "t_final"), ("duration",)),
    **dict.fromkeys(("integrator", "solver"), ("method",)),
    **dict.fromkeys(("com", "cog", "cg", "mass_center", "center"), ("center_of_mass",)),
    **dict.fromkeys(("I", "J", "inertia_tensor", "moments"), ("inertia",)),
    **dict.fromkeys(("m",), ("mass",)),
    **dict.fromkeys(("k", "spring_constant"), ("stiffness",)),
    **dict.fromkeys(("c", "d", "damper"), ("damping",)),
    **dict.fromkeys(("next", "update"), ("formula",)),
    **dict.fromkeys(("l0", "length0", "rest_length", "free_length", "natural_length"), ("length",)),
    **dict.fromkeys(("body1", "from", "point1", "a", "start"), ("first", "parent")),
    **dict.fromkeys(("body2", "to", "point2", "b", "end"), ("second", "child")),
    **dict.fromkeys(("pos", "origin", "xyz", "location"), ("position",)),
    **dict.fromkeys(("angle", "q", "q0", "x", "value0"), ("position",)),
    **dict.fromkeys(("rate", "v", "v0", "speed", "omega"), ("velocity",)),
    **dict.fromkeys(("rpy", "orientation", "euler"), ("rotation", "orientation")),
    **dict.fromkeys(("torque", "force", "value"), ("effort", "formula")),
    **dict.fromkeys(("expression", "function", "law", "definition"), ("formula",)),
    "formula": ("equation",),
    **dict.fromkeys(("period", "ts", "sample_time"), ("sample",)),
    **dict.fromkeys(("condition", "trigger", "guard"), ("when",)),
    **dict.fromkeys(("units",), ("unit",)),
    **dict.fromkeys(("error", "e", "measurement", "input_signal"), ("signal",)),
    **dict.fromkeys(("kp", "p", "p_gain", "gain_p"), ("proportional",)),
    **dict.fromkeys(("ki", "i_gain", "gain_i"), ("integral",)),
    **dict.fromkeys(("kd", "d_gain", "gain_d"), ("derivative",)),
    **dict.fromkeys(("tau", "tf", "filter", "filter_time", "time_const"), ("time_constant",)),
    **dict.fromkeys(("umax", "u_max", "max"), ("maximum", "upper")),
    **dict.fromkeys(("umin", "u_min", "min"), ("minimum", "lower")),
    **dict.fromkeys(("mu_s", "stiction"), ("static",)),
    **dict.fromkeys(("derivative", "ode", "equation", "dot"), ("rate", "formula")),
    # beams
    **dict.fromkeys(("E", "young", "youngs_modulus", "young_modulus", "modulus"), ("elastic_modulus",)),
    **dict.fromkeys(("rho",), ("density",)),
    **dict.fromkeys(("nu", "poisson"), ("poisson_ratio",)),
    **dict.fromkeys(("G",), ("shear_modulus",)),
    **dict.fromkeys(("EI", "EA", "GJ", "GA"), ("stiffness", "section")),
    # shapes
    **dict.fromkeys(("height", "terrain"), ("surface", "road", "length")),
    **dict.fromkeys(("tube", "minor_radius"), ("tube_radius",)),
    **dict.fromkeys(("dimensions", "extents", "sides"), ("size",)),
    **dict.fromkeys(("filename", "path", "mesh", "stl"), ("file",)),
    **dict.fromkeys(("colour", "rgb", "rgba", "material"), ("color",)),
    **dict.fromkeys(("alpha", "transparency"), ("opacity",)),
    # sections
    **dict.fromkeys(("visuals", "visual", "geometry", "meshes"), ("shapes",)),
    **dict.fromkeys(("loops", "loop", "closures", "equality"), ("constraints",)),
    **dict.fromkeys(("links", "link", "masses"), ("bodies",)),
    **dict.fromkeys(("motors", "actuators", "torques"), ("efforts",)),
    **dict.fromkeys(("sensors", "measurements"), ("outputs",)),
    **dict.fromkeys(("constants", "params", "variables"), ("parameters",)),
    **dict.fromkeys(("dampers", "spring_dampers"), ("springs",)),
    **dict.fromkeys(("markers", "sites"), ("points",)),
    **dict.fromkeys(("tires", "wheels"), ("tyres",)),
}

#: Keys of the body that carries a place: the base has none.
_CARRIED = frozenset({"body", "parent"})


def key_meant(name: str, keys: Collection[str], value: object) -> str:
    """Return the key, or a whole line, that a name from another tool stands for in a table with the keys ``keys``;
    empty without one. ``value`` stands under the name."""
    if line := _line_meant(name, keys, value) or _concept_meant(name, keys):
        return line
    for row in rows_of("eomgen.keys_elsewhere", ForeignKeys):
        if hint := row.hint(name, keys, value):
            return str(hint)
    meant = KEYS_ELSEWHERE.get(name, KEYS_ELSEWHERE.get(name.lower(), ()))
    return next((key for key in meant if key in keys), "")


def _line_meant(name: str, keys: Collection[str], value: object) -> str:
    """Return the line for a value under a name from another tool: a file, a frequency, one coordinate; else an empty
    text."""
    if "table" in keys and (name in ("file", "csv", "path", "data", "filename") or is_file(value)):
        return f"table = {{ file = {quote(value)} }}"
    if name in ("frequency", "freq", "f") and "period" in keys and isinstance(value, int | float) and value > 0:
        return f"period = {1.0 / value:.6g}, s"
    if name in ("x", "y", "z") and "position" in keys and isinstance(value, str | int | float):
        entries = ", ".join(quote(value) if axis == name else "0" for axis in "xyz")
        return f"position = [{entries}]"
    return ""


def _concept_meant(name: str, keys: Collection[str]) -> str:
    """Return a hint on eomgen's concept for a name from another tool that corresponds to no single key, in a table with
    the keys ``keys``; else an empty text."""
    if name in ("mu", "mu_k", "coefficient") and "coulomb" in keys:
        return "coulomb, a force in N or a torque in N m: no normal force is multiplied by a coefficient"
    if {"position", "rotation"} <= set(keys) and _CARRIED.isdisjoint(keys) and (hint := _concept_of_bases(name)):
        return hint
    if name == "friction" and "tube_radius" in keys:
        return "no friction: a rolling contact does not slip, and a sliding one has none; [tyres] and [contacts] slip"
    if name in ("diameter", "d") and "radius" in keys and "diameter" not in keys:
        return "radius, half of the diameter"
    if "stiffness_damping" in keys and name in ("mass_damping", "alpha", "rayleigh"):
        return "stiffness_damping in s, D = this times K; none goes with the mass: a load -c * velocity.here does it"
    if "stiffness_damping" in keys and name in ("damping_ratio", "modal_damping", "zeta"):
        return "stiffness_damping, 2 ratio / w in s for the ratio at the angular frequency w"
    if name == "initial" and {"shape", "curvature", "section"} <= set(keys):
        return 'shape or curvature, of the beam at rest; runs start bent by start = "equilibrium" or initial={"q": ...}'
    return ""


def _concept_of_bases(name: str) -> str:
    """Return a hint for a name of another tool in the table of the base's motion; else an empty text."""
    if name in ("velocity", "angular_velocity", "angular_acceleration"):
        integral = "its second integral" if name.endswith("acceleration") else "its integral"
        key = "rotation" if name.startswith("angular") else "position"
        return f"{key} alone, from which rates follow: a formula of t, or a curve through {integral}"
    if name in ("initial_velocity", "initial_position", "initial"):
        return 'position = ["0.5 * t", 0, 0.2], place and velocity at t = 0, to which the integral is added'
    return 'drift = "remove"' if name in ("baseline", "correction", "detrend", "baseline_correction") else ""


_AXES = ("x", "y", "z")
#: Numbers within a bound, by the kind of pydantic's message.
_BOUNDS: Mapping[str, str] = {
    "greater_than_equal": "{} or more",
    "less_than_equal": "{} or less",
    "greater_than": "a number above {}",
    "less_than": "a number below {}",
}
#: Nouns of types, by the kind of pydantic's message.
_NEEDED: Mapping[str, str] = {
    **dict.fromkeys(("string_type", "invalid_key"), "a text"),
    "bool_type": "true or false",
    **dict.fromkeys(("int_type", "int_from_float"), "a whole number"),
    **dict.fromkeys(("dict_type", "model_type"), "a table"),
    "tuple_type": "a list",
    "float_type": "a number",
}


def child_hint(data: Mapping[str, Any]) -> str:
    """Return the hint for a joint without a child in a scene's data: up to three bodies that no joint carries."""
    bodies, beams, joints = (data.get(section, {}) for section in ("bodies", "beams", "joints"))
    if not (isinstance(bodies, Mapping) and isinstance(beams, Mapping) and isinstance(joints, Mapping)):
        return "child = ..."
    carried = {str(joint.get("child")) for joint in joints.values() if isinstance(joint, Mapping)}
    free = [str(body) for body in (*bodies, *beams) if body not in carried]
    return " or ".join(f'child = "{name}"' for name in free[:3] if is_legal(name)) or "child = ..."


def wrong_format(value: object) -> tuple[str, str]:
    """Return the fault and the remedy of a ``format`` that is not 1."""
    remedy = "format = 1, or a newer eomgen" if isinstance(value, int) and value > 1 else "format = 1"
    return f"this eomgen reads format 1, not {describe(value)} [E1479]", remedy


def explain(
    kind: str, message: str, location: Location, value: object, table: type[BaseModel] = SceneDocument, depth: int = 0
) -> tuple[str, str]:
    """Return a fault that pydantic found in the words of the scene file, and a hint, which may be empty. ``kind`` and
    ``message`` are pydantic's, ``location`` has the keys to ``value``; the part from ``depth`` on is within
    ``table``."""
    last = str(location[-1])
    if kind == "extra_forbidden":
        return _unknown_key(location, value, table, depth)
    key_hint = _place_of(location[depth:], table)[1]
    if kind == "missing":
        return f"the key {last} is missing [E1343]", key_hint or example_of_missing_key(location)
    if location == ("format",):
        return wrong_format(value)
    if kind == "literal_error":
        return f"{describe(value)} is not known here [E0263]", key_hint or _word_meant(message, location, value)
    if kind in _BOUNDS:
        fault = f"{describe(value)} is out of range here: it {message.removeprefix('Input ')} [E1480]"
        return fault, _BOUNDS[kind].format(message.rpartition(" ")[2])
    fault = message[0].lower() + message[1:]
    if kind == "list" and isinstance(value, str) and value.lstrip("+-") in _AXES:
        sign = "-" if value[0] == "-" else ""
        entries = ", ".join(f"{sign}1" if axis == value[-1] else "0" for axis in _AXES)
        return fault, f"[{entries}]"
    if kind == "number" and (hint := _number_meant(location, value, table, depth)):
        return fault, hint
    if kind in _NEEDED:
        fault = f"{_NEEDED[kind]} is needed here, not {describe(value)} [E1475]"
    return fault, key_hint or example(location, value)


def _number_meant(location: Location, value: object, table: type[BaseModel], depth: int) -> str:
    """Return a hint for a value in place of a number: a single number for a list, the key of the unit for an entry with
    a unit within a list; empty otherwise."""
    key = str(location[-1])
    if isinstance(value, list | tuple) and value and all(map(is_plain_number, value)):
        if key == "radius" and len(set(value)) > 1:
            return f'one number, or type = "ellipsoid" with semi_axes = {list(value)}'
        return f"{key} = {value[0]}" if len(set(value)) == 1 else _BY_KEY.get(key, "one number")
    if not (isinstance(value, str) and is_quantity(value)):
        return ""
    words = [part for part in location if isinstance(part, str)]
    keys = [f"{words[-1]}_unit", f"{words[-1].removesuffix('s')}_unit"]
    unit_key = next((key for key in _keys_at(tuple(words[depth:-1]), table) if key in keys), "")
    unit = value.strip().lstrip("+-0123456789.eE \t")
    return f'{unit_key} = "{unit}", and numbers alone in {words[-1]}' if unit_key else ""


def _unknown_key(location: Location, value: object, table: type[BaseModel], depth: int) -> tuple[str, str]:
    """Return the message about an unknown key or section, and a hint: a product that is not installed, the key meant,
    or the nearest key. Arguments as of ``explain``."""
    last = str(location[-1])
    if len(location) == 1 and (absent := fault_of_absent(last)):
        return f"the section {shown(last)} is unknown: {absent[0]} [E1476]", absent[1]
    keys = _keys_at(location[depth:-1], table)
    is_formula = isinstance(value, str) and any(sign in value for sign in (" - ", " + ", "*", "(", "v.", "q."))
    if location[0] == "definitions" and len(location) == 3 and last.isidentifier() and is_formula:
        dotted = f"definitions.{location[1]} is a table with the key {shown(last)}, and names have no dots [E1477]"
        return dotted, f"{location[1]}_{last} = {quote(value)}"
    if absent := fault_of_absent(".".join(map(str, location))):
        return f"the key {shown(last)} is unknown here: {absent[0]} [E1478]", absent[1]
    return f"the key {shown(last)} is unknown here [E0722]", key_meant(last, keys, value) or nearest(last, keys)


def _report_fault(
    detail: Any, report: Report, renamed: set[Location], schema: type[BaseModel], data: Mapping[str, Any]
) -> Location:
    """Report a fault of pydantic's ``detail`` unless it follows from a reported fault, and return the keys to the
    value. ``renamed`` are the locations that misspelt keys were meant to be, which are not reported as missing too; new
    ones are added. ``schema`` is the schema of the whole ``data``."""
    location = tuple(part for part in detail["loc"] if not str(part).startswith("#"))  # tags are not keys
    if not issubclass(schema, SceneDocument):  # in all messages of scenes, values in a short form have keys
        location = _in_file(location, data)
    fault, hint = explain(detail["type"], detail["msg"], location, detail.get("input"), schema)
    if detail["type"] == "extra_forbidden":
        renamed.add((*location[:-1], hint))
    missing = detail["type"] == "missing"
    if missing and location[0] == "joints" and location[-1] == "child":
        hint = child_hint(data)
    reported = missing and location[0] == "definitions" and report.concerns(key_of(*location[:2]))
    if not (reported or isinstance(detail.get("input"), FaultyText) or (missing and location in renamed)):
        report.add(key_of(*location), fault, hint)
    return location


def _in_file(location: Location, data: object) -> Location:
    """Return the beginning of a location that exists in the data, with the key that is missing there, if any: a value
    in short form has no keys."""
    for depth, part in enumerate(location):
        every = dict(enumerate(data)) if isinstance(data, list | tuple) and isinstance(part, int) else data
        if not isinstance(every, Mapping):
            return location[:depth]
        data = every.get(part)
    return location


def _word_meant(message: str, location: Location, word: object) -> str:
    """Return a hint for a ``word`` that is none of the words which a key may hold; pydantic's ``message`` lists
    these."""
    expected = message.removeprefix("Input should be ").replace("'", "")
    names = expected.replace(" or ", ", ").split(", ")
    if location[0] == "terms":
        return nearest_term(str(word))
    meant = JOINTS_ELSEWHERE.get(str(word).lower(), "")
    if location[0] in ("joints", "constraints") and meant in names:
        return meant
    if location[0] == "constraints" and word in ("equation", "velocity_equation", "general", "holonomic"):
        return "formula"
    if location[-1] == "shape" and word in ("sine", "sin", "cosine", "cos"):
        return 'formula = "sin(2 * pi * t / 0.5)" in place of a wave'
    if alike := [name for name in names if _letters(name) == _letters(str(word))]:
        return alike[0]
    return nearest(str(word), names) if len(names) > 12 else f"one of {expected}"


def _letters(word: str) -> str:
    """Return the letters and digits of a word, small: ``skyhook`` of ``Sky_hook``."""
    return "".join(filter(str.isalnum, word)).lower()


def _place_of(location: Location, model: Any) -> tuple[Any, str]:
    """Return the class or type at a location within the schema ``model``, None for an unknown one, and the example of
    the innermost key, empty without one."""
    example_of_key, own_name = "", False  # whether the next part is one that the scene gives to an entry
    for part in location:
        if own_name:
            own_name = False
        elif isinstance(model, type) and issubclass(model, BaseModel) and part in model.model_fields:
            field = model.model_fields[str(part)]
            example_of_key, model = meaning_of(field).example, field.annotation
            own_name = get_origin(model) is dict
            while not isinstance(model, type) or not issubclass(model, BaseModel):
                arguments = get_args(model)[:1] if get_origin(model) is Annotated else get_args(model)
                candidates = [kind for kind in arguments if kind not in (type(None), str)]
                if not candidates:
                    return None, example_of_key
                model = candidates[-1] if candidates[-1] is not Ellipsis else candidates[0]
    return model, example_of_key


def _keys_at(location: Location, model: Any) -> list[str]:
    """Return the keys that the table at a location within the schema ``model`` may have; none for an unknown
    location."""
    model, _ = _place_of(location, model)
    if model is None:
        return []
    if issubclass(model, SceneDocument):
        return list(model.known_keys())
    return [field.alias or name for name, field in model.model_fields.items()]


def read_document(data: Mapping[str, Any], report: Report) -> tuple[SceneDocument, dict[str, set[str]]]:
    """Turn nested data into a SceneDocument; invalid entries are reported and left out.

    Returns
    -------
    document : SceneDocument
        Of the entries that are well formed.
    refused : dict
        For each section, the names of the entries left out: these names exist, and are not to be reported as unknown.
    """
    return read_table(document_for(data), section_keys(data), data, report, {"format": 1, "name": "scene"})


def read_table(
    schema: type[Read], sections: Sequence[str], data: Mapping[str, Any], report: Report, instead: Mapping[str, Any]
) -> tuple[Read, dict[str, set[str]]]:
    """Return a table of a schema for nested data, and the names of refused entries by section; faults are reported.
    Invalid entries of ``sections`` and other invalid keys are left out, and ``instead`` has values for required keys
    that were refused. Raises DescriptionError if required keys stay missing or a whole section is invalid."""
    refused: dict[str, set[str]] = {section: set() for section in sections}
    kept = {str(key): entry for key, entry in data.items()}  # numbers as keys are unknown keys
    try:
        return schema.model_validate(kept), refused
    except ValidationError as error:
        broken, renamed = False, set[Location]()
        for detail in sorted(error.errors(include_url=False), key=lambda detail: detail["type"] == "missing"):
            location = _report_fault(detail, report, renamed, schema, data)
            section = str(location[0])
            if section in sections and len(location) > 1 and isinstance(kept.get(section), Mapping):
                refused[section].add(str(location[1]))
                kept[section] = {name: entry for name, entry in kept[section].items() if name != location[1]}
            elif section in kept:
                broken = broken or section in sections
                del kept[section]
    kept = {**instead, **kept}  # a broken section: without a separate problem for every reference into it
    if broken or any(field.is_required() and name not in kept for name, field in schema.model_fields.items()):
        report.raise_problems()
    return schema.model_validate(kept), refused
