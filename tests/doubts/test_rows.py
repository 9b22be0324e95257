"""Each row of doubts on both sides of each of its limits: a number just inside is silent, a number just outside is
reported, and not if the row is silenced. Limits are written here again, so a changed one is noticed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, NamedTuple, cast

import numpy as np
import pytest

import eomgen
from eomgen.base.limits import CALLED, DoubtSettings
from eomgen.compiled.rest.state_warnings import StateWarning, equilibrium_notes
from eomgen.formula.nodes import Number, Symbol
from eomgen.products.doubts import (
    accuracy,
    fast_motions,
    momentum,
    notes,
    remarks,
    rests,
    start_checks,
    unseen_events,
    unseen_laws,
)
from eomgen.products.doubts.sampled_run import SampledRun
from eomgen.results.finding import Finding
from eomgen.scene.document.notes import Note
from eomgen.simulation.accuracy import fastest_rates
from eomgen.simulation.accuracy.fastest_rates import FastestRates, Rate
from eomgen.simulation.judgement import singular_positions
from eomgen.simulation.judgement.finished_run import Check, FinishedRun, UnseenLaw
from eomgen.simulation.judgement.register import BY_NAME, Verdict
from eomgen.system.description import Wheel
from tests.rest.test_state_warnings import line, machine, point
from tests.simulation.test_findings import (
    FOUND,
    LARGE,
    Change,
    begun,
    bounded,
    finished,
    having,
    method_with,
    returning,
    statistics,
)

Reported = Mapping[str, str]


class Case(NamedTuple):
    """Two sides of a limit.

    Attributes
    ----------
    inside, outside : numbers next to the limit, or other values that are right and doubtful
    reports : returns the texts of the reported doubts by name, for a value
    said : part of the text that the limit decides about; empty if it decides about the doubt
    """

    inside: Any
    outside: Any
    reports: Callable[[Any], Reported]
    said: str = ""


def of_scene(scene: Callable[[Any], Mapping[str, Any]]) -> Callable[[Any], Reported]:
    """Report the notes of scenes."""

    def reports(value: Any, quiet: tuple[str, ...] = ()) -> Reported:
        found = eomgen.load({**ARM, **scene(value), "doubts": {"quiet": quiet}}).notes
        return {getattr(note, "doubt"): note for note in found}  # noqa: B009  # of a text

    return reports


@contextmanager
def without_doubts(names: tuple[str, ...]) -> Iterator[None]:
    """Leave out doubts by name within the block, as a call does."""
    before = CALLED.set(DoubtSettings(names))
    try:
        yield
    finally:
        CALLED.reset(before)


def of_rest(rest: Callable[[Any], Any]) -> Callable[[Any], Reported]:
    """Report the warnings of equilibria."""

    def reports(value: Any, quiet: tuple[str, ...] = ()) -> Reported:
        measures, path = rest(value)
        with without_doubts(quiet):
            return {note.doubt: note for note in equilibrium_notes(measures, path, None)}

    return reports


def of_run(changes: Callable[[Any], tuple[Change, ...]]) -> Callable[[Any], Reported]:
    """Report the checks of a run of the pendulum, of which quantities are changed."""

    def reports(value: Any, quiet: tuple[str, ...] = ()) -> Reported:
        with pytest.MonkeyPatch.context() as patch, without_doubts(quiet):
            run = finished(patch, *changes(value))
            patch.setattr(FinishedRun, "has", lambda self, facts: True)
            return {finding.name: finding.text for finding in Verdict(run).findings}

    return reports


ARM: dict[str, Any] = {
    "format": 1,
    "name": "arm",
    "gravity": [0, 0, -9.81],
    "bodies": {"arm": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1], "center_of_mass": [0, 0, -0.5]}},
    "joints": {"hinge": {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0]}},
    "points": {
        "tip": {"body": "arm", "position": [0, 0, -1]},
        "end": {"body": "arm", "position": [0.5, 0, 0]},
        "wall": {"body": "base", "position": [0, 0, 0.5]},
    },
}


def hinge(**keys: Any) -> Mapping[str, Any]:
    return {"joints": {"hinge": {**ARM["joints"]["hinge"], **keys}}}


def arm(**keys: Any) -> Mapping[str, Any]:
    return {"bodies": {"arm": {**ARM["bodies"]["arm"], **keys}}}


def spring(second: str = "wall", **keys: Any) -> Mapping[str, Any]:
    return {"springs": {"stay": {"first": "tip", "second": second, **keys}}}


def sampled(sample: float, delay: float = 0.0) -> Mapping[str, Any]:
    keys = {"delay": delay} if delay else {}
    return {"states": {"seen": {"sample": sample, "formula": "q.hinge", "unit": "rad", **keys}}}


def shape(off: float) -> Mapping[str, Any]:
    """Return a rod of the base that ends at a point of the arm, at a distance from the axis of the hinge."""
    points = {**ARM["points"], "pin": {"body": "arm", "position": [off, 1.0, 0]}}
    rod = {"type": "capsule", "body": "base", "first": "wall", "second": "pin", "radius": 0.01}
    return {"points": points, "shapes": {"rod": rod}}


def beam(diameter: float = 0.01, stretch: float = 0.0, off: float = 0.0) -> Mapping[str, Any]:
    """Return a clamped beam of 1 m, of which a load is off the axis."""
    ring = {"shape": "circle", "diameter": diameter, "density": 1.0, "elastic_modulus": 1.0, "poisson_ratio": 0.3}
    stiffness = {"torsion": 1.0, "bending_y": 1.0, "bending_z": 1.0, "stretch": stretch, "shear_y": 1.0, "shear_z": 1.0}
    own = {"stiffness": stiffness, "mass_per_length": 1e-3, "rotary_inertia": [2e-5, 1e-5, 1e-5]}
    return {
        "beams": {"b": {"model": "cosserat", "length": 1.0, "elements": 1, **(own if stretch else {"section": ring})}},
        "joints": {**ARM["joints"], "clamp": {"type": "fixed", "parent": "base", "child": "b"}},
        "forces": {"f": {"body": "b", "point": [0.5, 0, off], "force": [0, 0, 1]}},
    }


def wheel(vertical: float) -> Mapping[str, Any]:
    slip = {"axis": [0, math.sqrt(1.0 - vertical**2), vertical], "stiffness": 1}
    return {"tyres": {"tyre": {"center": "tip", "radius": 0.3, "stiffness": 1e4, "road": -5, "slip": slip}}}


def rolling(height: float) -> Mapping[str, Any]:
    """Return a ball on a horizontal plane, whose centre starts at a height above the plane."""
    plane = {
        "type": "sliding",
        "first": {"body": "base", "axis": [0, 0, 1]},
        "second": {"body": "ball", "axis": [0, 0, 1]},
    }
    joint = {"type": "free", "parent": "base", "child": "ball", "initial": {"position": [0, 0, height]}}
    return {
        "bodies": {**ARM["bodies"], "ball": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}},
        "joints": {**ARM["joints"], "ball": joint},
        "constraints": {"ground": {**plane, "radius": 0.1}},
    }


def based(**keys: Any) -> Mapping[str, Any]:
    return {"base": keys, "simulation": {"duration": 1.0, "step": 1e-3}}


def dense(density: float) -> Mapping[str, Any]:
    """Return a small body beside the arm, in a cube of twice its centre's distance from its origin."""
    pebble = {"mass": density * 0.2**3, "inertia": [0.01, 0.01, 0.01], "center_of_mass": [0.1, 0, 0]}
    joint = {"type": "revolute", "parent": "base", "child": "pebble", "axis": [1, 0, 0]}
    return {"bodies": {**ARM["bodies"], "pebble": pebble}, "joints": {**ARM["joints"], "pebble": joint}}


NOTES: dict[str, tuple[Case, ...]] = {
    "unused names": (Case({}, {"idle": {"value": 1.0}}, of_scene(lambda x: {"parameters": x})),),
    "plain angles": (Case(3.0, 30.0, of_scene(lambda x: hinge(initial={"position": x}))),),
    "plain angles in formulas": (Case(6, 30, of_scene(lambda x: {"outputs": {"far": {"formula": f"q.hinge - {x}"}}})),),
    "plain lengths in formulas": (
        Case(99, 101, of_scene(lambda x: {"outputs": {"far": {"formula": f"position.tip[0] - {x}"}}})),
    ),
    "plain times": (
        Case(49, 51, of_scene(lambda x: sampled(1.0, x))),
        Case(9.9, 10.1, of_scene(sampled)),
    ),
    "negative stiffness or damping": (Case(0.5, -0.5, of_scene(lambda x: hinge(damping=x))),),
    "springs without laws": (Case(1.0, 0.0, of_scene(lambda x: spring(stiffness=x, length=1.0))),),
    "springs within a body": (Case("wall", "end", of_scene(lambda x: spring(x, stiffness=1.0, length=1.0))),),
    "shapes that leave their points": (Case(0.99e-6, 1.01e-6, of_scene(shape)),),
    "values out of scale": (
        Case(99.0, 101.0, of_scene(lambda x: spring(stiffness=1.0, length=x))),
        Case(9.9**2, 10.1**2, of_scene(lambda x: arm(inertia=[x, x, x]))),
        Case(7_990.0, 8_010.0, of_scene(lambda x: arm(mass=x))),
        Case(24_900.0, 25_100.0, of_scene(dense)),
    ),
    "efforts on drives": (
        Case(
            {},
            {"drive": "0.1 * sin(t)"},
            of_scene(lambda x: {**hinge(**x), "efforts": {"e": {"joint": "hinge", "effort": 1}}}),
        ),
    ),
    "loads without a size or a component": (
        Case(
            {"force": [0, 0, 1]}, {}, of_scene(lambda x: {"forces": {"f": {"body": "arm", "point": [0, 0, -1], **x}}})
        ),
    ),
    "doubtful beams": (
        Case(1.0 / 24_900.0, 1.0 / 25_100.0, of_scene(beam)),
        Case(0.249, 0.251, of_scene(lambda x: beam(off=x))),
        Case(0.99e13, 1.01e13, of_scene(lambda x: beam(stretch=x))),
    ),
    "tyres in the road": (Case(0.899, 0.901, of_scene(wheel)),),
    "bodies below planes of contact": (Case(0.1, -0.1, of_scene(rolling)),),
    "base that falls freely": (Case(9.81, -9.81, of_scene(lambda x: based(acceleration=[0, 0, x]))),),
    "base opposite to gravity or moved twice": (
        Case(9.81 * 0.979, 9.81 * 0.981, of_scene(lambda x: based(acceleration=[0, 0, f"{x} + 0 * t"]))),
    ),
    "base with motions far beyond the scene": (
        Case(4.95, 5.05, of_scene(lambda x: based(position=[0, 0, f"{x} * sin(30 * t)"]))),
        Case(9.9, 10.1, of_scene(lambda x: based(position=[0, 0, f"10.1 * sin({math.sqrt(x / 10.1 * 10.0)} * t)"]))),
    ),
}


def through(*places: tuple[float, float, float]) -> Any:
    """Return a spring from the world to a body that goes through the places."""
    return machine(
        {"mass": list(places)},
        points=(point("wall", "world"), point("hook", "mass")),
        lines=(line("spring", "wall", "hook"),),
    )


def bent(error: float) -> Any:
    """Return a beam of one element that bends within itself."""
    measures, path = machine({"a": [(0.0, 0.0, 0.0)] * 2, "b": [(0.0, 0.0, 0.0)] * 2})
    element = SimpleNamespace(nodes=("a", "b"), twists=np.zeros((1, 6)), lengths=[1.0])
    element.matrices = lambda values: np.zeros((1, 6, 6))
    element.bending_within = lambda values, forces: np.array([math.sqrt(2.0 * error)])
    measures.model.description.element_stiffness = (element,)  # type: ignore[misc, assignment]
    return measures, path


def sinking(end: float) -> Any:
    wheels = (Wheel("front", "hub", Number(0.3), Number(0.4), Number(1e5)),)
    return machine({"wheel": [(0.0, 0.0, 0.5), (0.0, 0.0, end)]}, points=(point("hub", "wheel"),), wheels=wheels)


RESTS: dict[str, tuple[Case, ...]] = {
    "inverted springs": (
        Case(0.0501, 0.0499, of_rest(lambda x: through((1.0, x, 0.0), (-1.0, x, 0.0))), "inside out"),
    ),
    "inverted tyres": (Case(0.41, 0.39, of_rest(sinking)),),
    "coarse beams": (Case(0.0099, 0.0101, of_rest(bent)),),
    "long ways": (Case(1.09, 1.11, of_rest(lambda x: machine({"far": [(0.6, 0.8, 0.0), (0.6, 0.8 + x, 0.0)]}))),),
}


def found(value: object) -> Finding | None:
    return FOUND if value else None


def hidden(share: float) -> Change:
    """Give the hinge an error in parts of its motion."""

    def change(run: FinishedRun, patch: pytest.MonkeyPatch) -> None:
        error = share * float(np.ptp(run.states.q))
        vars(run)["error"] = replace(LARGE, relative=0.0, increment_at=np.array([[error]]))

    return change


def floating(drift: float) -> Change:
    """Give a sphere in free flight a velocity that falls by a part."""
    builder = eomgen.SceneBuilder("sphere", gravity=[0, 0, 0]).body("sphere", 1.0, inertia=[1.0, 1.0, 1.0])
    model = eomgen.build(builder.joint("root", "free", "base", "sphere").build(), profile="instant")
    q, v = np.tile(model.initial_q, (2, 1)), np.zeros((2, 6))
    v[:, 3] = 1.0, 1.0 - drift
    told = momentum.momentum_drift(model, (np.array([0.0, 1.0]), q, v, np.zeros((2, 0))), model.parameter_array())
    return returning(accuracy, "momentum_drift", told)


def rounded(share: float) -> tuple[Change, ...]:
    def change(run: FinishedRun, patch: pytest.MonkeyPatch) -> None:
        vars(run)["states"] = run.states._replace(multipliers=np.ones((len(run.states.t), 1)))
        patch.setattr(accuracy, "momentum_drift", lambda *_: None)

    return statistics(max_rounding=share), change


def singular(part: float) -> tuple[Change, ...]:
    def change(run: FinishedRun, patch: pytest.MonkeyPatch) -> None:
        patch.setattr(singular_positions, "_by_nonzeros", lambda *_: (np.array([1.0, part]), 1.0))
        model, none = cast(Any, SimpleNamespace(multipliers=("pin",), functions=())), np.zeros((2, 1))
        nearest = singular_positions.nearest(model, np.array([0.0, 0.05]), none, np.zeros(0), 0)
        patch.setattr(accuracy, "nearest_singular", lambda *_: nearest)

    return statistics(halvings=3), change


def evaluating(name: str, evaluate: Callable[[FinishedRun], Iterable[Finding]]) -> Change:
    """Evaluate a check by another function."""
    return lambda run, patch: patch.setitem(cast(Any, BY_NAME), name, replace(BY_NAME[name], evaluate=evaluate))


def grown(sizes: list[float], travel: float = 1.0) -> Change:
    """Give a velocity the sizes in the quarters of a run of 4 travel s."""
    model = SimpleNamespace(nv=1, q_units=("rad",), v_units=("rad/s",), v_names=("v.hinge",))
    model.library = SimpleNamespace(layout={"method": {}})
    t = np.repeat([0.0, 1.0, 2.0, 3.0], 8) * travel
    t[-1] = 4.0 * travel
    states = SimpleNamespace(t=t, v=np.repeat(sizes, 8)[:, np.newaxis], q=np.zeros((32, 1)))
    run = cast(Any, SimpleNamespace(model=model))
    return returning(remarks, "unbounded_growth", remarks.unbounded_growth(run, cast(Any, states)))


def oscillating(step: float = 1.2, share: float = 1.0, ratio: float = 10.0) -> Change:
    """Give a mass on a spring, with an angular frequency of 1/s, a deflection: in parts of the acceleration of another
    mass, and of its deflection before an event."""
    builder = eomgen.SceneBuilder("masses", gravity=[0, 0, 0]).body("fast", 1.0).body("slow", 1.0)
    builder.joint("fast", "prismatic", "base", "fast", axis=[1, 0, 0], stiffness=1.0)
    builder.joint("slow", "prismatic", "base", "slow", axis=[1, 0, 0]).effort("pull", "slow", 1.0)
    model = eomgen.build(builder.build(), profile="instant")
    with pytest.MonkeyPatch.context() as patch:
        run = finished(patch, model=model).run
    q, none, p = np.array([share / math.sqrt(1.0 - min(share, 0.999) ** 2), 0.0]), np.zeros(2), model.parameter_array()
    before = q / ratio, none, np.zeros(0), p
    place = fast_motions._ExaminedState("the event", 0.0, q, none, np.zeros(0), p, before)
    swing = fast_motions._UnresolvedModes(run, place, step, np.zeros((1, 2))).largest()
    return having(error=replace(LARGE, relative=0.0, unresolved=str(FOUND) if swing else ""))


def missed(beyond: float, seen: float, *, sampled: bool) -> tuple[Change, ...]:
    roots = object.__new__(unseen_events._Roots)
    roots._sampled = sampled
    missing = roots._beyond(np.array([seen + beyond]), np.array([seen]))
    return having(error=replace(LARGE, relative=0.0)), returning(unseen_events, "unseen_events", found(missing.any()))


def varying(share: float) -> Change:
    """Give a law of time values between steps that are off by a part of their standard deviation."""
    off = share * math.sqrt(3.0 / (3.0 - share**2))  # of values of 1 and -1 at the ends and on the line between
    shown, sides = np.array([1.0, -1.0] * 50), off * np.array([1.0, 1.0, -1.0, -1.0] * 25)
    law = fast_motions._Law("the input f", "N", np.array([shown, shown]), shown + sides, shown)
    return returning(fast_motions, "_inputs", [law])


def examination(**values: Any) -> Any:
    """Return an examination of laws between steps with the given quantities alone."""
    result = object.__new__(unseen_laws._Examination)
    vars(result).update(values)
    return result


def unseen(law: object) -> Change:
    return having(passed_over=UnseenLaw(FOUND, "the formula f", 0.01) if law else None)


def lacking(net: float = 0.0, within: float = 0.0) -> Change:
    """Give a step defects at its end and within, in parts of a velocity."""
    known = {"_sizes": np.ones(1), "_sizes_after": np.ones((2, 1)), "_left_out": np.zeros(1, dtype=bool)}
    defects = unseen_laws._Defects(np.array([0]), np.array([[net]]), np.array([[within]]), np.zeros(1))
    return unseen(examination(**known, _least=unseen_laws.DEFECT)._excess(defects, 1.0) > 1.0)


def aliased(off: float = 1.0, ends: float = 0.0, part: float = 1.0) -> Change:
    """Give a part of 100 steps a law that is off its chord in its middle, between ends of both signs."""
    inside = off * np.array([1.0, 1.0, -1.0, -1.0] * 25)
    inside[round(100 * part) :] = 0.0
    laws = [(inside, ends * np.array([1.0, -1.0] * 51)[:101])]
    known = {"_steps": np.arange(100), "_met_steps": np.zeros(100, dtype=bool), "_grid": np.array([0.0, 0.5, 1.0])}
    known |= {"_samples": None, "_path": SimpleNamespace(at_rows=None), "_features": [], "_arguments": []}
    looked = examination(**known, _laws=lambda *_: laws)
    return unseen(looked.looked_at and looked._aliased)


def understated(effect: float) -> Change:
    """Give an aliased law an effect in parts of the stated error, 0.01."""
    path = SimpleNamespace(run=SimpleNamespace(method=SimpleNamespace(chooses_steps=False)))
    error = SimpleNamespace(relative=0.01, available=True)
    known = {
        "looked_at": [0],
        "_whole": [0],
        "_steps": [0],
        "_aliased": True,
        "_still": False,
        "_least": unseen_laws.DEFECT,
    }
    looked = examination(**known, _path=path, _finished=SimpleNamespace(error=error))
    looked._judge = lambda *_: 0.01 * effect > looked._least or None
    return unseen(looked.finding())


def passing(*vectors: tuple[float, float]) -> Change:
    """Give a spring of 1 m two vectors from end to end."""
    met = remarks._meetings(np.array([[*vector, 0.0] for vector in vectors]), 1.0)
    return evaluating("passed_spring", lambda _: [FOUND] * bool(met.any()))


def quantised(span: float, values: int) -> Change:
    """Give a state with a quantum of 1 a span, and its formula a number of values."""
    symbol = Symbol("q", "hinge")
    held = SimpleNamespace(quantum=1.0, controller="", formula=symbol)
    state = SimpleNamespace(name="seen", unit="", sampling=held)
    model = SimpleNamespace(z_names=("z.seen",), description=SimpleNamespace(states=(state,)))
    exact = np.arange(20.0) % values / values
    run = SimpleNamespace(model=model, parameters=None, signals=None)
    fake = cast(FinishedRun, SimpleNamespace(run=run, states=SimpleNamespace(z=np.array([[1.0], [1.0 + span]]))))

    def change(run: FinishedRun, patch: pytest.MonkeyPatch) -> None:
        patch.setattr(remarks, "_values_at_rows", lambda *_: {("q", "hinge", 0): exact})
        evaluating("coarse_quantum", lambda _: remarks.coarse_quanta(fake))(run, patch)

    return change


def steep(share: float, sign: float) -> tuple[Change, ...]:
    """Give a velocity that falls from 1 to -1 a law with a jump at 0, as a part of its change within the step."""
    rates = object.__new__(fastest_rates._RateSearch)
    step = np.array([[1.0], [-1.0]])
    states = SimpleNamespace(v=step, t=np.array([0.0, 0.05]))
    run = SimpleNamespace(settings={"step": 1.0})
    vars(rates).update(
        _states=states, _slow=np.zeros(1), _left=100, _run=run, _model=SimpleNamespace(v_names=("v.hinge",))
    )
    jump = 0.5 * share / (1.0 - share)
    vars(rates).update(_way=lambda *_: np.ones(1), _next_velocities=lambda: step)
    vars(rates).update(_accelerations=lambda _, v: sign * (0.5 * v + jump * np.sign(v)))
    decay, rise, _ = rates._within(0, 0)
    return method_with(real_stability=1e-9), having(fastest=FastestRates(decay, rise))


def fastest(**rates: float) -> Change:
    """Give a run fastest rates in parts of its step."""

    def change(run: FinishedRun, patch: pytest.MonkeyPatch) -> None:
        found = {name: Rate(rate / run.settings["step"], 0.05, "v.hinge") for name, rate in rates.items()}
        vars(run)["fastest"] = FastestRates(**found)

    return change


def cancelling(error: float) -> tuple[Change, ...]:
    """Give the start accelerations with a relative error, of doubles."""
    ratio = error / 2.0**-52
    return (
        returning(start_checks, "largest_cancellation", ratio),
        returning(start_checks, "cancellation", np.array([ratio])),
        method_with(terms=lambda *_: ("forward_dynamics",)),
    )


def gaussian(value: float) -> Change:
    """Give a standard normal variable a value."""
    parameters = [SimpleNamespace(name=name, standard_normal=True) for name in ("xi1", "xi2")]
    model = SimpleNamespace(parameters=("xi1", "xi2"), description=SimpleNamespace(parameters=parameters))
    told = remarks._improbable_variables(cast(Any, model), np.array([0.0, -value]))
    return returning(remarks, "doubtful_call", told)


def longer(step: float) -> Change:
    grid = cast(Any, SimpleNamespace(start=2.0, end=3.0, step=step))
    return returning(remarks, "exchanged_times", remarks.exchanged_times(grid))


def passed(error: float) -> tuple[Change, ...]:
    """Give a run a singular position and an error in parts of its tolerance."""
    told = returning(remarks, "not_followed", accuracy.not_followed(error, 1.0))
    return statistics(singular_passages=1), told


def costing(run: FinishedRun, patch: pytest.MonkeyPatch, told: str) -> None:
    run.stepper.controllers = cast(Any, SimpleNamespace(cost=lambda wall: told))


def warning(run: FinishedRun, patch: pytest.MonkeyPatch, told: list[str]) -> None:
    patch.setitem(run.run.model.library.layout, "warnings", told)


def by(change: Callable[[Any], Change]) -> Callable[[Any], Reported]:
    """Report a run that one change makes doubtful."""
    return of_run(lambda value: (change(value),))


def patched(change: Callable[[FinishedRun, pytest.MonkeyPatch, Any], None]) -> Callable[[Any], Reported]:
    """Report a run of which a function replaces something by a value."""
    return by(lambda value: lambda run, patch: change(run, patch, value))


def given(module: Any, name: str) -> Callable[[Any], Reported]:
    """Report a run of which a function returns a value."""
    return by(lambda value: returning(module, name, value))


TOLD = [str(FOUND)]
CHECKS_OF_RUNS: dict[str, tuple[Case, ...]] = {
    "unresolved_coordinate": (Case(0.0666, 0.0668, by(hidden)),),
    "momentum_drift": (Case(0.0499, 0.0501, by(floating)),),
    "multiplier_rounding": (Case(0.0099, 0.0101, of_run(rounded)),),
    "linear_range": (
        Case(
            "", str(FOUND), of_run(lambda x: (statistics(halvings=3), returning(accuracy, "linear_range_exceeded", x)))
        ),
    ),
    "singular_position": (Case(0.0501, 0.0499, of_run(singular)),),
    "unbounded_growth": (
        Case(9.9, 10.1, by(lambda x: grown([1.0, x, 1e3, 1e6]))),
        Case(0.99e6, 1.01e6, by(lambda x: grown([1.0, 1e2, 1e4, x]))),
        Case(0.98, 1.0, by(lambda x: grown([1e-3, 1.0, 1e2, 1.01e3], x))),
    ),
    "unresolved_motion": (
        Case(0.99, 1.01, by(lambda x: oscillating(step=x))),
        Case(0.098, 0.102, by(lambda x: oscillating(share=x))),
        Case(2.97, 3.03, by(lambda x: oscillating(ratio=x))),
    ),
    "missed_event": (
        Case(1.4, 1.6, of_run(lambda x: missed(x, 0.0, sampled=False))),
        Case(51.0, 52.0, of_run(lambda x: missed(x, 1000.0, sampled=True))),
    ),
    "fast_law": (Case(0.79, 0.81, by(varying)),),
    "unseen_law": (
        Case(0.0499, 0.0501, by(lambda x: lacking(net=x))),
        Case(0.249, 0.251, by(lambda x: lacking(within=x))),
        Case(0.79, 0.81, by(lambda x: aliased(math.sqrt(2.0 * x**2 / (3.0 - x**2)), ends=1.0))),
        Case(0.49, 0.51, by(lambda x: aliased(part=x))),
        Case(2.99, 3.01, by(understated)),
    ),
    "partly_examined": (Case(1.0, 0.99, patched(lambda _, patch, x: patch.setattr(SampledRun, "examined_share", x))),),
    "bounded_steps": (Case((), (bounded,), of_run(lambda x: x)),),
    "passed_spring": (
        Case(0.0501, 0.0499, by(lambda x: passing((0.1, x), (-0.1, x)))),
        Case(2.01, 1.99, by(lambda x: passing((1.0, 0.0), (1.0 - x, 0.0)))),
    ),
    "undefined_output": (Case(1.0, math.nan, by(lambda x: having(outputs={"f": np.full(101, x)}))),),
    "singular_passage": (Case(999.0, 1001.0, of_run(passed), "do not follow"),),
    "coarse_quantum": (
        Case(2.51, 2.49, by(lambda x: quantised(x, 20))),
        Case(8, 9, by(lambda x: quantised(1.0, x))),
    ),
    "controller_cost": (Case("", str(FOUND), patched(costing)),),
    "model_limits": (Case([], TOLD, patched(warning)),),
    "method_limits": (Case([], TOLD, by(lambda x: method_with(warnings=lambda self, constrained: x))),),
    "steep_law": (Case(([], []), ([], TOLD), given(remarks, "followed_laws")),),
    "exchanged_times": (Case(99.0, 101.0, by(longer), "simulate("),),
    "doubtful_call": (Case(7.99, 8.01, by(gaussian)),),
    "unresolved_damping": (Case(0.099, 0.101, of_run(lambda x: steep(x, -1.0))),),
    "unresolved_states": (
        Case(0.99, 1.01, of_run(lambda x: (method_with(real_stability=2.0), fastest(states=2.0 * x)))),
    ),
    "passed_growth": (
        Case(0.99, 1.01, by(lambda x: fastest(growth=x))),
        Case(0.099, 0.101, of_run(lambda x: (*steep(x, 1.0), method_with(real_stability=1e9)))),
    ),
    "lost_digits": (Case(0.99e-8, 1.01e-8, of_run(cancelling)),),
    "start_beyond_limits": (Case([], TOLD, given(start_checks, "starts_beyond_limits")),),
    "start_on_impact": (Case([], TOLD, given(start_checks, "impacts_at_start")),),
    "turned_start": (Case([], TOLD, by(lambda x: begun(notes=x))),),
    "deep_start": (Case([], TOLD, given(start_checks, "deep_tyres")),),
    "doubtful_start": (Case([], TOLD, by(lambda x: begun(doubts=x))),),
}
CASES = {**NOTES, **RESTS, **CHECKS_OF_RUNS}
ROWS: tuple[Note | StateWarning | Check, ...] = (
    *notes.NOTES,
    *rests.ROWS,
    *accuracy.ROWS,
    *remarks.ROWS,
    *start_checks.ROWS,
)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_a_row_doubts_beyond_its_limits_alone_unless_it_is_silenced(row: Note | StateWarning | Check) -> None:
    cases = CASES[row.name]
    assert len(cases) == max(1, len(row.limits)), "a case for each limit"
    for case in cases:
        reports: Any = case.reports
        assert not (row.name in (inside := reports(case.inside)) and case.said in inside[row.name]), case
        assert case.said in reports(case.outside)[row.name]
        assert row.name not in reports(case.outside, (row.name,))


def test_every_case_is_of_a_row() -> None:
    assert CASES.keys() == {row.name for row in ROWS}
