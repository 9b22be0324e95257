"""Faults in nested data, told in the words of the scene file: unknown and missing keys, wrong types; with a hint."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel

from eomgen.base.products import fault_of_absent
from eomgen.base.text import is_legal, nearest, shown
from eomgen.scene.document.examples import example, required
from eomgen.scene.document.keys_elsewhere import key_meant
from eomgen.scene.document.schema import Document
from eomgen.scene.joint_types import JOINTS_ELSEWHERE
from eomgen.scene.reading.kinds import described
from eomgen.system.terms import nearest_term

#: So many words that a key may hold are listed in a hint; of more, the nearest are.
_LISTED = 12
_AXES = ("x", "y", "z")


def child_hint(data: Mapping[str, Any]) -> str:
    """Return hints of bodies for a joint without a child: bodies that no other joint carries."""
    bodies, beams, joints = (data.get(section, {}) for section in ("bodies", "beams", "joints"))
    if not (isinstance(bodies, Mapping) and isinstance(beams, Mapping) and isinstance(joints, Mapping)):
        return "child = ..."
    carried = {str(joint.get("child")) for joint in joints.values() if isinstance(joint, Mapping)}
    free = [str(body) for body in (*bodies, *beams) if body not in carried]
    return " or ".join(f'child = "{name}"' for name in free[:3] if is_legal(name)) or "child = ..."


def explained(
    kind: str,
    message: str,
    location: tuple[str | int, ...],
    given: object,
    table: type[BaseModel] = Document,
    depth: int = 0,
) -> tuple[str, str]:
    """Return pydantic's message about a place in the words of the scene file, and a hint; the part of the location from
    ``depth`` on is within ``table``."""
    last = str(location[-1])
    if kind == "extra_forbidden":
        if len(location) == 1 and (absent := fault_of_absent(last)):
            return f"the section {shown(last)} is unknown: {absent[0]}", absent[1]
        keys = _keys_at(location[depth:-1], table)
        if absent := fault_of_absent(".".join(map(str, location))):
            return f"the key {shown(last)} is unknown here: {absent[0]}", absent[1]
        return f"the key {shown(last)} is unknown here", key_meant(last, keys, given) or nearest(last, keys)
    if kind == "missing":
        return f"the key {last} is missing", required(location)
    if location == ("format",):
        return f"this eomgen reads format 1, not {described(given)}", "format = 1"
    if kind == "literal_error":
        expected = message.removeprefix("Input should be ").replace("'", "")
        names = expected.replace(" or ", ", ").split(", ")
        if location[0] == "terms":
            return f"{described(given)} is not known here", nearest_term(str(given))
        meant = JOINTS_ELSEWHERE.get(str(given).lower(), "")
        if location[0] in ("joints", "constraints") and meant in names:
            return f"{described(given)} is not known here", meant
        if last == "shape" and given in ("sine", "sin", "cosine", "cos"):
            return f"{described(given)} is not known here", 'formula = "sin(2 * pi * t / 0.5)" in place of a wave'
        hint = nearest(str(given), names) if len(names) > _LISTED else f"one of {expected}"
        return f"{described(given)} is not known here", hint
    if kind in ("greater_than_equal", "less_than_equal"):
        bound = f"{message.rpartition(' ')[2]} or {'more' if kind == 'greater_than_equal' else 'less'}"
        return f"{described(given)} is out of range here: it {message.removeprefix('Input ')}", bound
    if kind == "list" and isinstance(given, str) and given.lstrip("+-") in _AXES:
        sign = "-" if given[0] == "-" else ""
        entries = ", ".join(f"{sign}1" if axis == given[-1] else "0" for axis in _AXES)
        return message[0].lower() + message[1:], f"[{entries}]"
    plain = {
        "string_type": "a text",
        "bool_type": "true or false",
        "int_type": "a whole number",
        "dict_type": "a table",
    }
    plain |= {"model_type": "a table", "tuple_type": "a list", "int_from_float": "a whole number"}
    if kind in plain:
        return f"{plain[kind]} is needed here, not {described(given)}", example(location, given)
    return message[0].lower() + message[1:], example(location, given)


def _keys_at(location: tuple[str | int, ...], model: Any) -> list[str]:
    """Return the keys that the schema knows at a place within a table."""
    own_name = False  # whether the next part is one that the scene gives to an entry
    for part in location:
        if own_name:
            own_name = False
        elif isinstance(model, type) and issubclass(model, BaseModel) and part in model.model_fields:
            model = model.model_fields[str(part)].annotation
            own_name = get_origin(model) is dict
            while not isinstance(model, type) or not issubclass(model, BaseModel):
                arguments = get_args(model)[:1] if get_origin(model) is Annotated else get_args(model)
                candidates = [
                    candidate for candidate in arguments if candidate is not type(None) and candidate is not str
                ]
                if not candidates:
                    return []
                model = candidates[-1] if candidates[-1] is not Ellipsis else candidates[0]
    return [field.alias or name for name, field in model.model_fields.items()]
