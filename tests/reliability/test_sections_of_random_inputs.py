"""Random processes of scenes: what they are in Python, in C and in a run, their statistics, and what is refused."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.stats import norm

import eomgen
from eomgen.base.random_inputs import standard_normals
from eomgen.cli import main
from eomgen.errors import DescriptionError, UsageError
from eomgen.formula.curves import Curve
from eomgen.formula.evaluate import evaluate_batch
from eomgen.formula.nodes import Application
from eomgen.products.reliability.random_processes import karhunen_loeve
from eomgen.products.reliability.random_processes.coherence import (
    CrossCovariance,
    ExponentialCoherence,
    nearest_correlation,
)
from eomgen.products.reliability.random_processes.covariance import (
    SquaredExponential,
    translated_correlation,
)
from eomgen.products.reliability.random_processes.karhunen_loeve import expand
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.system.signals import NormalSeries
from tests.models import library
from tests.models.toml_text import toml_text

FORCE = {
    "type": "squared_exponential",
    "correlation_time": "1 s",
    "share": 0.9999,
    "seed": 1,
    "translation": "F0 * (1 + delta * g)**2",
}
DUFFING = library.scene(
    "oscillator",
    name="duffing",
    parameters={"F0": 0.5, "delta": {"value": 0.3, "tunable": True}},
    random={"force": FORCE},
    joints__slide__stiffness=None,
    joints__slide__initial={"position": 0.488353313},
    efforts={
        "spring": {"joint": "slide", "effort": "-q.slide - 0.1 * q.slide**3 - 0.2 * v.slide"},
        "excitation": {"joint": "slide", "effort": "force"},
    },
    outputs={"force": {"formula": "force"}},
    simulation={"method": "taylor", "step": 0.05, "duration": 15},
)


def _with(**random: dict[str, Any]) -> dict[str, Any]:
    """Return the oscillator with other processes, the first of which moves it."""
    effort = {"joint": "slide", "effort": " + ".join(random)}
    return DUFFING | {"random": random, "efforts": {"excitation": effort}, "outputs": {}}


def _loaded(scene: dict[str, Any]) -> Scene:
    return from_data(scene, file="duffing.toml")


def _scene(**random: dict[str, Any]) -> Scene:
    return _loaded(_with(**random))


def _process(scene: Scene, place: int = 0) -> NormalSeries:
    process = scene.inputs[place].series
    return process


@cache
def _model() -> eomgen.Model:
    return eomgen.build(DUFFING, profile="quick")


@pytest.mark.slow
def test_a_run_beyond_the_window_is_refused() -> None:
    told = r"t_end: the random process force is known up to t = 15 s, the run ends at t = 16 s; try: t_end = 15, or dur"
    with pytest.raises(eomgen.errors.UsageError, match=told + r"ation = 16 in \[random.force\]"):
        _model().simulate(16.0)


EXPONENTIAL = {"type": "exponential", "correlation_time": 1.0, "share": 0.9}
REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"share": 0.9}, r"\(random.force\): a random process needs its type, or the process that it follows; try: type"),
    ({"type": "exponential"}, r"exponential over time needs correlation_time; try: correlation_time = ..."),
    (EXPONENTIAL | {"correlation_time": -1}, r"correlation time -1 is not positive"),
    (EXPONENTIAL | {"correlation_length": 1}, r"exponential over time takes no correlation_length; try: correlation"),
    (EXPONENTIAL | {"share": 1.2}, r"the share 1.2 is not between 0 and 1; try: share = 0.99"),
    (EXPONENTIAL | {"modes": 3}, r"both share and modes say how many modes there are; try: one of them"),
    (EXPONENTIAL | {"share": 0.99999}, r"needs more than 1024 modes; 1024 have 0.997; try: share = 0.997, or a"),
    (EXPONENTIAL | {"standard_deviation": 0}, r"the standard deviation 0 is not positive"),
    (EXPONENTIAL | {"duration": 0}, r"the duration 0 s is not positive"),
    (EXPONENTIAL | {"delay": 0.1}, r"delay belongs to a process that follows another; try: follows = "),
    ({"type": "road", "class": "C"}, r"road is a process over distance; try: speed = 20"),
    ({"type": "kanai_tajimi", "frequency": 15.0, "damping": 1.0}, r"the damping ratio 1 is not below 1"),
    ({"type": "kanai_tajimi", "frequency": 15.0, "damping": 0.6, "speed": 2}, r"process over time; try: no speed"),
    ({"type": "band", "band": [3, 2]}, r"3 to 2 Hz is not a band of frequencies"),
    ({"type": "road", "class": "C", "speed": 5, "standard_deviation": 1}, r"road says the variance itself"),
    ({"type": "covariance", "points": [[0, 1], [2, 0.5], [1, 0.2]]}, r"the points are not in order: 1 comes after 2"),
    ({"type": "covariance", "points": [[1, 1], [2, 0.5]]}, r"the first lag is 1, so the variance is not known"),
    ({"type": "covariance", "points": [[0, 0], [2, 0.5]]}, r"the variance 0, at lag 0, is not positive"),
    ({"type": "spectrum", "points": [[0, 1], [2, -0.5]]}, r"the density -0.5 at 2 is negative"),
    ({"type": "spectrum", "points": [[-1, 1], [2, 0.5]]}, r"the first frequency -1 is negative"),
    ({"type": "spectrum"}, r"spectrum over time needs points or table"),
    (FORCE | {"translation": "F0 * g + t"}, r"time t cannot be used here \(column 10\); try: g, parameters and"),
    (FORCE | {"translation": "2 + 0 * g"}, r"it is 2 for any g, so it is not random; try: a formula of g"),
    ({"follows": "wind", "delay": 1}, r"there is no random process 'wind'"),
    (EXPONENTIAL | {"quantiles": [[0.1, 2], [0.5, 1], [0.9, 3]]}, r"quantiles are three points or more, probabilities"),
    (
        EXPONENTIAL | {"quantiles": [[0.1, 2], [0.5, 3], [0.9, 4]], "translation": "g"},
        r"both translation and quantiles define the process",
    ),
    (EXPONENTIAL | {"covariance_of": "translated"}, r"covariance_of translated needs a translation or quantiles of a"),
    (
        EXPONENTIAL | {"covariance_of": "translated", "translation": "exp(g)", "mean": 1},
        r"needs a translation or quantiles of a standard normal g; try: translation = ..., without mean",
    ),
    (
        {"type": "damped_cosine", "decay": 0.1, "frequency": 3, "covariance_of": "translated", "translation": "exp(g)"},
        r"no Gaussian process has a translation with the correlation -0.901 at the lag 1.04: of this one",
    ),
]


@pytest.mark.parametrize(("entry", "message"), REFUSED)
def test_what_is_wrong_is_said_once(entry: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=message) as caught:
        _scene(force=entry)
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize(
    ("follower", "message"),
    [
        ({"follows": "force"}, r"a process that follows a process over time needs delay, and no offset; try: delay ="),
        ({"follows": "force", "delay": 1, "seed": 3}, r"seed is set by force, which this process follows"),
        ({"follows": "late", "delay": 1}, r"late itself follows late; try: a process with a type of its own"),
    ],
)
def test_followers_have_all_but_their_lag_from_the_first(follower: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        _scene(force=FORCE, late=follower)


def test_names_of_variables_are_taken() -> None:
    scene = _with(force=FORCE) | {"parameters": {"F0": 1.0, "delta": 0.3, "force_z7": 2.0}}
    with pytest.raises(DescriptionError, match="has the parameter force_z7, and there is a parameter of that name"):
        _loaded(scene)


@pytest.mark.parametrize("process", [FORCE, EXPONENTIAL | {"covariance_of": "translated", "translation": "delta * g"}])
def test_a_translation_of_a_refused_parameter_is_no_fault_of_its_own(process: dict[str, Any]) -> None:
    scene = _with(force=process) | {"parameters": {"F0": 1.0, "delta": "nothing"}}
    with pytest.raises(DescriptionError, match=r"\(parameters.delta.value\): a number is needed") as caught:
        _loaded(scene)
    assert len(caught.value.problems) == 1


@pytest.mark.slow
def test_an_included_scene_has_its_processes_under_their_new_names(tmp_path: Path) -> None:
    more = {"force": FORCE, "late": {"follows": "force", "delay": 1}, "gust": {"correlation": {"force": 0.5}}}
    (tmp_path / "part.toml").write_text(toml_text(DUFFING | {"random": more}))
    scene = {"format": 1, "name": "two", "include": {"a": {"file": "part.toml"}, "b": {"file": "part.toml"}}}
    (tmp_path / "two.toml").write_text(toml_text(scene))
    model = eomgen.build(tmp_path / "two.toml", profile="quick")
    assert [item.name for item in model.scene.inputs] == [
        f"{of}_{name}" for of in "ab" for name in ("force", "late", "gust")
    ]
    u = model.input_values(np.array([0.0, 4.0]), parameters={"a_force_z1": 0.0})
    assert np.all(u[:, 0] != u[:, 3])


@pytest.mark.slow
def test_seeds_vary_in_ensembles_side_by_side_as_scenes_with_these_seeds() -> None:
    model = _model()
    options = {"method": "rk4", "step": 0.05}
    found = model.simulate_many(vary={"seed.force": "values(1, 6)", "delta": "values(0.2, 0.3)"}, **options)
    variables = _process(_loaded(DUFFING)).variables
    for row, (seed, delta) in enumerate(zip(found.values["seed.force"], found.values["delta"], strict=True)):
        drawn = dict(zip(variables, standard_normals(int(seed), 21, "force").tolist(), strict=True))
        run = model.simulate(parameters=drawn | {"delta": delta}, error_estimate=False, **options)
        assert found.results["output.force.final"][row] == pytest.approx(
            float(np.ravel(run.outputs["force"])[-1]), rel=1e-12
        )
    assert len(set(found.results["output.force.final"])) == 4
    with pytest.raises(eomgen.errors.UsageError, match="a seed is a whole number from 0 on"):
        model.simulate_many(vary={"seed.force": "uniform(0, 9)"})


def test_info_shows_the_modes_and_what_they_capture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "duffing.toml"
    scene.write_text(toml_text(DUFFING))
    assert main(["info", str(scene), "--json"]) == 0
    (process,) = json.loads(capsys.readouterr().out)["random"]
    assert len(process["variables"]) == 21 and process["window"] == [0.0, 15.0]
    assert process["captured"][-2] < 0.9999 <= process["captured"][-1] and process["standard_deviation"] == 1.0
    assert main(["info", str(scene)]) == 0
    text = capsys.readouterr().out
    assert "force_z1 to force_z21" in text and "99.9942 %" in text and "first modes, 1: 16.4 %," in text
    assert "force_z7" not in text


def test_a_translation_that_turns_round_is_noted_and_one_without_a_value_is_refused() -> None:
    turned = "random.force.translation: it turns round at g = -3.33, 3.3 standard deviations from the mean"
    assert any(note.startswith(turned) for note in _loaded(DUFFING).notes)
    assert not [note for note in _scene(force=FORCE | {"translation": "exp(0.2 * g)"}).notes if "turns" in note]
    with pytest.raises(DescriptionError, match=r"it has no value at g = -6, 6 standard deviations from the mean"):
        _scene(force=FORCE | {"translation": "log(2 + g)"})


def test_coherent_processes_share_variables_and_have_the_covariances_of_their_cross_spectra() -> None:
    base, decay = SquaredExponential(2.0, 1.0), 0.7
    u = {"type": "squared_exponential", "correlation_time": 1.0, "standard_deviation": 2.0, "share": 0.9999}
    scene = _scene(
        u=u | {"duration": 4.0},
        v={"coherence": {"u": decay}, "standard_deviation": 0.5, "mean": 3.0},
        w={"coherence": {"u": [[0, 1], [2, 0.5]], "v": 1.5}, "translation": "2 * g"},
        late={"follows": "v", "delay": 1.5},
    )
    u, v, w, late = (_process(scene, k) for k in range(4))
    assert u.variables == v.variables == w.variables == late.variables == u.own_variables
    assert v.own_variables == () and v.mean == 3.0 and w.coherent_with == ("u", "v")
    assert len([item for item in scene.parameters if "_z" in item.name]) == len(u.modes)

    def covariance(one: NormalSeries, t: float, other: NormalSeries, s: float) -> float:
        rows = [
            np.array([weight * float(mode(np.array(at))) for weight, mode in zip(of.weights, of.modes, strict=True)])
            for of, at in ((one, t - one.lag), (other, s - other.lag))
        ]
        return float(rows[0] @ rows[1])

    cross = CrossCovariance(base, ExponentialCoherence(decay), 4.0)
    for lag in (0.0, 0.8, -1.5):
        exact = float(cross.at(np.array([lag]))[0])
        assert covariance(u, 2.0, v, 2.0 + lag) == pytest.approx(0.25 * exact, abs=2e-3)
        assert covariance(u, 2.0, late, 3.5 + lag) == pytest.approx(0.25 * exact, abs=2e-3)
        assert covariance(v, 2.0, v, 2.0 + lag) == pytest.approx(float(base.at(np.array([lag]))[0]) / 16.0, abs=2e-3)
    assert v.captured[-1] == pytest.approx(0.9999, abs=2e-4)


@pytest.mark.parametrize(
    ("random", "message"),
    [
        ({"v": {"coherence": {"u": -1.0}}}, r"the decay -1 of the coherence with u is not positive; try: a decay such"),
        ({"v": {"coherence": {"u": [[0, 1.2], [1, 0]]}}}, r"of rising frequencies from 0 on, between -1 and 1"),
        ({"v": {"coherence": {"u": [["a", 1], [1, 0]]}}}, r"coherence.u\[0\]\[0\]\): unknown name 'a'"),
        ({"v": {"coherence": {"v": 0.5}}}, r"it is coherent with itself; try: coherence with another process"),
        ({"v": {"coherence": {"u": 0.5}, "seed": 3}}, r"seed is set by u, with which this process is coherent"),
        ({"v": {"coherence": {"u": 0.5}, "correlation": {"u": 0.5}}}, r"both correlation and coherence say"),
        ({"v": {"coherence": {"u": 0.5}}, "w": {"correlation": {"u": 0.5}}}, r"\(random.w.correlation\): it is"),
        ({"v": {"coherence": {"u": 0.1}}, "w": {"coherence": {"u": 0.1}}}, r"no processes have the coherences of u"),
        ({"v": {"coherence": {"u": 1e-7}}}, r"the coherence falls too slowly"),
    ],
)
def test_coherences_that_no_processes_have_are_refused(random: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        _scene(u={"type": "exponential", "correlation_time": 1.0, "share": 0.9}, **random)


@pytest.mark.parametrize(
    ("random", "message"),
    [
        (
            {"v": {"correlation": {"u": 0.9}}, "w": {"correlation": {"u": 0.9, "v": -0.9}}},
            r"\(random.w.correlation\): no processes have the correlations of u, v, w: an eigenvalue of their matrix is"
            r" -0.8, not positive; the nearest ones that some have are 0\.98 away; try: coefficients closer to 0",
        ),
        ({"v": {"correlation": {"v": 0.5}}}, r"it is correlated with itself; try: correlation with another process"),
        ({"v": {"correlation": {"x": 0.5}}}, r"there is no random process 'x'"),
        ({"v": {"correlation": {"w": 0.5}}, "w": {"correlation": {"v": 0.5}}}, r"one process with a type of its own"),
        ({"v": {"correlation": {"u": 0.5}, "share": 0.5}}, r"share is set by u, with which this process is correlated"),
        (
            {"v": {"correlation": {"u": 0.5, "w": 0.1}}, "w": {"correlation": {"u": 0.5, "v": 0.2}}},
            r"its correlation with v is 0.2 here and 0.1 there; try: one of them",
        ),
    ],
)
def test_correlations_that_no_processes_have_are_refused(random: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        _scene(u={"type": "squared_exponential", "correlation_time": 1.0}, **random)


@pytest.fixture
def few_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search for modes ends at 256 nodes of the window in place of 4096."""
    monkeypatch.setattr(karhunen_loeve, "_MOST_NODES", 256)


@pytest.mark.long
def test_covariances_and_correlations_are_repaired_where_that_is_asked_for() -> None:
    bad = {"type": "covariance", "points": [[0, 1], [0.5, -0.9], [1, 0.95], [2, 0]], "duration": 3, "share": 0.9}
    with pytest.raises(DescriptionError, match=r"is -1\.\d+ times the largest; the nearest positive one differs .*"):
        _scene(force=bad)
    scene = _scene(force=bad | {"covariance_repair": "nearest"})
    assert any("the covariance is not positive, and the nearest one that is, 0." in note for note in scene.notes)
    assert _process(scene).captured[-1] >= 0.9 and _process(scene).eigenvalues[-1] > 0.0
    u = {"type": "squared_exponential", "correlation_time": 1.0, "covariance_repair": "nearest"}
    scene = _scene(u=u, v={"correlation": {"u": 0.9}}, w={"correlation": {"u": 0.9, "v": -0.9}})
    assert any("no processes have these; the nearest ones, 0.98 away" in note for note in scene.notes)
    rows = np.zeros((3, 3))
    for k in range(3):
        process = _process(scene, k)
        rows[k, : len(process.weights) // len(_process(scene).modes)] = process.weights[:: len(_process(scene).modes)]
    assert rows @ rows.T == pytest.approx(
        nearest_correlation(np.array([[1, 0.9, 0.9], [0.9, 1, -0.9], [0.9, -0.9, 1]]))
    )


def test_tables_of_modes_are_short_and_as_close_at_the_ends_as_elsewhere() -> None:
    modes = _process(_loaded(DUFFING)).modes
    exact = expand(SquaredExponential(1.0, 1.0), 15.0, modes=21)
    times = np.linspace(0.0, 15.0, 2001)
    off = np.array([mode(times) for mode in modes]) - exact.modes(times)
    assert np.max(np.abs(off)) < 1e-6
    assert len(modes[0].x) < len(modes[-1].x) <= 257


@pytest.mark.parametrize(
    ("text", "law"),
    [
        ("lognormal(300, 30)", stats.lognorm(np.sqrt(np.log(1.01)), scale=300.0 / np.sqrt(1.01))),
        ("uniform(-1, 2)", stats.uniform(-1.0, 3.0)),
        ("weibull(1.5, 2.5)", stats.weibull_min(2.5, scale=1.5)),
        ("gumbel(2, 0.3)", stats.gumbel_r(2.0, 0.3)),
        ("exponential(2)", stats.expon(scale=2.0)),
    ],
)
def test_a_distribution_is_that_of_the_process_whatever_its_own_mean_and_deviation(text: str, law: Any) -> None:
    process = _process(_scene(force=EXPONENTIAL | {"distribution": text, "mean": 2.0, "standard_deviation": 0.5}))
    z = np.array([-6.0, -3.0, -0.5, 0.0, 1.0, 4.0, 6.0])
    found = evaluate_batch(process.translation, lambda symbol: 2.0 + 0.5 * z, along_motion=True)
    expected = np.where(z < 0.0, law.ppf(norm.cdf(z)), law.isf(norm.sf(z)))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8)


def test_quantiles_are_those_of_the_process_and_it_is_straight_beyond_them() -> None:
    quantiles = [[0.01, -3.0], [0.2, -1.0], [0.5, 0.5], [0.9, 2.0], [0.99, 6.0]]
    process = _process(_scene(force=EXPONENTIAL | {"quantiles": quantiles}))
    assert isinstance(process.translation, Application) and isinstance(process.translation.curve, Curve)
    (share, value), curve = np.array(quantiles).T, process.translation.curve
    np.testing.assert_allclose(curve(norm.ppf(share)), value, atol=2e-3)
    x = np.linspace(-6.0, 6.0, 1000)
    assert np.all(np.diff(curve(x)) > 0.0)
    np.testing.assert_allclose(np.diff(curve(np.array([3.0, 4.0, 5.0])), 2), 0.0, atol=1e-3)


@pytest.mark.slow
def test_a_translated_process_has_the_correlation_that_is_asked_for() -> None:
    """Of exp(g) it is (exp(r) - 1) / (e - 1): the closed form, and samples of the process at two times."""
    asked = {"type": "exponential", "correlation_time": 2.0, "share": 0.995, "duration": 4.0}
    process = _process(_scene(force=asked | {"covariance_of": "translated", "translation": "exp(g)"}))
    modes = np.array([mode(np.array([1.0, 2.0])) for mode in process.modes])
    found = float(modes[:, 0] @ modes[:, 1])
    wanted = float(np.exp(-0.5))
    assert found == pytest.approx(np.log(1.0 + wanted * (np.e - 1.0)), abs=5e-3)
    z = np.random.default_rng(0).standard_normal((200_000, len(modes))) @ modes
    assert np.corrcoef(np.exp(z).T)[0, 1] == pytest.approx(wanted, abs=0.015)


@pytest.mark.usefixtures("few_nodes")
def test_a_correlation_of_a_translation_that_no_gaussian_process_makes_in_this_window_is_refused() -> None:
    asked = {"type": "squared_exponential", "correlation_time": 1.0, "duration": 4.0, "share": 0.99}
    with pytest.raises(DescriptionError, match="no Gaussian process is translated to this covariance: its own"):
        _scene(force=asked | {"covariance_of": "translated", "translation": "exp(g)"})


def test_correlations_of_translations_have_their_closed_forms() -> None:
    r = np.array([-1.0, -0.5, 0.3, 1.0])
    lognormal = translated_correlation(np.exp, r)
    np.testing.assert_allclose(lognormal, (np.exp(r) - 1.0) / (np.e - 1.0), atol=1e-12)
    square = translated_correlation(lambda g: (1.0 + 0.3 * g) ** 2, r)
    np.testing.assert_allclose(square, (0.36 * r + 2.0 * 0.3**4 * r**2) / (0.36 + 2.0 * 0.3**4), atol=1e-12)
    with pytest.raises(UsageError, match="the translation has no variance"):
        translated_correlation(lambda g: 0.0 * g + 3.0, r)
