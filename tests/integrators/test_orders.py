"""Orders of all methods of the register on all groups: the page docs/orders.md, measured; and witnesses of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from eomgen.integrators.families.composition import SymplecticComposition
from eomgen.integrators.families.family import Family
from eomgen.integrators.families.register import BUILT_IN
from tests.integrators.orders.checks import CHECKS
from tests.integrators.orders.page import COMMAND, PAGE, Cell, cells, names, page, read, refusals
from tests.integrators.orders.scenes import KINDS, MECHANISMS, Kind
from tests.integrators.orders.slopes import declared, made, slopes, subjects, tolerance_of
from tests.models.cache import shared_cache

__all__ = ["shared_cache"]

TESTS = Path(__file__).parents[1]
ON_PAGE = read(PAGE.read_text(encoding="utf-8"))


def holds(name: str, slope: float) -> bool:
    return abs(slope - declared(name)) <= tolerance_of(declared(name))


def same(one: Cell, other: Cell) -> bool:
    """Return whether cells are the same but for what rounding makes of slopes."""
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    return one.keys() == other.keys() and all(abs(one[group] - other[group]) < 0.1 for group in one)


@pytest.mark.slow
@pytest.mark.long_cases("drivers", "loop, internal states, moving base", "tree, internal states")
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind.states or kind.driven], ids=lambda kind: kind.name)
def test_every_method_has_its_order_on_every_group(kind: Kind) -> None:
    """Three of the kinds of scenes, which have what the others have; the command measures all."""
    found = cells(kind)
    missed = {
        (name, group): slope
        for name, cell in found.items() if not isinstance(cell, str)
        for group, slope in cell.items() if not holds(name, slope)
    }  # fmt: skip  # two loops
    assert missed == {}
    old = ON_PAGE[kind.name]
    assert {name: cell for name, cell in found.items() if not same(cell, old[name])} == {}, f"run: {COMMAND}"


def test_the_page_has_a_row_for_every_method_and_its_slopes_are_those_declared() -> None:
    assert list(ON_PAGE) == [kind.name for kind in KINDS]
    for kind in KINDS:
        column = ON_PAGE[kind.name]
        assert tuple(column) == names()
        for name, reason in refusals(kind).items():
            cell = column[name]
            if reason or isinstance(cell, str):
                assert cell == reason, f"{name}, {kind.name}; run: {COMMAND}"
            else:
                assert list(cell) == list(MECHANISMS)
                assert all(holds(name, slope) for slope in cell.values()), name
    assert page(ON_PAGE) == PAGE.read_text(encoding="utf-8"), f"run: {COMMAND}"


def test_the_checks_that_the_page_lists_are_there() -> None:
    for check in CHECKS:
        for one in check.tests:
            file, _, function = one.partition("::")
            assert f"\ndef {function}(" in (TESTS / file).read_text(encoding="utf-8"), one


@pytest.mark.slow
@pytest.mark.long_cases("adaptive_generalized_alpha", "generalized_alpha", "rosenbrock", "runge_kutta")
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
