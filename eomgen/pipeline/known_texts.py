"""Texts of a library that differs from an earlier one in numbers alone: a changed mass schedules and prints nothing.

Numbers of functions stand in a source of their own. Every other text follows from the operations of the functions, the
data of the stepper and the names, whose digest is the *structure* of a model. The cache has by structure the library
that was made first, and the constant of the tape of each entry in its tables.
"""

from __future__ import annotations

import hashlib
import json
import re
from array import array
from collections.abc import Mapping, Sequence
from math import copysign
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass, replace
from eomgen.base.version import __version__, checkout_stamp
from eomgen.codegen.convert import LONG
from eomgen.codegen.folder import MANIFEST
from eomgen.codegen.targets.c.printer import NumberTable, stays_in_text
from eomgen.codegen.targets.c.target import fingerprint

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.symbolic.tape import Tape
    from eomgen.system.system import System
    from eomgen.toolchain.cache import Cache
    from eomgen.toolchain.library import Library

_RECORD = "tables.json"
#: A table in C: name of the array, and its rows.
_TABLE = r"(?s)const double (\w+)\[\d+\] = \{\n(.*?) \};"
_MARK = r'(?<=fingerprint\[\] = ")\w+'


@dataclass(frozen=True)
class KnownTexts:
    """Texts of all files of a library by name, headers first and then the numbers, which alone are compiled; names of
    the sources without branches; and the layout of the earlier library."""

    files: Mapping[str, str]
    straight: Sequence[str]
    layout: Mapping[str, Any]


def structure_of(system: System, program: Program) -> str:
    """Return the digest of everything that decides the texts but for the values of constants; empty for a System whose
    texts have further numbers: with loops, curves, C of the scene, samples, or shared stretches of long functions.

    Parameters
    ----------
    program : of the System, without statements
    """
    tape, constants = system.tape, system.tape.constants[1:]
    several = tape.maps or tape.curves or program.sources or program.series or system.sample is not None
    if several or 2 * len(tape.op) >= LONG or len({*constants}) < len(constants):
        return ""
    recorded = {
        "constants": [value if stays_in_text(value) else None for value in constants],
        "functions": [[name, function.refs] for name, function in system.functions.items()],
        "tape": [tape.inputs, tape.blocks, [*tape.names.items()], tape.reciprocals],
        "program": vars(replace(program, constants=())),  # names of numbers stand in no text of a library
        "code": [__version__, checkout_stamp()],
    }
    digest = hashlib.sha256(json.dumps(recorded, default=_plain).encode())
    for column in (tape.op, tape.a, tape.b, tape.c):
        digest.update(array("q", column))
    return hashlib.sha256(b"structure\0" + digest.digest()).hexdigest()


def _plain(value: Any) -> Any:
    return vars(value) if hasattr(value, "__dict__") else dict(value)


def keep_texts(cache: Cache, structure: str, tape: Tape, library: Library, straight: Sequence[str]) -> None:
    """Keep which library has the texts of a structure, unless a number of a function is no constant of the tape.

    Parameters
    ----------
    straight : names of the sources without branches
    """
    prefix = library.layout["prefix"]
    places = {value: place for place, value in enumerate(tape.constants)}
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

    cache.put(structure, write)


def known_texts(cache: Cache, structure: str, tape: Tape) -> KnownTexts | None:
    """Return the texts of a structure with the constants of this tape, None if the cache has no library with them."""
    entry = cache.get(structure)
    if entry is None:
        return None
    record = json.loads(entry.text(_RECORD))
    library = cache.get(record["library"])
    if library is None:
        cache.quarantine(structure)
        return None

    def renewed(table: re.Match[str]) -> str:
        places = record["tables"].get(table[1])
        if places is None:
            return table[0]
        values = [copysign(tape.constants[abs(int(place))], place) for place in places]
        return table[0].replace(table[2], NumberTable(table[1], values).rows)

    texts = {name: library.text(name) for name in library.files if name.endswith((".c", ".h", ".md", MANIFEST))}
    layout = json.loads(library.text("layout.json"))
    numbers = f"{layout['prefix']}_numbers.c"
    text = re.sub(_TABLE, renewed, texts[numbers])
    [earlier] = re.findall(_MARK, text)
    sources = {name: texts[name] for name in texts if not name.startswith("interface.")}
    mark = fingerprint({**sources, numbers: text.replace(earlier, "", 1)})
    texts |= {numbers: text.replace(earlier, mark), MANIFEST: texts[MANIFEST].replace(earlier, mark)}
    ordered = sorted(texts, key=lambda name: (name.endswith(".c"), name != numbers, name))
    return KnownTexts({name: texts[name] for name in ordered}, record["straight"], layout)
