"""Orders of all methods of the register on all groups: the measured ones of the page, and witnesses of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from eomgen.integrators.families.composition import SymplecticComposition
from eomgen.integrators.families.family import Family
from eomgen.integrators.families.register import BUILT_IN
from tests.integrators.orders.checks import CHECKS
from tests.integrators.orders.page import COMMAND, MEASURED, measured, names, page, refusals, slopes_of, written
from tests.integrators.orders.scenes import KINDS, Kind
from tests.integrators.orders.slopes import declared, made, slopes, subjects, tolerance_of
from tests.models.cache import shared_cache

__all__ = ["shared_cache"]

TESTS = Path(__file__).parents[1]
KNOWN = measured()


def holds(name: str, slope: float) -> bool:
    return abs(slope - declared(name)) <= tolerance_of(declared(name))


@pytest.mark.slow
@pytest.mark.long_cases("drivers", "loop, internal states, moving base", "tree, internal states")
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind.states or kind.driven], ids=lambda kind: kind.name)
def test_every_method_has_its_order_on_every_group(kind: Kind) -> None:
    """Three of the kinds of scenes, which have what the others have; the command measures all."""
    found, known = slopes_of(kind), KNOWN[kind.name]
    cells = {(name, group): slope for name, row in found.items() for group, slope in row.items()}
    assert {cell: slope for cell, slope in cells.items() if not holds(cell[0], slope)} == {}
    moved = {cell: slope for cell, slope in cells.items() if abs(slope - known[cell[0]][cell[1]]) >= 0.1}
    assert moved == {}, f"run: {COMMAND}"


@pytest.mark.slow
def test_every_method_that_runs_has_measured_slopes_which_are_those_declared() -> None:
    assert list(KNOWN) == [kind.name for kind in KINDS]
    for kind in KINDS:
        runs = [name for name, reason in refusals(kind).items() if not reason]
        assert list(KNOWN[kind.name]) == runs, f"{kind.name}; run: {COMMAND}"
        for name, row in KNOWN[kind.name].items():
            assert all(holds(name, slope) for slope in row.values()), name
    assert written(KNOWN) == MEASURED.read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_page_has_a_row_for_every_method() -> None:
    rows = {line.split("`")[1]: line.count("|") for line in page().splitlines() if line.startswith("| `")}
    assert tuple(rows) == names() and set(rows.values()) == {3 + len(KINDS)}


def test_the_checks_that_the_page_lists_are_there() -> None:
    for check in CHECKS:
        for one in check.tests:
            file, _, function = one.partition("::")
            assert f"\ndef {function}(" in (TESTS / file).read_text(encoding="utf-8"), one


@pytest.mark.long_except("taylor")
@pytest.mark.slow
@pytest.mark.parametrize(
    "family",  # compositions of drifts and kicks take none of these scenes
    [family for family in BUILT_IN if family is not SymplecticComposition],
    ids=lambda family: family.family,
)
def test_a_method_of_every_family_has_its_order_in_absolute_coordinates(family: type[Family]) -> None:
    """On a base that moves; where the method takes loops, on one of them with internal states."""
    name = family.names()[0].name
    method = made(name)
    assert isinstance(method, Family)
    tree, loop = (next(kind for kind in KINDS if kind.base and kind.closed is closed) for closed in (False, True))
    subject = subjects(tree if refusals(loop)[name] else loop)[1]
    missed = {key: slope for key, slope in slopes(name, subject).items() if not holds(name, slope)}
    assert missed == {}
