"""An unstable equilibrium is left along its most unstable direction, and a stable one is not left."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.solvers import equilibrium_search
from eomgen.solvers.blocks import Blocks


def nudged(monkeypatch: pytest.MonkeyPatch, stiffness: np.ndarray, rates: int = 0) -> Any:
    """Return the change of configuration that leaves an equilibrium of a stiffness, None for none."""
    size = len(stiffness)
    point: Any = SimpleNamespace(
        imbalance=np.zeros(size), couplings=(np.zeros(0), np.ones(rates)), stiffness=stiffness,
        stiffness_blocks=Blocks.of(stiffness),
        largest_stiffness=5.0, basis=np.eye(size), dual=np.eye(size), z=np.zeros(0),
    )  # fmt: skip  # a table
    monkeypatch.setattr(equilibrium_search, "move", lambda statics, point, change: change)
    return equilibrium_search._nudge(cast(Any, SimpleNamespace(sizes=np.ones(size))), point)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    ("stiffnesses", "leaves"), [((-1.0, 2.0, 3.0), True), ((5.0, -4.0, -1.0), True), ((1.0, 2.0, 3.0), False)]
)
def test_the_way_down_is_that_of_the_lowest_stiffness(
    monkeypatch: pytest.MonkeyPatch, seed: int, stiffnesses: tuple[float, ...], leaves: bool
) -> None:
    axes = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    symmetric = axes @ np.diag(stiffnesses) @ axes.T
    change = nudged(monkeypatch, symmetric)
    assert (change is not None) == leaves
    if leaves:
        lowest = axes[:, int(np.argmin(stiffnesses))]
        assert np.abs(change).max() == pytest.approx(1e-3)
        assert abs(change @ lowest) == pytest.approx(np.linalg.norm(change))
        assert nudged(monkeypatch, symmetric, rates=1) is None


@pytest.mark.parametrize(("follower", "leaves"), [(3.0, False), (1.0, True)])
def test_follower_forces_that_bring_the_motion_back_are_no_reason_to_leave(
    monkeypatch: pytest.MonkeyPatch, follower: float, leaves: bool
) -> None:
    # Eigenvalues 1 +- sqrt(4 - follower^2): the symmetric part alone has -1 and 3.
    stiffness = np.array([[1.0, 2.0 + follower], [2.0 - follower, 1.0]])
    assert (nudged(monkeypatch, stiffness) is not None) == leaves


def test_an_upright_pendulum_with_states_that_move_with_it_is_left() -> None:
    builder = eomgen.SceneBuilder("upright").body("rod", 1.0, center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.01])
    builder.joint("hinge", "revolute", "base", "rod", axis=[1, 0, 0], initial={"position": np.pi})
    builder.state("turned", "3 * v.hinge").state("back", "-v.hinge")
    found = eomgen.build(builder.build(), profile="quick").equilibrium()
    assert np.cos(found.q[0]) == pytest.approx(1.0)
    assert found.z == pytest.approx((found.q[0] - np.pi) * np.array([3.0, -1.0]), rel=1e-3)
