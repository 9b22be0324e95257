"""Runs with helical joints: the closed form over several turns, in joint coordinates, in absolute ones, and as a
loop."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen


@cache
def model(kind: str) -> eomgen.Model:
    """Return a nut on a screw of tunable pitch: a joint, in joint or absolute coordinates, or the rows of a loop."""
    builder = eomgen.SceneBuilder("screw", coordinates="absolute" if kind == "absolute" else "joint")
    builder.parameter("pitch", 0.3, unit="m", tunable=True).body("nut", 2.0, inertia=[0.05, 0.05, 0.08])
    if kind == "loop":
        ends = ({"body": body, "axis": [0, 0, -1], "x_axis": [1, 0, 0]} for body in ("base", "nut"))
        builder.joint("thread", "free", "base", "nut").constraint("screw", "helical", *ends, pitch="-pitch")
    else:
        turns = {"axis": [0, 0, -1], "pitch": "-pitch", "initial": {"velocity": 5}}
        builder.joint("thread", "helical", "base", "nut", **turns)
    return eomgen.build(builder.point("rim", "nut", [0.1, 0, 0]).output("rim", position="rim").build())


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "pitch"), [("joint", -0.1), ("absolute", 0.3), ("loop", -0.1)])
def test_a_nut_falls_along_its_screw(kind: str, pitch: float) -> None:
    """(I + m p^2) angle'' = -m g p, several turns down; the axis points down and the screw is left-handed."""
    start = {"q": [1.0, *[0.0] * 6], "v": [0.0, 0.0, -5.0, 0.0, 0.0, 5.0 * pitch]} if kind == "loop" else None
    solution = model(kind).simulate(2.0, 1e-3, initial=start, parameters={"pitch": pitch})
    assert solution.success, solution.message
    angle = 5.0 * solution.t - 0.5 * 2.0 * 9.81 * pitch / (0.08 + 2.0 * pitch**2) * solution.t**2
    assert np.ptp(angle) > 8.0 * np.pi
    expected = np.stack([0.1 * np.cos(angle), -0.1 * np.sin(angle), pitch * angle], axis=1)
    np.testing.assert_allclose(solution.outputs["rim"], expected, atol=2e-4)


def rack() -> eomgen.Scene:
    """Return a pinion, and a rack on a spring that follows it."""
    terms = ["forward_dynamics", "partials", "residual", "energy", "outputs", "poses"]
    builder = eomgen.SceneBuilder("rack", terms=terms).body("rack", 2.0)
    spring: dict[str, Any] = {"stiffness": 50, "rest": 0.25, "rotor_inertia": 0.5}
    mimic = {"joint": "pinion", "multiplier": -0.1, "offset": 0.2}
    builder.joint("rack", "prismatic", "base", "rack", axis=[0, 0, 1], mimic=mimic, **spring)
    builder.body("pinion", 1.0, inertia=[0.02, 0.02, 0.03])
    builder.joint("pinion", "revolute", "base", "pinion", axis=[0, 1, 0], initial={"position": 0.5})
    return builder.output("rack", formula=["q.rack", "v.rack", "a.rack"]).build()


def test_a_rack_that_follows_its_pinion() -> None:
    """(I + (m + rotor) r^2) angle'' = -r (m g + c (r angle + 0.2 - rest)) with r = -0.1: a swing about where both
    forces meet."""
    found = eomgen.build(rack())
    assert (found.nq, found.q_names) == (1, ["q.pinion"])
    solution = found.simulate(3.0, 5e-4)
    assert solution.success, solution.message
    inertia, rate = 0.02 + 2.5 * 0.01, np.sqrt(50.0 * 0.01 / (0.02 + 2.5 * 0.01))
    middle = (0.25 - 0.2 - 2.0 * 9.81 / 50.0) / -0.1
    angle = middle + (0.5 - middle) * np.cos(rate * solution.t)
    np.testing.assert_allclose(solution.q[:, 0], angle, atol=1e-4)
    speed = -(0.5 - middle) * rate * np.sin(rate * solution.t)
    np.testing.assert_allclose(
        solution.outputs["rack"][:, :2], np.stack([0.2 - 0.1 * angle, -0.1 * speed], axis=1), atol=2e-4
    )
    assert inertia * rate**2 == pytest.approx(0.5)
    np.testing.assert_allclose(solution.energy["total"], solution.energy["total"][0], atol=1e-3)
    with pytest.raises(eomgen.UsageError, match=r"there is no joint 'rack'"):
        found.simulate(1.0, 1e-3, initial={"rack": 0.1})
