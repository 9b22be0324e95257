"""Time-discontinuous Galerkin steps by a tolerance: errors at the ends of steps and between them, stiff motion, jumps,
and what the family keeps from step to step."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import polynomial

import eomgen
from eomgen.integrators.families.discontinuous_galerkin import largest_between
from eomgen.integrators.families.register import method_named
from tests.integrators.test_discontinuous_galerkin import exact, frame, made
from tests.integrators.test_taylor import error, model, pushed
from tests.models.cache import shared_cache
from tests.models.shear_frame import SCALE, shear_frame

__all__ = ["shared_cache"]

METHODS = ("tdg1", "tdg1_star", "tdg2", "tdg3")


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["pendulum", "flyer", "controlled", "tumbler"])
def test_errors_follow_the_tolerance_on_every_group(name: str, method: str) -> None:
    for tolerance in (1e-4, 1e-6):
        end = made(name).simulate(0.8, 0.1, method=method, tolerance=tolerance, error_estimate=False)
        assert end.success and end.metadata["method"] == f"{method}_adaptive"
        assert error(made(name), end, exact(name)) < 10 * tolerance
        assert end.stats["own_steps"] > 2


@cache
def best() -> np.ndarray:
    run = frame().simulate(10.0, 0.01, method="taylor", tolerance=1e-14)
    return np.hstack([run.q, run.v])


@pytest.mark.slow
@pytest.mark.parametrize(("method", "tolerances"), [("tdg2", (1e-4, 1e-6, 1e-8)), ("tdg3", (1e-4, 1e-6, 1e-8, 1e-10))])
def test_rows_within_steps_follow_the_tolerance(method: str, tolerances: tuple[float, ...]) -> None:
    """1001 rows of the shear frame, from 100 to 2000 steps."""
    for tolerance in tolerances:
        run = frame().simulate(10.0, 0.01, method=method, tolerance=tolerance, error_estimate=False)
        errors = np.abs((np.hstack([run.q, run.v]) - best()) / SCALE)
        assert errors.max() < 2 * tolerance
        assert run.stats["rejections"] < 0.02 * run.stats["own_steps"] + 1


@pytest.mark.slow
def test_steps_pass_over_what_is_stiff() -> None:
    """The first storey 1e6 times as stiff: its frequency times the longest step is above 100, rows are as accurate."""
    made = eomgen.build(shear_frame(ground_stiffness=2e11))
    fine, run = (
        made.simulate(10.0, 0.05, method=method, tolerance=tolerance, error_estimate=False)
        for method, tolerance in (("tdg3", 1e-8), ("tdg2", 1e-5))
    )
    slow = [1, 2, 3]
    assert np.abs(run.q[:, slow] - fine.q[:, slow]).max() < 1e-4
    assert run.stats["largest_step"] * 1e4 > 100.0
    assert fine.q[-1, slow] == pytest.approx([0.1373634437235, 0.2291467307201, -2.157586602157], abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["tdg1", "tdg2", "tdg3"])
def test_jumps_are_met(method: str) -> None:
    """A force that jumps within a row: a step ends there, so no step is rejected for it, and errors stay."""
    made = eomgen.build(pushed("3 if t > late else 0"))
    fine = made.simulate(1.2, 0.1, method="taylor", tolerance=1e-14)
    run = made.simulate(1.2, 0.1, method=method, tolerance=1e-6, error_estimate=False)
    assert np.abs(run.q - fine.q).max() < 1e-5
    assert run.t[-1] == pytest.approx(1.2, abs=1e-15)
    assert run.stats["rejections"] <= 2


@pytest.mark.slow
@pytest.mark.parametrize("method", ["tdg2", "tdg3"])
def test_a_checkpoint_within_a_step_goes_on_with_the_same_bits(method: str, tmp_path: Path) -> None:
    made, file = model("controlled"), tmp_path / "run.ckpt"
    one = made.simulate(0.6, 1e-2, method=method, tolerance=1e-6)
    first = made.simulate(0.3, 1e-2, method=method, tolerance=1e-6, checkpoint=file)
    whole = first.followed_by(made.resume(file, 0.6))
    assert all(np.array_equal(getattr(whole, name), getattr(one, name)) for name in ("q", "v", "a", "z"))
    assert one.stats["own_steps"] < 60


@pytest.mark.parametrize("method", METHODS)
def test_the_error_between_nodes_is_that_of_a_polynomial_that_vanishes_at_them(method: str) -> None:
    nodes = method_named(method).operators.nodes  # type: ignore[attr-defined]
    integral = polynomial.polyint(polynomial.polyfromroots(np.array(nodes, float)))
    shares = np.linspace(0.0, 1.0, 10_001)
    largest = np.abs(polynomial.polyval(shares, integral)).max() / np.prod(np.array(nodes, float))
    assert float(largest_between(nodes)) == pytest.approx(largest, rel=1e-6)


def test_two_passes_of_far_orders_take_no_tolerance() -> None:
    with pytest.raises(eomgen.UsageError, match=r"tdg2s takes no tolerance: its two passes are of orders 2 and 4"):
        frame().simulate(1.0, 0.1, method="tdg2s", tolerance=1e-6)
