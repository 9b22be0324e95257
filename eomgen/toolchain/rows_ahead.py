"""Fetches of rows in the C of lanes: between the statements for a block of samples, memory is fetched ahead for the
next samples' inputs and the present samples' outputs, a cache line after every few statements.

Rows are read and written at once at the ends of a block, between two computations, and a processor waits for few lines
at a time. Fetches at the beginning of a function wait as long as the reads would; between the statements the memory
works while the processor does.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

#: Pointers before the first block, see ``templates/c/interface/rows.c.jinja``.
_POINTERS = 16
#: The pointers are volatile, since compilers move fetches without reads to one place.
_TABLE = "const char *const volatile *"
_ROW = r"rows\[(\d+)\] = \(const char \*\)\((input|output)s\[(\d+)\]"
_ARGUMENT = r"real \*(?:restrict )?(\w+)"
_STATEMENT = re.compile(r"    (?:const real |\w+\[\d+\] = ).*;")
#: Macros of the fetches; lines of a cache have 64 bytes.
MACROS = (
    "/* Fetch the rows of 64 bytes of a block, the k-th: of an input of the next samples, to read, or of an output of"
    " the present samples, to write. */",
    "#define EG_FETCH_LINE(k, row, to_write) \\",
    "    do { \\",
    "        if ((k) * EG_LANES % 8 == 0) \\",
    "            __builtin_prefetch((row) + (k) * EG_LANES * 8, to_write); \\",
    "    } while (0)",
    "#define EG_FETCH(k, row) EG_FETCH_LINE(k, row, 0)",
    "#define EG_CLAIM(k, row) EG_FETCH_LINE(k, row, 1)",
)


def with_fetches(texts: list[str], interface: str, function: Mapping[str, Any], prefix: str) -> list[str]:
    """Return the texts of a model's sources with fetches of memory in one function and the parts.

    Unchanged if the function has few rows, or too few statements.

    Parameters
    ----------
    texts : without the interface.
    interface : the text that copies rows into blocks.
    function : from the layout of the library.
    prefix : of the model's functions.
    """
    name = re.escape(f"{prefix}_{function['name']}")
    head = rf"(?:static )?(?:EG_NOINLINE )?void {name}(?:_part\d+)?\(([^)]*)\)\n\{{\n"
    body = re.compile(rf"(?ms)^({head})(.*?)^\}}")
    bodies = [match for text in texts for match in body.finditer(text)]
    places = [k for match in bodies for k in _places(match[3].split("\n"))]
    fetches = _fetches(interface, function)
    # fewer rows are fetched early enough by the processor itself
    if not 64 <= len(fetches) <= 2 * len(places):
        return texts
    blocks = _blocks(interface, function)
    begun = 0

    def insert_fetches(match: re.Match[str]) -> str:
        nonlocal begun
        lines = match[3].split("\n")
        line_numbers = _places(lines)
        block = next((block for block in re.findall(_ARGUMENT, match[2]) if block in blocks), None)
        for number, line_number in enumerate(line_numbers, begun):
            taken = fetches[_share(number, len(places), len(fetches)) : _share(number + 1, len(places), len(fetches))]
            if block is not None and taken:
                lines[line_number] += "\n" + "\n".join(f"    {fetch};" for fetch in taken)
        begun += len(line_numbers)
        if block is not None and line_numbers:
            rows = f"({_TABLE})((const double *)({block} - {blocks[block]}) - {_POINTERS})"
            lines.insert(0, f"    {_TABLE}const rows = {rows};")
        return match[1] + "\n".join(lines) + "}"

    return [body.sub(insert_fetches, text) for text in texts]


def _share(number: int, places: int, fetches: int) -> int:
    """Return the number of fetches before a place."""
    return number * fetches // places


def _places(lines: list[str]) -> list[int]:
    return [k for k, line in enumerate(lines) if _STATEMENT.fullmatch(line)]


def _rows(interface: str, function: Mapping[str, Any]) -> list[tuple[int, str, int]]:
    """Return (number, ``input`` or ``output``, length) of each row that a function's interface copies, in order."""
    call = interface.partition(f"static int call_{function['name']}(")[2].partition("\n}\n")[0]
    lengths = {"input": function["input_sizes"], "output": [output["size"] for output in function["outputs"]]}
    return [(int(row), kind, int(lengths[kind][int(number)])) for row, kind, number in re.findall(_ROW, call)]


def _fetches(interface: str, function: Mapping[str, Any]) -> list[str]:
    verbs = {"input": "EG_FETCH", "output": "EG_CLAIM"}
    return [
        f"{verbs[kind]}({k}, rows[{row}])" for row, kind, length in _rows(interface, function) for k in range(length)
    ]


def _blocks(interface: str, function: Mapping[str, Any]) -> dict[str, int]:
    """Return each block's distance from the first block of a function, in numbers of a sample, by argument."""
    names = [name for name in function["inputs"] if name not in ("p", "t", "base")]
    names += [output["argument"] for output in function["outputs"]]
    begins, begun = {}, 0
    for name, (_, _, length) in zip(names, _rows(interface, function), strict=True):
        begins[name] = begun
        begun += length
    return begins
