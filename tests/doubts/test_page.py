"""The page of doubts lists every row with its limits, and no threshold of the product is without a row."""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from docs.site.doubts import page
from eomgen.base.limits import Limit
from eomgen.base.products import rows_of
from eomgen.compiled.rest.state_warnings import GROUP, StateWarning
from eomgen.products import doubts
from eomgen.scene.document.notes import every_note
from eomgen.simulation.judgement.register import CHECKS

ROWS = (*every_note(), *rows_of(GROUP, StateWarning), *CHECKS)


def test_every_limit_of_the_product_belongs_to_a_row() -> None:
    listed = {id(limit) for row in ROWS for limit in row.limits}
    for module in iter_modules(doubts.__path__, f"{doubts.__name__}."):
        for name, value in vars(import_module(module.name)).items():
            assert not isinstance(value, Limit) or id(value) in listed, f"{module.name}.{name} is in no row"


def test_names_of_doubts_are_unique() -> None:
    names = [row.name for row in ROWS]
    assert len(names) == len(set(names))


def test_the_page_lists_every_doubt_with_its_limits() -> None:
    lines = page().splitlines()
    for row in ROWS:
        assert sum(line.startswith(f"| `{row.name}` |") for line in lines) == max(1, len(row.limits))
        for limit in row.limits:
            assert limit.unit and limit.source and any(limit.meaning in line for line in lines)
