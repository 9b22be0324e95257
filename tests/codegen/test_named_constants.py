"""Shape integrals have names in the C: each is defined once, used, and is the number that the textbook's formulas
give."""

from __future__ import annotations

import re
from pathlib import Path

import mpmath
import pytest

import eomgen
from eomgen.scene.builder import SceneBuilder
from tests.mechanics.test_shape_integrals import oracle


def generated(
    folder: Path, stiffness: float | str = "flexural", *, order: int = 1, stiffening: bool = True
) -> tuple[str, str]:
    """Return header and functions of a beam that turns."""
    builder = SceneBuilder("spin", gravity=[0, 0, 0], terms=["mass", "coupling", "force", "outputs"])
    builder.parameter("flexural", 1.4e4, tunable=True)
    bending = {"modes": 2, "stiffness": stiffness}
    builder.beam("blade", 10.0, mass_per_length=1.2, bending_y=bending, order=order, stiffening=stiffening)
    builder.joint("hub", "revolute", "base", "blade", axis=[0, 0, 1])
    builder.point("tip", "blade", [10, 0, 0]).output("tip", position="tip")
    eomgen.generate(builder.build(), folder)
    return (folder / "spin.h").read_text(), (folder / "spin.c").read_text()


def constants(header: str) -> dict[str, float]:
    found = re.findall(r"^#define SPIN_(blade_\w+) (\S+) /\*", header, re.MULTILINE)
    assert len({name for name, _ in found}) == len(found)
    return {name: float(value) for name, value in found}


@pytest.mark.slow
def test_the_numbers_of_a_beam(tmp_path: Path) -> None:
    header, code = generated(tmp_path)
    named = constants(header)
    with mpmath.workdps(30):
        value, slope = oracle(1, 1)
        places = mpmath.linspace(0, 1, 9)
        e = 120 * mpmath.quad(lambda s: s * value(s), places)
        g1 = 12 * mpmath.quad(lambda s: (1 - s * s) / 2 * slope(s) ** 2, places)
        shortening = mpmath.quad(lambda s: slope(s) ** 2, places) / 10
        wave = mpmath.findroot(lambda x: mpmath.cos(x) * mpmath.cosh(x) + 1, 1.9)
    assert named["blade_e_0"] == pytest.approx(float(e), rel=1e-15)
    assert named["blade_g1_0_0"] == pytest.approx(float(g1), rel=1e-15)
    assert named["blade_shortening_0_0_at_10"] == pytest.approx(float(shortening), rel=1e-15)
    assert named["blade_k_0_0"] == pytest.approx(float(wave**4 / 1000), rel=1e-15)
    for name, number in named.items():
        assert f"K(SPIN_{name})" in code
        assert f"K({number!r})" not in code and f"K(-{number!r})" not in code
    assert set(re.findall(r"SPIN_(blade_\w+)", code)) == set(named)


@pytest.mark.slow
def test_a_stiffness_that_is_fixed_is_folded_in(tmp_path: Path) -> None:
    tunable, fixed = (
        constants(generated(tmp_path / str(k), stiffness)[0]) for k, stiffness in enumerate(("flexural", 1.4e4))
    )
    assert fixed["blade_k_0_0"] == pytest.approx(1.4e4 * tunable["blade_k_0_0"], rel=1e-15)
