"""Rosenbrock steps on loops: orders on every group with drives, rolling, internal states and a moving base; a step by
the formula in dense NumPy, and what its parts are worth; the bound of the drift; what ends a run; the same in C."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from tests.integrators.constrained_models import heavy_top, rolling_disc, shaking_base, two_links
from tests.models.cache import shared_cache
from tests.models.stewart import stewart

__all__ = ["shared_cache"]

Array = NDArray[np.float64]
METHODS = ("rosenbrock", "lsrt2")
GAMMA = {"rosenbrock": 0.5, "lsrt2": 1.0 - np.sqrt(0.5)}
SLOW = (0.0, 1.5, -0.0461538)


def slopes(errors: list[float]) -> Array:
    return np.asarray(np.log2(np.array(errors[:-1]) / errors[1:]))


def five_bar() -> eomgen.Scene:
    """Return a loop of five bars whose crank is driven, while a filtered signal turns its rocker."""
    builder = eomgen.SceneBuilder("five_bar")
    for name in ("crank", "left", "right", "rocker"):
        builder.body(name, 1.0, center_of_mass=[0.15, 0, 0], inertia=[1e-3, 0.01, 0.01])
    for name, parent, child, place, angle in (
        ("drive", "base", "crank", 0.0, 1.6),
        ("left_pin", "crank", "left", 0.3, -1.1),
        ("support", "base", "rocker", 0.4, 1.4),
        ("right_pin", "rocker", "right", 0.3, 1.2),
    ):
        free = {"initial": {"position": angle}, "damping": 0.02}
        law = {"drive": f"{angle} + 0.4 * sin(5 * t)"} if name == "drive" else free
        builder.joint(name, "revolute", parent, child, axis=[0, -1, 0], position=[place, 0, 0], **law)
    builder.state("push", "20 * (3 * sin(7 * t) - 2 * v.support - push)", initial=0.5)
    builder.effort("turned", "support", "push - 4 * q.support")
    ends = [{"body": name, "position": [0.3, 0, 0]} for name in ("left", "right")]
    return builder.constraint("tip", "spherical", ends[0], ends[1]).build()


def spatial_loop() -> eomgen.Scene:
    """Return a body on a ball joint and one in flight, joined by a ball and a rod to the ground, pushed over time."""
    builder = eomgen.SceneBuilder("spatial_loop")
    builder.body("swing", 2.0, center_of_mass=[0.1, 0, -0.4], inertia=[0.1, 0.12, 0.03])
    builder.body("plate", 1.5, center_of_mass=[0.05, 0.1, 0], inertia=[0.02, 0.03, 0.04])
    builder.joint("ball", "spherical", "base", "swing", initial={"velocity": [0.3, -0.5, 2.0]})
    builder.joint("float", "free", "base", "plate", initial={"position": [0, 0, -0.8]})
    builder.constraint("corner", "spherical", {"body": "swing", "position": [0, 0, -0.8]}, {"body": "plate"})
    builder.constraint(
        "rod", "distance", {"body": "plate", "position": [0.4, 0.3, 0]}, {"body": "base", "position": [1, 1, 0]},
        length=1.1,
    )  # fmt: skip  # one constraint
    return builder.build()


SCENES: dict[str, tuple[Callable[[], eomgen.Scene | str], float]] = {
    "four_bar": (lambda: "examples/four_bar/scene.toml", 0.25),
    "slider_crank": (lambda: "examples/slider_crank_planar/scene.toml", 0.01),
    "spatial_slider_crank": (lambda: "examples/slider_crank_spatial/scene.toml", 0.02),
    "drive_and_state": (five_bar, 0.4),
    "spatial_loop": (spatial_loop, 0.4),
    "stewart": (stewart, 0.3),
    "top_on_R3xSO3": (lambda: heavy_top("R3xSO3", SLOW), 0.4),
    "top_on_SE3": (lambda: heavy_top("SE3", SLOW), 0.4),
    "links_on_a_shaking_base": (lambda: two_links("absolute", shaking_base()), 0.4),
    "rolling_disc": (rolling_disc, 0.5),
}


@cache
def model(name: str) -> eomgen.Model:
    return eomgen.build(SCENES[name][0](), profile="quick")


@cache
def reference(name: str) -> eomgen.Solution:
    end = SCENES[name][1]
    return model(name).simulate(end, end / 4000, method="rk4_partitioned", record_every=4000, error_estimate=False)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", SCENES)
def test_order_in_positions_velocities_and_multipliers(name: str, method: str) -> None:
    """Against coordinate partitioning of order 4, on every group; multipliers are those of the accelerations."""
    exact, end = reference(name), SCENES[name][1]
    errors: dict[str, list[float]] = {}
    for count in (200, 400, 800):
        last = model(name).simulate(end, end / count, method=method, error_estimate=False)
        assert last.success, last.message
        for part in ("q", "v", "z", "multipliers"):
            if len(getattr(exact, part)[-1]):
                errors.setdefault(part, []).append(
                    float(np.abs(getattr(last, part)[-1] - getattr(exact, part)[-1]).max())
                )
        assert last.stats["max_constraint"] <= 1e-10
    for part, found in errors.items():
        assert slopes(found)[-1] == pytest.approx(2.0, abs=0.1), part


@pytest.mark.parametrize("method", METHODS)
def test_what_two_corrections_leave_falls_by_the_ninth_power_of_the_step(method: str) -> None:
    """From steps whose corrections do not reach rounding to those whose do."""
    left = []
    for step in (4e-3, 2e-3):
        end = model("four_bar").simulate(1.0, step, method=method, error_estimate=False)
        assert end.success, end.message
        left.append((end.stats["max_constraint"], end.stats["max_constraint_velocity"]))
    orders = np.log2(np.array(left[0]) / left[1])
    assert orders == pytest.approx([9.0, 9.0], abs=1.0)
    fine = model("four_bar").simulate(1.0, 5e-4, method=method, error_estimate=False)
    assert fine.stats["max_constraint"] < 1e-15 and fine.stats["max_constraint_velocity"] < 5e-14


@pytest.mark.parametrize("method", METHODS)
def test_steps_too_long_for_two_corrections_end_the_run(method: str) -> None:
    end = model("slider_crank").simulate(0.1, 2e-3, method=method, error_estimate=False)
    assert not end.success
    assert "the corrections of a step, a fixed number, did not bring it onto the constraints" in end.message
    assert "try: a step smaller than 0.002 s" in end.message
    loose = model("four_bar").simulate(0.1, 4e-3, method=method, error_estimate=False)
    strict = model("four_bar").simulate(0.1, 4e-3, method=method, error_estimate=False, settings={"drift": 1e-14})
    assert loose.success and not strict.success
