"""A base with a given acceleration: its second integral against quadrature, a shear frame in an earthquake against
SciPy, drift and its removal, and mistakes with one message each."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

import eomgen
from eomgen.errors import DescriptionError
from eomgen.formula.curves import Curve
from eomgen.formula.integration import _fit as fit
from eomgen.formula.recording import law_and_rate
from eomgen.mechanics.tree.base import base_law
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape
from eomgen.system.system import base_place

#: Points of a record that starts and ends at 0.
TIMES = np.array([0.0, 0.4, 1.0, 1.3, 2.0, 2.9, 3.4, 4.0])
RECORD = np.array([0.0, 1.2, -0.7, 0.9, -1.6, 0.4, 0.8, 0.0])


def frame(acceleration: Any, *, points: Any = None, curve: Any = None, **base: Any) -> dict[str, Any]:
    """Return a cart on springs whose base has an acceleration along x."""
    points = np.column_stack([TIMES, RECORD]).tolist() if points is None else points
    along = acceleration if isinstance(acceleration, list) else [acceleration, 0, 0]
    return {
        "format": 1,
        "name": "frame",
        "gravity": [0, 0, 0],
        "curves": {"quake": {"points": points, **(curve or {})}},
        "base": {"acceleration": along, **base},
        "bodies": {"cart": {"mass": 2.0}},
        "joints": {
            "x": {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0], "stiffness": 300.0}
        },
        "simulation": {"duration": 4.0},
    }


def read(*arguments: Any, parameters: Any = None, **keys: Any) -> Scene:
    data = frame(*arguments, **keys)
    return from_data({**data, "parameters": parameters or {}})


def motion(scene: Scene, t: Any, axis: int = 0, **parameters: float) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity of the base along an axis at times."""
    assert scene.base is not None
    values = {item.name: item.value for item in scene.parameters} | parameters
    return law_and_rate(scene.base.position[axis], values)(np.atleast_1d(np.asarray(t, dtype=float)))


def struct(scene: Scene, t: float) -> np.ndarray:
    """Return the base struct at a time, evaluated on the tape."""
    tape = Tape()
    assert scene.base is not None
    law = base_law(Algebra(tape), scene.base, {})
    return evaluate(tape, [item.ref for item in law], {"t": np.array([t])}).ravel()


def notes(scene: Scene) -> str:
    return "\n".join(scene.notes)


@pytest.mark.parametrize("interpolation", ["quintic", "linear", "steps"])
@pytest.mark.parametrize("outside", ["error", "hold", "periodic"])
@pytest.mark.parametrize("argument", ["t", "0.5 * t + 0.3", "2 * t", "t - 0.6"])
def test_integrals_of_curves_against_quadrature(interpolation: str, outside: str, argument: str) -> None:
    """x(T) = int (T - s) a(s) ds, with the curve of the scene, whose values have tests of their own."""
    if outside == "error" and argument not in ("t", "0.5 * t + 0.3"):
        return
    curve = {"interpolation": interpolation, "outside": outside}
    scene = read(f"1.5 * quake({argument})", curve=curve, drift="keep")
    quake = next(item for item in scene.curves if isinstance(item, Curve))
    a, b = {"t": (1.0, 0.0), "0.5 * t + 0.3": (0.5, 0.3), "2 * t": (2.0, 0.0), "t - 0.6": (1.0, -0.6)}[argument]
    breaks = [*TIMES, *(TIMES + 4.0), *(TIMES - 4.0), *(TIMES + 8.0)]
    inner = [(place - b) / a for place in breaks]
    for end in (0.35, 1.7, 3.9):
        places = sorted({time for time in inner if 1e-9 < time < end - 1e-9})
        pieces = list(zip([0.0, *places], [*places, end], strict=True))
        expected = [
            sum(quad(lambda s: power(s) * 1.5 * float(quake(a * s + b)), *piece, epsabs=1e-13)[0] for piece in pieces)  # noqa: B023
            for power in (lambda s: end - s, lambda s: 1.0)  # noqa: B023
        ]
        x, v = motion(scene, end)
        assert (x[0], v[0]) == pytest.approx(expected, abs=2e-12), end


#: Accelerations that are formulas, as Python functions, with times of jumps.
FORMULAS: dict[str, Any] = {
    "0.3 * sin(5 * t + 0.2)": (lambda t: 0.3 * np.sin(5 * t + 0.2), []),
    "2 - cos(3 * t) / 4": (lambda t: 2 - np.cos(3 * t) / 4, []),
    "exp(-0.4 * t) * sin(t * t * 4)": (lambda t: np.exp(-0.4 * t) * np.sin(4 * t * t), []),
    "1 - 0.5 * t": (lambda t: 1 - 0.5 * t, []),
    "0.4 if t > 1.23 else 0": (lambda t: 0.4 * (t > 1.23), [1.23]),
    "max(0, sin(4 * t))": (lambda t: max(0.0, np.sin(4 * t)), [np.pi / 4 * k for k in range(1, 6)]),
    "-(quake(t) * (1 + 0.1 * t))": (lambda t: -(np.interp(t, TIMES, RECORD) * (1 + 0.1 * t)), list(TIMES[1:-1])),
}


@pytest.mark.parametrize("formula", FORMULAS)
def test_integrals_of_formulas_against_quadrature(formula: str) -> None:
    law, jumps = FORMULAS[formula]
    scene = read(formula, curve={"interpolation": "linear"}, drift="keep")
    for end in (0.8, 2.6, 4.0):
        places = [time for time in jumps if time < end]
        pieces = list(zip([0.0, *places], [*places, end], strict=True))
        expected = [
            sum(quad(lambda s: power(s) * law(s), *piece, epsabs=1e-13, limit=200)[0] for piece in pieces)  # noqa: B023
            for power in (lambda s: end - s, lambda s: 1.0)  # noqa: B023
        ]
        x, v = motion(scene, end)
        assert (x[0], v[0]) == pytest.approx(expected, abs=1e-10), end


def test_the_error_of_a_quadrature_is_below_the_estimate() -> None:
    """The sentence states 1e-9 m or less, and the error is below the stated number."""
    scene = read("exp(-0.4 * t) * sin(t * t * 4)", drift="keep")
    assert scene.base is not None
    stated = float(scene.base.integrals[0].split("off by about ")[1].split(" m")[0])
    exact = quad(lambda s: (4.0 - s) * np.exp(-0.4 * s) * np.sin(4 * s * s), 0, 4, epsabs=1e-14, limit=400)[0]
    assert abs(motion(scene, 4.0)[0][0] - exact) <= stated <= 1e-9


def test_polynomials_of_degree_7_are_fitted_to_rounding() -> None:
    """A larger error halves intervals without end: the tolerance of a fit is 1e-12 of the largest value."""
    times = np.linspace(0.0, 2.0, 100, endpoint=False)
    curve, error = fit("base", lambda t: 1.0 + (t - 0.3) ** 7, np.array([0.0, 2.0]))
    expected = 1.0 + (times - 0.3) ** 7
    assert len(curve.breaks) == 2 and error < 1e-13 * expected.max()
    assert np.abs(np.array([float(curve(t)) for t in times]) - expected).max() < 1e-13 * expected.max()


@pytest.mark.parametrize("drift", ["keep", "remove"])
@pytest.mark.parametrize("formula", ["quake(t)", "0.3 * sin(5 * t)", "exp(-t) * sin(6 * t)"])
def test_position_velocity_and_acceleration_agree(formula: str, drift: str) -> None:
    """The base struct by central differences of order four; the base does not rotate, so components are in the
    world."""
    scene = read([formula, 0, "0.1 * cos(7 * t)"], drift=drift)
    h, weights = 1e-3, np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
    names = [slice(base_place(name), base_place(name) + 3) for name in ("position", "velocity", "velocity_dot")]
    for t in (0.71, 1.63, 3.11):
        around = np.array([struct(scene, t + step * h) for step in (-2, -1, 0, 1, 2)])
        for lower, upper in itertools.pairwise(names):
            assert weights @ around[:, lower] / h == pytest.approx(around[2, upper], abs=2e-9)
    if drift == "keep":
        a = next(item for item in scene.curves)(1.63) if "quake" in formula else None
        if a is not None:
            assert struct(scene, 1.63)[names[2]][0] == pytest.approx(float(a), abs=1e-13)


def test_place_and_velocity_at_the_start_are_given_by_the_position() -> None:
    still, moving = read("quake(t)", drift="keep"), read("quake(t)", position=["0.4 - 2 * t", 0, 1], drift="keep")
    (x, v), (y, w) = motion(still, [0.0, 2.2]), motion(moving, [0.0, 2.2])
    assert y - x == pytest.approx([0.4, -4.0], abs=1e-13) and w - v == pytest.approx([-2.0, -2.0], abs=1e-13)
    assert motion(moving, 3.0, 2)[0] == pytest.approx([1.0])


@pytest.mark.parametrize("interpolation", ["quintic", "linear", "steps"])
@pytest.mark.parametrize("argument", ["t", "t + 0.55", "2 * t", "t - 0.5"])
def test_a_record_without_drift_ends_at_rest_at_its_first_place(interpolation: str, argument: str) -> None:
    """A straight line is added to the acceleration up to the last point, and no correction behind it."""
    curve = {"interpolation": interpolation, "outside": "hold"}
    kept, removed = (read(f"quake({argument})", curve=curve, drift=drift) for drift in ("keep", "remove"))
    a, b = {"t": (1, 0), "t + 0.55": (1, 0.55), "2 * t": (2, 0), "t - 0.5": (1, -0.5)}[argument]
    end = (4.0 - b) / a
    x, v = motion(removed, [0.0, end, end + 1.0])
    assert x == pytest.approx([0, 0, 0], abs=1e-13) and v == pytest.approx([0, 0, 0], abs=1e-13)
    place = base_place("velocity_dot")
    times = np.linspace(max(0.0, -b) + 0.01, end - 0.01, 9)
    line = [struct(removed, t)[place] - struct(kept, t)[place] for t in times]
    assert np.max(np.abs(np.diff(line, 2))) <= 1e-12 < np.max(np.abs(line))


def test_a_periodic_acceleration_without_drift_stays_near_its_place() -> None:
    curve = {"outside": "periodic"}
    kept, removed = (read("quake(t) + 0.3 * sin(5 * t)", curve=curve, drift=drift) for drift in ("keep", "remove"))
    times = np.linspace(0.0, 400.0, 4001)
    assert np.ptp(motion(removed, times)[0]) < 3.0 and np.ptp(motion(kept, times)[0]) > 1e3
    assert motion(removed, 0.0)[0] == pytest.approx([0.0], abs=1e-14)


def test_factors_and_sines_follow_tunable_parameters() -> None:
    parameters = {name: {"value": value, "tunable": True} for name, value in (("g", 2.0), ("w", 5.0), ("f", 0.4))}
    scene = read("g * quake(t) + 3 * sin(w * t + f)", parameters=parameters, drift="keep")
    for g, w, f in ((2.0, 5.0, 0.4), (-1.0, 3.0, 0.0)):
        fixed = read(f"{g} * quake(t) + 3 * sin({w} * t + {f})", drift="keep")
        for own, other in zip(motion(scene, [0.3, 3.7], g=g, w=w, f=f), motion(fixed, [0.3, 3.7]), strict=True):
            assert own == pytest.approx(other, abs=1e-13)


@pytest.mark.parametrize(
    ("formula", "keys", "text"),
    [
        ("quake(t)", {}, "base.acceleration[0] is integrated from t = 0; it drifts by 0.419 m, and goes at 0.175 m/s"),
        ("0.3 * sin(5 * t)", {}, "it drifts by 0.24 m, and goes at 0.06 m/s at t = 4 s; try: drift"),
        ("quake(t)", {"drift": "keep"}, ""),
        ("quake(t)", {"drift": "remove"}, ""),
        ("0.3 * cos(5 * t)", {}, ""),
        ("0.3", {}, ""),
        ("0", {}, ""),
    ],
)
def test_notes_of_drift(formula: str, keys: Any, text: str) -> None:
    told = notes(read(formula, curve={"interpolation": "linear"}, **keys))
    assert text in told if text else "drift" not in told


def test_a_record_that_holds_an_acceleration_behind_its_end_is_noted() -> None:
    points = [[0, 0], [0.5, 1], [1.5, -1], [2, 0.125]]
    text = "its curve holds 0.125 m/s^2 from then on; try: drift"
    curve = {"interpolation": "linear", "outside": "hold"}
    assert text in notes(read("quake(t)", points=points, curve=curve))
    assert text not in notes(read("quake(t)", points=points, curve=curve, drift="remove"))


BASE = "base.acceleration[0]): "
MISTAKES: list[tuple[str, dict[str, Any], str]] = [
    ("a displacement as an acceleration", frame("quake(t)", curve={"unit": "m"}), BASE
     + 'the curve quake is in m, and an acceleration in m/s^2; try: position = ["quake(t)", 0, 0]'),
    ("a velocity as an acceleration", frame("quake(t)", curve={"unit": "m/s"}), BASE
     + "the curve quake is in m/s, and an acceleration in m/s^2; try: the derivative of the points, or their integral"),
    ("a record that begins later", frame("quake(t)", points=[[5, 0], [6, 1], [7, 0]]), BASE
     + "quake has values from 5 to 7, and its argument is 0 at t = 0;"
     ' try: outside = "hold" of the curve, or an argument within its points at t = 0, the start of the base'),
    ("a constant without drift", frame("0.3", drift="remove"), BASE
     + 'a constant acceleration is all drift, and would be removed; try: drift = "keep", or position'),
    ("a pole", frame("1 / t"), BASE + "the integral by polynomials is off by about "),
    ("drift without an acceleration", {**frame(0), "base": {"position": ["t", 0, 0], "drift": "remove"}},
        "(base.drift): drift belongs to the integral of an acceleration, and the base has no acceleration"),
    ("a coordinate", frame("quake(q.x)"), BASE + "q.x cannot be used here"),
    ("an input", {**frame("table"), "inputs": {"table": {"formula": "sin(t)"}}}, BASE
     + "the input 'table' cannot be used here: an acceleration is integrated when the scene is read, and values of"
     " inputs are known during a run alone (column 1); try: a curve at t, as a table in [curves]; or"
     " position by an input with motion = true, whose caller gives position, rate and acceleration"),
    ("a motion of the caller", {**frame("lift"), "inputs": {"lift": {"motion": True}}}, BASE
     + "the motion lift has a position, and no acceleration that is known when the scene is read;"
     ' try: position = ["lift", 0, 0]'),
    ("a tunable parameter within a function", {
        **frame("exp(-d * t)"), "parameters": {"d": {"value": 0.1, "tunable": True}}}, BASE
     + "the tunable parameter d is within a function that is integrated when the scene is read;"
     " try: a factor d of a function of t, a fixed parameter, or position, a formula of both"),
    ("no value", frame("sqrt(t - 2)"), BASE + "the acceleration has no value near t = 2 s;"
     " try: a formula that has one throughout the run"),
    ("a noise of a formula", frame("sin(100000 * t * t)"), BASE
     + "its integral needs more than 50000 polynomials up to t = 4 s; try: a curve through points"),
    ("a table by itself", {**frame(0), "base": {"acceleration": "quake.csv"}},
        "(base.acceleration): a list of 3 entries is needed here, not 'quake.csv'; try: acceleration = "
        '["quake(t)", 0,'),
    ("a correction of the baseline", frame("quake(t)", baseline="linear"),
     "(base.baseline): the key 'baseline' is unknown here; try: drift = \"remove\""),
]  # fmt: skip  # a table


@pytest.mark.parametrize(("data", "text"), [row[1:] for row in MISTAKES], ids=[row[0] for row in MISTAKES])
def test_mistakes(data: dict[str, Any], text: str) -> None:
    with pytest.raises(DescriptionError) as raised:
        from_data(data)
    assert text in " ".join(str(raised.value).split())


@pytest.mark.slow_cases("exp(-t) * sin(t)-base.acceleration[0] (to simulation.duration)")
@pytest.mark.parametrize(
    ("formula", "integrated"),
    [("exp(-t) * sin(t)", "base.acceleration[0] (to simulation.duration)"), ("quake(t)", "quake")],
)
def test_a_run_beyond_the_end_of_an_integral_is_refused(formula: str, integrated: str) -> None:
    model = eomgen.build(read(formula, drift="keep"), profile="quick")
    with pytest.raises(eomgen.errors.UsageError) as raised:
        model.simulate(8.0, 0.01)
    text = f"the points of the integral of {integrated} end at t = 4 s, the run ends at t = 8 s; try: t_end = 4, or"
    assert text in str(raised.value)


@pytest.mark.parametrize(
    ("keys", "note"),
    [
        ({"acceleration": "quake(-t)", "curve": {"outside": "hold"}}, "base.acceleration[0] is zero from t = 0 to 4"),
        (
            {"acceleration": "quake(t)", "points": [[0, 0], [400, 1.2], [900, 0]], "drift": "remove"},
            'base.acceleration[0] lasts 900 s, and the run 4 s; try: argument_unit = "ms" of a table whose times',
        ),
        ({"acceleration": "quake(t)", "drift": "remove"}, ""),
        ({"acceleration": "quake(t)", "points": [[0, 0], [50, 1.2], [199, 0]], "drift": "remove"}, ""),
    ],
)
def test_records_that_move_nothing_or_last_much_longer_than_the_run_are_noted(keys: Any, note: str) -> None:
    notes = [text for text in read(keys.pop("acceleration"), **keys).notes if text.startswith("base.acceleration")]
    assert len(notes) == bool(note) and all(text.startswith(note) for text in notes)


FALLS = (
    "base.acceleration is the gravity of the scene: the base falls freely, and bodies in it have no weight; try: no"
    " acceleration, if gravity alone is meant"
)
READS = (
    "base.acceleration[2] has a mean of {} m/s^2, opposite to gravity: an accelerometer at rest reads this, and the"
    " base moves away; try: the readings with -9.81 added"
)
TWICE = (
    "base.position[0] and base.acceleration[0] both move the base over time, and their motions add; try: one of the"
    " two, if they describe the same motion"
)
SHAKEN = ["-2 * sin(10 * t)", 0, 0]


@pytest.mark.parametrize(
    ("acceleration", "place", "note", "noted"),
    [
        *[([0, 0, up], 0, FALLS, noted) for up, noted in [(-9.81, True), (9.81, False), (-9.0, False)]],
        *[
            ([0, 0, f"{mean} + 0 * t"], 0, READS.format(mean), noted)
            for mean, noted in [("9.81", True), ("9.7", True), ("9.5", False), ("-9.81", False)]
        ],
        *[(SHAKEN, place, TWICE, noted) for place, noted in [("0.02 * sin(10 * t)", True), (0.02, False)]],
    ],
)
def test_bases_that_move_as_hardly_meant_are_noted(acceleration: Any, place: Any, note: str, noted: bool) -> None:
    data = frame(acceleration) | {"gravity": [0, 0, -9.81]}
    data["base"]["position"] = [place, 0, 0]
    assert (note in from_data(data).notes) == noted
