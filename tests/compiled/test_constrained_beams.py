"""Runs of beams without shear or stretch: digits of the flying spaghetti, orders in time, hidden constraints."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.models.cache import shared_cache

__all__ = ["shared_cache"]

spaghetti: Any = SimpleNamespace(
    **runpy.run_path(str(Path(__file__).parents[2] / "examples" / "flying_spaghetti" / "spaghetti.py"))
)
#: Where the end that is thrown is at t = 2.5 s and t = 5 s by elements, of an implementation in NumPy that shares no
#: code with this one: Kirchhoff beam on S^3 x R^3, RATTLie, steps of 2^-10 s (data of Hante, Tumiotto and Arnold 2022).
THROWN_END = {
    4: ((3.55778181, 0.14453902, 0.14393421), (19.68905208, 2.61983381, -2.32524228)),
    8: ((3.44348092, 0.18402970, 0.05276752), (19.63434192, 1.78533503, -1.70756265)),
    16: ((3.41719291, 0.19477725, 0.02708423), (19.58065630, 1.57869296, -1.55157278)),
    32: ((3.41086502, 0.19758223, 0.02046807), (19.56466560, 1.52752843, -1.51284367)),
}


def thrown(elements: int, model: str = "kirchhoff") -> dict[str, Any]:
    """Return the flying spaghetti without the strains that the model does not have, undamped."""
    data: dict[str, Any] = spaghetti.scene(elements)
    noodle = data["beams"]["noodle"]
    del noodle["stiffness_damping"]
    without = ("shear_y", "shear_z") if model == "kirchhoff" else ("stretch", "shear_y", "shear_z")
    kept = {strain: value for strain, value in noodle["stiffness"].items() if strain not in without}
    data["beams"]["noodle"] = {**noodle, "model": model, "stiffness": kept}
    return data


@pytest.mark.parametrize("elements", list(THROWN_END))
def test_the_thrown_end_is_where_another_implementation_has_it(elements: int) -> None:
    model = eomgen.build(thrown(elements), method="rattlie", profile="quick")
    run = model.simulate(5.0, 2.0**-10, method="rattlie", record_every=2560, error_estimate=False)
    assert run.success, run.message
    np.testing.assert_allclose(run.poses["noodle"][1:, 4:], THROWN_END[elements], atol=1e-6)


def test_rounding_of_places_stops_no_step_of_rattlie() -> None:
    """Steps that move less than places are rounded to: gaps of 1e-15 m by 6e-5 s are most of what changes."""
    model = eomgen.build(thrown(2), method="rattlie", profile="quick")
    for step in (2.0**-13, 2.0**-14):
        run = model.simulate(0.05, step, error_estimate=False)
        assert run.success, run.message
        assert run.stats["newton_iterations"] < 4.0 * run.stats["steps"]
