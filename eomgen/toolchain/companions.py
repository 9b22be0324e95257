"""The text of a companion of a library: one function of the model for batches in lanes, with parts kept apart from
inlining.

The model's own text is compiled a second time with ``real`` as vectors. A companion has one function, since a vector's
compiler takes as long for each function as for a number's, and a large batch asks for one: all files stand in one, in
which the other functions are declared static first, and a compiler drops static functions that are not called.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

#: The file that a companion is compiled from.
SOURCE = "lanes.c"
_APART = "__attribute__((noinline)) "
_DECLARED = re.compile(r"^void (\w+)\(", re.MULTILINE)


def companion_files(folder: Path, layout: Mapping[str, Any], function: str) -> dict[str, str]:
    """Return the files of the companion with one function of the library in a folder: headers, and ``lanes.c``.

    Raises
    ------
    OSError, UnicodeError
        The library's sources cannot be read.
    """
    prefix = str(layout["prefix"])
    number = [item["name"] for item in layout["functions"]].index(function)
    headers = {path.name: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.h"))}
    own = re.compile(rf"{re.escape(prefix)}(_\d+|_curves|_numbers|_tables)?\.c")
    sources = [path for path in sorted(folder.glob("*.c")) if own.fullmatch(path.name)]
    texts = [path.read_text(encoding="utf-8") for path in (*sources, folder / "interface.c")]
    # no prototypes: the types of the arguments are declared later, and the prototypes that follow fit to these
    declared = {name for text in headers.values() for name in _DECLARED.findall(text) if name.startswith(f"{prefix}_")}
    # functions in separate files stay apart here, too, since products are fused with sums within a function
    apart = _DECLARED.findall(headers.get(f"{prefix}_parts.h", ""))
    head = [
        f"/* {SOURCE}: {function} of the model {prefix}, a sample in each lane. */",
        f"#define EOMGEN_ONLY_FUNCTION {number}",
        *(f"static {_APART if name in apart else ''}void {name}();" for name in sorted(declared)),
        "",
    ]
    return {**headers, SOURCE: "\n".join([*head, *texts])}
