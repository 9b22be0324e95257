"""Time-discontinuous Galerkin steps in passes: published coefficients, one pass less, a strongly nonlinear oscillator,
stiff forces. Orders on every group are in test_orders.py."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from eomgen.errors import EomgenError
from eomgen.integrators.families.register import method_named
from tests.integrators.galerkin_in_numpy import ORDERS, SCHEMES

Array = NDArray[np.float64]
METHODS = tuple(ORDERS)


def slopes(counts: tuple[int, ...], errors: list[float]) -> Array:
    return np.asarray(np.log(np.array(errors[:-1]) / errors[1:]) / np.log(np.array(counts[1:]) / counts[:-1]))


@pytest.mark.parametrize(
    ("name", "nodes", "defect", "ends"),
    [
        ("tdg1", (1 / 3, 1), (-2 / 3, -0.2761423749153967), (1, -2.414213562373095)),
        ("tdg1_star", (1 / 3, 1), (-0.36700683814454793, 0.36700683814454793), (1, -1.4494897427831781)),
        ("tdg2", ((4 - 6**0.5) / 10, (4 + 6**0.5) / 10, 1), (-1 / 15, -3 / 5, 3 / 5), (1, -3, 1)),
        (
            "tdg3",
            (0.088587959512703947, 0.40946686444073471, 0.78765946176084706, 1),
            (-0.14999557707630168, -0.13527906640854299, -0.85766758494031221, 0.5367965367965368),
            (1, -5.0606060606060606, 7.2442607897153352, 0.81263507434306332),
        ),
    ],
)
def test_coefficients_are_the_published_ones(name: str, nodes: Any, defect: Any, ends: Any) -> None:
    """Nodes, r of T = P - gamma r e_p^T, and L_j(1/gamma); matrices against those of NumPy's polynomials."""
    method, oracle = method_named(name), SCHEMES[name]
    found = method.operators  # type: ignore[attr-defined]
    assert (method.degree, float(method.gamma), method.passes) == pytest.approx(  # type: ignore[attr-defined]
        (oracle.degree, oracle.gamma, oracle.passes), rel=1e-15
    )
    np.testing.assert_allclose(np.array(found.nodes, float), nodes, rtol=1e-15)
    np.testing.assert_allclose(np.array(found.values[-1], float), ends, rtol=1e-14)
    np.testing.assert_allclose(oracle.defect, defect, rtol=0, atol=1e-13)
    for ours, theirs in ((found.integration, oracle.integration), (found.first, oracle.first)):
        np.testing.assert_allclose(np.array(ours, float), theirs, rtol=0, atol=1e-13)


def duffing() -> eomgen.Scene:
    builder = eomgen.SceneBuilder("duffing", gravity=[0, 0, 0]).body("mass", 1.0)
    builder.joint("x", "prismatic", "base", "mass", axis=[1, 0, 0], damping=0.2, initial={"position": 1.0})
    return builder.effort("force", "x", "cos(1.3 * t) - q.x - 2 * q.x * q.x * q.x").build()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "largest"), [("tdg1", 1.2e-4), ("tdg1_star", 1.8e-4), ("tdg2", 4e-8), ("tdg3", 6e-11)]
)
def test_a_strongly_nonlinear_oscillator(method: str, largest: float) -> None:
    """q'' + 0.2 q' + q + 2 q^3 = cos 1.3 t: order, and the largest error at T/160 that a prototype allows."""
    made, counts = eomgen.build(duffing()), (80, 160, 320)
    best = made.simulate(10.0, 0.1, method="taylor", tolerance=1e-15)
    wanted = np.concatenate([best.q[-1], best.v[-1]])
    np.testing.assert_allclose(wanted, [1.01141459, -0.51687463], atol=5e-9)
    errors = []
    for count in counts:
        end = made.simulate(10.0, 10.0 / count, method=method, error_estimate=False)
        errors.append(float(np.abs(np.concatenate([end.q[-1], end.v[-1]]) - wanted).max()))
    assert errors[1] < largest
    order = ORDERS[method]
    assert slopes(counts, errors)[0 if order == 7 else -1] == pytest.approx(order, abs={3: 0.1, 5: 0.15, 7: 0.4}[order])


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_stiff_forces_of_a_known_motion(method: str) -> None:
    """q'' + omega^2 q with the force of q = sin t, omega = 1e6, h = 0.1."""
    scene = (
        eomgen.SceneBuilder("forced", gravity=[0, 0, 0]).body("mass", 1.0)
        .joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], stiffness=1e12, initial={"velocity": 1.0})
        .effort("known", "rail", "(1e12 - 1) * sin(t)").build()
    )  # fmt: skip  # a chain of calls
    end = eomgen.build(scene).simulate(2.0, 0.1, method=method, error_estimate=False)
    assert np.abs(end.q[:, 0] - np.sin(end.t)).max() < 1e-10
    largest = {"tdg1": 5e-2, "tdg1_star": 2e-3, "tdg2": 2e-5, "tdg2s": 2e-3, "tdg3": 1e-5}[method]
    assert np.abs(end.v[:, 0] - np.cos(end.t)).max() < largest


def test_loops_are_refused_with_the_methods_to_take() -> None:
    with pytest.raises(EomgenError) as caught:
        eomgen.build("examples/four_bar/scene.toml", profile="quick").simulate(0.1, 1e-3, method="tdg2")
    text = str(caught.value)
    assert "tdg2 cannot run on this scene" in text
    assert "forces of constraints are not known at its start" in text
    assert "try: rosenbrock or lsrt2" in text
