"""The distance of a ball or a free body from its reference, as a formula, against rotation matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from eomgen.formula.evaluate import evaluate
from eomgen.products.linear.controllers import error_on_group
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import STATE, SceneNames

NAMES = SceneNames(parameters={}, joints={"float": "free"})


def _turned(rng: np.random.Generator) -> tuple[Rotation, np.ndarray]:
    turn = Rotation.random(random_state=rng)
    x, y, z, w = turn.as_quat()
    return turn, np.array([w, x, y, z])


@pytest.mark.parametrize("seed", range(5))
def test_turns_are_sines_times_axes_and_travels_are_in_the_axes_of_the_reference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    (first, p), (second, r) = _turned(rng), _turned(rng)
    here, there = rng.standard_normal(3), rng.standard_normal(3)
    state = np.concatenate([p, here])
    reference = tuple(np.concatenate([r, there]).tolist())
    between = (second.inv() * first).as_rotvec()
    angle = np.linalg.norm(between)
    expected = [*(np.sin(angle) * between / angle), *second.inv().apply(here - there)]
    for component, value in enumerate(expected):
        formula = read_formula(error_on_group("float", component, reference), NAMES, STATE)
        assert evaluate(formula, lambda symbol: float(state[symbol.index])) == pytest.approx(value, abs=1e-12)
