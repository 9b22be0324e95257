"""Cases of tests in text files beside them: a paragraph for each case, with an arrow before each further field."""

from __future__ import annotations

import re
from pathlib import Path

from eomgen.products.robots.leftovers import IDLE, NOTED, READ, REFUSED

#: Meaning of each status in the tables of formats.
MEANINGS = {
    READ: "takes part in the equations, the names, the start or the pictures",
    IDLE: "pictures, contact, sound, memory, the numbers of solvers, or data of the user: no part of the equations",
    NOTED: "left out with a note if it would act; refused with `--strict`",
    REFUSED: "refused with its line if it would act",
}


def table(name: str) -> list[tuple[str, ...]]:
    """Return the fields of each case of a file; a line within a field is ended by ``\\n``."""
    text = Path(__file__).with_name(f"{name}.txt").read_text(encoding="utf-8")
    return [tuple(re.split("\n-> ?", case.replace("\\n", "\n"))) for case in text.strip("\n").split("\n\n")]
