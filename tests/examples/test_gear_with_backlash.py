"""The gear with play between the teeth against SciPy, stopped at each change of contact."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen

SCENE = Path(eomgen.__file__).parents[1] / "examples" / "gear_with_backlash" / "scene.toml"
RATIO, PLAY, STIFFNESS, DAMPING = 3.0, np.radians(0.6), 8e3, 4.0
ROTOR, DRUM, BEARING, TORQUE, FREQUENCY = 2e-3, 0.05, 0.1, 1.5, 40.0
Array = np.ndarray
_PRECISE = {"rtol": 1e-12, "atol": 1e-14, "max_step": 5e-5}


def _gap(y: Array) -> tuple[float, float]:
    """Return the twist at the load, rad, and the rate of the twist, rad/s."""
    return y[0] / RATIO - y[1], y[2] / RATIO - y[3]


def _push(y: Array, side: int) -> float:
    """Return the torque of a flank, N m, positive if the flank is pressed; side 1 leads, side -1 trails."""
    twist, rate = _gap(y)
    return STIFFNESS * (side * twist - PLAY / 2) + DAMPING * side * rate


def _contact(y: Array, side: int) -> float:
    """Return a number that is positive while a flank overlaps and pushes."""
    return min((side * _gap(y)[0] - PLAY / 2) * STIFFNESS, _push(y, side))


def _rates(side: int) -> Callable[[float, Array], Array]:
    """Return the equations of motion while one flank pushes; side 0: none does."""

    def rates(t: float, y: Array) -> Array:
        teeth = side * _push(y, side) if side else 0.0
        motor = (TORQUE * np.sin(FREQUENCY * t) - teeth / RATIO) / ROTOR
        return np.array([y[2], y[3], motor, (teeth - BEARING * y[3]) / DRUM])

    return rates


def reference(times: Array) -> Array:
    """Return q and v at times, integrated from one change of contact to the next."""
    t, y, side, rows = 0.0, np.zeros(4), 0, []
    while t < times[-1]:
        flanks = (side,) if side else (1, -1)
        changes = [lambda s, z, flank=flank: _contact(z, flank) for flank in flanks]
        for change in changes:
            change.direction, change.terminal = (-1.0 if side else 1.0), True
        asked = times[(times > t) & (times <= times[-1])]
        run = solve_ivp(_rates(side), (t, times[-1]), y, "DOP853", asked, events=changes, **_PRECISE)
        rows += list(np.transpose(run.y)) if len(run.t) else []
        if run.status == 0:
            break
        which = next(k for k, found in enumerate(run.t_events) if len(found))
        t, y = run.t_events[which][0], run.y_events[which][0]
        side = 0 if side else (1, -1)[which]
    return np.array(rows)


@pytest.mark.long
def test_the_motion_is_the_motion_between_changes_of_contact() -> None:
    run = eomgen.build(SCENE, profile="quick").simulate(0.4)
    expected = reference(run.t[1:])
    ours = np.concatenate([run.q, run.v], axis=1)[1:]
    assert len(expected) == len(ours)
    assert np.all(np.abs(ours - expected) <= [2e-8, 2e-9, 1e-5, 1e-6])
    twist = run["twist"]
    assert (np.abs(twist) < 0.9 * PLAY / 2).any() and (twist > PLAY / 2).any() and (twist < -PLAY / 2).any()
    torque = run["tooth_torque"]
    assert np.all(torque * twist >= 0.0) and np.all(torque[np.abs(twist) < PLAY / 2] == 0.0)
