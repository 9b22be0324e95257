"""Motions that are excited and too fast for the step are told of, and stiff machines that do not swing are not."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen

#: Of the cord, rad/s.
FAST = float(np.sqrt(6e7 / 2.0))


@cache
def hanging(*, absolute: bool = False) -> eomgen.Model:
    """Return a mass of 2 kg on a stiff cord along z, which begins at its natural length, and free along x."""
    builder = eomgen.SceneBuilder("hanging")
    if absolute:
        builder = eomgen.SceneBuilder("hanging_absolute", coordinates="absolute")
    builder.parameter("kick", 0.0, tunable=True).body("sledge", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.body("mass", 2.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("across", "prismatic", "base", "sledge", axis=[1, 0, 0])
    builder.joint("down", "prismatic", "sledge", "mass", axis=[0, 0, 1])
    builder.spring("cord", "below", "middle", stiffness=6e7, damping=1.5, length=1.0)
    builder.point("below", "sledge", position=[0, 0, 1]).point("middle", "mass")
    return eomgen.build(builder.output("pull", formula="tension.cord", unit="N").build(), profile="quick")


@pytest.mark.slow
@pytest.mark.parametrize("absolute", [False, True])
def test_a_stiff_start_off_balance_is_told_of(absolute: bool, tmp_path: Path) -> None:
    run = hanging(absolute=absolute).simulate(1.0, 2e-3)
    name = "v.mass[5]" if absolute else "v.down"
    period = 2.0 * np.pi / FAST
    assert run.success and run.error.unresolved == (
        f"the start excites a motion of {name} at {1.0 / period:.3g} Hz, whose period of {period:.2g} s steps of"
        " 0.002 s do not resolve: accelerations, forces and outputs made of them follow the slow motion alone, and the"
        f" estimated error need not count the fast one; try: a step of {0.3 / FAST:.2g} s, or a start in which stiff"
        " parts are in balance"
    )
    assert run.message.endswith(run.error.unresolved)
    true = 2.0 * 9.81 * (1.0 - np.cos(FAST * run.t))
    assert np.abs(run.outputs["pull"] - true).max() > 10.0  # N, of which the comparison of steps knows nothing
    assert eomgen.Solution.load(run.save(tmp_path / "run.npz")).error.unresolved == run.error.unresolved
    assert run.error.summary()["unresolved"] == run.error.unresolved


def test_a_velocity_of_a_stiff_mode_is_told_of_too() -> None:
    balance = -2.0 * 9.81 / 6e7
    run = hanging().simulate(0.5, 2e-3, initial={"down": {"position": balance, "velocity": 0.1}})
    assert "the start excites a motion of v.down" in run.error.unresolved


def test_balance_a_resolved_motion_and_an_explicit_method_are_not_told_of() -> None:
    balance = {"down": -2.0 * 9.81 / 6e7, "across": {"position": 0.0, "velocity": 3.0}}
    assert hanging().simulate(0.5, 2e-3, initial=balance).error.unresolved == ""
    assert hanging().simulate(0.01, 1e-4).error.unresolved == ""
    assert hanging().simulate(0.01, 2e-4, method="rk4").error.unresolved == ""


@cache
def pushed(effort: str) -> eomgen.Model:
    """Return two masses of 1 kg with a stiff leg between them, of which the first is pushed along x."""
    builder = eomgen.SceneBuilder("pushed", gravity=[0, 0, 0]).body("upper", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.body("lower", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("slide", "prismatic", "base", "upper", axis=[1, 0, 0])
    builder.joint("leg", "prismatic", "upper", "lower", axis=[1, 0, 0], stiffness=1e7)
    return eomgen.build(builder.effort("push", "slide", effort).build(), profile="quick")


def test_a_known_jump_that_sets_a_stiff_machine_ringing_is_told_of() -> None:
    run = pushed("100 if t > 0.5 else 0").simulate(1.0, 2e-3)
    hertz = float(np.sqrt(2e7)) / (2.0 * np.pi)  # of the reduced mass of 0.5 kg
    assert run.error.unresolved.startswith(f"the jump at t = 0.5 s excites a motion of v.leg at {hertz:.3g} Hz")
    assert pushed("100 if t > 0.5 else 0").simulate(1.0, 1e-4).error.unresolved == ""


@pytest.mark.slow
def test_a_kink_and_a_force_that_rises_smoothly_from_rest_are_not_told_of() -> None:
    """At rest there is no acceleration to hold a swing against, but later in the run there is."""
    assert pushed("400 * max(t - 0.5, 0)").simulate(1.0, 2e-3).error.unresolved == ""
    assert pushed("100 * sin(2 * t)").simulate(1.0, 2e-3).error.unresolved == ""
    assert "the start excites a motion of v.leg" in pushed("100 * cos(2 * t)").simulate(1.0, 2e-3).error.unresolved


@pytest.mark.slow
def test_an_impact_that_sets_a_stiff_machine_ringing_is_told_of() -> None:
    builder = eomgen.SceneBuilder("ringing").body("upper", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.body("lower", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("fall", "prismatic", "base", "upper", axis=[0, 0, 1], initial={"position": 1.0})
    builder.joint("leg", "prismatic", "upper", "lower", axis=[0, 0, -1], stiffness=1e7)
    builder.event("floor", "q.fall - q.leg", direction="falling", action="impact", restitution=0.5)
    run = eomgen.build(builder.build(), profile="quick").simulate(0.6, 2e-3)
    assert run.error.unresolved.startswith("the event floor at t = 0.4515")
