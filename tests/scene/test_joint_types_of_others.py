"""A joint type of another distribution, found by its entry point, in joint coordinates; refusals of broken ones."""

from __future__ import annotations

import re
import runpy
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen import extending
from eomgen.errors import DescriptionError, ModelError, UsageError
from eomgen.extending import Connection, ElementaryMotion
from eomgen.pipeline.readings import stored_scene
from eomgen.pipeline.scenes import SCENES
from eomgen.scene.joint_types import JOINTS, fault_of, joint_types_of_others
from eomgen.scene.load import load_toml
from tests.models import slots_for_eomgen as slots
from tests.scene.distributions import install

MASS, ARM, INERTIA, GRAVITY, STIFFNESS = 2.0, 0.3, 0.05, 9.81, 40.0
TEXT = f"""
format = 1
name = "plate"
bodies.plate = {{ mass = {MASS}, center_of_mass = [{ARM}, 0, 0], inertia = [0.02, 0.04, {INERTIA}] }}
[joints.pin]
type = "slot"
parent = "base"
child = "plate"
axis = [0, 1, 0]
x_axis = [1, 0, 0]
stiffness = [0, "40 N/m"]
initial = {{ position = [0.4, 0.1], velocity = ["20 deg/s", "0.5 m/s"] }}
[simulation]
method = "rk4"
step = 1e-3
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Install a distribution that brings the joint type ``slot``."""
    entries = install(
        tmp_path, monkeypatch, "slots-for-eomgen", f"[eomgen.joint_types]\nslot = {slots.__name__}:SLOT\n"
    )
    joint_types_of_others.cache_clear()
    yield entries
    joint_types_of_others.cache_clear()


def _rates(t: float, y: np.ndarray) -> list[float]:
    """Angle about y and place along x of the plate, by Lagrange's equations: the centre is at s + l cos a, -l sin a."""
    angle, place, spin, speed = y
    sine, cosine = np.sin(angle), np.cos(angle)
    inertia = np.array([[0.04 + MASS * ARM**2, -MASS * ARM * sine], [-MASS * ARM * sine, MASS]])
    forces = [MASS * GRAVITY * ARM * cosine, MASS * ARM * cosine * spin**2 - STIFFNESS * place]
    return [spin, speed, *np.linalg.solve(inertia, forces)]


@pytest.mark.slow
@pytest.mark.usefixtures("installed")
def test_a_plate_in_a_slot_moves_as_lagrange_says() -> None:
    model = eomgen.build(load_toml(TEXT), profile="quick")
    run = model.simulate(1.0)
    exact = solve_ivp(_rates, (0.0, 1.0), [0.4, 0.1, np.radians(20), 0.5], rtol=1e-12, atol=1e-13)
    assert np.max(np.abs([*run.q[-1], *run.v[-1]] - exact.y[:, -1])) < 1e-8
    assert run.metadata["method"] == "rk4"


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('type = "slot"', 'type = "slut"', "(joints.pin.type): 'slut'"),
        ('"40 N/m"', '"40 N m/rad"', "(joints.pin.stiffness[1]): '40 N m/rad'"),
        ("format = 1", 'format = 1\ncoordinates = "absolute"', "has no equations between absolute bodies; try: coord"),
    ],
)
def test_mistakes_are_told_as_in_any_other_type(old: str, new: str, message: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(message)):
        load_toml(TEXT.replace(old, new, 1))


def test_the_page_has_this_type(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "how_to" / "write_a_plug_in.md").read_text(encoding="utf-8")
    (tmp_path / "page.py").write_text(page.partition("```python\n")[2].partition("```")[0], encoding="utf-8")
    assert runpy.run_path(str(tmp_path / "page.py"))["SLOT"] == slots.SLOT


def test_every_name_for_distributions_is_there() -> None:
    for name in extending.__all__:
        assert getattr(extending, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'Sectoin'"):
        extending.Sectoin  # noqa: B018


def test_without_the_distribution_the_type_is_unknown() -> None:
    joint_types_of_others.cache_clear()
    with pytest.raises(DescriptionError, match=r"\(joints.pin.type\): 'slot'"):
        load_toml(TEXT)
    assert "slot" not in JOINTS and JOINTS.get("slot") is None


@pytest.mark.usefixtures("installed")
def test_libraries_follow_from_the_type(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No record of a scene is kept either, since a record knows the files of the scene alone."""
    before = SCENES.content(load_toml(TEXT))
    assert before == SCENES.content(load_toml(TEXT))
    file = tmp_path / "plate.toml"
    file.write_text(TEXT, encoding="utf-8")
    eomgen.build(file, profile="quick")
    assert stored_scene(file, {}) is None
    monkeypatch.setattr(slots, "SLOT", replace(slots.SLOT, meanings=("turn", "shift")))
    joint_types_of_others.cache_clear()
    assert SCENES.content(load_toml(TEXT)) != before


def _travel(*components: int, axes: tuple[int, ...] = (0,)) -> ElementaryMotion:
    return ElementaryMotion("travel", axes, components or (0,))


def _turn(component: int = 0, axis: int = 0) -> ElementaryMotion:
    return ElementaryMotion("turn", (axis,), (component,))


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        (Connection("two words", (_turn(),)), "has a name that is not a word of letters, digits and underscores"),
        (Connection("slot", (_turn(),), drive="angle"), "has drive, which only types in eomgen have"),
        (Connection("slot"), "has an empty chain: a joint type has at least one elementary motion"),
        (Connection("slot", (_turn(), _turn(2, 1))), "has the velocity components [0, 2], and each from 0 to 1 is"),
        (Connection("slot", (_travel(0), _turn(1))), "has a travel before a turn among its velocity components"),
        (Connection("slot", (_turn(0), _travel(1))), "has a travel after a turn in its chain; travels come first"),
        (
            Connection("slot", (_travel(3), ElementaryMotion("ball", (), (0, 1, 2)))),
            "has a ball, a free motion or a screw among other motions",
        ),
        (Connection("slot", (_turn(0, 2),)), "has turns about other directions than the axis"),
        (Connection("slot", (_travel(0, axes=(2,)),)), "has a travel along the third direction without one along"),
        (Connection("slot", (_travel(1), _travel(2, axes=(1,)), _turn())), "has 3 coordinates and needs as many"),
    ],
)
def test_rows_that_equations_cannot_be_derived_of_are_refused(row: Connection, fault: str) -> None:
    assert fault_of(row).startswith(fault)


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (f"slit = {slots.__name__}:SLOT", "is the joint type slot"),
        ("slot = math:pi", "is not an eomgen.scene.joint_types.Connection"),
        ("slot = no_such_module:SLOT", "does not load: ModuleNotFoundError: No module named 'no_such_module'"),
    ],
)
def test_a_broken_entry_point_is_named_with_its_distribution(installed: Path, entry: str, message: str) -> None:
    installed.write_text(f"[eomgen.joint_types]\n{entry}\n", encoding="utf-8")
    joint_types_of_others.cache_clear()
    with pytest.raises(UsageError, match=re.escape(f"of the distribution slots-for-eomgen {message}")):
        load_toml(TEXT)


@pytest.mark.usefixtures("installed")
def test_models_with_a_type_of_another_distribution_are_not_saved(tmp_path: Path) -> None:
    model = eomgen.build(load_toml(TEXT), profile="quick")
    fault = "plate has parts of another distribution, which a file cannot hold: the type of the joint pin"
    with pytest.raises(ModelError, match=f"save: {fault}; try: eomgen.build"):
        model.save(tmp_path / "plate.eomgen")
