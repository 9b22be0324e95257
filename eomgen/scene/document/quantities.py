"""The numbers and formulas of a scene, each with key, SI unit and owner: one walk over nested
data by the metadata of the keys."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from eomgen.base.messages import key_of
from eomgen.scene.document.schema import document_for
from eomgen.scene.reading.key_metadata import ANY_UNIT, KeyMetadata, Table, Units, fields_of

Data = Mapping[str, Any]
Path = tuple[str | int, ...]


class SceneQuantity(NamedTuple):
    """A number, a formula or a text with a unit in a scene.

    Attributes
    ----------
    path : names and indices from the top of the scene
    field : key in the table, without names of entries: ``mass``
    unit : in SI; "1" or "" for a plain number
    value : as in the data
    owner : path of the table that holds the key
    table : class of this table
    meaning : metadata of the key
    """

    path: Path
    field: str
    unit: str
    value: object
    owner: Path
    table: type[Table]
    meaning: KeyMetadata

    @property
    def key(self) -> str:
        """The dotted key, ``bodies.arm.inertia[2]``."""
        return key_of(*self.path)


def quantities(data: Data, without: frozenset[str] = frozenset()) -> Iterator[SceneQuantity]:
    """Yield all values of keys with units or formulas, outer tables first; a list component by component.

    Parameters
    ----------
    data : nested data of a well-formed scene
    without : fields whose values are left out, with all tables below
    """
    kinds = {str(name): joint.get("type", "fixed") for name, joint in data.get("joints", {}).items()}
    ahead: deque[tuple[type[Table], Data, Path, object]] = deque([(document_for(data), data, (), None)])
    while ahead:
        table, entries, path, kind = ahead.popleft()
        kind = entries.get("type", kind or kinds.get(str(entries.get("joint"))))
        for field, (meaning, inner) in fields_of(table).items():
            if field not in entries or field in without:
                continue
            value, value_path = entries[field], (*path, field)
            if inner is None:
                yield from _components(table, entries, field, meaning, kind, path, value_path)
            elif inner.shape == "table":
                ahead += [(inner.model, value, value_path, kind)] * isinstance(value, Mapping)
            elif isinstance(value, Mapping | list | tuple):
                for name, item in value.items() if isinstance(value, Mapping) else enumerate(value):
                    if isinstance(item, Mapping):
                        ahead.append((inner.model, item, (*value_path, name), kind))
                    elif short := inner.model.short:  # the entry is the value of one key
                        whole, key = (*value_path, name), fields_of(inner.model)[short][0]
                        yield from _components(inner.model, {short: item}, short, key, kind, whole, whole)


def _components(
    table: type[Table], entries: Data, field: str, meaning: KeyMetadata, kind: object, owner: Path, value_path: Path
) -> Iterator[SceneQuantity]:
    """Yield a SceneQuantity for each number and text in the value of the key ``field`` of ``entries``, with the SI
    unit; none for a key without unit and formulas. ``kind`` is the type of the entry or joint, which may decide the
    unit, ``owner`` the path of the table, ``value_path`` the path of the value."""
    units = meaning.unit.get(str(kind), "") if isinstance(meaning.unit, Mapping) else meaning.unit
    if units == ANY_UNIT:
        units = str(entries.get("unit", ""))
    elif isinstance(units, tuple) and isinstance(entries.get("index"), int):
        units = units[entries["index"]]
    elif field == table.rate_of_entry:
        units = f"{entries.get('unit') or '1'}/s"
    if not units and meaning.names is None:
        return
    for path, unit, value in _leaves(value_path, units, entries[field]):
        yield SceneQuantity(path, field, unit if isinstance(unit, str) else "", value, owner, table, meaning)


def _leaves(path: Path, unit: Units, value: object) -> Iterator[tuple[Path, Units, object]]:
    """Yield path, unit and value of each number or text in a value, also in lists and mappings at any depth; a list may
    have one unit for all or a unit for each component."""
    if isinstance(value, list | tuple):
        each = (unit,) * len(value) if isinstance(unit, str) else unit
        for index, (table, part) in enumerate(zip(each, value, strict=True)):
            yield from _leaves((*path, index), table, part)
    elif isinstance(value, Mapping):
        for name, part in value.items():
            yield from _leaves((*path, name), unit, part)
    else:
        yield path, unit, value
