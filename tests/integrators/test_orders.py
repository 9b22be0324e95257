"""Orders of all methods of the register on all groups: the measured ones of the page, and witnesses of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from eomgen.integrators.families.register import BUILT_IN
from tests.integrators.orders.checks import CHECKS
from tests.integrators.orders.page import COMMAND, MEASURED, measured, names, page, refusals, worst_slopes, written
from tests.integrators.orders.scenes import KINDS
from tests.integrators.orders.slopes import declared, tolerance_of

TESTS = Path(__file__).parents[1]
KNOWN = measured()
CASES = [
    (kind, name) for kind in ("tree, internal states", "loop, internal states, moving base") for name in KNOWN[kind]
]
#: Of each family, and of further ones with coefficients that others do not have.
FIRST = {family.names()[0].name for family in BUILT_IN} | {"lsrt2", "tdg1_star", "tdg2", "tdg2s", "tdg3"}


def holds(name: str, slope: float) -> bool:
    return abs(slope - declared(name)) <= tolerance_of(declared(name))


@pytest.mark.slow
@pytest.mark.long_except(*(f"{kind}-{name}" for kind, name in CASES if name in FIRST))
@pytest.mark.parametrize(("kind", "name"), CASES)
def test_a_method_has_its_order_on_every_group(kind: str, name: str) -> None:
    """On two of the kinds of scenes, which have what the others have but drivers; the command measures all."""
    found = worst_slopes(name, next(one for one in KINDS if one.name == kind))
    assert {group: slope for group, slope in found.items() if not holds(name, slope)} == {}
    assert found == pytest.approx(KNOWN[kind][name], abs=0.1), f"run: {COMMAND}"


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
