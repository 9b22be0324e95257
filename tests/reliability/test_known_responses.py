"""Studies of outputs that are formulas of normal variables, against closed forms: the block of the scene is at rest."""

from __future__ import annotations

import json
import math
import re
import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import integrate, stats

import eomgen
from eomgen import RandomVibration, random_vibration
from eomgen.base.arrays import Array
from eomgen.cli import main
from eomgen.errors import NumericalError, UsageError
from eomgen.products.reliability.command import _print
from eomgen.products.reliability.vibration import result
from eomgen.products.reliability.vibration.inputs import doubts_of_spread, processes_of
from eomgen.products.reliability.vibration.run_response import RunResponse
from eomgen.products.reliability.vibration.study import _VibrationStudy
from eomgen.results.error_estimate import NOTICED, SampleErrors
from tests.models import library
from tests.models.toml_text import toml_text

END, STEP, NORMAL = 2.0, 0.05, stats.norm
#: Outputs of the standard normal variables first and second; at the end bowl is 1 + 2 first + second^2 / 5.
OUTPUTS = {
    "bowl": "1 + 2 * first + 0.1 * t * second**2",
    "cubic": "first + 0.3 * first**3",
    "growing": "t * first - 1",
    "pair": ["first", "second"],
    "gusts": "3 + gust",
    "bent": "second + abs(first - 1)",
    "kink": "abs(first)",
    "fixed": "3",
}
#: Standard normal variables: of both constants, and of the three modes of the process gust.
VARIABLES = 5
THRESHOLDS = np.array([-5.0, 3.0, 9.0])


def scene() -> dict[str, Any]:
    gust = {"type": "exponential", "correlation_time": 1.0, "modes": 3, "standard_deviation": 2.0}
    return library.scene(
        "oscillator",
        name="block",
        random={"first": {"type": "constant"}, "second": {"type": "constant"}, "gust": gust},
        outputs={name: {"formula": text} for name, text in OUTPUTS.items()},
        simulation={"duration": END, "step": STEP, "method": "trapezoidal"},
        joints__slide__stiffness=None,
        joints__slide__initial=None,
    )


@cache
def model() -> eomgen.Model:
    return eomgen.build(scene(), method="trapezoidal")


@cache
def bowl() -> RandomVibration:
    options: dict[str, Any] = {"projected": 0.9, "samples": 500, "tail_samples": 250, "pairs": 3, "seed": 3}
    with warnings.catch_warnings():  # Sobol' sequences of three pairs
        warnings.simplefilter("error")
        return random_vibration(model(), "bowl", thresholds=THRESHOLDS, times=[2.0, 0.5, 0.0], levels=[1.0], **options)


def bowl_above(threshold: float) -> float:
    """Return P(1 + 2 x + y^2 / 5 > threshold), by the normal distribution of x at each y."""

    def part(y: float) -> float:
        return float(NORMAL.sf((threshold - 1.0 - 0.2 * y * y) / 2.0) * NORMAL.pdf(y))

    return integrate.quad(part, -12.0, 12.0, epsabs=0.0, epsrel=1e-12)[0]


def test_a_quadratic_response_has_its_moments_and_tails() -> None:
    found, true = bowl(), np.array([bowl_above(y) for y in THRESHOLDS])
    exact = 1.2, math.sqrt(4.08), 0.064 / 4.08**1.5, 0.0768 / 4.08**2
    assert found.moments["second_order"] == pytest.approx(exact, rel=1e-9)
    for name in ("first_order", "projected"):  # the gradient at the mean has no part along the second variable
        assert found.moments[name] == pytest.approx((1.0, 2.0, 0.0, 0.0), abs=1e-9)
        np.testing.assert_allclose(found.distributions[name].above, NORMAL.sf(THRESHOLDS, 1.0, 2.0), rtol=1e-9)
    assert found.moments["hermite"][1:] == pytest.approx(exact[1:], rel=1e-9)
    assert found.moments["hermite"][0] == pytest.approx(1.2, abs=0.2)
    for name in ("second_order", "quadratic", "corrected"):
        np.testing.assert_allclose(found.distributions[name].above, true, rtol=1e-7)
        np.testing.assert_allclose(found.distributions[name].below, 1.0 - true, rtol=1e-7)
    index = (THRESHOLDS - 1.0) / 2.0  # along the first axis: the surface bends away by less than a circle
    np.testing.assert_allclose(found.indices, index, rtol=1e-7)
    np.testing.assert_allclose(found.distributions["form"].above, NORMAL.sf(index), rtol=1e-7)
    less = np.where(true <= 0.5, NORMAL.sf(index) / true, NORMAL.cdf(index) / (1.0 - true)) - 1.0
    np.testing.assert_allclose(found.errors["form"], less, rtol=1e-5)
    np.testing.assert_allclose(found.errors["quadratic"], 0.0, atol=1e-6)
    np.testing.assert_allclose(found.errors["first_order"], less, rtol=1e-5)
    assert set(found.errors) == set(found.distributions) - {"corrected", "importance_sampling", "monte_carlo"}
    sampled = found.distributions["importance_sampling"]
    half = 0.5 * (sampled.high - sampled.low)
    assert np.all(np.abs(sampled.above - true) < 2.0 * half) and np.all(half < 0.4 * np.fmin(true, 1.0 - true))


def test_files_have_all_numbers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = bowl()
    files = found.save(tmp_path)
    assert [file.name for file in files] == ["random.json", "distribution.csv", "autocovariance.csv"]
    data = json.loads(files[0].read_text(encoding="utf-8"))
    assert data["message"] == found.message and data["thresholds"] == THRESHOLDS.tolist()
    assert data["moments"]["first_order"] == {
        "mean": pytest.approx(1.0), "standard_deviation": pytest.approx(2.0), "skewness": 0.0, "excess_kurtosis": 0.0
    }  # fmt: skip
    assert data["distributions"]["form"]["above"] == found.distributions["form"].above.tolist()
    assert data["costs"]["monte_carlo"] == {"runs": 500, "adjoints": 0, "tangents": 0}
    assert data["processes"][1] == {
        "name": "second", "kind": "constant", "variables": 1, "captured": 1.0, "eigenvalues": [2.0]
    }  # fmt: skip
    assert data["first_passage"] == {"1": found.first_passage[1.0]} and data["lost_variance"] == 0.0
    rows = np.genfromtxt(files[1], delimiter=",", names=True, deletechars="")
    np.testing.assert_array_equal(rows["threshold"], THRESHOLDS)
    np.testing.assert_array_equal(rows["index"], found.indices)
    np.testing.assert_array_equal(rows["monte_carlo.low"], found.distributions["monte_carlo"].low)
    assert "form.low" not in rows.dtype.names
    table = np.genfromtxt(files[2], delimiter=",", names=True, deletechars="")
    np.testing.assert_array_equal(table["second_order"], found.autocovariance["second_order"])
    _print(found)
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["first", "order", "1", "2", "0", "0"] in lines and ["second", "constant", "1", "100"] in lines
    shown = ["first_order", "second_order", "projected", "hermite", "form", "quadratic"]
    shown += ["corrected", "importance_sampling", "monte_carlo"]
    for threshold, side, sign in (("-5", "below", "<="), ("9", "above", ">")):
        place = THRESHOLDS.tolist().index(float(threshold))
        cells = [f"{getattr(found.distributions[name], side)[place]:.4g}" for name in shown]
        assert [threshold, sign, *cells] in lines
    at = lines.index(["0", *(f"{found.autocovariance[name][2]:.6g}" for name in ("first_order", "second_order"))])
    assert [line[0] for line in lines[at : at + 3]] == ["0", "0.5", "2"]
    passage = found.first_passage[1.0]
    assert ["1", f"{passage['crossing_rate']:.4g}", f"{passage['monte_carlo']:.4g}"] in lines
    assert ["monte", "carlo", "500", "0", "0"] in lines


def test_a_cubic_response_is_corrected_by_samples() -> None:
    """x + 0.3 x^3 is y if x is the only real root; its variance is 1 + 6 0.3 + 15 0.09."""
    found = random_vibration(model(), "cubic", thresholds=[-6.0, 0.5, 4.0], seed=1)
    roots = [
        next(float(root.real) for root in np.roots([0.3, 0.0, 1.0, -y]) if abs(root.imag) < 1e-9)
        for y in found.thresholds
    ]
    np.testing.assert_allclose(found.indices, roots, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(found.distributions["form"].below, NORMAL.cdf(roots), rtol=1e-6)
    true = found.distributions["corrected"]
    error = (true.high - true.low) / 2.0 / 1.96
    assert np.all(np.abs(true.below - NORMAL.cdf(roots)) <= 4.0 * error + 1e-9)
    assert found.moments["corrected"][:2] == pytest.approx((0.0, math.sqrt(4.15)), rel=0.2, abs=0.2)
    (note,) = (note for note in found.notes if note.startswith("the quadratic form about the mean misses"))
    assert f"correct the standard deviation from 1 to {found.moments['corrected'][1]:.4g}" in note
    assert found.message.startswith(f"cubic at t = 2 s has mean {found.moments['corrected'][0]:.6g} and standard")
    assert "by a form and samples" in found.message


def response(output: str) -> RunResponse:
    return RunResponse(model(), processes_of(model())[1], output, (END, STEP), {"method": "trapezoidal"})


def test_derivatives_about_a_constant_state_are_those_of_any_run_and_of_differences() -> None:
    """The state stays as it is at any point; the run tells at the mean alone, where it takes no tangents."""
    still, general, differenced = (response("bowl") for _ in range(3))
    general.stationary = None
    differenced.reason = "asked for"
    mean, point, some = np.zeros(VARIABLES), np.array([0.5, -1.5, 0.2, 0.0, 1.0]), np.eye(VARIABLES)[:, 1:3]
    bend = np.zeros((VARIABLES, VARIABLES))
    bend[1, 1] = 0.2 * END
    for one, value, slope in ((mean, 1.0, 0.0), (point, 2.0 + 0.2 * 1.5**2, -0.4 * 1.5)):
        for of in (still, general, differenced):
            found = of.expansion(one)
            assert found.value == pytest.approx(value, rel=1e-12)
            np.testing.assert_allclose(found.gradient, [2.0, slope, 0.0, 0.0, 0.0], atol=1e-9)
            np.testing.assert_allclose(found.hessian, bend, atol=1e-6)
            np.testing.assert_allclose(of.products(one, some), bend[:, 1:3], atol=1e-6)
    assert general.costs == (2, 1 + 1 + 2 + 1 + 1 + 2, 2 * (VARIABLES + 2))
    assert differenced.costs == (10 + 4 + 1 + 10 + 1 + 4, 1 + 10 + 4 + 1 + 10 + 4, 0)
    for of in (still, general):
        t, y, slopes = of.along(mean)
        np.testing.assert_allclose(t, STEP * np.arange(41), atol=1e-12)
        np.testing.assert_allclose(y, 1.0, rtol=1e-12)
        np.testing.assert_allclose(slopes, np.tile([2.0, 0.0, 0.0, 0.0, 0.0], (41, 1)), atol=1e-12)
        np.testing.assert_allclose(of.ending(0.5).expansion(mean).hessian, 0.25 * bend, atol=1e-12)
    y, highest = still.samples(np.array([point, -point]))
    np.testing.assert_allclose(y, [2.45, 0.45], rtol=1e-12)
    np.testing.assert_allclose(highest, y, rtol=1e-12)
    np.testing.assert_array_equal(still.values(np.array([point])), y[:1])
    assert still.costs[0] == 1 + 2 + 1 and still.failed == 0


def test_points_by_projected_hessians_are_those_by_whole_ones() -> None:
    options: dict[str, Any] = {"thresholds": [3.0], "projected": 0.9, "whole": False, "times": [0.5]}
    found = random_vibration(model(), "bowl", **options)
    np.testing.assert_allclose(found.indices, [1.0], rtol=1e-7)
    assert set(found.autocovariance) == {"first_order", "projected"} == set(found.moments) - {"corrected"}
    np.testing.assert_allclose(found.distributions["quadratic"].above, NORMAL.sf([1.0]), rtol=1e-6)
    np.testing.assert_allclose(found.autocovariance["projected"], 4.0, rtol=1e-9)
    true = found.distributions["corrected"]
    assert true.low[0] < 1.0 - bowl_above(3.0) < true.high[0]


def test_operations_at_which_slopes_jump_are_those_of_the_output() -> None:
    assert response("bowl").kinks() == []
    (kink,) = response("bent").kinks()
    assert "abs" in kink or "absolute" in kink
    assert response("pair[0]").kinks() == []


def test_the_variance_of_modes_left_out_is_told() -> None:
    """The output is the process at the end: the modes have the squares of their values there, of 4."""
    process = next(item.series for item in model().description.inputs if item.name == "gust")
    assert process is not None
    kept = sum(float(mode(np.array(END))) ** 2 for mode in process.modes)
    found = random_vibration(model(), "gusts", thresholds=[4.0], points=False)
    assert found.moments["second_order"] == pytest.approx((3.0, math.sqrt(kept), 0.0, 0.0), abs=1e-9)
    assert found.lost_variance == pytest.approx(1.0 - kept / 4.0, abs=1e-9)
    assert tuple(vars(found.costs["truncation"]).values()) == (1, 1, 0)
    lost, low = 100.0 * found.lost_variance, 100.0 * (1.0 - math.sqrt(kept / 4.0))
    assert f"{lost:.2g} % of its variance is lost with the modes left out" in found.message
    told = f"the modes left out, with {100.0 * (1.0 - process.captured[-1]):.2g} % of a process's variance, have"
    (note,) = (note for note in found.notes if note.startswith(told))
    assert f"have {lost:.2g} % of the output's: its standard deviation is {low:.2g} % low" in note
    share = 1.0 - 0.1 * (1.0 - process.captured[-1])
    assert note.endswith(f"try: share = {share:.6g} or more")
    options: dict[str, Any] = {"columns": ["gusts", "pair[0]"], "samples": 16, "error_estimate": True}
    notes = model().simulate_many(vary={"seed.gust": "integers(0, 99)"}, **options).notes
    (note,) = (note for note in notes if "modes left out" in note)
    assert note.startswith(
        f"output gusts: {told} {lost:.2g} % of the output's, to first order about the mean motion: i"
    )
    notes = model().simulate_many(vary={"q.slide": "uniform(0, 1)"}, **options).notes
    assert not [note for note in notes if "modes left out" in note]


def test_outputs_without_spread_are_refused_or_noted() -> None:
    for output, message in (
        ("fixed", "output: to second order about the mean the output does not depend on the random processes at this"),
        ("kink", "output: about the mean the output has neither slope nor bend, though samples differ: a kink, as of"),
    ):
        with pytest.raises(UsageError, match=message):
            random_vibration(model(), output, points=False)
        with pytest.raises(UsageError, match=message):
            random_vibration(model(), output, thresholds=[3.5])
        found = random_vibration(model(), output, thresholds=[2.5, 3.5], points=False, samples=20)
        assert message.removeprefix("output: ") in found.message
        assert np.isnan(found.moments["second_order"][2])
    assert doubts_of_spread(1e9, 0.5, varies=True)[0].startswith("the output's standard deviation is 5e-10 of its mean")
    assert doubts_of_spread(1e9, 1.5, varies=True) == []


def test_steps_that_put_the_output_off_are_told() -> None:
    study = _VibrationStudy(response("bowl"), 0)
    study.error, study._of_steps = SampleErrors(columns={"output.bowl": 0.25}), ["", "a process is not resolved"]
    study.check_steps("bowl", 2.0)
    (told, other) = study.notes
    assert other == "a process is not resolved" and told.startswith(
        "the steps put the output off by up to 0.25, 12 % of its standard deviation; try: a step smaller than 0.05 s"
    )
    study.notes.clear()
    study.check_steps("bowl", 0.25 / NOTICED * 1.001)
    assert study.notes == ["a process is not resolved"]


def test_what_is_drawn_depends_on_times(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(result, "save_figure", lambda figure, file: file)
    assert [file.name for file in bowl().plot(tmp_path)] == ["distribution.png", "autocovariance.png", "modes.png"]
    assert [file.name for file in replace(bowl(), times=np.zeros(0)).plot(tmp_path)] == [
        "distribution.png",
        "modes.png",
    ]
    (axes,) = result._modes(bowl()).axes
    for line, process in zip(axes.get_lines(), bowl().processes, strict=True):
        sizes = np.array(process.eigenvalues)
        assert list(line.get_xdata()) == list(range(1, len(sizes) + 1))
        np.testing.assert_allclose(line.get_ydata(), sizes / sizes.max(), rtol=1e-15)
    modes = [text.get_text() for text in axes.get_legend().get_texts()]
    assert modes[0] == "first: 1 modes, 100 % of the variance" and modes[2].startswith("gust: 3 modes, ")
    assert axes.get_title() == "Karhunen-Loève modes of the random processes" and axes.get_xlabel() == "mode"


def test_the_command_takes_options_as_the_function_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("eomgen.pipeline.pipeline.build_for_run", lambda *given, **options: model())
    file, out = tmp_path / "block.toml", tmp_path / "out"
    file.write_text(toml_text(scene()), encoding="utf-8")
    words = ["--output", "bowl", "--threshold", "3", "--no-points", "--t-end", "1", "--covariance-at", "0.5"]
    words += ["--monte-carlo", "40", "--seed", "5", "--no-plots", "--json", "--out", str(out)]
    assert main(["random", str(file), *words]) == 0
    told = capsys.readouterr()
    data = json.loads(told.out)
    options: dict[str, Any] = {"thresholds": [3.0], "points": False, "times": [0.5], "samples": 40, "seed": 5}
    found = random_vibration(model(), "bowl", 1.0, **options)
    assert data["message"] == found.message and data["moments"] == found.to_dict()["moments"]
    assert data["files"] == ["random.json", "distribution.csv", "autocovariance.csv"] and data["folder"] == str(out)
    assert f"{found.message}\nwritten to {out}: random.json, distribution.csv, autocovariance.csv" in told.err


def test_the_first_passage_of_a_growing_output() -> None:
    """t x - 1 comes to 1 at 2 / x: of the rate's integral sf(1), and of runs sf(1)."""
    found = random_vibration(model(), "growing", points=False, levels=[1.0, -2.0])
    shares = np.array([1e-4, 1e-3, 0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 0.99, 0.999, 0.9999])
    np.testing.assert_allclose(found.thresholds, 2.0 * NORMAL.ppf(shares) - 1.0, rtol=1e-9)
    passage = found.first_passage[1.0]
    assert passage["crossing_rate"] == pytest.approx(-math.expm1(-NORMAL.sf(1.0)), rel=2e-3)
    assert passage["samples"] == pytest.approx(NORMAL.sf(1.0), abs=0.04)
    assert passage["preferred"] == passage["crossing_rate"]
    assert found.first_passage[-2.0]["crossing_rate"] == 1.0
    assert "the output starts at -1, not below the level -2, and counts as passed" in found.message
    assert np.isnan(found.indices).all() and set(found.distributions) == {"first_order", "second_order"}
    assert found.distributions["second_order"].below == pytest.approx(shares, rel=1e-9)


def test_samples_that_fail_are_counted_and_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(self: RunResponse, points: Array) -> tuple[Array, Array]:
        y = np.where(points[:, 0] < -1.5, np.nan, points[:, 0] + 0.3 * points[:, 0] ** 3)
        return y, y

    monkeypatch.setattr(RunResponse, "samples", run)
    monkeypatch.setattr(RunResponse, "samples_with_errors", lambda self, z: (run(self, z), SampleErrors(), ()))
    found = random_vibration(model(), "cubic", thresholds=[0.0, 1.0], samples=400, points=False, seed=5, levels=[1.0])
    x = np.random.default_rng(5).standard_normal((400, VARIABLES))[:, 0]
    failed = int(np.count_nonzero(x < -1.5))
    assert failed > 10 and f"{failed} of 400 samples failed, and are in no statistics" in found.message
    y = (x + 0.3 * x**3)[x >= -1.5]
    assert found.distributions["monte_carlo"].below.tolist() == [np.mean(y <= 0.0), np.mean(y <= 1.0)]
    assert found.moments["monte_carlo"][:2] == pytest.approx((y.mean(), y.std()), rel=1e-9)
    assert found.first_passage[1.0]["monte_carlo"] == np.mean(y > 1.0)
    (told,) = (note for note in found.notes if "samples fail, so the statistics of the output leave them out" in note)
    assert re.fullmatch(r"[1-9]\d? of 32", told.partition(" samples")[0])


def test_few_good_samples_are_no_statistics(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(self: RunResponse, points: Array) -> tuple[Array, Array]:
        y = np.where(np.arange(len(points)) < 19, points[:, 0], np.nan)
        return y, y

    monkeypatch.setattr(RunResponse, "samples", failing)
    with pytest.raises(NumericalError, match="81 of 100 samples of Monte Carlo fail"):
        random_vibration(model(), "bowl", samples=100, points=False)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"output": "y"}, "output: there is no output 'y'; try: one of bowl, cubic"),
        ({"output": "pair"}, "output: there is no output 'pair'; try: pair["),
        ({"thresholds": [[1.0]]}, "thresholds: a list of numbers is needed, not [[1.0]]; try: thresholds=[0.5, 1.0]"),
        ({"projected": 1.0}, "projected: the share 1 is not between 0 and 1; try: projected=0.999"),
        ({"projected": "most"}, "projected: a number is needed, not str"),
        ({"whole": False}, "whole: no Hessian is left without the whole one; try: projected=0.999, the share of"),
        ({"samples": 1}, "samples: of 1 samples no error is known: 20 are the least; try: samples=1000, or 0"),
        ({"tail_samples": 19}, "tail_samples: of 19 samples no error is known"),
        ({"levels": [np.nan]}, "levels: "),
        ({"times": [0.333]}, "times: t = 0.333 s is not a row of the run; the nearest one is at 0.35 s"),
        ({"at": 1.01}, "at: the last step is shorter than 0.05 s, and has no derivatives here; try: at = 1 (--t-end)"),
        ({"at": 1.0, "step": 1.2}, "at: the run from 0 s to 1 s has no whole step of 1.2 s; try: at = 1.2, step = 1:"),
        ({"at": -1.0}, "at: the end -1 s lies before the start 0 s; try: a later at (--t-end)"),
        ({"inputs": {"first": 1.0}}, "inputs: first is a random process, and the study goes over all its values; try"),
        ({"method": "auto"}, "method: auto chooses a method for each run, and not all of them have derivatives"),
        ({"foo": 1}, "random_vibration: there is no argument 'foo'; try: one of output, at, step"),
        ({"threshold": [1.0]}, "random_vibration: there is no argument 'threshold'; try: thresholds"),
        ({"tolerance": 1e-6}, "random_vibration: there is no argument 'tolerance'; try: step=..., for fixed steps"),
        ({"parameters": [1.0, 2.0]}, "parameters: values by name are needed, not [1.0, 2.0]; try: parameters={"),
        ({"record_every": 7}, "record_every: crossings, largest values and gradients are looked for at every step"),
        ({"parameters": {"first_z1": 3.0}}, "parameters: first_z1 is a variable of a random process, and the study"),
        ({"output": np.zeros(2)}, "output: there is no output array([0., 0.]); try: one of bowl, cubic"),
    ],
)
def test_mistakes_are_named(options: dict[str, Any], text: str) -> None:
    given = {"output": "bowl", "at": 1.0, "step": 0.05, "thresholds": [0.5], "points": False} | options
    with pytest.raises(UsageError, match=re.escape(text)):
        random_vibration(model(), given.pop("output"), **{"method": "trapezoidal"} | given)
