"""How each element and attribute of SDF is taken: a table by element, from ``coverage.txt``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from eomgen.products.robots.leftovers import IDLE, NOTED, READ, REFUSED, read_table

#: Meaning of each status.
MEANINGS: Mapping[str, str] = {
    READ: "takes part in the equations, the names, the start or the pictures",
    IDLE: "pictures, contact, sound, or the numbers of solvers: no part of the equations; counted in a note",
    NOTED: "left out with a note if it would act; refused with `--strict`",
    REFUSED: "refused with file and line if it would act",
}
#: Status by child or attribute, of each element.
STATUSES: Mapping[str, Mapping[str, str]] = read_table(Path(__file__).with_name("coverage.txt"))
