"""Every closed form of the covering examples agrees with differences, complex steps and second derivations."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from eomgen.products.studies.verification.differences import LADDER
from eomgen.studies import check
from tests.examples.covering import covering

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Of two that differ in the method alone, so not in their equations, one; of a net, whose matrices of 600 x 600 entries
#: are written on request only, none.
SCENES = covering(
    sorted(
        path.relative_to(EXAMPLES).as_posix()
        for path in EXAMPLES.glob("*/*.toml")
        if not path.stem.endswith("_index3") and path.parent.name != "cable_net"
    )
)
#: Of these only what differs from smaller scenes is checked here, for the time that compiling all of it takes.
LONG = {
    "misaligned_four_bar/scene.toml": ("constraint", "coupling", "energy", "inverse_dynamics", "partials", "jacobians"),
    "jerk_limited_arm/scene.toml": (
        "energy",
        "inverse_dynamics",
        "forward_dynamics",
        "rates",
        "partials",
        "linearization",
    ),
}


@pytest.mark.slow
@pytest.mark.long_except("gear_with_backlash/scene.toml")
@pytest.mark.parametrize("name", SCENES)
def test_every_closed_form_of_an_example_agrees(name: str) -> None:
    report = check(EXAMPLES / name, states=4, profile="quick", only=LONG.get(name, ()))
    assert report.passed, [(form.name, str(form.worst)) for form in report.failures]
    assert len(report.states) == 4 and not report.notes
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
    report = check(EXAMPLES / "quarter_car" / "scene.toml", states=2, profile="quick", only=("second_partials",))
    assert report.passed and [form.name for form in report.forms] == ["second_partials.Hd"]


@pytest.mark.long
def test_a_report_is_written_and_drawn(tmp_path: Path) -> None:
    report = check(
        EXAMPLES / "slider_crank_spatial" / "scene.toml", states=3, profile="quick", only=("constraint", "partials")
    )
    files = report.write(tmp_path / "new" / "folder")
    assert [path.name for path in files] == ["check.json", "check.csv", "check.png"]
    data = json.loads(files[0].read_text(encoding="utf-8"))
    assert data["passed"] and data["ladder"] == LADDER.tolist()
    assert [form["name"] for form in data["forms"]] == [form.name for form in report.forms]
    rows = list(csv.reader(files[1].read_text(encoding="utf-8").splitlines()))
    drawn = [form for form in report.forms if form.errors]
    assert rows[0] == ["step", *(form.name for form in drawn)] and len(rows) == 1 + len(LADDER)
    column = rows[0].index("partials.K")
    assert min(float(row[column]) for row in rows[1:]) == next(f.agreement for f in drawn if f.name == "partials.K")
    assert files[2].read_bytes().startswith(b"\x89PNG") and files[2].stat().st_size > 20_000
