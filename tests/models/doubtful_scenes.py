"""Scenes whose runs have large errors or steps that resolve nothing, by which verbs that run a scene are compared."""

from __future__ import annotations

from typing import Any

import eomgen

METHOD, STEP, END = "generalized_alpha", 0.05, 4.0
UNRESOLVED = "too fast for an explicit method"


def oscillator() -> Any:
    """Return a slider that moves slowly and smoothly, beside internal states on a limit cycle with fast turns."""
    builder = eomgen.SceneBuilder("oscillator", gravity=[0, 0, 0]).body("cart", 1.0)
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], initial={"velocity": 0.1})
    builder.state("a", "1 + a**2 * b - 4 * a", initial=1.5).state("b", "3 * a - a**2 * b", initial=3.0)
    builder.parameter("push", 0.1, tunable=True).effort("pull", "rail", "-push * q.rail")
    return builder.simulation(method=METHOD, step=STEP, duration=END).build()


def share_of_state() -> float:
    """Return the error of an internal state of the oscillator, relative to its motion, of a run."""
    run = eomgen.build(oscillator(), profile="quick").simulate()
    assert run.error.worst is not None and run.error.worst.name.startswith("z.")
    assert run.error.worst.share > 1e-3  # the slider's error is below 1e-5
    return run.error.worst.share


def stuck(duration: float = 1.0, *, gusts: bool = False) -> Any:
    """Return a cart that a spring pulls over dry friction, whose width no step resolves, and random gusts."""
    builder = eomgen.SceneBuilder("stuck", gravity=[0, 0, 0]).body("cart", 1.0)
    friction = {"coulomb": 3.0, "static": 5.0, "stribeck": 2e-7, "velocity": 1e-8}
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], friction=friction)
    builder.parameter("pull", 400.0, tunable=True).effort("spring", "rail", "pull * (0.1 * t - q.rail)")
    if gusts:
        builder.random("gust", type="exponential", standard_deviation=1, correlation_time=1, unit="N", modes=3)
        builder.effort("gusts", "rail", "gust")
        builder.output("place", formula="q.rail")
    return builder.simulation(method="rk4", step=1e-3, duration=duration).build()
