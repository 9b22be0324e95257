"""Checks of the closed forms of scenes that other tests have."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from eomgen.mechanics import scene_tape
from eomgen.mechanics.tree import alike
from eomgen.products.studies.verification.check import check
from eomgen.scene.load import load_toml
from tests.mechanics.test_alike_links import chain
from tests.mechanics.test_rolling_on_surfaces import BODIES, HILLS, shaped
from tests.pipeline.test_front_ends import installed, lattice  # noqa: F401  # a fixture
from tests.scene.test_body_inertia import SHAFTS
from tests.simulation.test_events import DOUBLE, changed


@pytest.mark.slow
def test_the_extended_system_of_such_a_chain_agrees(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(alike, "MANY", 6)
    monkeypatch.setattr(scene_tape, "MANY", 6)
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))
    report = check(chain("mixed", 8), states=2, only=["iteration", "energy"], profile="quick")
    assert report.passed, [(form.name, str(form.worst)) for form in report.failures]


@pytest.mark.slow
def test_check_compares_geometric_stiffness_without_loads() -> None:
    builder = eomgen.SceneBuilder("mast", gravity=[0, 0, 0])
    builder.beam("mast", 2.0, mass_per_length=0.5, bending_z={"modes": 2, "shapes": "polynomial", "stiffness": 70.0})
    builder.joint("clamp", "revolute", "base", "mast", axis=[0, 1, 0], stiffness=100)
    builder.distributed_load("wind", "mast", [5, 0, "-3 * (1 + 0.2 * sin(t))"], profile=[0.5, 0.5])
    assert check(builder.build()).passed


@pytest.mark.long
@pytest.mark.parametrize("shape", [*BODIES][:1])
def test_derivatives_of_other_shapes_are_complex_steps(shape: str) -> None:
    """Derivatives take the place from three steps behind the iteration; complex steps go through the iteration."""
    tilted = "rotation = [{ axis = [1, 0, 0], angle = 0.25 }]"
    slides = shaped(shape, type="sliding", position=f"[0.3, 0.25, 0.7], {tilted}", surface=f'surface = "{HILLS}"')
    report = check(slides, states=2, only=["partials", "second_partials"])
    assert report.passed, report.summary


@pytest.mark.slow
def test_closed_forms_of_another_front_end_are_checked() -> None:
    report = check(lattice("pendulums"), profile="quick", states=4)
    assert report.passed, report.failures
    assert {"mass.M", "partials.K"} <= {form.name for form in report.forms}


@pytest.mark.slow
def test_rates_and_gradients_of_events_are_checked_against_differences() -> None:
    scene = changed(DOUBLE, "checked_events", states={"lag": {"rate": "q.elbow - lag"}})
    scene["base"] = {"position": [0, 0, "0.1*sin(3*t)"], "rotation": [{"axis": [0, 1, 0], "angle": "0.2*sin(t)"}]}
    scene["events"]["rate"] = {"when": "v.elbow*lag + position.tip[0]*sin(t) + velocity.tip[2]"}
    report = check(scene, only=["event"], profile="quick")
    assert report.passed and [form.name for form in report.forms] == ["events.event_rate", "event_impulse.gradient"]


@pytest.mark.slow
def test_shafts_without_mass_pass_every_check() -> None:
    assert check(load_toml(SHAFTS)).passed
