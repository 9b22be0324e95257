"""Checks of the closed forms of scenes that other tests have, and next to features of functions:
limits of differences and of complex steps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.tree import links
from eomgen.products.studies.verification.differences import _as_finer
from eomgen.scene.load import load_toml
from eomgen.studies import check
from tests.mechanics.test_alike_links import chain
from tests.mechanics.test_rolling_on_surfaces import BODIES, HILLS, shaped
from tests.pipeline.test_front_ends import installed, lattice  # noqa: F401  # a fixture
from tests.scene.test_body_inertia import SHAFTS
from tests.simulation.test_events import DOUBLE, changed


def slide(**parts: Any) -> dict[str, Any]:
    return {
        "format": 1,
        "name": "slide",
        "gravity": [0, 0, 0],
        "bodies": {"b": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}},
        "joints": {"x": {"type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0], **parts.pop("joint")}},
        **parts,
    }


def clipped() -> dict[str, Any]:
    """Return a clipped damper at rest: both limits and the wanted force are 0, and the slope is 0 on both sides."""
    limits = "soft*v.x", "hard*v.x"
    text = f"max(min({limits[0]}, {limits[1]}), min(max({limits[0]}, {limits[1]}), semi*v.x))"
    numbers = {"soft": 0.0, "hard": 3e3, "semi": 0.0}
    parameters = {name: {"value": value, "tunable": True} for name, value in numbers.items()}
    return slide(joint={}, parameters=parameters, efforts={"damper": {"joint": "x", "effort": text}})


def pushed() -> dict[str, Any]:
    """Return a slide without parameters whose input has a law of time."""
    inputs = {"push": {"unit": "N", "formula": "sin(3 * t)"}}
    return slide(joint={}, inputs=inputs, efforts={"motor": {"joint": "x", "effort": "push"}})


def driven() -> eomgen.Scene:
    """Return a driven turn, whose rate is w less the drive's rate times cos^2 + sin^2, of exactly no change in time."""
    builder = eomgen.SceneBuilder("driven").body("crank", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("main", "revolute", "base", "crank", axis=[0, 0, 1], initial={"velocity": 150.0})
    base, crank = ({"body": body, "axis": [0, 0, 1], "x_axis": [1, 0, 0]} for body in ("base", "crank"))
    builder.constraint("drive", "revolute", base, crank, drive="150 * t")
    return builder.simulation(duration=0.1, step=1e-5).build()


def watched() -> dict[str, Any]:
    """Return a double pendulum on a moving base, with events of all levels."""
    scene = changed(DOUBLE, "checked_events", states={"lag": {"rate": "q.elbow - lag"}})
    scene["base"] = {"position": [0, 0, "0.1*sin(3*t)"], "rotation": [{"axis": [0, 1, 0], "angle": "0.2*sin(t)"}]}
    scene["events"]["rate"] = {"when": "v.elbow*lag + position.tip[0]*sin(t) + velocity.tip[2]"}
    return scene


def on_hills() -> Any:
    """Return a body on hills: derivatives take the place from three steps behind the iteration that complex steps go
    through."""
    tilted = "rotation = [{ axis = [1, 0, 0], angle = 0.25 }]"
    place = f"[0.3, 0.25, 0.7], {tilted}"
    return shaped(next(iter(BODIES)), type="sliding", position=place, surface=f'surface = "{HILLS}"')


CAR = "examples/car_in_side_wind/system/car.toml"
#: Scenes, options of ``check``, and forms that are in the report.
SCENES: dict[str, tuple[Callable[[], Any], dict[str, Any], set[str]]] = {
    "equal operands": (clipped, {"states": 2, "only": ["forward_dynamics"]}, set()),
    "laws by differences": (lambda: CAR, {"states": 2, "only": ["output_parameter_partials"]}, set()),
    "input without parameters": (
        pushed, {"states": 2, "only": ["input_derivatives"]}, {"input_derivatives.input_derivatives"}
    ),
    "cancelling drive": (
        driven, {"states": 4, "only": ["constraint_velocity_derivatives"]},
        {"constraint_velocity_derivatives.constraint_velocity_derivatives"},
    ),
    "another front end": (lambda: lattice("pendulums"), {"states": 4}, {"mass.M", "partials.K"}),
    "events": (watched, {"only": ["event"]}, {"events.event_rate", "event_impulse.gradient"}),
    "shafts without mass": (lambda: load_toml(SHAFTS), {}, set()),
    "shape on hills": (on_hills, {"states": 2, "only": ["partials", "second_partials"]}, set()),
}  # fmt: skip  # a table


@pytest.mark.slow
@pytest.mark.long_cases("shape on hills")
@pytest.mark.parametrize("name", SCENES)
def test_closed_forms_of_a_scene_agree(name: str) -> None:
    scene, options, forms = SCENES[name]
    report = check(scene(), profile="instant", **options)
    assert report.passed, [(form.name, str(form.worst)) for form in report.failures]
    assert forms <= {form.name for form in report.forms}


@pytest.mark.slow
def test_the_extended_system_of_such_a_chain_agrees(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(links, "MANY", 6)
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))
    report = check(chain("mixed", 8), states=2, only=["iteration", "energy"], profile="instant")
    assert report.passed, [(form.name, str(form.worst)) for form in report.failures]


@pytest.mark.parametrize(
    ("value", "bars", "finer"),
    [
        ([0.0, 0.0, 0.0, 0.9, 1.0, 1.001], [1e-9, 1e-9, 1e-3, 0.05, 1e-3, 1e-2], [False] * 3 + [True] * 3),
        ([1.2, 1.0001, 1.0, 1.01, 1.4], [0.2, 1e-4, 1e-4, 0.05, 0.5], [True] * 5),
    ],
    ids=["a coarse plateau is no agreement", "noise at small steps is no disagreement"],
)
def test_values_agree_with_finer_ones(value: list[float], bars: list[float], finer: list[bool]) -> None:
    assert _as_finer(np.array(value), np.array(bars)).tolist() == finer
