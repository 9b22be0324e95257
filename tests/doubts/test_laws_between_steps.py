"""Laws that act between the steps of a run are named, resolved ones are not; runs compared with themselves tell no
error. References: SciPy's DOP853 in small steps on equations typed here."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.arrays import Array
from eomgen.cli import main
from eomgen.formula.features import Feature
from eomgen.formula.nodes import Number
from tests.simulation.rails import built, on_rail

#: Findings that say that a run may be wrong.
DOUBTS = {
    *("unseen_law", "fast_law", "discretisation_error", "unknown_error", "halved_steps", "energy_balance"),
}
#: Parameters of all laws; amplitudes are 0 unless a test gives them.
NONE = {
    **dict.fromkeys(("cog", "barrier", "box", "pulse", "ramp", "hill", "stiffness", "aside", "wave", "dose"), 0.0),
    **{"period": 1.0, "phase": 0.0, "place": 0.5, "width": 0.01, "time": 0.5},
}
EFFORT = (
    "cog*sin(2*pi*q.x/period + phase)"
    " + barrier*(q.x - place)/width*exp(-((q.x - place)/width)**2)"
    " + (box if place < q.x < place + width else 0)"
    " + (pulse if time < t < time + width else 0)"
    " + ramp*tent((t - time)/width) + hill*tent((q.x - place)/width) - stiffness*q.x"
)


@cache
def sliders() -> eomgen.Model:
    """Return a slider x of 1 kg under every law, one aside that is driven by the place of x, and a dosed state w."""
    builder = on_rail(EFFORT, velocity=1.0).body("aside", 1.0).joint("y", "prismatic", "base", "aside", axis=[0, 1, 0])
    for name, value in NONE.items():
        builder.parameter(name, value, tunable=True)
    points = [[-1e6, 0], [0, 0], [0.25, 0.5], [0.5, 1], [0.75, 0.5], [1, 0], [1e6, 0]]
    builder.curve("tent", points=points, interpolation="linear")
    builder.state("w", rate="wave*cos(2*pi*t/period) + (dose if time < t < time + width else 0)")
    builder.effort("across", "y", "aside*cos(2*pi*q.x/period + phase)").simulation(duration=2.0, step=0.01)
    return built(builder)


def true_motion(given: Mapping[str, float], t: Array) -> Array:
    """Return [x, y, w] of the sliders at times."""
    p = {**NONE, **given}

    def tent(s: float) -> float:
        return float(np.interp(s, [0.0, 0.5, 1.0], [0.0, 1.0, 0.0]))

    def rates(time: float, state: Array) -> list[float]:
        x, _, v, across, _ = state.tolist()
        way, begun = (x - p["place"]) / p["width"], (time - p["time"]) / p["width"]
        angle = 2.0 * math.pi * x / p["period"] + p["phase"]
        force = p["cog"] * math.sin(angle) - p["stiffness"] * x + p["barrier"] * way * math.exp(-min(way * way, 700.0))
        force += p["box"] * (0.0 < way < 1.0) + p["pulse"] * (0.0 < begun < 1.0)
        force += p["ramp"] * tent(begun) + p["hill"] * tent(way)
        dosed = p["wave"] * math.cos(2.0 * math.pi * time / p["period"]) + p["dose"] * (0.0 < begun < 1.0)
        return [v, across, force, p["aside"] * math.cos(angle), dosed]

    narrow = p["barrier"] or p["box"] or p["hill"]
    longest = 0.3 * p["width"] if narrow else 0.1 * p["period"] if p["cog"] or p["aside"] or p["wave"] else np.inf
    ends = np.unique(np.clip([0.0, *(p["time"] + part * p["width"] for part in (0.0, 0.5, 1.0)), t[-1]], 0.0, t[-1]))
    found, state = np.zeros((len(t), 5)), np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    for begin, end in pairwise(ends):
        inner = t[(t >= begin) & (t <= end)]
        asked = np.unique([*inner, end])
        solved = solve_ivp(rates, (begin, end), state, "DOP853", asked, max_step=longest, rtol=1e-6, atol=1e-9)
        found[np.searchsorted(t, inner)] = solved.y.T[np.searchsorted(asked, inner)]
        state = solved.y[:, -1]
    return found[:, [0, 1, 4]]


def off(run: eomgen.Solution, given: Mapping[str, float]) -> float:
    """Return the largest error of a run as a part of the motion, of the largest in m at least a thousandth."""
    true = true_motion(given, run.t)
    size = np.ptp(true, axis=0)
    size[:2] = np.maximum(size[:2], 1e-3 * size[:2].max())
    size[2] = max(size[2], given.get("wave", 0.0) * given.get("period", 0.0) / 6.28, 1e-9)
    return float((np.abs(np.hstack([run.q, run.z]) - true) / size).max())


LAWS = {  # parameters, step at which it is not seen, and one that resolves it
    "cogging, whole periods": ({"aside": 100.0, "period": 0.005}, 0.01, 2e-4),
    "barrier": ({"barrier": 100.0, "width": 0.02}, 0.1, 5e-4),
    "box": ({"box": -300.0, "place": 0.503, "width": 0.001}, 0.05, 2e-5),
    "kick at a tunable time": ({"pulse": 500.0, "time": 0.512}, 0.1, 2e-4),
    "kick of 1 us": ({"pulse": 1e6, "time": 0.512, "width": 1e-6}, 0.05, None),
    "linear table over time": ({"ramp": 200.0, "time": 0.503}, 0.05, 2e-4),
    "linear table over place": ({"hill": 100.0, "place": 0.503}, 0.05, 2e-4),
    "rate, whole periods": ({"wave": 1e3, "period": 0.005}, 0.01, 2e-4),
    "dose": ({"dose": 1e3, "time": 0.5123, "width": 1e-4}, 0.01, None),
}


@pytest.mark.parametrize("period", [0.0, 0.7])
def test_places_between_two_values_are_the_places_of_every_period(period: float) -> None:
    """Against a list of the places of many periods; ``sides`` counts the places that lie below a value."""
    feature = Feature(Number(0.0), np.array([0.1, 0.25, 0.6]), period)
    every = (
        np.sort(np.ravel(feature.places + period * np.arange(-100, 101)[:, np.newaxis])) if period else feature.places
    )
    for low, high in ((-3.3, -1.2), (-0.2, 0.3), (0.2, 5.1), (0.6, 0.6)):
        inside = [place for place in every.tolist() if low <= place <= high]
        assert sorted(feature.between(low, high, 50).tolist()) == pytest.approx(inside)
        first, last = feature.sides(np.array([low - 1e-9, high + 1e-9]))
        assert last - first == len(inside)


def outcome(run: eomgen.Solution) -> set[str]:
    """Return the names of the findings of a run."""
    return {finding.name for finding in run.findings}


@pytest.mark.parametrize(
    ("method", "law"),
    [
        *(("generalized_alpha", law) for law in LAWS),
        *(("rk45", law) for law in ("cogging, whole periods", "box", "rate, whole periods", "kick of 1 us")),
        *(("rk4", law) for law in ("kick at a tunable time", "dose")),
    ],
)
def test_a_law_that_steps_pass_over_is_named(law: str, method: str) -> None:
    given, step, finer = LAWS[law]
    run = sliders().simulate(0.8, step, method=method, parameters=given)
    wrong = off(run, given) > 0.1
    assert wrong or method == "rk45" or law == "barrier"
    assert bool({"unseen_law", "fast_law", "discretisation_error"} & outcome(run)) == wrong, run.message
    for found in (finding for finding in run.findings if finding.name == "unseen_law"):
        assert "acts between the steps at t = " in found.text and "is not seen by them: " in found.text
        remedy = "a step of " if method in ("generalized_alpha", "rk4") else "largest_step = "
        assert found.hint.startswith(remedy) and found.value > 0.05
    if finer is not None and method == "generalized_alpha":
        resolved = sliders().simulate(0.8, finer, method=method, parameters=given)
        assert off(resolved, given) < 0.02 and "unseen_law" not in outcome(resolved), resolved.message


BARRIER = "20*(q.x - 0.5)/0.02**2*exp(-((q.x - 0.5)/0.02)**2)*0.1"


def test_the_message_names_law_time_size_and_step() -> None:
    run = sliders().simulate(0.8, 0.1, method="rk4", parameters=LAWS["kick at a tunable time"][0])
    (found,) = (finding for finding in run.findings if finding.name == "unseen_law")
    assert found.text.startswith("the formula pulse if (time < t) * (t < time + width) else 0 acts between the steps")
    assert 0.512 <= found.time <= 0.522 and "v.x by 5 m/s" in found.text
    assert 2e-4 < float(found.hint.split()[3]) < 5e-3
    assert str(found) in run.message


ESCAPES = {  # effort, velocity (m/s), method, end, rows (s), tolerance, true place at the end (m)
    "finer runs go another way": ("-27 if t0 < t < t0 + 0.11 else 0", 1.0, "rk45", 2.5, 0.25, 1e-3, -3.75),
    "barrier as long as a step": (BARRIER, 1.35, "generalized_alpha", 2.0, 0.1, None, None),
    "slow behind a barrier": ("-12.07 if 0.2094 < q.x < 0.3031 else 0", 1.52, "rosenbrock", 2.0, 0.02, None, None),
    "adaptive of second order": ("-27 if t0 < t < t0 + 0.11 else 0", 1.0, "generalized_alpha", 2.5, 0.25, 1e-3, -3.75),
    "adaptive over a box": ("-25 if 0.63 < q.x < 0.69 else 0", 0.8, "rk45", 2.0, 0.2, 1e-7, -0.289),
}


@pytest.mark.parametrize("escape", ESCAPES)
def test_a_law_does_not_escape_by_what_the_examination_compares_with(escape: str) -> None:
    effort, velocity, method, end, step, tolerance, place = ESCAPES[escape]
    model = built(on_rail(effort, velocity=velocity).parameter("t0", 0.34, tunable=True), method=method)
    given: dict[str, Any] = {} if tolerance is None else {"tolerance": tolerance, "settings": {"largest_step": 0.0}}
    run = model.simulate(end, step, **given)
    assert "unseen_law" in outcome(run), run.message
    resolved = model.simulate(end, 2e-4, **given)
    if place is not None:  # straight lines and parabolas
        assert resolved.q[-1, 0] == pytest.approx(place, abs=0.02)
        assert abs(run.q[-1, 0] - place) > 1.0
    assert "unseen_law" not in outcome(resolved), resolved.message


@cache
def arm() -> eomgen.Model:
    builder = eomgen.SceneBuilder("arm").body("upper", 1.2, center_of_mass=[0, 0, -0.25], inertia=[0.03, 0.03, 0.001])
    builder.body("lower", 0.8, center_of_mass=[0, 0, -0.2], inertia=[0.02, 0.02, 0.001])
    builder.joint("shoulder", "revolute", "base", "upper", axis=[0, 1, 0], damping=0.1, initial={"position": 0.5})
    builder.joint(
        "elbow", "revolute", "upper", "lower", position=[0, 0, -0.5], axis=[0, 1, 0], damping=0.05,
        initial={"position": 1.0},
    )  # fmt: skip
    return eomgen.build(builder.build(), profile="quick")


@pytest.mark.parametrize(("method", "start"), [("rk4", 0.5), ("generalized_alpha", 2.0)])
@pytest.mark.parametrize("step", [0.2, 0.5, 3.0])
@pytest.mark.parametrize("steps", [1, 2])
def test_few_steps_are_not_compared_with_themselves(method: str, start: float, step: float, steps: int) -> None:
    run = arm().simulate(steps * step, step, method=method, initial={"shoulder": start})
    solved = solve_ivp(
        arm().rhs, (0.0, run.t[-1]), [*run.q[0], *run.v[0]], "DOP853", rtol=1e-9, atol=1e-9, max_step=0.05
    )
    wrong = np.abs(run.q[-1] - solved.y[:2, -1]).max() / np.ptp(solved.y[:2], axis=1).max()
    if run.success and wrong > 0.1:
        assert outcome(run) & DOUBTS, run.message
        assert not (run.error.available and run.error.relative == 0.0)
    if not run.error.available and run.success:
        assert f"the discretisation error is not known: {run.error.reason}; try: a step smaller" in run.message


@pytest.mark.slow
def test_a_state_that_seems_at_rest_at_the_rows_is_measured_between_them() -> None:
    given = {"wave": 1e3, "period": 0.005, "stiffness": 1.0}
    run = sliders().simulate(0.4, 0.01, method="rk45", tolerance=1e-8, parameters=given)
    assert np.ptp(run.z) < 1e-3  # and moves by 1.6 between the rows
    assert run.error.relative < 1e-3 and off(run, given) < 1e-3
    assert run.message.endswith("taken again)")


@pytest.mark.slow
def test_no_run_is_wrong_by_a_tenth_without_a_word_and_resolved_ones_are_quiet() -> None:
    random = np.random.default_rng(0)
    methods = ["generalized_alpha", "rk4", "rk45", "rosenbrock", "trapezoidal", "tdg1", "rattlie", "adaptive"]
    for _ in range(12):
        law = str(random.choice(["cog", "barrier", "box", "pulse", "ramp", "hill", "aside", "wave", "dose"]))
        over_time, whole = law in ("pulse", "ramp", "dose"), law in ("cog", "aside", "wave")
        width = 10.0 ** random.uniform(-4.0 if over_time else -2.3, -0.5)
        strength = 10.0 ** random.uniform(-2.0, 1.0) * (10.0 if whole else 1.0 / width)
        given = {
            law: strength * random.choice([-1.0, 1.0]),
            "width": width,
            "period": 10.0 ** random.uniform(-1.7, -0.2),
            "phase": random.uniform(0.0, 6.0),
            "place": random.uniform(0.1, 0.9),
            "time": random.uniform(0.1, 1.2),
            "stiffness": random.choice([0.0, random.uniform(1.0, 20.0)]),
        }
        method, every = str(random.choice(methods)), int(random.choice([1, 1, 1, 4]))
        step, tolerance = 10.0 ** random.uniform(-2.7, -1.0), 10.0 ** random.uniform(-7.0, -3.0)
        options = {"method": method} if method != "adaptive" else {"method": "generalized_alpha"}
        if method in ("rk45", "adaptive"):
            options["tolerance"] = tolerance
        run = sliders().simulate(1.5, step, parameters=given, record_every=every, **options)
        if run.success:
            error = off(run, given)
            assert outcome(run) & DOUBTS or error < 0.1, (given, method, step, every, error, run.message)
            assert error > 0.01 or "unseen_law" not in outcome(run), (given, method, step, every, error, run.message)


@pytest.mark.parametrize("text", ["0", "-1", "nan", "-2 ms"])
def test_a_largest_step_that_is_none_is_refused(text: str, capsys: pytest.CaptureFixture) -> None:
    assert main(["simulate", "scene.toml", "--out", "there", f"--largest-step={text}"]) == 2
    assert f"--largest-step: '{text}' is not a step; try: 0.003, or \"3 ms\"" in capsys.readouterr().err


#: Loads of 1 kg, or 1 kg m^2, that a narrow part stops or slows down, by a quantity of the place where they act.
NARROW_BY_PLACE = {
    "position": ("prismatic", "force", "-30*exp(-((position.here[0] - 0.73)/0.006)**2)"),
    "rotation": ("revolute", "torque", "-30*exp(-((rotation.here[0] - 0.73)/0.006)**2)"),
    "velocity": ("prismatic", "force", "1 - 2*exp(-((velocity.here[0] - 1.753)/0.004)**2)"),
    "angular_velocity": ("revolute", "torque", "1 - 2*exp(-((angular_velocity.here[0] - 1.753)/0.004)**2)"),
}


@pytest.mark.parametrize("quantity", NARROW_BY_PLACE)
def test_a_narrow_load_by_a_quantity_of_its_place_is_seen(quantity: str) -> None:
    """Reference: the work of a barrier, 30*0.006*sqrt(pi) J; a level that holds a velocity at 0.004*sqrt(ln 2) below.

    Both take effect within about 0.01 s.
    """
    joint, load, formula = NARROW_BY_PLACE[quantity]
    placed = eomgen.SceneBuilder("placed", gravity=[0, 0, 0]).body("a", 1.0, inertia=[1, 1, 1])
    placed.joint("x", joint, "base", "a", axis=[1, 0, 0], initial={"velocity": 1.3})
    model = built(placed.force("k", body="a", **{load: [formula, 0, 0]}))
    if "velocity" in quantity:
        level = 1.753 - 0.004 * math.sqrt(math.log(2.0))
        end = 0.5 * (1.3 + level) * (level - 1.3) + level * (2.0 - (level - 1.3))
    else:
        after = math.sqrt(1.3**2 - 2.0 * 30.0 * 0.006 * math.sqrt(math.pi))
        end = 0.73 + after * (2.0 - 0.73 / 1.3)
    for options in ({"method": "generalized_alpha"}, {"method": "rk45", "tolerance": 1e-5}):
        run = model.simulate(2.0, 0.1, **options)
        wrong = abs(float(run.q[-1, 0]) - end) > 0.01 * end
        assert wrong == ("unseen_law" in outcome(run)), (options, run.q[-1], end, run.message)


@pytest.mark.parametrize("argument", ["q.x", "rotated"])
def test_a_barrier_of_any_width_is_seen_by_any_name_of_the_place(argument: str) -> None:
    """The work of the barrier does not depend on its width; the place is 0.2 m ahead of the joint on the body, whose x
    axis is the world's -y axis if it is rotated."""
    turned = argument == "rotated"
    formula = f"-0.18/width*exp(-(({'-position.here[1] - 0.2' if turned else argument} - 0.73)/width)**2)"
    rotation = {"rotation": [{"axis": [0, 0, 1], "angle": "90 deg"}]} if turned else {}
    axis = [0, -1, 0] if turned else [1, 0, 0]
    placed = on_rail(axis=axis, velocity=1.3, **rotation).parameter("width", 0.01, tunable=True)
    place, force = ([0, -0.2, 0], [0, f"-({formula})", 0]) if turned else ([0.2, 0, 0], [formula, 0, 0])
    model = built(placed.force("k", body="b", point=place, force=force, axes="body" if turned else "world"))
    after = math.sqrt(1.3**2 - 2.0 * 0.18 * math.sqrt(math.pi))
    for width in (1e-2, 1e-3, 1e-5):
        run = model.simulate(2.0, 0.1, method="rk4", parameters={"width": width})
        wrong = abs(float(run.q[-1, 0]) - 0.73 - after * (2.0 - 0.73 / 1.3)) > 0.1
        assert wrong == ("unseen_law" in outcome(run)), (width, run.q[-1], run.message)


@pytest.mark.parametrize(
    ("law", "gravity", "speed", "step"),
    [("exp(-4000 * q.rail)", -9.81, 1.0, 0.05), ("exp(-4000 * q.rail) - exp(4000 * (q.rail - 1))", 0.0, 3.0, 0.01)],
)
def test_forces_that_overflow_between_the_steps_give_no_warning_of_numpy(
    law: str, gravity: float, speed: float, step: float
) -> None:
    builder = eomgen.SceneBuilder("wall", gravity=[gravity, 0, 0]).body("cart", 1.0)
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], initial={"position": 0.5, "velocity": -speed})
    model = eomgen.build(builder.effort("wall", "rail", law).build(), profile="instant")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert model.simulate(1.5, step, method="rk45").success


@pytest.mark.slow
def test_a_held_force_is_no_law_between_the_steps() -> None:
    """Sampled states keep their values between samples: a coarse converter makes no law of the slow gust beside it."""
    held = on_rail("force + gust", "rail").input("gust", "0.3*sin(2*t)")
    held.state("force", sample=0.02, delay=0.01, formula="-400*q.rail - 30*v.rail", quantum=2.0)
    run = built(held).simulate(2.0, 0.005, initial={"rail": 0.1})
    assert "unseen_law" not in outcome(run), run.message


def test_partials_by_one_factorization_are_differences_of_accelerations() -> None:
    """Rates by whole solutions on both sides of each move."""
    model = eomgen.build("examples/four_bar/scene.toml", profile="quick")
    q, v = np.tile(model.initial_q, (3, 1)), np.tile(model.initial_v, (3, 1))
    v = v * [[0.1], [-0.7], [2.0]]
    moves, expected = [], []
    for block in ("q", "v"):
        for k in range(model.nv):
            shift = np.zeros(model.nv)
            shift[k] = 1e-6
            ahead, behind = ({"q": q, "v": v} | {block: (q if block == "q" else v) + side * shift} for side in (1, -1))
            moves.append((ahead, behind, 2e-6))
            two = [model.constrained_dynamics(one["q"], one["v"])[0] for one in (ahead, behind)]
            expected.append((two[0] - two[1]) / 2e-6)
    given = {"q": q, "v": v, "t": 0.0, "u": None, "z": None, "parameters": None, "base": None}
    partials = model.evaluator.acceleration_partials(moves, **given)
    np.testing.assert_allclose(partials, np.stack(expected, axis=-1), rtol=1e-6, atol=1e-7 * np.abs(partials).max())


@pytest.mark.slow
def test_a_search_that_is_left_out_is_named() -> None:
    swift = on_rail("100 * exp(-((q.x - 0.055) / 0.001)**2)", velocity=1.0)
    swift.event("there", "(q.x - 0.031) * (q.x - 0.033) * (q.x - 0.035) * (q.x - 0.037) * (q.x - 0.039)")
    model = built(swift, method="taylor")
    quick, whole = (model.simulate(0.1, 0.01, error_estimate=choice) for choice in (False, True))
    assert not quick.findings and str(quick.error) == (
        "not known: it was switched off, and with it the search for laws that act between the steps and pairs of events"
    )
    assert "missed_event" in outcome(whole)
