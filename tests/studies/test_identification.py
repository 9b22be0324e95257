"""Identification: estimates with intervals, what data do not decide, times off the grid, several runs, mistakes."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.errors import FileError, NumericalError, UsageError
from eomgen.pipeline.pipeline import build_for_run
from eomgen.products.studies.identification.estimation import structure
from eomgen.products.studies.identification.experiment import CubicInterpolation
from eomgen.scene.load import from_data, load


def unknown(value: float, unit: str = "1") -> dict[str, Any]:
    return {"value": value, "unit": unit, "tunable": True}


SPRING = "push - sqrt(stiffness)**2 * q.slide - damping * v.slide"
SCENE: dict[str, Any] = {
    "format": 1, "name": "two_masses", "gravity": [0, 0, 0],
    "simulation": {"method": "trapezoidal", "step": 0.02, "duration": 4},
    "inputs": {"push": {"unit": "N"}},
    "parameters": {
        "mass_a": unknown(1.0, "kg"), "mass_b": unknown(2.0, "kg"), "stiffness": unknown(30.0, "N/m"),
        "damping": unknown(1.0, "N s/m"), "far": unknown(1.0), "gain": unknown(2.0, "1/s"), "fixed": 3.0,
    },
    "bodies": {name: {"mass": f"mass_{name}", "inertia": [1e-2, 1e-2, 1e-2]} for name in ("a", "b")},
    "joints": {
        "slide": {"type": "prismatic", "parent": "base", "child": "a", "axis": [1, 0, 0], "initial": {"position": 0.1}},
        "glue": {"type": "fixed", "parent": "a", "child": "b"},
    },
    "efforts": {"spring": {"joint": "slide", "effort": SPRING}},
    "outputs": {
        "x": {"formula": "q.slide", "unit": "m"}, "force": {"formula": "stiffness * q.slide", "unit": "N"},
        "pair": {"formula": ["q.slide", "v.slide"]}, "aside": {"formula": "far * t"},
        "bent": {"formula": "(far + gain) * t + far * gain * t**2 / (1 + t)"},
    },
}  # fmt: skip  # a table


def built(effort: str = SPRING, start: float = 0.1, **sections: Any) -> eomgen.Model:
    """Return the model of the scene, as the command builds it, with another effort, start and sections."""
    joints = SCENE["joints"] | {"slide": SCENE["joints"]["slide"] | {"initial": {"position": start}}}
    changed = {"joints": joints, "efforts": {"spring": {"joint": "slide", "effort": effort}}}
    return build_for_run(from_data(SCENE | changed | sections))


TRUE = {"mass_a": 1.0, "mass_b": 2.0, "stiffness": 30.0, "damping": 1.0}
NOISE = 1e-3


@pytest.fixture(scope="module")
def slider() -> eomgen.Model:
    return built()


def deflection(
    t: Array, push: float = 0.0, start: float = 0.1, speed: float = 0.0, stiffness: float = 30.0, damping: float = 1.0
) -> Array:
    """Return x of 3 x'' + damping x' + stiffness x = push: the closed form."""
    decay = damping / 6.0
    rate, away = np.sqrt(stiffness / 3.0 - decay**2), start - push / stiffness
    wave = away * np.cos(rate * t) + (speed + decay * away) / rate * np.sin(rate * t)
    return np.asarray(push / stiffness + np.exp(-decay * t) * wave)


def data(seed: int = 0, count: int = 201, noise: float = NOISE, **given: float) -> dict[str, Array]:
    t = np.linspace(0.0, 4.0, count)
    return {"t": t, "x": deflection(t, **given) + noise * np.random.default_rng(seed).standard_normal(count)}


def found_by(model: eomgen.Model, given: Any, *names: str, **options: Any) -> eomgen.Identification:
    values = {"stiffness": 25.0, "damping": 0.5} | options.pop("values", {})
    return eomgen.identify(model, given, list(names), values=values, **{"step": 0.005} | options)


def test_estimates_of_a_damped_oscillation_and_their_covariance(slider: eomgen.Model) -> None:
    found = found_by(slider, data(), "stiffness", "damping")
    for name in ("stiffness", "damping"):
        assert found[name].low < TRUE[name] < found[name].high
        assert found[name].state == "determined"
    t = np.linspace(0.0, 4.0, 201)
    at, h = {name: found[name].value for name in ("stiffness", "damping")}, 1e-4
    sides = [[deflection(t, **at | {name: at[name] + h * sign}) for sign in (1.0, -1.0)] for name in at]
    J = np.stack([(ahead - behind) / (2.0 * h) for ahead, behind in sides], axis=1)
    noise = found.columns[0].deviation
    assert noise == pytest.approx(NOISE, rel=0.15) and found.noise == "estimated"
    expected = noise * np.sqrt(np.diag(np.linalg.inv(J.T @ J)))
    np.testing.assert_allclose([one.deviation for one in found.estimates], expected, rtol=2e-3)
    assert found.degrees_of_freedom == 199
    # Student's quantile at 199 degrees of freedom, of tables
    one = found["stiffness"]
    assert one.high - one.value == pytest.approx(1.972 * one.deviation, rel=1e-3)
    assert found.parameters == {name: found[name].value for name in ("stiffness", "damping")}
    assert found.notes == () and found.failed == 0


def test_given_deviations_have_normal_intervals_and_are_doubted(slider: eomgen.Model) -> None:
    fine = found_by(slider, data(), "stiffness", "damping", deviations={"x": NOISE})
    assert fine.noise == "given" and fine.notes == ()
    one = fine["damping"]
    assert one.high - one.value == pytest.approx(1.959964 * one.deviation, rel=1e-5)
    small = found_by(slider, data(), "stiffness", "damping", deviations=0.5 * NOISE)
    assert "times the deviations given: the model misses something" in small.message
    assert small["damping"].deviation == pytest.approx(0.5 * one.deviation, rel=1e-6)
    large = found_by(slider, data(), "stiffness", "damping", deviations=2.0 * NOISE)
    assert "which are too large" in large.message


def test_times_off_the_grid_and_the_order_of_interpolation(slider: eomgen.Model) -> None:
    t = np.sort(np.random.default_rng(1).uniform(0.0, 4.0, 150))
    given = {"t": t, "x": deflection(t) + NOISE * np.random.default_rng(2).standard_normal(150)}
    found = found_by(slider, given, "stiffness", "damping", t_start=0.0)
    assert all(one.low < TRUE[one.name] < one.high for one in found.estimates)
    misses = []
    for step in (0.1, 0.05):
        ends = np.arange(0.0, 4.2, step)
        rows = CubicInterpolation.of(t, 0.0, step)
        misses.append(np.abs(rows.at(np.sin(3.0 * ends)) - np.sin(3.0 * t)).max())
    assert np.log2(misses[0] / misses[1]) == pytest.approx(4.0, abs=0.4)
    rows = CubicInterpolation.of(np.array([0.0, 0.1, 0.3 + 1e-9]), 0.0, 0.1)
    np.testing.assert_array_equal(rows.at(np.arange(4.0)), [0.0, 1.0, 3.0])


def test_derivatives_off_the_grid_are_those_of_the_interpolated_run(slider: eomgen.Model) -> None:
    """A fit to noise-free data of the model itself ends at its parameters to rounding, wherever samples lie."""
    t = np.sort(np.random.default_rng(3).uniform(0.0, 2.0, 40))
    run = slider.simulate(2.1, 0.02, error_estimate=False)
    given = {"t": t, "x": CubicInterpolation.of(t, 0.0, 0.02).at(run.outputs["x"])}
    found = found_by(slider, given, "stiffness", "damping", step=0.02, t_start=0.0)
    np.testing.assert_allclose([found[name].value for name in ("stiffness", "damping")], [30.0, 1.0], rtol=1e-9)
    assert found.runs <= 12


def test_what_the_steps_move_estimates_by_is_known_from_half_of_them(slider: eomgen.Model) -> None:
    coarse, fine = (
        found_by(slider, data(), "stiffness", "damping", step=step, deviations=NOISE) for step in (0.04, 0.005)
    )
    moved = coarse["stiffness"].value - fine["stiffness"].value
    assert coarse["stiffness"].bias == pytest.approx(moved, rel=0.05)
    assert abs(moved) > 3.0 * coarse["stiffness"].deviation
    assert "the step of 0.04 s moves estimates, stiffness by" in coarse.message
    assert abs(fine["stiffness"].bias) < 0.25 * fine["stiffness"].deviation and fine.notes == ()


def test_several_runs_have_initial_states_of_their_own(slider: eomgen.Model) -> None:
    runs = [data(0, start=0.1), data(1, start=-0.2, speed=0.5), data(2, start=0.0, speed=-1.0)]
    found = found_by(slider, runs, "stiffness", "damping", states=["q.slide", "v.slide"])
    names = [one.name for one in found.estimates]
    assert names == ["stiffness", "damping", *(f"{c}.slide of run{k}" for k in (1, 2, 3) for c in "qv")]
    truth = [30.0, 1.0, 0.1, 0.0, -0.2, 0.5, 0.0, -1.0]
    off = [(one.value - true) / one.deviation for one, true in zip(found.estimates, truth, strict=True)]
    assert np.abs(off).max() < 3.0
    assert found["v.slide of run3"].unit == "m/s" and found["q.slide of run1"].unit == "m"
    assert found.records[1].initial["v"][0] == found["v.slide of run2"].value
    assert set(found.parameters) == {"stiffness", "damping"}


def test_masses_that_move_together_are_known_by_their_sum(slider: eomgen.Model) -> None:
    given = data(0, push=2.0) | {"input.push": np.full(201, 2.0)}
    found = found_by(slider, given, "stiffness", "mass_a", "mass_b", values={"mass_a": 1.5})
    (one,) = found.combinations
    assert (one.text, one.form, one.members) == ("mass_a + mass_b", "sum", ("mass_a", "mass_b"))
    assert one.low < 3.0 < one.high
    assert [item.state for item in found.estimates] == ["determined", "undetermined", "undetermined"]
    assert found["mass_a"].high == np.inf and found["mass_b"].value == found["mass_b"].start == 2.0
    assert "only mass_a + mass_b is determined" in found.message
    assert np.isnan(found.correlation[1]).all() and found.correlation[0, 0] == pytest.approx(1.0)


def test_what_the_start_does_not_decide_is_found_at_the_end(slider: eomgen.Model) -> None:
    """Where both factors are 1 their derivatives are the same, where they end they are not."""
    t = np.linspace(0.0, 4.0, 41)
    bent = 4.0 * t + 1.5 * 2.5 * t**2 / (1.0 + t) + NOISE * np.random.default_rng(0).standard_normal(41)
    found = eomgen.identify(slider, {"t": t, "bent": bent}, ["far", "gain"], values={"gain": 1.0}, step=0.1)
    assert [one.state for one in found.estimates] == ["determined", "determined"]
    for one, true in zip(sorted(found.estimates, key=lambda one: one.value), (1.5, 2.5), strict=True):
        assert one.low < true < one.high


def test_deviations_of_few_samples_make_up_for_the_unknowns(slider: eomgen.Model) -> None:
    """Residuals of eighteen samples that three unknowns are fitted to have the noise of fifteen."""
    rng, given = np.random.default_rng(0), data(0, 9, push=2.0) | {"push": np.full(9, 2.0)}
    given["force"] = 30.0 * deflection(given["t"], push=2.0) + 0.05 * rng.standard_normal(9)
    found = found_by(slider, given, "stiffness", "damping", "mass_a", step=0.02)
    squares = sum(one.samples * (one.rms / one.deviation) ** 2 for one in found.columns)
    assert squares == pytest.approx(15.0, rel=1e-2) and found.degrees_of_freedom == 15


def test_what_is_hardly_determined_is_named_with_its_direction(slider: eomgen.Model) -> None:
    """A push of 1 mN among motions by its thousandfold: all forces could be twice as large."""
    given = data(0, push=1e-3) | {"push": np.full(201, 1e-3)}
    found = found_by(slider, given, "mass_a", "stiffness", "damping", values={"mass_b": 0.0, "mass_a": 3.0})
    assert found.combinations == ()
    said = "intervals wider than the value: mass_a, stiffness, damping; least determined, in shares of their values: "
    assert said + "0.58 mass_a + 0.58 stiffness + 0.58 damping" in found.message


def test_combinations_of_columns_are_read_from_the_left() -> None:
    rng = np.random.default_rng(0)
    J = rng.standard_normal((30, 5))
    J[:, 2] = 2.0 * J[:, 0] - 1e6 * J[:, 1] * 1e-6
    J[:, 4] = 0.0
    found = structure(J)
    assert found.kept == (0, 1, 3) and found.others == (2, 4) and found.mixed_columns == (0, 1)
    np.testing.assert_allclose(found.coefficients, [[2.0, 0.0], [-1.0, 0.0], [0.0, 0.0]], atol=1e-12)


def test_missing_values_are_refused_or_dropped(slider: eomgen.Model) -> None:
    given = data()
    given["x"][[3, 50, 51]] = np.nan
    with pytest.raises(UsageError, match=r"run1: 3 of 201 rows have missing values \(x 3\); try: missing=\"drop\""):
        found_by(slider, given, "stiffness")
    found = found_by(slider, given, "stiffness", "damping", missing="drop")
    assert found.columns[0].samples == 198 and found.degrees_of_freedom == 196
    assert np.count_nonzero(np.isnan(found.records[0].residuals["x"])) == 3


def test_a_bound_that_holds_an_estimate_is_named(slider: eomgen.Model) -> None:
    found = found_by(slider, data(), "stiffness", "damping", bounds={"stiffness": (20.0, 28.0)})
    assert found["stiffness"].state == "on its bound" and found["stiffness"].value == pytest.approx(28.0, rel=1e-5)
    assert "on a bound: stiffness" in found.message
    assert "residuals are not white noise (correlation at lag 1: x 0." in found.message


@pytest.mark.slow
def test_a_scene_without_a_method_is_identified_by_the_one_with_derivatives() -> None:
    model = build_for_run(load(Path(eomgen.__file__).with_name("cli") / "first_scene.toml"), None)
    run = model.simulate(0.4, 1e-2, method="generalized_alpha", parameters={"lower_mass": 0.7})
    measured = {"t": run.t, "tip[0]": run.outputs["tip"][:, 0], "tip[2]": run.outputs["tip"][:, 2]}
    found = eomgen.identify(model, measured, ["lower_mass"], step=1e-2)
    assert found.estimates[0].value == pytest.approx(0.7, abs=1e-4)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "the file is empty; try: a first line of names"),
        ("t,x\n0,1\n1,2,3", "line 3: the row has 3 cells, and there are 2 names"),
        ('t,x\n0,"1\n1,2"', "line 2: this is not a CSV file: unexpected end of data"),
        ("t,x\n0,1\n1,two", "line 3, column x: 'two' is not a number; try: numbers alone, without units"),
        ("t;x\n0;1,5\n1;2", "line 2, column x: '1,5' is not a number; try: a decimal point in place of the comma"),
    ],
)
def test_files_that_are_no_tables(slider: eomgen.Model, tmp_path: Path, text: str, told: str) -> None:
    file = tmp_path / "run.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match=re.escape(told)):
        found_by(slider, file, "stiffness")


def test_a_file_that_is_not_there_or_no_text(slider: eomgen.Model, tmp_path: Path) -> None:
    (tmp_path / "run1.csv").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(FileError, match=r"runl.csv: cannot be read: No such file or directory; try: .*run1.csv"):
        found_by(slider, tmp_path / "runl.csv", "stiffness")
    with pytest.raises(FileError, match=r"this is not a text in UTF-8, and a CSV file is needed"):
        found_by(slider, tmp_path / "run1.csv", "stiffness")
    files = [tmp_path / name / "run.csv" for name in ("first", "second")]
    for file in files:
        file.parent.mkdir()
        file.write_text("t,x\n0,1\n1,2", encoding="utf-8")
    with pytest.raises(UsageError, match=r"data: two runs are named run; try: files of different names"):
        found_by(slider, files, "stiffness")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"y": 1.0}, "run1, column 'y': it is neither an output nor an input of the scene"),
        ({"x": None}, "run1: no column is an output of the scene: t; try: columns named x, force"),
        ({"t": None}, "run1: there is no column t of times in s; try: t in place of one of x"),
        ({"t": 1.0}, "run1: time does not increase: 1 s in row 2 follows 1 s; try: rows in the order of their times"),
        ({"t": np.nan}, "run1: 201 of 201 times are not numbers, the first in row 1"),
        ({"x": "text"}, "data: the column x is str, not one number for each time"),
        ({"x": np.zeros((201, 2))}, "data: the column x is ndarray, not one number for each time"),
        ({"x": 1e300}, "run1, column x: 1e+300 is too large a value: squares of differences to it overflow"),
        ({"x": np.inf}, "run1: 201 of 201 rows have infinite values (x 201); try: missing"),
        ({"x": np.zeros(7)}, "data: columns differ in length: t 201, x 7"),
    ],
)
def test_mistakes_in_data_are_named(slider: eomgen.Model, change: dict[str, Any], told: str) -> None:
    given: dict[str, Any] = dict(data())
    for name, value in change.items():
        if value is None:
            del given[name]
        else:
            given[name] = np.full(201, value) if isinstance(value, float) else value
    with pytest.raises(UsageError, match=re.escape(told)):
        found_by(slider, given, "stiffness")


@pytest.mark.parametrize(
    ("names", "options", "told"),
    [
        ([], {}, "parameters: no parameter or state is named as unknown; try: parameters=['mass_a', 'mass_b'"),
        (["stiffness", "stiffness"], {}, "parameters: a name is given twice"),
        (["far"], {}, "no measurement depends on far at the initial guess; try: other outputs"),
        (["stiffness"], {"states": ["q.slid"]}, "states: there is no component 'q.slid' of the initial state"),
        (["stiffness"], {"bounds": {"stiffness": (40.0, 20.0)}}, "bounds of stiffness: 40 is not below 20"),
        (["stiffness"], {"bounds": {"stiffness": 40.0}}, "bounds of stiffness: 40.0 are not two numbers"),
        (
            ["stiffness"],
            {"bounds": {"stiffness": (math.nan, 5e3)}},
            "(nan, 5000.0) are not two numbers; try: (0.1, 10.0)",
        ),
        (["stiffness"], {"bounds": {"stiffness": (26.0, 40.0)}}, "another start within them, by values= (--set)"),
        (["stiffness"], {"bounds": [(1.0, 2.0)]}, "bounds: bounds by name are needed, not [(1.0, 2.0)]"),
        (["stiffness"], {"deviations": {"x": np.ones(2)}}, "deviations of x: a number is needed, not ndarray"),
        (["stiffness"], {"record_every": 2}, "identify: there is no argument 'record_every'; try: data at the times"),
        (["stiffness"], {"bounds": {"damping": (0.0, 1.0)}}, "there is no unknown 'damping'"),
        (["stiffness"], {"deviations": -1.0}, "deviations: standard deviations are positive numbers"),
        (["stiffness"], {"outputs": ["z"]}, "outputs: there is no output 'z'"),
        (["stiffness"], {"outputs": "x"}, "outputs are a list of names, not the text 'x'"),
        (["stiffness"], {"missing": "skip"}, "missing: 'skip' is none of the choices; try: refuse or drop"),
        (["stiffness"], {"confidence": 95}, "confidence: 95 is not a probability; try: confidence=0.95"),
        (["stiffness"], {"t_start": 1.0}, "t_start: run1 begins at t = 0 s, before the run at 1 s"),
        (["stiffness"], {"step": 0.0}, "step: 0 s is not a step"),
        (["stiffness"], {"initial": [{}, {}]}, "initial: there are 2 initial states for 1 runs"),
        (["stiffness"], {"method": "tdg2"}, "tdg2 has no derivatives of runs here"),
    ],
)
def test_mistakes_in_calls_are_named(
    slider: eomgen.Model, names: list[str], options: dict[str, Any], told: str
) -> None:
    with pytest.raises(UsageError, match=re.escape(told)):
        found_by(slider, data(), *names, **options)


@pytest.mark.slow
def test_starts_at_rest_follow_what_is_unknown() -> None:
    """3 x'' + x' + 30 x = 3 + t from rest at 3/30: a start held at 3/25, where the search begins, would fit nothing."""
    effort = SPRING.replace("push", "3 + t")
    resting = built(effort, start=0.05, simulation=SCENE["simulation"] | {"start": "equilibrium"})
    t = np.linspace(0.0, 4.0, 201)
    decay, rate, slope = 1.0 / 6.0, np.sqrt(10.0 - 1.0 / 36.0), 1.0 / 30.0
    mean = (3.0 - slope) / 30.0
    wave = (0.1 - mean) * np.cos(rate * t) + (decay * (0.1 - mean) - slope) / rate * np.sin(rate * t)
    x = mean + slope * t + np.exp(-decay * t) * wave + NOISE * np.random.default_rng(0).standard_normal(len(t))
    found = found_by(resting, {"t": t, "x": x}, "stiffness", "damping")
    for name in ("stiffness", "damping"):
        assert found[name].low < TRUE[name] < found[name].high
    np.testing.assert_allclose(found.records[0].initial["q"], 3.0 / found["stiffness"].value, rtol=1e-9)
    with pytest.raises(UsageError, match=r"states: the scene starts at static equilibrium, and q\.slide cannot be"):
        found_by(resting, {"t": t, "x": x}, "stiffness", states=["q.slide"])


@pytest.mark.slow
def test_starts_of_absolute_bodies_follow_what_is_unknown(slider: eomgen.Model) -> None:
    resting = built(simulation=SCENE["simulation"] | {"start": "equilibrium"})
    found = found_by(resting, data(), "stiffness", "damping", initial={"slide": 0.1})
    assert found["stiffness"].low < 30.0 < found["stiffness"].high
    aside = SCENE["bodies"]["a"] | {"center_of_mass": ["0.1 * far", 0, 0]}
    model = built(coordinates="absolute", bodies=SCENE["bodies"] | {"a": aside})
    found = found_by(model, data(), "stiffness", "damping")
    plain = found_by(slider, data(), "stiffness", "damping")
    for name in ("stiffness", "damping"):
        assert found[name].value == pytest.approx(plain[name].value, rel=1e-5)
        assert found[name].deviation == pytest.approx(plain[name].deviation, rel=1e-3)
    with pytest.raises(UsageError, match=r"states: the scene's initial state follows from parameters, and v\.a\[3\]"):
        found_by(model, data(), "stiffness", states=["v.a[3]"])


@pytest.mark.slow
def test_the_file_of_a_loop_is_read(tmp_path: Path) -> None:
    """Its multipliers are columns, too, and neither outputs nor mistakes."""
    link = {"mass": 0.5, "inertia": [1e-2, 1e-2, 1e-2]}
    hinge = {"type": "revolute", "parent": "a", "child": "link", "axis": [0, 1, 0]}
    ends = {"first": {"body": "link", "position": [0, 0, -0.5]}, "second": {"body": "base", "position": [0.4, 0, -0.6]}}
    scene = SCENE | {"bodies": SCENE["bodies"] | {"link": link}, "joints": SCENE["joints"] | {"hinge": hinge}}
    scene |= {"efforts": {"spring": {"joint": "slide", "effort": SPRING.replace("push ", "")}}}
    loop = build_for_run(from_data(scene | {"constraints": {"rod": {"type": "distance", **ends, "length": 0.4}}}))
    loop.simulate(1.0, 0.01, parameters={"stiffness": 28.0}, error_estimate=False).save(tmp_path / "run.csv")
    assert "rod: distance" in (tmp_path / "run.csv").read_text(encoding="utf-8").partition("\n")[0]
    found = found_by(loop, tmp_path / "run.csv", "stiffness", "damping", outputs=["x"], step=0.01)
    assert found["stiffness"].value == pytest.approx(28.0, rel=1e-6)


def test_a_solution_and_a_number_are_no_tables(slider: eomgen.Model) -> None:
    run = slider.simulate(0.1, 0.01, inputs={"push": 0.0}, error_estimate=False)
    with pytest.raises(UsageError, match=r'not Solution; try: "run.csv", or \{"t": run.t, "angle"'):
        found_by(slider, run, "stiffness")
    with pytest.raises(UsageError, match="data: a file or columns by name are needed, not int"):
        found_by(slider, 3, "stiffness")
    with pytest.raises(UsageError, match=r"values: values by name are needed, not \[1.0\]"):
        eomgen.identify(slider, data(), ["stiffness"], values=[1.0])  # type: ignore[arg-type]  # a mistake on purpose


def test_too_few_samples_and_no_runs(slider: eomgen.Model) -> None:
    few = {"t": [0.0, 0.1], "x": [0.1, 0.09]}
    with pytest.raises(UsageError, match="data: there are 2 samples for 3 unknowns; try: more samples"):
        found_by(slider, few, "stiffness", "damping", "mass_a")
    with pytest.raises(UsageError, match="run2: there are 1 rows, and a run has two at least; try: more data"):
        found_by(slider, [data(), {"t": [0.0], "x": [0.0]}], "stiffness")
    with pytest.raises(UsageError, match="data: there are no measured runs"):
        found_by(slider, [], "stiffness")


def test_a_run_that_fails_at_the_start_is_the_answer(slider: eomgen.Model) -> None:
    with pytest.raises(NumericalError, match=r"identify: the run fails at the initial guess: .*; try: other start"):
        found_by(slider, data(), "mass_a", values={"stiffness": -1.0})
    with pytest.raises(UsageError, match="the mass -5 is negative at mass_a = -5"):
        found_by(slider, data(), "mass_a", values={"mass_a": -5.0})
