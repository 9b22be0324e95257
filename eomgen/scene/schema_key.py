"""What a key of a scene file means, said once: its unit, the names its formulas may use, what it refers to, and in words.

The check of unit strings, the JSON Schema, the prefixes of included files and the tables of ``docs/scene.md`` all read this.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

from eomgen.scene.formula_scope import Scope

#: A unit in SI, or units of components; where it depends on a type (of joint, of constraint), by that type.
Units = str | tuple[str, ...]


class Table(BaseModel):
    """A table with known keys only."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


@dataclass(frozen=True)
class Meaning:
    """What is known of a key.

    Attributes
    ----------
    unit : SI unit of its numbers; by component; or by the ``type`` of the entry, of what is around it, or of its ``joint``.
    names : which names its formulas may use; None where it takes no formulas.
    refers : the section whose entries it names.
    kind : words for the type of value, in place of what follows from the annotation.
    shown_default : words for the default, in place of its value.
    """

    unit: Units | Mapping[str, Units] = ""
    names: Scope | None = None
    refers: str = ""
    kind: str = ""
    shown_default: str = ""


def key(
    description: str,
    default: Any = ...,
    *,
    unit: Units | Mapping[str, Units] = "",
    names: Scope | None = None,
    refers: str = "",
    kind: str = "",
    shown_default: str = "",
    **constraints: Any,
) -> Any:
    """Return a field of a table with its meaning; ``constraints`` (``alias``, ``ge``, ``le``, ...) are those of pydantic.

    Parameters
    ----------
    description : str
        For the reference page and for editors: one line of Markdown, no full stop.
    default : object
        The value where the key is absent; required by default.
    """
    meaning = Meaning(unit, names, refers, kind, shown_default)
    field = Field(default, description=description, **constraints)
    field.metadata.append(meaning)
    return field


def meaning_of(field: FieldInfo) -> Meaning:
    """Return what is known of a field of a table."""
    return next((entry for entry in field.metadata if isinstance(entry, Meaning)), Meaning())


def every_unit(meaning: Meaning) -> tuple[str, ...]:
    """Return each unit that a key can have, once, in order."""
    by_type = meaning.unit.values() if isinstance(meaning.unit, Mapping) else (meaning.unit,)
    flat = [unit for units in by_type for unit in ((units,) if isinstance(units, str) else units)]
    return tuple(dict.fromkeys(unit for unit in flat if unit))
