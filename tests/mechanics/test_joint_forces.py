"""Stops and dry friction of joints: their laws, their energies, exact partials, and motions known in closed form."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

import eomgen
from eomgen.mechanics.derive import derive
from eomgen.scene.builder import SceneBuilder
from eomgen.system.system import System
from tests.models.cache import shared_cache
from tests.oracles.evaluation import Array, tape_evaluator

pytestmark = pytest.mark.slow

__all__ = ["shared_cache"]

LIMITS = {"lower": -0.4, "upper": 0.7, "stiffness": 300.0, "damping": 4.0, "onset": 0.05}
FRICTION = {"coulomb": 1.5, "velocity": 0.02, "static": 2.5, "stribeck": 0.3}


def slider(mass: float = 1.0, **joint: Any) -> SceneBuilder:
    """Return a body that slides along x, without weight."""
    builder = SceneBuilder("slider", gravity=[0, 0, 0]).body("body", mass)
    return builder.joint("rail", "prismatic", "base", "body", axis=[1, 0, 0], **joint)


def arm(coordinates: str = "joint") -> SceneBuilder:
    """Return a pendulum that carries a slider; both have stops and friction."""
    builder = SceneBuilder("arm", coordinates=coordinates)
    builder.body("link", 1.2, center_of_mass=[0.1, 0, -0.4], inertia=[0.1, 0.12, 0.03])
    builder.body("sled", 0.7, center_of_mass=[0, 0.05, 0.1], inertia=[0.01, 0.02, 0.015])
    builder.joint("hinge", "revolute", "base", "link", axis=[0.3, 1, 0.2], limits=LIMITS, friction=FRICTION)
    rail, rubbing = {"upper": 0.2, "stiffness": 900.0}, {"coulomb": 3, "velocity": 0.1}
    return builder.joint("rail", "prismatic", "link", "sled", axis=[0, 0.6, 0.8], limits=rail, friction=rubbing)


def stop_effort(q: float, v: float) -> float:
    """Return the effort of LIMITS, written down from its documentation."""
    for depth, rate, sign in ((q - LIMITS["upper"], v, -1.0), (LIMITS["lower"] - q, -v, 1.0)):
        if depth > 0.0:
            u = min(depth / LIMITS["onset"], 1.0)
            return sign * u * u * (3.0 - 2.0 * u) * max(0.0, LIMITS["stiffness"] * depth + LIMITS["damping"] * rate)
    return 0.0


def evaluated(system: System, function: str, q: Any, v: Any) -> dict[str, Array]:
    q, v = np.broadcast_arrays(np.asarray(q, float), np.asarray(v, float))
    return tape_evaluator(system)(function, {"q": q[..., np.newaxis], "v": v[..., np.newaxis]})


def test_stops_follow_their_law_and_never_pull() -> None:
    system = derive(slider(limits=LIMITS).build(), ["force"])
    q, v = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.6, 0.9, 301), [-20.0, -1.0, -0.1, 0.0, 0.5, 3.0]))
    found = evaluated(system, "force", q, v)["Q"][:, 0]
    np.testing.assert_allclose(found, [stop_effort(*state) for state in zip(q, v, strict=True)], rtol=1e-12, atol=1e-12)
    assert (
        np.all(found[q > 0.7] <= 0.0) and np.all(found[q < -0.4] >= 0.0) and not np.any(found[np.abs(q - 0.15) < 0.55])
    )
    assert np.any((found == 0.0) & (q > 0.75))  # where the damper alone would pull


def test_stops_store_the_work_of_their_elastic_force() -> None:
    system = derive(slider(limits=LIMITS).build(), ["energy"])
    q = np.array([-0.55, -0.43, -0.1, 0.69, 0.705, 0.73, 0.75, 0.9])
    work = [
        -quad(lambda x: stop_effort(x, 0.0), 0.0, end, points=[-0.45, -0.4, 0.7, 0.75], epsabs=1e-13)[0] for end in q
    ]
    np.testing.assert_allclose(evaluated(system, "energy", q, 0.0)["energy"][:, 1], work, rtol=1e-11, atol=1e-13)
    for v in (-9.0, -0.5, 0.7):
        power = evaluated(system, "energy", q, v)["energy"][:, 2]
        expected = [(stop_effort(x, v) - stop_effort(x, 0.0)) * v for x in q]
        np.testing.assert_allclose(power, expected, rtol=1e-11, atol=1e-12)
        assert np.all(power <= 0.0)


def test_stop_forces_are_smooth_where_contact_begins_and_where_the_onset_ends() -> None:
    system = derive(slider(limits=LIMITS).build(), ["partials"])
    for place in (0.7, 0.75, -0.4, -0.45):
        left, right = (
            evaluated(system, "partials", place + side, 1.0 if place > 0 else -1.0) for side in (-1e-9, 1e-9)
        )
        for name, jump in (("K", 2e-3), ("C", 1e-6)):  # second derivatives over a step of 2e-9
            assert abs(left[name] - right[name]).max() < jump


def test_friction_follows_its_law() -> None:
    system = derive(slider(friction=FRICTION).build(), ["force", "energy"])
    v = np.linspace(-2.0, 2.0, 401)
    level = 1.5 + np.exp(-((v / 0.3) ** 2))
    np.testing.assert_allclose(
        evaluated(system, "force", 0.0, v)["Q"][:, 0], -level * np.tanh(v / 0.02), rtol=1e-13, atol=1e-15
    )
    np.testing.assert_allclose(
        evaluated(system, "energy", 0.0, v)["energy"][:, 2], -level * np.tanh(v / 0.02) * v, rtol=1e-13
    )


@pytest.mark.parametrize("kind", ["cylindrical", "universal", "planar"])
def test_stops_and_friction_in_each_coordinate_of_a_joint(kind: str, rng: np.random.Generator) -> None:
    """A joint of several coordinates has the forces of as many joints with one each: they act on their own coordinates
    only."""
    count = 3 if kind == "planar" else 2
    limits = {"lower": [-0.5, -np.inf, -0.2][:count], "upper": [np.inf, 0.3, 0.4][:count]}
    limits |= {
        "stiffness": [200.0, 300.0, 400.0][:count],
        "damping": [3.0, 2.0, 0.0][:count],
        "onset": [0.05, 0.1, 0.2][:count],
    }
    friction = {"coulomb": [1.0, 0.0, 2.0][:count], "velocity": [0.3, 1.0, 0.2][:count]}
    builder = SceneBuilder("joint", gravity=[0, 0, 0]).body("body", 1.0, inertia=[0.1, 0.2, 0.3])
    second: dict[str, Any] = {"second_axis": [0, 1, 0]} if kind == "universal" else {}
    builder.joint("joint", kind, "base", "body", axis=[1, 0, 0], limits=limits, friction=friction, **second)
    system = derive(builder.build(), ["force"])
    q, v = rng.uniform(-1, 1, (60, count)), rng.uniform(-2, 2, (60, count))
    expected = np.zeros((60, count))
    for k in range(count):
        for depth, rate, sign in (
            (q[:, k] - limits["upper"][k], v[:, k], -1.0),
            (limits["lower"][k] - q[:, k], -v[:, k], 1.0),
        ):
            u = np.clip(depth / limits["onset"][k], 0.0, 1.0)
            linear = limits["stiffness"][k] * np.maximum(depth, 0.0) + limits["damping"][k] * rate
            expected[:, k] += sign * u * u * (3 - 2 * u) * np.maximum(0.0, linear)
        expected[:, k] -= friction["coulomb"][k] * np.tanh(v[:, k] / friction["velocity"][k])
    np.testing.assert_allclose(tape_evaluator(system)("force", {"q": q, "v": v})["Q"], expected, rtol=1e-12, atol=1e-12)


# -- motions -----------------------------------------------------------------------------------------------------------


def test_a_slider_with_friction_slows_down_as_the_closed_form_says() -> None:
    """m v' = -F tanh(v / s) has the solution sinh(v / s) = sinh(v0 / s) exp(-F t / (m s))."""
    friction = {"coulomb": 3.0, "velocity": 0.5}
    model = eomgen.build(slider(2.0, friction=friction, initial={"velocity": 2.0}).build(), profile="quick")
    t = np.linspace(0.0, 3.0, 301)
    expected = 0.5 * np.arcsinh(math.sinh(4.0) * np.exp(-3.0 * t / (2.0 * 0.5)))
    errors = []
    for step in (1e-2, 5e-3):
        run = model.simulate(3.0, step, rho_inf=0.8, record_every=round(1e-2 / step))
        errors.append(np.abs(run.v[:, 0] - expected).max())
    assert errors[0] < 3e-5 and 1.9 < math.log2(errors[0] / errors[1]) < 2.1


def test_an_explicit_method_says_when_its_step_cannot_resolve_friction() -> None:
    scene = slider(2.0, friction={"coulomb": 3.0, "velocity": 1e-3}, initial={"velocity": 0.5}).build()
    model = eomgen.build(scene, profile="quick")
    coarse, fine = (model.simulate(0.5, step, method="rk4") for step in (1e-2, 1e-3))
    what, hint = "too fast for an explicit method at this step", "generalized_alpha, or a step below 0.0019 s"
    (found,) = coarse.findings
    assert found.name == "unresolved_damping" and found.value == pytest.approx(1.5e3, rel=1e-3)
    assert found.time == pytest.approx(1.0 / 3.0, abs=0.02)  # it comes to rest there, and chatters from then on
    assert coarse.message.endswith(f"s, {what}; try: {hint}") and "friction of rail decays" in coarse.message
    assert fine.success and fine.message == "reached t = 0.5 s in 500 steps"
    assert "too fast" not in model.simulate(0.5, 1e-2).message
