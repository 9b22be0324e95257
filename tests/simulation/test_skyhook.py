"""Skyhook, groundhook and clipped dampers in runs: against their laws in NumPy, and what they do to energy and
smoothness."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from tests.oracles.semi_active import clipped, skyhook
from tests.simulation.rails import built

LIMITS = {"softest": 300.0, "hardest": 3000.0}


@pytest.mark.slow_cases("0.05")
@pytest.mark.parametrize("width", [None, 0.05])
def test_tensions_are_those_of_the_laws(width: float | None, rng: np.random.Generator) -> None:
    """On a tilted rail: velocities count along the spring."""
    model = built(masses(width=width, tilt=0.3), terms=["outputs", "forward_dynamics"])
    for _ in range(40):
        q, v = 0.05 * rng.normal(size=2), rng.normal(size=2)
        p = {"sky": rng.uniform(0, 3000), "ground": rng.uniform(0, 1000), "softest": 200.0, "hardest": 2500.0}
        found = model.outputs(q, v, parameters=p)
        body, wheel = v[model.v_names.index("v.body")], v[model.v_names.index("v.wheel")]
        wanted = skyhook(body, wheel, p["sky"], p["ground"])
        assert found["ideal"] == pytest.approx(float(wanted), rel=1e-12, abs=1e-9)
        held = float(clipped(wanted, body - wheel, 200.0, 2500.0, width or 0.0))
        assert found["semi"] == pytest.approx(held, rel=1e-11, abs=1e-9)


def masses(*, width: float | None = None, tilt: float = 0.0, moving: bool = False) -> eomgen.SceneBuilder:
    """Return two masses on one rail, tilted, and a spring between them with a skyhook, clipped or not, as outputs
    say."""
    axis = [np.sin(tilt), 0.0, np.cos(tilt)]
    builder = eomgen.SceneBuilder("masses", gravity=[0, 0, -9.81])
    for name, value in (("sky", 2000.0), ("ground", 400.0), *LIMITS.items()):
        builder.parameter(name, value, tunable=True)
    if moving:
        builder.base(position=[0, 0, "0.05 * sin(9 * t)"])
    builder.body("wheel", 36.0).body("body", 240.0).point("hub", "wheel").point("mount", "body")
    builder.joint("wheel", "prismatic", "base", "wheel", axis=axis, stiffness=160000.0, initial={"velocity": 1.3})
    start = {"position": 0.05, "velocity": -0.4}
    builder.joint("body", "prismatic", "base", "body", axis=axis, position=[0.4 * x for x in axis], initial=start)
    hook = {"spring": "strut", "damping": "sky", "groundhook": "ground"}
    limits = {"minimum_damping": "softest", "maximum_damping": "hardest", **({} if width is None else {"width": width})}
    builder.controller("ideal", "skyhook", **hook).controller("semi", "skyhook", clipped=True, **hook, **limits)
    builder.spring("strut", "hub", "mount", stiffness=16000.0, length=0.55, force="semi")
    builder.output("ideal", formula="ideal", unit="N").output("semi", formula="semi", unit="N")
    return builder.output("along", formula=["velocity.mount[2]", "velocity.hub[2]", "rate.strut"])


@pytest.mark.slow
def test_velocities_are_those_against_the_world() -> None:
    """On a moving base the mount moves with it, and a skyhook feels that."""
    model = built(masses(moving=True), terms=["outputs", "forward_dynamics"])
    at_rest = model.outputs([0.0, 0.0], [0.0, 0.0], t=0.0)
    speed = 0.05 * 9.0
    assert at_rest["along"] == pytest.approx([speed, speed, 0.0])
    assert at_rest["ideal"] == pytest.approx((2000.0 - 400.0) * speed)


@pytest.mark.slow
@pytest.mark.parametrize("width", [None, 0.01])
def test_a_clipped_damper_only_takes_energy_out(width: float | None) -> None:
    run = built(masses(width=width)).simulate(2.0, 2e-4)
    assert run.success, run.message
    rate, tension = run.outputs["along"][:, 2], run.outputs["semi"]
    assert (tension * rate).min() >= -1e-12 * np.abs(tension).max()
    total = run.energy["total"]
    assert np.diff(total).max() < 1e-6 * np.ptp(total)
    moving = np.abs(rate) > 1e-6
    coefficient = tension[moving] / rate[moving]
    assert coefficient.min() >= 300.0 * (1 - 1e-9) and coefficient.max() <= 3000.0 * (1 + 1e-9)
    assert coefficient.min() < 301.0 and coefficient.max() > 2000.0  # both are made use of


def test_corners_are_known_and_a_width_takes_them_away() -> None:
    assert not eomgen.derive(masses().build(), terms=["force"]).facts.smooth
    assert eomgen.derive(masses(width=0.01).build(), terms=["force"]).facts.smooth
