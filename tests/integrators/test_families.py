"""The register of families: every row is whole, and whoever needs a fact about a family asks its row."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import eomgen
from eomgen.base.files import template_folder
from eomgen.integrators.families.family import Sizes
from eomgen.integrators.families.register import BUILT_IN, family_named, method_named, method_names, row_of

PACKAGE = Path(eomgen.__file__).parent
SIZES = (Sizes(7, 6, 2, 1, 3, 0, 0), Sizes(14, 12, 0, 0, 0, 5, 3))
NAMES = sorted(set(method_names().values()) - {"trapezoidal_index3"})  # which is refused
INSTANCES = {name: method_named(name, alpha=0.1 if name.startswith("newmark") else None) for name in NAMES}


def test_families_and_names_are_found_by_the_register() -> None:
    assert len({family.family for family in BUILT_IN}) == len([*BUILT_IN])
    for family in BUILT_IN:
        assert family_named(family.family) is family
        for row in family.names():
            for name in (row.name, row.name.upper().replace("_", "-"), *row.aliases):
                assert row_of(name) == (family, row) or row_of(name)[1].name == row.name
    with pytest.raises(eomgen.UsageError, match="there is no family of methods 'magic'"):
        family_named("magic")


@pytest.mark.parametrize("family", [*BUILT_IN], ids=lambda family: family.family)
def test_a_family_has_its_templates(family) -> None:
    assert (template_folder() / "c" / "integrators" / family.family / "stepper.c.jinja").is_file()


@pytest.mark.parametrize(
    ("name", "sizes"),
    [
        (name, sizes)
        for name, method in INSTANCES.items()
        for sizes in SIZES
        if not sizes.lam or method.holds_constraints
    ],
)
def test_rows_of_a_method_fit_together(name: str, sizes: Sizes) -> None:
    method = INSTANCES[name]
    fields, settings = method.state(sizes), method.settings(sizes)
    names = ["t", "q", "v", "vdot", "lam", "z", "zdot", *(item.name for item in (*fields, *method.statistics(sizes)))]
    assert len(set(names)) == len(names)
    assert {item.group for item in fields} - {""} == dict(method.groups).keys()
    assert set(method.parameters) <= {item.name for item in settings}
    for item in settings:
        assert item.comment and (item.whole is None or item.whole[0] <= item.default <= item.whole[1])
    for angles in (False, True):
        statuses = method.statuses(sizes.lam > 0, angles)
        assert len({item.number for item in statuses} | {0}) == len({item.name for item in statuses}) + 1
        values = {"step": 1e-3, **{item.name: item.default for item in settings}}
        assert all(item.advice.format(**values) and item.text for item in statuses)
    again = method_named(name, **method.keywords)
    assert again.order == method.order
    assert {key: float(value) for key, value in again.parameters.items()} == pytest.approx(
        {key: float(value) for key, value in method.parameters.items()}, rel=1e-14
    )


def test_nobody_asks_which_family_it_is() -> None:
    asked = re.compile(
        r"\.family ?[=!]= ?[\"']|\[[\"']family[\"']\] ?[=!]=|\.family (not )?in"
        r" |startswith\(\(?\"(rk4|taylor|generalized)"
        r"|isinstance\([a-z_.]+, ?\(?(GeneralizedAlpha|RungeKutta|Taylor|Hermite|Partitioned)"
    )
    files = [*PACKAGE.rglob("*.py"), *template_folder().rglob("*.jinja")]
    assert [
        f"{file.name}: {line}" for file in files for line in file.read_text("utf-8").splitlines() if asked.search(line)
    ] == []
