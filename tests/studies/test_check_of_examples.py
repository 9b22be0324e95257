"""Every closed form of examples agrees with differences, complex steps and second derivations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from eomgen.studies import check
from tests.examples.covering import features

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Sections whose types, groups and coordinates choose equations.
MECHANICS = ("base", "beams", "bodies", "constraints", "coordinates", "events", "forces", "joints", "springs", "tyres")


def choices(name: str) -> set[str]:
    """Return the choices of an example that its closed forms depend on, and the sections that it has of these."""
    words = {word for word in features(name) if word.partition(".")[0] in MECHANICS}
    return {word for word in words if "=" in word or "." not in word}


def scenes() -> list[str]:
    """Return few examples with all choices; of a net, whose matrices are written on request only, none."""
    names = sorted(path.relative_to(EXAMPLES).as_posix() for path in EXAMPLES.glob("*/*.toml"))
    of = {name: choices(name) for name in names if not name.endswith("_index3.toml") and "cable_net" not in name}
    taken, missing = list[str](), set[str]().union(*of.values())
    while missing:
        taken.append(max(of, key=lambda name: (len(of[name] & missing), -len(features(name)))))
        missing -= of[taken[-1]]
    return taken


@pytest.mark.slow
@pytest.mark.long_except(
    *(f"{name}/scene.toml" for name in ("gear_with_backlash", "quarter_car_on_bump", "spin_up_beam", "bouncing_ball"))
)
@pytest.mark.parametrize("name", ["gear_with_backlash/scene.toml", *scenes()])
def test_every_closed_form_of_an_example_agrees(name: str) -> None:
    report = check(EXAMPLES / name, states=2, profile="quick")
    assert report.passed, [(form.name, str(form.worst)) for form in report.failures]
    assert len(report.states) == 2 and not report.notes
    by_complex_step = [form.complex_step for form in report.forms if form.complex_step is not None]
    by_differences = [form.agreement for form in report.forms if form.agreement is not None]
    # corners of a bump move with its parameters, and differences step over them
    smooth = [form.agreement for form in report.forms if form.agreement is not None and form.family != "parameters"]
    slopes = [form.slope for form in report.forms if form.slope is not None]
    # second derivatives of a drive at 150 rad/s cancel terms of 150^3, whose rounding the verdict counts
    first = [form.complex_step or 0.0 for form in report.forms if not form.name.endswith("_hessian")]
    assert len(by_complex_step) >= 6 and max(first) < 2e-12
    assert len(by_differences) == len(by_complex_step) and max(smooth) < 1e-5
    assert not slopes or abs(np.median(slopes) - 2.0) < 0.05  # less smooth tables have other slopes


@pytest.mark.slow
def test_second_derivatives_alone_bring_the_first_ones_that_they_are_held_to() -> None:
    report = check(EXAMPLES / "quarter_car" / "scene.toml", states=2, profile="instant", only=("second_partials",))
    assert report.passed and [form.name for form in report.forms] == ["second_partials.Hd"]
