"""Texts of a library that differs from an earlier one in numbers alone: a changed mass needs no schedule.

Numbers of functions stand in a source of their own. Every other text follows from the operations of the functions, the
data of the stepper and the names, whose digest is the *structure* of a model. The cache has by structure the library
that was made first, and the constant of the tape of each entry in its tables.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from math import copysign
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.data import dataclass, replace
from eomgen.base.version import __version__, checkout_stamp
from eomgen.codegen.folder import MANIFEST
from eomgen.codegen.targets.c.interface import fingerprint
from eomgen.codegen.targets.c.printer import NumberTable, stays_in_text
from eomgen.symbolic.operations import Op
from eomgen.toolchain.number_tables import keeps_tables, with_tables

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.system.system import System
    from eomgen.toolchain.builder import Builder
    from eomgen.toolchain.cache import Cache
    from eomgen.toolchain.library import Library

_RECORD = "tables.json"
#: A table in C: name of the array, and its rows.
_TABLE = r"(?s)const double (\w+)\[\d+\] = \{\n(.*?) \};"
_MARK = r'(?<=fingerprint\[\] = ")\w+'


@dataclass(frozen=True)
class KnownTexts:
    """Texts of all files of a library by name, headers first and then the numbers, which alone are compiled; names of
    the sources without branches; the layout; and the bytes of the library, None if it has to be compiled."""

    files: Mapping[str, str]
    straight: Sequence[str]
    layout: Mapping[str, Any]
    library: bytes | None


@dataclass(frozen=True)
class Structure:
    """The structure of a model, as a key of the cache, and the constants of its functions, in the order of the tape."""

    key: str
    constants: Sequence[float]


def structure_of(
    system: System, functions: Sequence[str], program: Program, key: Callable[[bytes], str], family: str
) -> Structure | None:
    """Return the structure of a System; None for a System whose texts have further numbers: with loops, curves, or C
    of the scene.

    Parameters
    ----------
    functions : of the model
    program : of these functions, without statements
    key : from a content to the key of its library in the cache, as of ``Builder``
    family : digest of the method's code and templates, if it is of another distribution
    """
    tape = system.tape
    if tape.maps or tape.curves or program.sources or program.series or system.sample.parts:
        return None
    results = [np.array(system.functions[name].refs, int) for name in functions]
    live = np.array(tape.live(np.concatenate(results).tolist()))
    op, places = np.array(tape.op)[live], np.zeros(len(tape.op), int)
    places[live] = np.arange(1, len(live) + 1)
    constants = [tape.constants[tape.a[node]] for node in live[op == Op.CONST].tolist()]
    if len({*constants}) < len(constants):
        return None

    def placed(refs: Any) -> Any:
        return np.sign(refs) * places[np.abs(refs)]

    leaves = (op == Op.CONST) | (op == Op.INPUT)
    operands = [np.where(leaves, 0, placed(np.array(column)[live])) for column in (tape.a, tape.b, tape.c)]
    recorded = {
        "constants": [value if stays_in_text(value) else None for value in constants],
        "inputs": [tape.inputs[tape.a[node]] for node in live[op == Op.INPUT].tolist()],
        "functions": [functions, *(placed(refs).tolist() for refs in results)],
        "blocks": [[int(np.searchsorted(live, node)), label] for node, label in tape.blocks],
        "names": [[int(places[node]), name] for node, name in tape.names.items() if places[node]],
        "program": vars(replace(program, constants=(), notes=())),  # of which C has none
        "code": [__version__, checkout_stamp(), tape.reciprocals, family],
    }
    digest = hashlib.sha256(b"structure\0" + json.dumps(recorded, default=_plain).encode())
    for column in (op, *operands):
        digest.update(column.tobytes())
    signs = [] if 1.0 in constants else [1.0]  # in tables of shared stretches
    return Structure(key(digest.digest()), constants + signs)


def _plain(value: Any) -> Any:
    return vars(value) if hasattr(value, "__dict__") else dict(value)


def keep_texts(cache: Cache, structure: Structure, library: Library, straight: Sequence[str]) -> None:
    """Keep which library has the texts of a structure, unless a number of a function is none of its constants.

    Parameters
    ----------
    straight : names of the sources without branches
    """
    prefix = library.layout["prefix"]
    places = {value: place for place, value in enumerate(structure.constants, 1)}
    tables: dict[str, list[float]] = {}
    text = (library.folder / f"{prefix}_numbers.c").read_text(encoding="utf-8")
    for name, rows in re.findall(_TABLE, text):
        if name == f"{prefix}_start_numbers":  # the initial state belongs to the structure
            continue
        values = [float(value) for value in rows.split(",")]
        if not all(abs(value) in places for value in values):
            return
        tables[name] = [copysign(places[abs(value)], value) for value in values]
    record = json.dumps({"library": library.folder.name, "tables": tables, "straight": [*straight]})

    def write(folder: Path) -> None:
        (folder / _RECORD).write_text(record, encoding="utf-8")

    cache.put(structure.key, write)


def known_texts(builder: Builder, structure: Structure, program: Program) -> KnownTexts | None:
    """Return the texts of a structure with these constants, None if the cache has no library with them; without README
    if the notes are others.

    Parameters
    ----------
    program : as of ``structure_of``
    """
    cache = builder.cache
    entry = cache.get(structure.key)
    if entry is None:
        return None
    record = json.loads(entry.text(_RECORD))
    library = cache.get(record["library"])
    if library is None:
        cache.quarantine(structure.key)
        return None

    tables: list[tuple[Sequence[float], Sequence[float]]] = []

    def renewed(table: re.Match[str]) -> str:
        places = record["tables"].get(table[1])
        if places is None:
            return table[0]
        values = [copysign(structure.constants[abs(int(place)) - 1], place) for place in places]
        tables.append(([*map(float, table[2].split(","))], values))
        return table[0].replace(table[2], NumberTable(table[1], values).rows)

    layout = json.loads(library.text("layout.json"))
    endings = (".c", ".h", MANIFEST, *([".md"] if layout["notes"] == [*program.notes] else ()))
    texts = {name: library.text(name) for name in library.files if name.endswith(endings)}
    numbers = f"{layout['prefix']}_numbers.c"
    text = re.sub(_TABLE, renewed, texts[numbers])
    [earlier] = re.findall(_MARK, text)
    sources = {name: texts[name] for name in texts if not name.startswith("interface.")}
    mark = fingerprint({**sources, numbers: text.replace(earlier, "", 1)})
    texts |= {numbers: text.replace(earlier, mark), MANIFEST: texts[MANIFEST].replace(earlier, mark)}
    ordered = sorted(texts, key=lambda name: (name.endswith(".c"), name != numbers, name))
    files = {name: texts[name] for name in ordered}
    made = None
    if keeps_tables(builder.compiler):
        compiled = library.file(builder.binary).read_bytes()
        made = with_tables(compiled.replace(earlier.encode(), mark.encode()), tables)
    return KnownTexts(files, record["straight"], {**layout, "notes": program.notes}, made)
