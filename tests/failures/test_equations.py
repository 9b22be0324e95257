"""Scenes whose numbers leave no equation: a division by zero or an overflow while deriving is named, not raised."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen

HEAD = """
format = 1
name = "odd"
[parameters]
nothing = 0.0
huge = 1e300
[bodies.arm]
mass = {mass}
center_of_mass = [0, 0, -1]
[joints.hinge]
type = "revolute"
parent = "base"
child = "arm"
axis = [0, 1, 0]
[points.mark]
body = "arm"
[points.anchor]
body = "base"
"""


def odd(folder: Path, tail: str = "", mass: str = "1.0") -> Path:
    file = folder / "odd.toml"
    file.write_text(HEAD.format(mass=mass) + tail)
    return file


@pytest.mark.parametrize(
    ("formula", "operation"),
    [
        ("q.hinge / nothing", "div(..., 0)"),
        ("1 / (q.hinge - q.hinge)", "div(1, 0)"),
        ("log(nothing)", "log(0)"),
        ("sqrt(nothing - 1)", "sqrt(-1)"),
        ("huge * huge * q.hinge", "mul(1e+300, 1e+300)"),
    ],
)
def test_an_operation_without_a_finite_value_is_shown(tmp_path: Path, formula: str, operation: str) -> None:
    with pytest.raises(eomgen.ModelError) as caught:
        eomgen.derive(odd(tmp_path, f'[efforts.motor]\njoint = "hinge"\neffort = "{formula}"\n'))
    assert (
        str(caught.value) == f"model error: {operation} in a formula has no finite value for any state; "
        "try: other values of the fixed parameters there, or tunable = true for them"
    )


@pytest.mark.slow
def test_a_fixed_condition_guards_its_division(tmp_path: Path) -> None:
    tail = '[efforts.motor]\njoint = "hinge"\neffort = "1 / nothing if nothing > 0 else 7 + q.hinge"\n'
    model = eomgen.build(odd(tmp_path, tail), profile="quick")
    np.testing.assert_allclose(model.force([0.0], [0.0]), [7.0], rtol=1e-15)


def test_a_mass_whose_inverse_is_infinite_is_refused(tmp_path: Path) -> None:
    with pytest.raises(eomgen.ModelError) as caught:
        eomgen.derive(odd(tmp_path, mass="1e-320"))
    assert (
        str(caught.value)
        == "model error: odd: numbers of the scene combine to an infinite one: they are too small or too large, "
        "or cancel to zero in a divisor; try: masses, inertias and lengths between 1e-100 and 1e100"
    )


@pytest.mark.parametrize("name", ["string", "limits", "int", "math"])
def test_a_model_named_like_a_word_or_a_header_of_c_has_files_of_a_longer_name(tmp_path: Path, name: str) -> None:
    file = odd(tmp_path)
    file.write_text(file.read_text().replace('"odd"', f'"{name}"'))
    files = {path.name for path in eomgen.generate(file, tmp_path / "c")}
    assert {f"{name}_model.c", f"{name}_model.h"} <= files and not {f"{name}.c", f"{name}.h"} & files


@pytest.mark.slow_except("1e+160")
@pytest.mark.parametrize("mass", [1e-200, 1e160, 1e290])
def test_motion_under_gravity_is_the_same_at_any_scale_of_mass(tmp_path: Path, mass: float) -> None:
    def acceleration(scale: float) -> np.ndarray:
        file = odd(tmp_path, mass=repr(scale))
        inertia = f"center_of_mass = [0, 0, -1]\ninertia = [{scale!r}, {scale!r}, {scale!r}]"
        file.write_text(file.read_text().replace("center_of_mass = [0, 0, -1]", inertia))
        return eomgen.build(file, terms=["forward_dynamics"], profile="quick").forward_dynamics([0.3], [0.0])

    np.testing.assert_allclose(acceleration(mass), acceleration(1.0), rtol=1e-13)
    np.testing.assert_allclose(acceleration(1.0), [-9.81 * np.sin(0.3) / 2.0], rtol=1e-13)
