"""Compositions of kicks and drifts as methods of mechanical scenes: orders, energies, and scenes that are refused."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.integrators.compositions import composition_named
from eomgen.integrators.families.composition import NAMES
from tests.models.lattice import LATTICES, Lattice
from tests.models.library import scene

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Coarse steps at which errors of the lattice are above rounding, and fall by the order.
STEPS = {"suzuki6": 0.4, "blanes_moan6": 0.4, "yoshida8": 0.2, "kahan_li8": 0.8}


@dataclass(frozen=True)
class Chain(Lattice):
    """The lattice, which says itself who derives its equations."""

    @property
    def front_end(self) -> object:
        return LATTICES


@cache
def lattice() -> eomgen.Model:
    mode = np.sin(np.pi * np.arange(1, 7) / 7)
    return eomgen.build(Chain("fput", "fput", tuple((0.8 * mode).tolist())), profile="quick")


def _end(model: eomgen.Model, step: float, method: str) -> Array:
    run = model.simulate(4.0, step, method=method, error_estimate=False)
    assert run.success, run.message
    return np.concatenate([run.q[-1], run.v[-1]])


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_errors_fall_with_the_order(name: str) -> None:
    exact = _end(lattice(), 0.05, "taylor")
    step = STEPS.get(name, 0.2)
    coarse, fine = (float(np.abs(_end(lattice(), h, name) - exact).max()) for h in (step, step / 2))
    assert math.log2(coarse / fine) == pytest.approx(composition_named(name).order, abs=0.2)


@pytest.mark.long
@pytest.mark.slow
def test_forces_that_change_with_time_are_taken_at_the_times_of_the_kicks() -> None:
    motor = {"body": "rod", "torque": [0, "2*sin(3*t)", 0]}
    model = eomgen.build(scene("pendulum", forces__motor=motor), profile="quick")
    exact = _end(model, 0.05, "taylor")
    for name, order in (("leapfrog", 2), ("omf4", 4), ("yoshida4", 4)):
        coarse, fine = (float(np.abs(_end(model, h, name) - exact).max()) for h in (0.05, 0.025))
        assert math.log2(coarse / fine) == pytest.approx(order, abs=0.15), name


@pytest.mark.parametrize("name", ["leapfrog", "suzuki4", "omf4"])
def test_a_step_evaluates_forces_as_often_as_the_composition_says(name: str) -> None:
    run = lattice().simulate(2.0, 0.1, method=name, error_estimate=False)
    assert run.stats["evaluations"] == 1 + 20 * composition_named(name).gradients


@pytest.mark.parametrize("name", ["bcss3", "suzuki4", "yoshida6"])
def test_steps_there_and_back_end_where_they_began(name: str) -> None:
    model = lattice()
    there = model.simulate(5.0, 0.1, method=name, error_estimate=False)
    back = model.simulate(5.0, 0.1, method=name, error_estimate=False, initial={"q": there.q[-1], "v": -there.v[-1]})
    np.testing.assert_allclose(back.q[-1], there.q[0], atol=2e-14)
    np.testing.assert_allclose(back.v[-1], -there.v[0], atol=2e-14)


def _energy_errors(name: str, step: float, steps: int, rows: int) -> Array:
    run = lattice().simulate(steps * step, step, method=name, record_every=steps // rows, error_estimate=False)
    assert run.success, run.message
    total = run.energy["total"]
    return np.asarray(np.abs(total / total[0] - 1.0))


@pytest.mark.slow
@pytest.mark.long_cases("omf4-2.2e-07-1000000")
@pytest.mark.parametrize(
    ("name", "bound", "steps"),
    [("leapfrog", 8e-3, 10**5), ("yoshida4", 3.5e-4, 10**5), ("suzuki4", 1.5e-5, 10**5), ("omf4", 2.2e-7, 10**6)],
)
def test_energy_errors_are_bounded_over_many_steps(name: str, bound: float, steps: int) -> None:
    errors = _energy_errors(name, 0.3, steps, 1000)
    assert errors.max() < bound
    assert errors[500:].max() < 1.5 * errors[:500].max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("double_pendulum_on_shaking_base", r"constant mass: its drifts are exact at constant velocities"),
        ("four_bar", r"without constraints"),
        ("quarter_car", r"without velocity forces: its kicks hold positions while velocities change"),
        ("free_spinning_body", r"accelerations that do not depend on velocities, and gyroscopic or Coriolis forces do"),
    ],
)
def test_other_scenes_are_refused_with_the_reason(name: str, reason: str) -> None:
    model = eomgen.build(EXAMPLES / name / "scene.toml", profile="quick")
    with pytest.raises(eomgen.EomgenError, match=reason):
        model.simulate(0.1, 0.01, method="leapfrog")


@pytest.mark.slow
def test_a_tolerance_is_refused() -> None:
    with pytest.raises(eomgen.UsageError, match="leapfrog takes no tolerance: it keeps energies because its steps"):
        lattice().simulate(0.1, 0.01, method="leapfrog", tolerance=1e-6)
