"""tune: demands are met on runs that were not tuned on, by what a sweep finds best; files, real time, mistakes."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.products.studies.tuning import race
from eomgen.products.studies.tuning.race import MARGIN, Contender, RaceRun
from eomgen.products.studies.tuning.result import with_settings
from eomgen.products.studies.work_precision.axes import candidates
from eomgen.products.studies.work_precision.running import Grid, ladder_grid, tuning_grid, whole_steps
from tests.models.scenes import SWING
from tests.models.toml_text import toml_text
from tests.studies.runs_of_laws import model_of

SCENE = """\
format = 1
name = "swing" # a pendulum

[bodies.rod]
mass = 1.0
center_of_mass = [0, 0, -0.5]

[joints.pin]
type = "revolute"
parent = "base"
child = "rod"
axis = [0, 1, 0]
initial = { position = 1.0 }

[simulation] # as fine as it was thought to need
step = 1e-3 # s
rho_inf = 0.9
duration = 1.28

[outputs]
angle = { formula = "q.pin", unit = "rad" }
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("tuning") / "swing.toml"
    file.write_text(SCENE)
    return file


@pytest.fixture(scope="module")
def tuned(path: Path) -> eomgen.Tuned:
    found = eomgen.tune(path, 1e-4, output="angle", methods=["generalized_alpha", "rk4"], formulated=False)
    return found


SCENE_DATA = tomllib.loads(SCENE)


@pytest.mark.slow
def test_the_scene_is_written_with_its_comments(tuned: eomgen.Tuned, tmp_path: Path) -> None:
    """Comments of the file and of its sections stay."""
    text = tuned.save(tmp_path / "tuned.toml").read_text()
    assert "# a pendulum" in text
    assert "# as fine as it was thought to need" in text
    assert tomllib.loads(text)["simulation"]["duration"] == 1.28
    simulation = eomgen.load(tmp_path / "tuned.toml").simulation
    assert simulation.method == tuned.configuration.method
    assert simulation.step == tuned.simulation["step"]
    others = {key: value for key, value in tomllib.loads(text).items() if key != "simulation"}
    assert others == {key: value for key, value in SCENE_DATA.items() if key != "simulation"}


def test_a_comment_beside_a_replaced_value_is_dropped(tmp_path: Path) -> None:
    """It may be false of the new value; beside a value that stays it is kept."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.replace("rho_inf = 0.9", 'method = "auto"   # chosen before each run'), encoding="utf-8")
    kept, replaced = (with_settings(path, {"method": name}, "joint", "SE3") for name in ("auto", "rk4"))
    assert "# chosen before each run" in kept and "# chosen before each run" not in replaced


#: A quarter car whose strut meets its stop for some 10 ms: peaks of the ride that are 1 ms wide.
STOPPED: dict[str, Any] = {
    "format": 1, "name": "quarter_car_with_stop",
    "inputs": {"road": {"road": {"bump": {"length": 1, "height": 0.08, "position": 2}, "speed": 5}, "unit": "m"}},
    "bodies": {"wheel": {"mass": 40.0}, "body": {"mass": 320.0}},
    "joints": {
        "hop": {"type": "prismatic", "parent": "base", "child": "wheel", "axis": [0, 0, 1]},
        "strut": {
            "type": "prismatic", "parent": "wheel", "child": "body", "axis": [0, 0, 1],
            "stiffness": 18000.0, "rest": "320 * 9.81 / 18000", "damping": 1200.0,
            "limits": {"lower": -0.03, "upper": 0.03, "stiffness": 2e5, "damping": 500, "onset": 0.002},
        },
    },
    "efforts": {"tyre": {"joint": "hop", "effort": "180000 * (road - q.hop)"}},
    "outputs": {"ride": {"formula": "a.hop + a.strut", "unit": "m/s^2"}},
}  # fmt: skip  # a table
RIDE = '[simulation]\nstep = 1e-3\nduration = 1.5\nstart = "equilibrium"\n'


@pytest.mark.slow
def test_errors_are_the_largest_over_all_rows_of_the_file_that_is_written(tmp_path: Path) -> None:
    (tmp_path / "car.toml").write_text(toml_text(STOPPED) + RIDE)
    tuned = eomgen.tune(tmp_path / "car.toml", 1e-4, output="ride", methods=["generalized_alpha"], formulated=False)
    assert tuned.met
    assert tuned.span == pytest.approx(1.5)
    model = eomgen.build(tuned.save(tmp_path / "tuned.toml"))
    written = model.simulate(error_estimate=False)
    exact = model.simulate(1.5, written.t[1], record_every=1, method="rk45", tolerance=1e-13, error_estimate=False)
    assert len(written.t) == len(exact.t) >= 1501
    difference = np.abs(written.outputs["ride"] - exact.outputs["ride"])
    true = difference.max() / np.ptp(exact.outputs["ride"])  # as stated errors of runs are measured
    assert true <= 1e-4
    claimed = tuned.written[0]
    assert claimed == tuned.error  # files hold all that was chosen
    assert true / 1.5 <= claimed <= 1.5 * true
    steps = written.stats.get("own_steps", written.stats["steps"])
    assert tuned.steps == steps  # what was timed is what the file does


def test_references_are_known_at_thousands_of_times_among_which_are_all_rows_of_the_scenes_runs() -> None:
    grid = tuning_grid(3.0, 1e-3, 1e-3)
    assert (grid.row, grid.rows, grid.recorded, grid.coarsest) == (5e-4, 6000, 2, 120)
    assert grid.end == pytest.approx(3.0)
    coarse = tuning_grid(100.0, 0.1, 1.0)  # 101 rows are recorded
    assert (coarse.row, coarse.rows, coarse.recorded) == (1.0 / 64, 6400, 64)
    long = tuning_grid(1e3, 1e-3, 1e-3)  # a million rows: memory bounds it
    assert (long.rows, long.recorded) == (15625, 1)
    ladder = ladder_grid(5.0, 1e-3, 1e-3, ())
    assert ladder == Grid(ladder.row, ladder.rows, 0.0, 64, 1)
    assert (ladder.row, ladder.end) == (pytest.approx(1e-3), pytest.approx(4.992))
    given = ladder_grid(1.2, 1e-3, 1e-3, (0.02, 0.01, 0.02 / 3))
    assert given.coarsest % 6 == 0
    assert given.rows >= 4000
    assert [whole_steps(r, 10) for r in (0.01, 0.21, 0.3, 0.6, 1.0, 1.2)] == [0.1, 0.25, 1 / 3, 1.0, 1.0, 2.0]


def test_settings_are_put_into_texts_of_every_kind(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    file.write_text('name = "x"\n[bodies.a]\nmass = 1.0\n')
    text = with_settings(file, {"method": "rk4", "step": 0.5}, "absolute", "R3xSO3")
    data = tomllib.loads(text)
    assert data == {
        "name": "x",
        "coordinates": "absolute",
        "bodies": {"a": {"mass": 1.0, "group": "R3xSO3"}},
        "simulation": {"method": "rk4", "step": 0.5},
    }
    text = with_settings(file, {"method": "hht", "settings": {"rtol": 1e-4, "reuse": 0.0}, "real": "float"}, "", "")
    assert tomllib.loads(text)["simulation"] == {
        "method": "hht",
        "settings": {"rtol": 1e-4, "reuse": 0.0},
        "real": "float",
    }
    file.write_text(text)
    assert tomllib.loads(with_settings(file, {"method": "rk4"}, "", ""))["simulation"] == {"method": "rk4"}
    file.write_text('name = "x"\nsimulation = { step = 1e-3 }\n')
    with pytest.raises(eomgen.UsageError, match=r"cannot be changed here; try: \[simulation\] method = \"rk4\""):
        with_settings(file, {"method": "rk4"}, "", "")
    with pytest.raises(eomgen.UsageError, match=r"can be written into .toml scene files only; try: \[simulation\]"):
        with_settings(None, {"method": "rk4"}, "", "")


def test_methods_of_low_order_begin_with_as_many_steps_as_others() -> None:
    """The local error of a step of order p is of order p + 1: order 2 begins where it takes the steps of order 5."""
    for demand in (1e-2, 1e-4, 1e-8):
        steps = [race.first_tolerance(order, demand) ** (-1.0 / (order + 1)) for order in (2, 5)]
        assert steps[0] <= steps[1] * (1.0 + 1e-12)
        assert race.first_tolerance(20, demand) == demand
    assert race.first_tolerance(2, 1e-8) == pytest.approx(1e-4)
    assert race.first_tolerance(2, 0.5) == 0.1


def test_contenders_expect_what_their_order_says() -> None:
    candidate = next(c for c in candidates("joint", model_of(), ["rk4"], {}))
    contender = Contender(candidate, candidate.configuration({}), "step", 4.0)
    assert contender.predict_resolution(1e-6) == 4.0
    contender.add(RaceRun(4.0, 1e-3, 1e-3), 1e-6)
    assert contender.predict_resolution(MARGIN**-1 * 1e-3 / 16.0) == 8.0  # order 4: half the step
    contender.add(RaceRun(8.0, 2.0**-2 * 1e-3, 2e-3), 1e-6)
    assert contender.order == pytest.approx(2.0)  # as low as is believed of 4
    assert contender.best(1e-6) is None
    contender.add(RaceRun(64.0, 7e-7, 16e-3), 1e-6)
    assert contender.closed
    assert contender.best(1e-6) == RaceRun(64.0, 7e-7, 16e-3)
    contender.reopen(5e-7)
    assert not contender.closed
    contender.add(RaceRun(128.0, 1e-9, 32e-3), 5e-7)
    assert (
        64.0 < contender.predict_resolution(5e-7) < 128.0
    )  # between a run that misses and one that is better than demanded


def test_a_tolerance_that_has_not_met_the_demand_is_dropped_by_measured_times_alone() -> None:
    """Errors that follow tolerances badly made extrapolated times five times too long."""
    candidate = next(c for c in candidates("joint", model_of(), ["rk45"], {}))
    contender = Contender(candidate, candidate.configuration({}), "tolerance", 1e3)
    demand = 1e-3
    contender.add(RaceRun(1e3, 0.19, 1e-4), demand)
    assert contender.least_seconds(demand) == 1e-4 < contender.predict_seconds(demand)
    contender.add(RaceRun(2e3, 0.15, 1.1e-4), demand)  # it hardly helps: by the model a tolerance of 1e-7 is wanted
    assert contender.least_seconds(demand) == 1.1e-4 and contender.predict_seconds(
        demand
    ) > 2.0 * contender.least_seconds(demand)
    contender.add(RaceRun(1e4, 9e-4, 1.2e-4), demand)
    assert contender.best(demand) == RaceRun(1e4, 9e-4, 1.2e-4)
    assert contender.least_seconds(demand) == contender.predict_seconds(demand)


def test_steps_lie_between_runs_that_miss_a_demand_and_runs_that_meet_it() -> None:
    candidate = next(c for c in candidates("joint", model_of(), ["rk4"], {}))
    contender = Contender(candidate, candidate.configuration({}), "step", 4.0)
    contender.runs = [RaceRun(10.0, 1e-3, 1.0), RaceRun(40.0, 1e-7, 4.0)]
    assert contender._between(8.0, 1e-5) == pytest.approx(20.0)  # the geometric mean
    assert contender._between(12.0, 1e-5) == 12.0
    contender.runs = contender.runs[:1]
    assert contender._between(8.0, 1e-5) == pytest.approx(13.0) and contender._between(8.0, 1e-2) == 8.0
    refused = Contender(
        candidate, candidate.configuration({}), "step", 4.0, runs=[RaceRun(4.0, np.inf, 1.0)], closed=True
    )
    refused.reopen(1e-2)
    assert refused.closed
    contender.closed, contender.taken = True, 3
    contender.reopen(1e-5)
    assert (contender.closed, contender.taken) == (False, 0)
    for number in range(7):
        contender.add(RaceRun(10.0 + number, 1.0, 1.0), 1e-5)
    assert (contender.closed, contender.why) == (True, "enough runs")


def test_the_margin_is_not_bought_with_twice_the_steps() -> None:
    """Steps of two rows would miss the margin by a little, steps of one row are the next: two rows are tried first."""
    candidate = next(c for c in candidates("joint", model_of(), ["rk4"], {}))
    contender = Contender(candidate, candidate.configuration({}), "step", 0.125, 8)
    demand = 1e-8
    contender.add(RaceRun(0.125, 0.9 * 4.0**4 * demand, 1e-3), demand)
    assert MARGIN < 0.9 and contender.predict_resolution(demand) == 0.5
    assert contender.predict_seconds(demand) == pytest.approx(4e-3)
    contender.add(RaceRun(0.5, 1.01 * demand, 4e-3), demand)  # it misses
    assert contender.predict_resolution(demand) == 1.0
    fine = Contender(candidate, candidate.configuration({}), "step", 8.0)
    fine.add(RaceRun(8.0, 0.9 * 2.0**4 * demand, 1e-3), demand)
    assert fine.predict_resolution(demand) == 17.0  # whole steps are near, and the margin is cheap


#: A pushed pendulum: its length may be tuned, a constant force and one over time push it.
PUSHED: dict[str, Any] = {
    **SCENE_DATA,
    "parameters": {"length": {"value": 0.5, "unit": "m", "tunable": True}},
    "inputs": {"push": {"formula": "0.4", "unit": "N m"}, "shake": {"formula": "0.3 * sin(5 * t)", "unit": "N m"}},
    "efforts": {"drive": {"joint": "pin", "effort": "(push + shake + 0.1 * pull) * length / 0.5"}},
}
PUSHED["inputs"]["pull"] = {"unit": "N m"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "tune: a demand on the error is needed; try: error=1e-4"),
        ({"error": 1e-4, "real_time": 1e-3}, "tune: the argument tune(real_time) was removed; try: a demand"),
        ({"error": 2.0}, "error: a demand lies in 1e-13..0.5, not 2.0; try: 1e-4"),
        (
            {"error": 1e-4, "axes": ["method", "profile"]},
            "axes: eomgen.tune does not vary the axis profile; try: one of formulation, method, ",
        ),
        ({"error": 1e-4, "axes": "policy"}, "axes are a list of names, not the text 'policy'; try: axes=[\"policy\"]"),
        ({"error": 1e-4, "methods": "rk4"}, "methods are a list of names, not the text 'rk4'; try: methods=[\"rk4\"]"),
        ({"error": 1e-4, "iterations": 3}, "tune: the argument tune(iterations) was removed; try: a demand"),
    ],
)
def test_mistakes_are_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(eomgen.EomgenError, match=re.escape(message)):
        eomgen.tune(SWING, **arguments)


@pytest.mark.slow
def test_what_does_not_move_is_not_studied() -> None:
    still = {**SWING, "gravity": [0, 0, 0]}
    for ask in (lambda: eomgen.tune(still, 1e-4, methods=["rk4"]), lambda: eomgen.tradeoff(still, methods=["rk4"])):
        with pytest.raises(eomgen.NumericalError, match="nothing moves in this run, so that all methods give the same"):
            ask()


def test_where_the_file_cannot_be_written_is_found_before_the_work(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["tune", str(path), "--error", "1e-3", "--out", str(path / "tuned.toml")]) == 7
    printed = capsys.readouterr()
    assert not printed.out and f"{path}: this is a file, and a folder is needed" in printed.err
    assert main(["tune", str(path)]) == 2
    assert "a demand on the error is needed; try: " in capsys.readouterr().err
    assert main(["tune", str(path), "--real-time", "5ns", "--error", "1e-3"]) == 2
    assert "no such option '--real-time': the option tune --real-time was removed; try:" in capsys.readouterr().err
