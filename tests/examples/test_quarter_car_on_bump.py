"""The quarter car that leaves the road, against SciPy's integration restarted at every located event."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

import eomgen
from eomgen import Model, Solution

SCENE = Path(__file__).parents[2] / "examples" / "quarter_car_on_bump" / "scene.toml"
SPRUNG, UNSPRUNG, SPRING, DAMPER, TYRE, TYRE_DAMPING, ONSET = 240.0, 36.0, 16000.0, 980.0, 160000.0, 200.0, 0.002
SPEED, START, LENGTH, HEIGHT, STATIC = 10.0, 1.0, 1.0, 0.08, 276.0 * 9.81 / 160000.0
END = 1.5
#: Instants of the README, s.
LIFT_OFF, TOUCHDOWN = 0.1598338426, 0.2281729222
Array = np.ndarray


@pytest.fixture(scope="module")
def model() -> Model:
    return eomgen.build(SCENE, profile="quick")


def road(t: float) -> tuple[float, float]:
    """Return height and rate."""
    along = (SPEED * t - START) / LENGTH
    if not 0.0 < along < 1.0:
        return 0.0, 0.0
    turn = 2.0 * math.pi * along
    return 0.5 * HEIGHT * (1.0 - math.cos(turn)), 0.5 * HEIGHT * math.sin(turn) * 2.0 * math.pi * SPEED / LENGTH


def deflection(t: float, y: Array) -> tuple[float, float]:
    height, rate = road(t)
    return STATIC + height - y[0], rate - y[2]


def load(t: float, y: Array) -> float:
    d, rate = deflection(t, y)
    if d <= 0.0:
        return 0.0
    u = min(d / ONSET, 1.0)
    return u * u * (3.0 - 2.0 * u) * max(0.0, TYRE * d + TYRE_DAMPING * rate)


def motion(t: float, y: Array) -> list[float]:
    """Return the rates of wheel and body over their rest, and of their velocities."""
    wheel, body, wheel_rate, body_rate = y
    strut = SPRING * (body - wheel) + DAMPER * (body_rate - wheel_rate)
    weight = (SPRUNG + UNSPRUNG) * 9.81
    return [wheel_rate, body_rate, (strut + load(t, y) - weight) / UNSPRUNG, -strut / SPRUNG]


class Reference(NamedTuple):
    """Instants of lift-off and touchdown, and states at given times."""

    lift_off: float
    touchdown: float
    states: Array


def _event(crossing: Callable[[float, Array], float]) -> Callable[[float, Array], float]:
    crossing.terminal = True  # type: ignore[attr-defined]  # solve_ivp wants it so
    return crossing


@pytest.fixture(scope="module")
def reference() -> Reference:
    """Integrate piece by piece: every piece ends where the law of the tyre changes its formula, or the bump begins or
    ends."""
    events = [
        _event(lambda t, y: deflection(t, y)[0]),
        _event(lambda t, y: deflection(t, y)[0] - ONSET),
        _event(lambda t, y: TYRE * deflection(t, y)[0] + TYRE_DAMPING * deflection(t, y)[1]),
    ]
    t, y, crossings, states = 0.0, np.zeros(4), [], [np.zeros(4)]
    grid = np.linspace(0.0, END, 151)
    corners = [START / SPEED, (START + LENGTH) / SPEED, END]
    while t < END:
        until = next(corner for corner in corners if corner > t + 1e-12)
        settings = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14, "max_step": 2e-3}
        piece = solve_ivp(motion, (t, until), y, events=events, dense_output=True, **settings)
        if piece.t_events[0].size:
            crossings.append(float(piece.t_events[0][0]))
        inside = grid[(grid > t) & (grid <= piece.t[-1])]
        states += [piece.sol(time) for time in inside]
        if piece.status == 1:  # past the event, so that it is not found again: a step of the order of round-off
            t, y = float(piece.t[-1]), piece.y[:, -1] + 1e-13 * np.array(motion(piece.t[-1], piece.y[:, -1]))
            t += 1e-13
        else:
            t, y = until, piece.y[:, -1]
    assert len(crossings) == 2 and len(states) == len(grid)
    return Reference(*crossings, np.array(states))


def instants(run: Solution) -> list[float]:
    """Return where the deflection passes zero, by the cubic through recorded values and rates."""
    d = run.outputs["deflection"].reshape(-1)
    rate = np.array([road(t)[1] for t in run.t]) - run.v[:, 0]
    places = np.nonzero(np.diff(np.sign(d)))[0]
    return [
        float(CubicHermiteSpline(run.t[k : k + 2], d[k : k + 2], rate[k : k + 2]).roots(extrapolate=False)[0])
        for k in places
    ]


@pytest.mark.slow
def test_the_reference_is_the_one_of_the_readme(reference: Reference) -> None:
    assert (reference.lift_off, reference.touchdown) == pytest.approx((LIFT_OFF, TOUCHDOWN), abs=1e-9)


@pytest.mark.slow
def test_lift_off_and_touchdown_converge_to_the_located_ones(model: Model, reference: Reference) -> None:
    """The lift-off with order 2; the touchdown, behind the kinks of the flight, scatters about it."""
    expected, errors = [reference.lift_off, reference.touchdown], []
    for step in (4e-4, 1e-4, 2.5e-5):
        run = model.simulate(END, step, rho_inf=0.9, record_every=1)
        assert run.success and len(instants(run)) == 2
        errors.append(np.abs(np.array(instants(run)) - expected))
    assert np.all(errors[-1] < [1e-8, 2e-8])
    slopes = np.log2(np.array(errors[:-1]) / errors[1:]) / 2.0
    assert np.all(np.abs(slopes[:, 0] - 2.0) < 0.1) and np.all(np.abs(slopes[:, 1] - 2.0) < 0.4), slopes


@pytest.mark.slow
def test_motion_is_the_reference(model: Model, reference: Reference) -> None:
    run = model.simulate(END, 2e-5, method="rk4", record_every=500)
    found = np.hstack([run.q, run.v])
    np.testing.assert_allclose(run.t, np.linspace(0.0, END, 151), atol=1e-12)
    np.testing.assert_allclose(found[:, [0, 1]], reference.states[:, [0, 1]], atol=2e-8)
    np.testing.assert_allclose(found[:, [2, 3]], reference.states[:, [2, 3]], atol=2e-6)
