"""What a run and a call say of themselves: halved steps, energy out of balance, fixed parameters, inputs that are no
mapping."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.simulation.judgement.invariants import REPORTED_ENERGY, energy_balance


def test_the_balance_of_energy_is_judged_where_the_rows_allow_it() -> None:
    t = np.linspace(0.0, 10.0, 1001)
    kinetic, potential = np.sin(t) ** 2, np.cos(t) ** 2
    force = np.cos(3.0 * t)

    def energies(drift: float) -> dict[str, np.ndarray]:
        total = kinetic + potential + np.sin(3.0 * t) / 3.0 + drift * t
        return {"kinetic": kinetic, "potential": potential, "total": total, "power": force, "base_power": 0.0 * t}

    swing = 1.0 + 1.0 + 1.0 / 3.0  # of potential energy, kinetic energy and work
    assert energy_balance(t, energies(0.0)).error == pytest.approx(0.0, abs=2e-5)
    off = energy_balance(t, energies(0.1))
    assert off.error == pytest.approx(1.0 / swing, rel=1e-3) and str(off) == "off by 43 % of the energies at work"
    sparse = {name: values[::150] for name, values in energies(0.0).items()}
    assert str(energy_balance(t[::150], sparse)) == "not known: the rows are too widely spaced for the work in between"
    few = {name: values[::250] for name, values in energies(0.0).items()}
    three = {name: values[::400] for name, values in energies(0.0).items()}
    assert str(energy_balance(t[::400], three)).startswith("not known: 3 rows")
    assert energy_balance(t[::250], few, conservative=True).error > 0.1  # no work can be between the rows
    assert str(energy_balance(t, {})) == "not known: the model was built without the term energy"
    shares = [energy_balance(t, energies(drift)).error for drift in (0.002, 0.003)]
    assert shares[0] < REPORTED_ENERGY < shares[1] and shares[1] == pytest.approx(0.0128, rel=0.01)
    # of force 100 on a mass of 1, between two rows: the rows know nothing of its work
    pulse = (t > 0.5021) & (t < 0.5073)
    speed = 0.52 * (t >= 0.5073)
    kicked = dict.fromkeys(energies(0.0), 0.0 * t) | {"kinetic": 0.5 * speed**2, "total": 0.5 * speed**2}
    kicked["power"] = 100.0 * pulse * speed
    assert energy_balance(t, kicked).error > 0.9
    assert energy_balance(t, kicked, [0.5021, 0.5073]).error == 0.0
    # dissipated power of 1e-9 W in every second row leaves the work open, a gain of 1 J is out of nothing
    thrown = kicked | {"power": -1e-9 * (np.arange(1001) % 2)}
    thrown["kinetic"] = thrown["total"] = np.where(t > 5.0, 1.0, 1e-12)
    assert energy_balance(t, thrown, sparse=True).error == pytest.approx(1.0)
    rest = {name: np.full(1001, 5.0 if name in ("potential", "total") else 0.0) for name in energies(0.0)}
    rest["total"] = rest["total"] + 1e-13 * np.arange(1001)
    assert energy_balance(t, rest).error == 0.0
    drifting = {**rest, "kinetic": np.geomspace(1e-60, 1e-90, 1001), "potential": 0.0 * t}
    drifting["total"] = drifting["kinetic"]
    # whether that is rounding, energies alone do not tell
    assert energy_balance(t, drifting).error == pytest.approx(1.0)
    endless = {**rest, "total": np.where(t < 4.0, rest["total"], np.inf)}
    assert energy_balance(t, endless).infinite == 4.0 and energy_balance(t, endless).error is None


@pytest.mark.parametrize("rows", [3, 4, 60])
@pytest.mark.parametrize(("start", "joule"), [(1e3, 1.0), (-1e3, 1.0), (0.0, 1e-9), (50.0, 1e6)])
def test_balances_of_energy_know_no_origin_of_time_and_no_unit_of_energy(rows: int, start: float, joule: float) -> None:
    """Few rows report a gain beyond 1000 times the initial energy plus the range of the potential and the work of the
    largest power, which are 5 J here."""
    t = np.linspace(0.0, 8.0, rows)
    shape = {"kinetic": 1.0 + 0.5 * t, "potential": 2.0 - 0.25 * t, "power": 0.25 + 0.0 * t, "base_power": 0.0 * t}
    moving = 2.0 + 5.0  # range of the potential, largest kinetic energy
    for gain in (2.0, 4.9e3, 5.1e3):
        energy = {**shape, "total": 3.0 + gain * (t / 8.0)}
        balance = energy_balance(t, energy)
        moved = energy_balance(t + start, {name: joule * values for name, values in energy.items()})
        assert moved.unknown == balance.unknown
        if rows < 5 and gain < 5e3:
            assert moved.error is None and f"{rows} rows are too few" in moved.unknown
        elif rows < 5:
            assert moved.error == moved.gain == pytest.approx(gain / moving)
        else:
            assert moved.error == pytest.approx((gain - 2.0) / (moving + 2.0), rel=1e-6, abs=1e-9)


POINTS = [[-0.5, 0.25], [-0.25, 0.0625], [0, 0], [0.25, 0.0625], [0.5, 0.25]]


FRAMES = {"first": {"body": "base", "axis": [0, 0, 1], "x_axis": [1, 0, 0]}, "second": {"body": "pin"}}


#: Constraints that leave the curve's end: keys, and what is said.
SLOTS: dict[str, tuple[dict[str, Any], str]] = {
    "formula": ({"equation": "z - profile(x)", "unit": "m", **FRAMES}, r"at 0\.5[01]\d+ by the constraint slot"),
    "of a point": ({"equation": "position.tip[2] - profile(position.tip[0])", "unit": "m"}, r"at 0\.5[01]\d+"),
    "sliding": (
        {"shape": "sphere", "radius": 0.05, "surface": "profile(x)", **FRAMES},
        r"within 0\.05 m of 0\.4\d+ by the constraint slot",
    ),
}


@pytest.mark.slow_except("formula")
@pytest.mark.parametrize("kind", SLOTS)
def test_a_constraint_that_leaves_the_end_of_a_curve_is_named(kind: str) -> None:
    keys, asked = SLOTS[kind]
    builder = eomgen.SceneBuilder("pin").curve("profile", points=POINTS).body("slider", 0)
    builder.body("pin", 1.0, inertia=[0.01, 0.01, 0.01]).point("tip", "pin", [0, 0, 0])
    start = {"position": 0.1, "velocity": 4.0}
    builder.joint("x", "prismatic", "base", "slider", axis=[1, 0, 0], initial=start)
    builder.joint("z", "prismatic", "slider", "pin", axis=[0, 0, 1], initial={"position": 0.07})
    builder.constraint("slot", "sliding" if kind == "sliding" else "formula", **keys)
    run = eomgen.build(builder.build(), profile="quick").simulate(1.0, 0.005)
    equation = "contact with the surface" if kind == "sliding" else "formula"
    text = rf"component slot: {equation} at t = 0\.1\d+ s, where the curve profile has points from -0\.5 to 0\.5 and is"
    remedy = r"; try: points that reach further, or outside = \"hold\" or \"periodic\""
    assert not run.success
    assert re.search(rf"{text} asked {asked}{remedy}", run.message), run.message
