"""Scenes with tunable factors: quantities of formulas in the scene's own units."""

from __future__ import annotations

import pytest

from eomgen.products.studies.ladders.scaling import LENGTH, TIME, with_factors
from eomgen.scene.formula.parser import with_other_quantities


@pytest.mark.parametrize(
    ("formula", "marked"),
    [
        ("2*q.hinge - sin(t)", "2*<q.hinge> - sin(<t>)"),
        ("q . ball [2] + position.tip[0]", "<q . ball [2]> + <position.tip[0]>"),
        ("tau.elbow(v.elbow) if x > 0 else -t", "tau.elbow(<v.elbow>) if <x> > 0 else -<t>"),
        (" x**2 ", " <x>**2 "),
        ("t1*t", "<t1>*<t>"),
        ("2 kg", "2 kg"),
        ("(t", "(t"),
    ],
)
def test_quantities_of_a_formula_get_another_text(formula: str, marked: str) -> None:
    assert with_other_quantities(formula, lambda text, *_: f"<{text}>") == marked


def test_a_law_of_time_and_travel_is_evaluated_in_its_own_units() -> None:
    scene = {
        "joints": {"slide": {"type": "prismatic"}},
        "efforts": {"pull": {"joint": "slide", "effort": "3*sin(2*t) - 5*q.slide"}},
    }
    scaled = with_factors(scene, (LENGTH, TIME))
    law = f"3*sin(2*(t / ({TIME}))) - 5*(q.slide / ({LENGTH}))"
    assert scaled["efforts"]["pull"]["effort"] == f"({LENGTH} * {TIME}**(-2)) * ({law})"
