"""Structures of models: a model that differs from an earlier one in numbers alone has its library, with other numbers.

The texts of a library follow from the operations of the functions, the data of the stepper and the names, whose digest
is the *structure* of a model; the loader of the library hands the numbers of the functions over. The cache has by
structure the library that was made first, and the constant of the tape for each number of that library.

Numbers that stay in the text (``stays_in_text``) are in the digest, and two numbers that become equal are one
constant of the tape. Models with such changes miss the structure; they may still find all of their objects.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from math import copysign
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.data import dataclass, replace
from eomgen.base.version import __version__, checkout_stamp
from eomgen.codegen.targets.c.printer import stays_in_text
from eomgen.symbolic.operations import Op
from eomgen.toolchain.tables import fingerprints_and_numbers, packed_tables, tables_in

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.system.system import System
    from eomgen.toolchain.builder import Builder
    from eomgen.toolchain.cache import Entry
    from eomgen.toolchain.library import Library

_RECORD = "structure.json"


@dataclass(frozen=True)
class KnownLibrary:
    """A library of the cache with the structure of a model, the layout but for notes, and tables of the model."""

    entry: Entry
    layout: Mapping[str, Any]
    tables: bytes


@dataclass(frozen=True)
class Structure:
    """The part of a model on which the texts of a library depend, as a digest, and the numbers. The numbers are the
    constants of the functions in the order of the tape, and the initial state by name of the field."""

    digest: bytes
    constants: Sequence[float]
    initial: Mapping[str, Sequence[float]]


def structure_of(system: System, functions: Sequence[str], program: Program, family: str) -> Structure | None:
    """Return the structure of a System for the given functions.

    None for a System whose texts have further numbers, as of loops, curves, series or C of the scene; for a short scene
    in place of a longer one; and for equal constants, as generic ones of ``mechanics/tree/alike`` may be.

    Parameters
    ----------
    functions : of the model
    program : of these functions, without statements
    family : digest of the method's code and templates, if it is of another distribution
    """
    tape = system.tape
    if tape.maps or tape.curves or program.sources or program.series or system.sample.parts:
        return None
    results = [np.array(system.functions[name].refs, int) for name in functions]
    live = np.array(tape.live(np.concatenate(results).tolist()))
    op, places = np.array(tape.op)[live], np.zeros(len(tape.op), int)
    places[live] = np.arange(1, len(live) + 1)
    nodes = live[op == Op.CONST].tolist()
    constants = [tape.constants[tape.a[node]] for node in nodes]
    divisors = {*np.abs(np.array(tape.b)[live[op == Op.DIV]]).tolist()}
    if len({*constants}) < len(constants):
        return None

    def new_refs(refs: Any) -> Any:
        return np.sign(refs) * places[np.abs(refs)]

    leaves = (op == Op.CONST) | (op == Op.INPUT)
    operands = [np.where(leaves, 0, new_refs(np.array(column)[live])) for column in (tape.a, tape.b, tape.c)]
    initial = {name: getattr(program, name) for name in ("initial_q", "initial_v", "initial_z")}
    recorded = {
        "constants": [
            value if stays_in_text(value, divides=node in divisors) else None
            for node, value in zip(nodes, constants, strict=True)
        ],
        "inputs": [tape.inputs[tape.a[node]] for node in live[op == Op.INPUT].tolist()],
        "functions": [functions, *(new_refs(refs).tolist() for refs in results)],
        "blocks": [[int(np.searchsorted(live, node)), label] for node, label in tape.blocks],
        "names": [[int(places[node]), name] for node, name in tape.names.items() if places[node]],
        "program": vars(replace(program, constants=(), notes=(), initial_q=(), initial_v=(), initial_z=())),
        "code": [__version__, checkout_stamp(), tape.reciprocals, family],
    }
    digest = hashlib.sha256(b"structure\0" + json.dumps(recorded, default=_plain).encode())
    for column in (op, *operands):
        digest.update(column.tobytes())
    # constant number n + 1 of n is 1.0, for signs in tables of shared stretches
    return Structure(digest.digest(), [*constants, 1.0], initial)


def _write(folder: Path, record: str) -> None:
    (folder / _RECORD).write_text(record, encoding="utf-8")


def _plain(value: Any) -> Any:
    return vars(value) if hasattr(value, "__dict__") else dict(value)


def keep_structure(builder: Builder, structure: Structure | None, library: Library) -> Library:
    """Record in the cache that a library has a structure, and return the library. There is no record without a
    structure, or if a number of a function is none of its constants."""
    if structure is None:
        return library
    places = {value: index for index, value in enumerate(structure.constants, 1)}
    _, _, numbers = fingerprints_and_numbers(tables_in(library.folder))
    numbers.pop(f"{library.layout['prefix']}_start_numbers", None)  # defaults, and the initial state
    if all(abs(value) in places for row in numbers.values() for value in row):
        taken = {name: [copysign(places[abs(value)], value) for value in row] for name, row in numbers.items()}
        record = json.dumps({"library": library.folder.name, "places": taken})
        builder.cache.put(builder.key(structure.digest), lambda folder: _write(folder, record))
    return library


def known_library(builder: Builder, structure: Structure | None) -> KnownLibrary | None:
    """Return the library of the cache with a structure, with the tables of this structure's constants and initial
    state. None if the cache has none, or without a structure."""
    if structure is None or (entry := builder.cache.get(key := builder.key(structure.digest))) is None:
        return None
    record = json.loads(entry.text(_RECORD))
    if (library := builder.cache.get(record["library"])) is None:
        builder.cache.remove(key)
        return None
    layout = json.loads(library.text("layout.json")) | structure.initial
    layout.pop("digest", None)  # of a library in two with other numbers
    _, texts, numbers = fingerprints_and_numbers(tables_in(library.folder))
    if start := [value for part in structure.initial.values() for value in part]:
        numbers[f"{layout['prefix']}_start_numbers"][-len(start) :] = start
    for name, places in record["places"].items():
        numbers[name] = [copysign(structure.constants[abs(int(index)) - 1], index) for index in places]
    return KnownLibrary(library, layout, packed_tables(texts, numbers))
