"""Distributed loads on geometrically exact beams against the differential equations of a rod."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

from eomgen.mechanics.derive import derive
from eomgen.scene.forces.distributed_loads import DistributedLoad
from eomgen.scene.load import from_data
from tests.mechanics.test_cosserat_parts import TERMS
from tests.models.cosserat import beam_scene, pose_of_last, rest
from tests.oracles.evaluation import Array

EI, EA, GA = 500.0, 1e4, 1e4


def loaded(elements: int, load: dict[str, Any], **joint: Any) -> dict[str, Any]:
    data = beam_scene(elements, {}, **joint)
    del data["forces"]
    return data | {"distributed_loads": {"wind": {"beam": "rope", **load}}}


def tip_of_rod(force: Any, moment: Any, follows: bool) -> Array:
    """Return where the tip of a clamped beam of 10 m is under loads per length at s, by shooting from its clamp.

    Plane statics (Antman, Nonlinear Problems of Elasticity, 1995, chapter 4): n' = -f, M' = -m - r' x n.
    """

    def slopes(x: float, y: Array) -> Array:
        c, s = np.cos(y[2]), np.sin(y[2])
        axial, across = c * y[4] + s * y[5], -s * y[4] + c * y[5]
        ahead, aside = c * (1 + axial / EA) - s * across / GA, s * (1 + axial / EA) + c * across / GA
        fx, fy = force(x / 10.0)
        fx, fy = (c * fx - s * fy, s * fx + c * fy) if follows else (fx, fy)
        return np.array([ahead, aside, y[3] / EI, -moment(x / 10.0) - ahead * y[5] + aside * y[4], -fx, -fy])

    def end(start: Array) -> Array:
        y = solve_ivp(slopes, (0.0, 10.0), [0, 0, 0, *start], method="DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
        return np.asarray(y)

    found = root(lambda start: end(start)[3:], np.array([10.0, 0.0, 1.0]), tol=1e-12)
    assert np.abs(found.fun).max() < 1e-9
    return end(found.x)[:2]


LOADS: dict[str, tuple[dict[str, Any], tuple[Any, Any, bool]]] = {
    "dead, by a formula of s": (
        {"force": ["-load * s", "4 * load * cos(s)", 0]}, (lambda s: (-s, 4.0 * np.cos(s)), lambda _: 0.0, False),
    ),
    "moment": (
        {"force": [0, 0, 0], "moment": [0, 0, "5 * load * (1 + s)"]},
        (lambda _: (0.0, 0.0), lambda s: 5 * (1 + s), False),
    ),
    "following": (
        {"force": [0, "4 * load", 0], "axes": "beam"}, (lambda _: (0.0, 4.0), lambda _: 0.0, True),
    ),
}  # fmt: skip  # one line for each load


@pytest.mark.slow
@pytest.mark.parametrize(("load", "exact"), list(LOADS.values()), ids=list(LOADS))
def test_large_deflections_converge_with_order_2(load: dict[str, Any], exact: tuple[Any, Any, bool]) -> None:
    expected, errors = tip_of_rod(*exact), []
    for elements in (8, 16):
        system = derive(from_data(loaded(elements, load)), TERMS)
        errors.append(np.linalg.norm(pose_of_last(system, rest(system, 8))[4:6] - expected))
    assert errors[1] < 0.08 and np.linalg.norm(expected - [10.0, 0.0]) > 0.5
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)


def test_nodes_bear_the_profile_exactly() -> None:
    data = loaded(3, {"force": [1, 0, 0], "profile": [2.0, 0.0, 3.0]})
    data["points"] = {"eye": {"body": "rope", "position": [1.0, 0, 0]}}
    load = next(item for item in from_data(data).elements if isinstance(item, DistributedLoad))
    places, weights = np.array([0.0, 1.0, 5.5, 10.0]), np.array([node.weight for node in load.nodes])
    assert weights.sum() == pytest.approx(30.0, rel=1e-14)
    assert weights @ places == pytest.approx(175.0, rel=1e-14)
    assert weights[0] == pytest.approx(2.0 * 0.5 + 0.03 * (1 / 3 - 1 / 4), rel=1e-14)
