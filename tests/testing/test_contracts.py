"""Contract tests for authors of other distributions (``eomgen.testing``): they pass for sound rows and name the demand
that a broken one does not meet."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen import testing
from eomgen.formula.words import other_words
from eomgen.integrators.families.register import families_of_others
from eomgen.mechanics.forces import applied
from eomgen.products.testing import demands, joint_types
from eomgen.scene.joint_types import joint_types_of_others
from eomgen.scene.load import from_data, load_toml
from eomgen.scene.sections import others
from tests.models import drags_for_eomgen as drags
from tests.models import slots_for_eomgen as slots
from tests.models.c_laws import TYRE_C, TYRE_LAW, wheel_scene
from tests.models.drags_for_eomgen import law

ENTRIES = f"""
[eomgen.sections]
drags = {drags.__name__}:DRAGS
winds = {drags.__name__}:WINDS
[eomgen.formula_words]
wind_speed = {drags.__name__}:WIND_SPEED
[eomgen.joint_types]
slot = {slots.__name__}:SLOT
[eomgen.integrator_families]
adams = tests.integrators.adams.family:AdamsBashforth
"""
SAIL = """
format = 1
name = "sail"
[bodies.boat]
mass = 200.0
inertia = [80.0, 150.0, 180.0]
[joints.free]
type = "free"
parent = "base"
child = "boat"
[points.mast]
body = "boat"
position = [0.2, 0.1, 3.0]
[drags.air]
point = "mast"
coefficient = "4 kg/m"
wind = [8.0, "3 * sin(t)", 0.5]
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Install a distribution with a section, a word, a joint type and a family of methods."""
    information = tmp_path / "sailing_for_eomgen-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: sailing\nVersion: 1.0\n", "utf-8")
    (information / "entry_points.txt").write_text(ENTRIES, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    registers: tuple[Any, ...] = (others, other_words, joint_types_of_others, families_of_others)
    for register in registers:
        register.cache_clear()
    yield
    for register in registers:
        register.cache_clear()


@pytest.mark.long
@pytest.mark.usefixtures("installed")
def test_sound_rows_pass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    testing.check_force_element(load_toml(SAIL), "air")
    for name in ("slot", "revolute", "universal"):
        testing.check_joint_type(name)
    testing.check_integrator("adams_bashforth", 2, order=2)
    testing.check_integrator("generalized_alpha", 2)
    rng, scenes = np.random.default_rng(1), (wheel_scene(TYRE_LAW, tmp_path), wheel_scene(None))
    states = {"q": rng.uniform(-0.05, 0.05, (4, 5)), "v": np.array([0.1, 20.0, 0.5, 0.1, 60.0]) * np.ones((4, 1))}
    testing.check_law(*(from_data(scene) for scene in scenes), states)


def test_a_sound_joint_type_passes_and_a_wrong_chain_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled: list[Any] = []
    monkeypatch.setattr(joint_types, "check_c", compiled.append)
    testing.check_joint_type("free")
    assert [scene.joints[-1].kind.name for scene in compiled] == ["free"]
    with (
        monkeypatch.context() as patch,
        pytest.raises(testing.ContractError, match="partials of the residual differ fr"),
    ):
        patch.setattr(joint_types, "PARTIALS", 1e-30)
        testing.check_joint_type("helical")
    with pytest.raises(testing.ContractError, match="helical: a joint without x_axis is taken"):
        joint_types.check_needed(joint_types.JOINTS["helical"], "x_axis")


@pytest.mark.parametrize("unused", ["", "int unused;"])
def test_c_that_compiles_with_warnings_is_named(unused: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In place of the generated C, a program that prints."""

    def written(_: Any, folder: Path) -> None:
        text = f'#include <stdio.h>\nint main(void) {{ {unused} puts("there"); return 0; }}\n'
        (folder / "main.c").write_text(text, encoding="utf-8")
        (folder / "manifest.json").write_text('{"compile": "cc main.c -o one"}', encoding="utf-8")

    monkeypatch.setattr(demands, "generate", written)
    scene: Any = SimpleNamespace(name="one")
    if unused:
        with pytest.raises(
            testing.ContractError, match=r"(?s)one: the generated C does not compile without warn.*unused"
        ):
            demands.check_c(scene)
        return
    program = demands.compile_c(scene, tmp_path)
    assert subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout == "there\n"


@pytest.mark.usefixtures("installed")
def test_a_law_with_a_wrong_power_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def without_power(loads: Any, drag: Any, quantities: Any) -> None:
        before = loads.power
        law.add_drag(loads, drag, quantities)
        loads.power = before

    monkeypatch.setattr(law, "LAW", replace(law.LAW, add=without_power))
    for function in vars(applied).values():
        if hasattr(function, "cache_clear"):
            function.cache_clear()
    with pytest.raises(testing.ContractError, match=r"air: the power of the law differs from the rate of energy by \d"):
        testing.check_force_element(load_toml(SAIL), "air")


@pytest.mark.usefixtures("installed")
def test_a_broken_section_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drags, "DRAGS", replace(drags.DRAGS, offers={"drag": "element", "pull": "element"}))
    others.cache_clear()
    with pytest.raises(testing.ContractError, match=r"drags: the law offers \['drag'\], and the section \['drag', 'pu"):
        testing.check_force_element(load_toml(SAIL), "air")
    with pytest.raises(testing.ContractError, match="water: the scene sail has no such element"):
        testing.check_force_element(load_toml(SAIL), "water")


def test_unknown_types_and_wrong_orders_are_named() -> None:
    with pytest.raises(testing.ContractError, match="slut: there is no joint type of this name"):
        testing.check_joint_type("slut")
    with pytest.raises(testing.ContractError, match=r"rk4: errors fall with order \d\.\d\d, and not 2"):
        testing.check_integrator("rk4", 2)
    with pytest.raises(testing.ContractError, match="rk45: the method chooses its steps"):
        testing.check_integrator("rk45", 5)


def test_a_wrong_law_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    scene, expected = wheel_scene(TYRE_LAW, tmp_path), from_data(wheel_scene(None))
    (tmp_path / "tyre.c").write_text(TYRE_C.replace("1.6, &", "1.7, &"), encoding="utf-8")
    with pytest.raises(testing.ContractError, match=r"car: residuals differ from the scene with formulas by \d"):
        testing.check_law(from_data(scene), expected)


@pytest.mark.slow
def test_no_framework_of_tests_is_imported() -> None:
    program = "import sys, eomgen.testing; print('pytest' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"
    assert eomgen.testing is testing
