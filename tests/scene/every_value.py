"""A scene in which every key whose value formulas of parameters can give is there, to try values key by key."""

from __future__ import annotations

import copy
import pathlib
import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from eomgen.scene.document.schema import every_document, section_keys
from eomgen.scene.formula.scope import FIXED_PARAMETERS, PARAMETERS
from eomgen.scene.reading.key_metadata import Table, fields_of
from eomgen.scene.sections import bounds_of, own_sections
from tests.models.library import scene

DOCUMENT = every_document()
SECTIONS = section_keys()

Path = tuple[str | int, ...]

_MODELS = pathlib.Path(__file__).parents[1] / "models"

#: Gravity of scenes in which no water has to be level.
TILTED = (0.1, 0.2, -9.81)
#: Sections whose entries need level water.
LEVEL = ("hulls",)
SCENE = scene("every_value", laws__drag__source=str(_MODELS / "drag.c"))
for _name in ("cover", "mirrored"):
    SCENE["shapes"][_name]["file"] = str(_MODELS / "tetrahedron.obj")


def parameter_keys(model: type[Table] = DOCUMENT, before: str = "") -> Iterator[str]:
    """Yield every key of the schema whose value formulas of parameters give, without names of entries."""
    for name, (meaning, inner) in fields_of(model).items():
        key = f"{before}.{name}" if before else name
        if key == "include":  # an include is made of entries of other sections before values are read
            continue
        if inner is not None:
            yield from parameter_keys(inner.model, key)
        elif meaning.names is PARAMETERS or (
            meaning.names is not FIXED_PARAMETERS and key in bounds_of(own_sections())
        ):
            yield key


@cache
def places() -> tuple[Path, ...]:
    """Return the places of all numbers in the scene that formulas of parameters could give in their stead."""
    keys = frozenset(parameter_keys())
    return tuple(place for place in _numbers(SCENE, ()) if key_at(place) in keys)


def _numbers(value: Any, place: Path) -> Iterator[Path]:
    if isinstance(value, dict):
        for name, entry in value.items():
            yield from _numbers(entry, (*place, name))
    elif isinstance(value, list):
        for number, entry in enumerate(value):
            yield from _numbers(entry, (*place, number))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield place


def key_at(place: Path) -> str:
    """Return the key of the schema for a place; names of values in a table of formulas are no keys."""
    words = [part for part in place if isinstance(part, str)]
    key = ".".join(words[:1] + words[2:] if words[0] in SECTIONS else words)
    return key.removesuffix(f".{words[-1]}") if words[0] == "laws" or "coefficients" in words else key


def number_at(place: Path) -> float:
    """Return the number that the scene has at a place."""
    value: Any = SCENE
    for part in place:
        value = value[part]
    return float(value)


def scene_with(place: Path, formula: str | float, X: float = 1.0) -> dict[str, Any]:
    """Return the scene with a formula of the tunable parameter X at a place, and the default of X."""
    return scene_of({place: formula}, X)


def scene_of(formulas: Mapping[Path, str | float], X: float = 1.0) -> dict[str, Any]:
    """Return the scene with formulas of the tunable parameter X at places, and the default of X."""
    scene = copy.deepcopy(SCENE)
    scene["parameters"]["X"]["value"] = X
    for place, formula in formulas.items():
        inner: Any = scene
        for part in place[:-1]:
            inner = inner[part]
        inner[place[-1]] = formula
    return scene


def without_value(text: str) -> str:
    """Return a message of a build, or of a call, without where the value came from."""
    return re.sub(r" at X = [^;,]*(?=$|;)|at the default parameters, ", "", text)
