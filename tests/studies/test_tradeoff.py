"""Speed against accuracy: points, front, slopes, files, going on, the axes of scenes, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.products.studies.work_precision.axes import AXES, Configuration
from eomgen.products.studies.work_precision.formulations import formulations
from eomgen.products.studies.work_precision.observation import errors
from eomgen.products.studies.work_precision.result import Point, _groups
from eomgen.products.studies.work_precision.running import Grid, Runner
from tests.models.scenes import SWING

STEPS = (0.02, 0.01, 0.005, 0.0025)


def test_curves_are_ranked_by_their_cost_of_the_demands() -> None:
    """The cheapest of each method for the smallest demand comes first, then the others."""

    def point(method: str, key: str, seconds: float | None, error: float) -> Any:
        return SimpleNamespace(configuration=SimpleNamespace(method=method, key=key), seconds=seconds, error=error)

    points = [
        point("rough", "rough", 1e-3, 0.5), point("two", "two", 9.0, 1e-9), point("one", "dear", 2.0, 1e-9),
        point("one", "cheap", 1.0, 1e-9), point("two", "two", 3.0, 1e-5), point("untimed", "untimed", None, 1e-9),
        point("third", "third", 5.0, 1e-5),
    ]  # fmt: skip  # a table
    for order in (points, points[::-1]):
        study = SimpleNamespace(usable=order, error=lambda one: one.error)
        groups = _groups(cast(eomgen.Tradeoff, study))
        keys = [members[0].configuration.key for members in groups]
        assert keys[:3] == ["cheap", "two", "third"] and set(keys[3:5]) == {"rough", "untimed"} and keys[5] == "dear"
        assert sorted(map(id, (one for members in groups for one in members))) == sorted(map(id, points))


def test_help_names_the_axes_that_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tradeoff", "--help"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert ", ".join(AXES) in printed


@pytest.mark.slow
def test_errors_are_those_of_runs_made_by_hand() -> None:
    methods = ["rk4", "generalized_alpha", "taylor"]
    axes = ["formulation", "method", "resolution", "arithmetic"]
    study = eomgen.tradeoff(SWING, outputs=["angle"], methods=methods, steps=STEPS, repeats=3, axes=axes)
    model = eomgen.build(SWING)
    exact = model.simulate(1.28, 0.02, method="taylor", tolerance=1e-15)
    coarse = model.simulate(1.28, 0.01, method="rk4", record_every=2)
    largest = np.abs(coarse.outputs["angle"] - exact.outputs["angle"]).max() / np.ptp(exact.outputs["angle"])
    point = next(
        p
        for p in study.points
        if p.configuration.method == "rk4" and p.value == 0.01 and p.configuration.real == "double"
    )
    assert point.error["angle"].largest == pytest.approx(largest, rel=1e-3)  # the range is known at rows


@pytest.mark.slow
def test_formulations_of_a_loop_begin_in_one_state() -> None:
    path = Path(__file__).resolve().parents[2] / "examples" / "four_bar" / "scene.toml"
    runner = Runner(formulations(path, {}, others=True), Grid(0.02, 10))
    runs = {name: runner.run(Configuration(name, "rk4_partitioned"), 40).observation for name in ("joint", "SE3")}
    assert errors(runs["SE3"], runs["joint"])["state"].largest < 1e-6


@pytest.mark.slow_cases("options1-outputs: the scene has no output 'angel'; try: angle")
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"axes": ["formulations"]}, "axes: there is no axis 'formulations'; try: formulation"),
        ({"outputs": ["angel"]}, "outputs: the scene has no output 'angel'; try: angle"),
        ({"measure": "mean"}, "measure: there is no measure 'mean'; try: one of largest, rms, final"),
        ({"methods": ["rk5"]}, "method: there is no method 'rk5'; try: rk4"),
        ({"methods": ["rk4_partitioned"]}, "methods: no method runs on this scene: partitioned needs a system with"),
        ({"budget": "120"}, "budget: '120' is neither a number nor a number with a unit"),
        ({"budget": -1.0}, "budget: a study takes a positive number of seconds, not -1; try: budget=60"),
        ({"steps": [0.02, 0.015]}, "steps: the step 0.015 s is not a whole part of the coarsest, 0.02 s; try: 0.01"),
        ({"steps": [0.02, -1.0]}, "steps: steps are positive numbers of seconds, which -1 is not; try: 1e-3"),
        ({"steps": [3.0]}, "steps: the coarsest step, 3 s, does not fit into a run of 1.28 s; try: smaller steps"),
        ({"t_end": 0.0}, "steps: the coarsest step, 0.01 s, does not fit into a run of 0 s; try: smaller steps"),
        ({"inputs": {"zz": 1.0}}, "there is no input 'zz': the scene has no inputs; try: [inputs] in the scene"),
        ({"parameters": {"length": 1.0}}, "there is no parameter 'length': the scene has no tunable parameters"),
    ],
)
def test_mistakes_are_named(options: dict[str, Any], message: str) -> None:
    with pytest.raises(eomgen.EomgenError, match=re.escape(message)):
        eomgen.tradeoff(SWING, **options)


@pytest.mark.parametrize("name", ["budget", "limit"])
def test_maps_and_tunings_take_positive_seconds(name: str) -> None:
    call = {
        "budget": lambda: eomgen.tune(SWING, error=1e-4, budget=0.0),
        "limit": lambda: eomgen.extremes(SWING, limit=0.0),
    }
    with pytest.raises(eomgen.UsageError, match=f"{name}: a study takes a positive number of seconds, not 0"):
        call[name]()


def test_an_error_by_an_unknown_measure_is_refused() -> None:
    with pytest.raises(eomgen.UsageError, match="measure: there is no measure 'mean'; try: one of largest, rms, final"):
        Point.error_of(cast(Any, None), "q", "mean")
