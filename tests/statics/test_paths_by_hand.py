"""Critical points, branches and buckling loads of small structures whose forces are written down."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from eomgen.errors import NumericalError
from eomgen.lie.product import Factor
from eomgen.products.statics.critical_points import (
    critical_points,
    examined,
    half_way,
    linear_buckling,
    load_scale,
    lowest_frequency_squared,
    scaled_mode,
)
from eomgen.products.statics.equilibrium_path import EquilibriumPath
from eomgen.products.statics.path_following import _aside, _follow_path, _misleads, components_of
from eomgen.solvers.bordered_newton import Balance, LoadedState, LoadedStatics, Tangents
from eomgen.solvers.equilibrium_path import StepLimits, first_point, follow
from tests.oracles.evaluation import Array

Force = Callable[[Array, float], Array]


def structure(
    force: Force, stiffness: Force, by_load: Force, n: int, mass: float = 1.0, sizes: Array | None = None
) -> LoadedStatics:
    """Return the statics of n coordinates with forces r(q, s), r = 0 at rest, and their slopes."""
    none = np.zeros(0)

    def tangents(rest: LoadedState) -> Tangents:
        return Tangents(stiffness(rest.q, rest.s), *(np.zeros(shape) for shape in ((0, n), (n, 0), (0, n), (0, 0))))

    return LoadedStatics(
        factors=[Factor("R", "x", 0, n, 0, n)],
        sizes=np.ones(n) if sizes is None else sizes,
        reach=1.0,
        balance=lambda rest: Balance(force(rest.q, rest.s), none, none),
        tangents=tangents,
        by_factor=lambda rest: Balance(by_load(rest.q, rest.s), none, none),
        followed=lambda q, _: q,
        strains=lambda _: None,
        mass=lambda _: mass * np.eye(n),
    )


#: Two rigid links with springs of 1 N m at their hinges, pushed along their line.
LINKS = np.array([[2.0, -1.0], [-1.0, 1.0]])


def links(follower: float = 0.0) -> LoadedStatics:
    """Return two links under a load of fixed direction; a part of it follows the second link, for small angles."""
    turned = follower * np.array([[0.0, 1.0], [0.0, 1.0]])
    return structure(
        lambda q, s: LINKS @ q - s * np.sin(q) + s * turned @ q,
        lambda q, s: LINKS - s * np.diag(np.cos(q)) + s * turned,
        lambda q, s: -np.sin(q) + turned @ q,
        2,
    )


def pairs(second: float = 1.0) -> LoadedStatics:
    """Return two links side by side, each pushed along its own line; the stiffness of one is given."""
    k = np.array([1.0, second])
    return structure(
        lambda q, s: k * q - s * np.sin(q), lambda q, s: np.diag(k - s * np.cos(q)), lambda q, s: -np.sin(q), 2
    )  # fmt: skip  # three functions


def truss(k: float = 1000.0, mass: float = 1.0) -> LoadedStatics:
    """Return half of von Mises' truss: the height of an apex 0.2 m above its pin, and a spring beside it."""
    length = float(np.hypot(1.0, 0.2))

    def force(q: Array, s: float) -> Array:
        h = q[0]
        return np.array([k * (1.0 - length / np.hypot(1.0, h)) * h + s, q[1] + 0.1 * s])

    def stiffness(q: Array, s: float) -> Array:
        far = np.hypot(1.0, q[0])
        return np.diag([k * (1.0 - length / far + length * q[0] ** 2 / far**3), 1.0])

    return structure(force, stiffness, lambda *_: np.array([1.0, 0.1]), 2, mass)


def path_of(statics: LoadedStatics, q: Array, to: float, step: float = 0.3) -> tuple[list[Any], list[Any]]:
    """Return the examined points of a path and its critical points."""
    start = first_point(statics, LoadedState(np.array(q), np.zeros(0), np.zeros(0), 0.0), np.sign(to))
    points, critical = [examined(statics, start)], []
    for point in follow(statics, start, to, StepLimits(step, 0.1 * abs(to))):
        points.append(examined(statics, point))
        critical += critical_points(statics, *points[-2:])
    return points, critical


GOLDEN = (3.0 - 5.0**0.5) / 2.0, (3.0 + 5.0**0.5) / 2.0  # eigenvalues of LINKS


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_links_bifurcate_where_their_stiffness_vanishes(sign: float) -> None:
    """In the modes (1, golden) and (1, -1 / golden); no load in the other sense does anything."""
    points, critical = path_of(links(), [0.0, 0.0], 3.0 * sign)
    if sign < 0.0:
        assert not critical and all(item.stiffness.negative == 0 for item in points)
        return
    assert [item.kind for item in critical] == ["bifurcation"] * 2
    np.testing.assert_allclose([item.point.rest.s for item in critical], GOLDEN, rtol=1e-9)
    for item, s in zip(critical, GOLDEN, strict=True):
        assert item.modes.shape == (2, 1) and np.max(np.abs(item.modes)) == 1.0
        np.testing.assert_allclose((LINKS - s * np.eye(2)) @ item.modes[:, 0], 0.0, atol=1e-7)
    for item in points:
        s = item.point.rest.s
        assert item.stiffness.negative == sum(s > value for value in GOLDEN)
        values = sorted(np.array(GOLDEN) - s, key=abs)
        if abs(values[0] + values[1]) > 1e-6:
            assert lowest_frequency_squared(links(), item) == pytest.approx(values[0], rel=1e-9)


@pytest.mark.slow
def test_a_link_that_buckles_just_before_a_truss_snaps_is_found_in_the_same_step() -> None:
    """The load of an apex at h is k (L / far - 1) h with far^2 = 1 + h^2, the largest at far^3 = L."""
    length, own = float(np.hypot(1.0, 0.2)), truss()
    far = length ** (1.0 / 3.0)
    snap = 1000.0 * (length / far - 1.0) * np.sqrt(far**2 - 1.0)
    stiff = 0.9999 * snap
    statics = structure(
        lambda q, s: np.array([own.balance(replace(REST, q=q, s=s)).residual[0], stiff * q[1] - s * np.sin(q[1])]),
        lambda q, s: np.diag([own.tangents(replace(REST, q=q, s=s)).K[0, 0], stiff - s * np.cos(q[1])]),
        lambda q, s: np.array([1.0, -np.sin(q[1])]),
        2,
    )
    points, critical = path_of(statics, [0.2, 0.0], 1.6)
    assert [item.kind for item in critical[:3]] == ["bifurcation", "limit point", "bifurcation"]
    np.testing.assert_allclose([item.point.rest.s for item in critical[:3]], [stiff, snap, stiff], rtol=1e-9)
    assert any(abs(a.stiffness.negative - b.stiffness.negative) == 2 for a, b in itertools.pairwise(points))


def test_frequencies_are_relative_to_the_masses() -> None:
    statics = truss(mass=4.0)
    points, _ = path_of(statics, [0.2, 0.0], 1e-3)
    stiffness = np.diag(statics.tangents(points[0].point.rest).K)
    assert lowest_frequency_squared(statics, points[0]) == pytest.approx(min(stiffness) / 4.0)


def test_equal_links_bifurcate_together_and_nearly_equal_ones_do_not() -> None:
    _, (both,) = path_of(pairs(), [0.0, 0.0], 1.2)
    assert both.modes.shape == (2, 2) and both.point.rest.s == pytest.approx(1.0, rel=1e-9)
    assert np.linalg.matrix_rank(both.modes) == 2
    np.testing.assert_allclose(np.max(np.abs(both.modes), axis=0), 1.0, rtol=1e-12)
    np.testing.assert_allclose(both.modes.T @ both.modes, np.diag(np.sum(both.modes**2, axis=0)), atol=1e-9)
    _, critical = path_of(pairs(1.001), [0.0, 0.0], 1.2)
    np.testing.assert_allclose([item.point.rest.s for item in critical], [1.0, 1.001], rtol=1e-9)
    assert [item.modes.shape[1] for item in critical] == [1, 1]


@pytest.mark.parametrize("follower", [0.3, 0.5])
def test_forces_without_a_potential_bifurcate_where_the_determinant_vanishes(follower: float) -> None:
    """Of LINKS - s (1 - part): with half of the load that follows the roots are far apart, with more there are none."""
    statics = links(follower)
    points, critical = path_of(statics, [0.0, 0.0], 6.0)
    assert not points[1].stiffness.symmetric
    dets = [np.linalg.det(statics.tangents(LoadedState(np.zeros(2), np.zeros(0), np.zeros(0), s)).K) for s in (0, 1, 2)]
    polynomial = np.polyfit([0.0, 1.0, 2.0], dets, 2)
    expected = sorted(root.real for root in np.roots(polynomial) if not root.imag and 0.0 < root.real < 6.0)
    np.testing.assert_allclose([item.point.rest.s for item in critical], expected, rtol=1e-8)
    assert {item.kind for item in critical} <= {"bifurcation"}


@pytest.mark.parametrize("size", [1.0, -1.0, 2.0])
def test_branches_leave_on_the_side_that_is_asked_for(size: float) -> None:
    """Past the first load of one link: q / sin(q) = s."""
    statics = pairs(5.0)
    _, critical = path_of(statics, [0.0, 0.0], 2.0)
    onto = _aside(statics, critical[0], size)
    assert np.sign(onto.rest.q[0]) == np.sign(size * critical[0].modes[0, 0]) and abs(onto.rest.q[1]) < 1e-9
    assert 0.5 * 0.05 * abs(size) < abs(onto.rest.q[0]) < 2.0 * 0.05 * abs(size)
    assert onto.direction.unknowns[0] * onto.rest.q[0] > 0.0  # away from the point
    for point in follow(statics, onto, 2.0, StepLimits(0.3, 0.1)):
        assert point.rest.q[0] / np.sin(point.rest.q[0]) == pytest.approx(point.rest.s, rel=1e-9)
    assert point.rest.s == 2.0 and np.sign(point.rest.q[0]) == np.sign(onto.rest.q[0])


def test_a_point_without_a_branch_is_refused() -> None:
    """A link that hits a wall on both sides: beside the bifurcation nothing is at rest."""
    statics = pairs(5.0)
    _, (critical, *_) = path_of(statics, [0.0, 0.0], 2.0)
    broken = structure(lambda q, s: np.where(np.abs(q) > 1e-9, np.nan, 0.0 * q), lambda q, s: np.eye(2), np.cos, 2)
    with pytest.raises(NumericalError, match="no equilibrium was found near the bifurcation"):
        _aside(broken, critical, 1.0)


# -- buckling loads by extrapolation -----------------------------------------------------------------------------------

REST = LoadedState(np.zeros(2), np.zeros(0), np.zeros(0), 0.0)


@pytest.mark.parametrize("at", [0.0, -1.0, 1.0])
def test_linear_buckling_is_by_eigenvalues_of_the_stiffness_and_its_rate(at: float) -> None:
    """K + mu K' = LINKS - (s + mu) 1: nearest to the preload first, the reversed ones with their sign."""
    rest = LoadedState(np.zeros(2), np.zeros(0), np.zeros(0), at)
    factors, modes = linear_buckling(links(), rest, 4)
    expected = sorted((value - at for value in GOLDEN), key=abs)
    np.testing.assert_allclose(factors, expected, rtol=1e-8)
    for mu, mode in zip(factors, modes.T, strict=True):
        np.testing.assert_allclose((LINKS - (at + mu) * np.eye(2)) @ mode, 0.0, atol=1e-6)
        assert np.max(np.abs(mode)) == 1.0
    assert len(linear_buckling(links(), rest, 1)[0]) == 1


def test_of_two_loads_of_one_size_the_positive_one_comes_first() -> None:
    """Two links, pulled by the same load as pushed: one buckles under it, the other one under the reversed load."""
    sign = np.array([1.0, -1.0])

    def pulled(k: Array) -> LoadedStatics:
        return structure(
            lambda q, s: k * q - s * sign * q, lambda q, s: np.diag(k - s * sign), lambda q, s: -sign * q, 2
        )  # fmt: skip  # three functions

    for k, expected in (([1.0, 1.0], [1.0, -1.0]), ([1.2, 1.0], [-1.0, 1.2]), ([1.0, 1.2], [1.0, -1.2])):
        np.testing.assert_allclose(linear_buckling(pulled(np.array(k)), REST, 2)[0], expected, rtol=1e-8)


def test_large_structures_buckle_by_iteration() -> None:
    """A row of hinged links with 201 coordinates and more: the eigenvalues next to the preload."""
    n = 240
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    weights = np.linspace(1.0, 3.0, n)
    statics = structure(lambda q, s: K @ q - s * weights * q, lambda q, s: K - s * np.diag(weights),
                        lambda q, s: -weights * q, n)  # fmt: skip  # three functions
    factors, modes = linear_buckling(statics, LoadedState(np.zeros(n), np.zeros(0), np.zeros(0), 0.0), 3)
    root = np.sqrt(weights)
    expected = np.linalg.eigvalsh(K / root / root[:, np.newaxis])
    np.testing.assert_allclose(factors, expected[:3], rtol=1e-6)
    for mu, mode in zip(factors, modes.T, strict=True):
        np.testing.assert_allclose(K @ mode, mu * weights * mode, atol=1e-6)


def test_the_scale_of_a_load_is_the_one_that_moves_the_softest_motion_by_its_size() -> None:
    statics = structure(
        lambda q, s: np.diag([50.0, 2e3]) @ q - s * np.array([0.2, 0.0]),
        lambda q, s: np.diag([50.0, 2e3]),
        lambda q, s: -np.array([0.2, 0.0]),
        2,
        sizes=np.array([3.0, 1.0]),
    )
    assert load_scale(statics, REST) == pytest.approx(50.0 * 3.0**2 / (0.2 * 3.0), rel=0.05)
    assert load_scale(links(), REST) == 0.0  # it pushes nothing aside
    loose = structure(lambda q, s: 0.0 * q, lambda q, s: np.zeros((2, 2)), lambda q, s: np.ones(2), 2)
    assert load_scale(loose, REST) == 0.0


def test_extrapolation_is_checked_half_way() -> None:
    """The links keep their shape; a truss bends before it snaps, and one that hardens does not buckle."""
    (lowest, *_), _ = linear_buckling(links(), REST, 2)
    assert half_way(links(), REST, lowest) == pytest.approx(lowest, rel=1e-6)
    assert _misleads(links(), REST, "load", 0.0, np.array([lowest])) == ""
    start = LoadedState(np.array([0.2, 0.0]), np.zeros(0), np.zeros(0), 0.0)
    factors, _ = linear_buckling(truss(), start, 1)
    later = half_way(truss(), start, float(factors[0]))
    snap = minimize_scalar(lambda h: -1000.0 * (np.hypot(1.0, 0.2) / np.hypot(1.0, h) - 1.0) * h, bounds=(0.0, 0.2),
                           method="bounded")  # fmt: skip  # the limit load
    if later is not None:
        assert abs(later + snap.fun) < abs(factors[0] + snap.fun)  # nearer to the limit load
    said = _misleads(truss(), start, "load", 2.0, factors)
    assert (
        f"the lowest linear buckling load is load = {2.0 + factors[0]:.6g} by the stiffness at 2, and half way" in said
    )
    assert "no buckling load was found: the stiffness at load = 2 does not" in _misleads(
        truss(), start, "load", 2.0, np.zeros(0)
    )
    singular = structure(lambda q, s: q * 0.0, lambda q, s: np.zeros((2, 2)), lambda q, s: np.ones(2), 2)
    assert half_way(singular, REST, 1.0) is None
    with pytest.raises(ArithmeticError, match="the tangent stiffness is singular there"):
        linear_buckling(singular, REST, 1)


# -- results -----------------------------------------------------------------------------------------------------------


def test_components_of_a_mode_are_the_large_ones_in_their_sizes() -> None:
    model: Any = SimpleNamespace(v_names=tuple(f"v.x{k}" for k in range(8)))
    mode = np.array([0.1, -1.0, 0.5, 0.31, 0.29, 0.9, 0.8, 0.7])
    statics: Any = SimpleNamespace(sizes=np.ones(8))
    assert components_of(model, statics, mode) == ("x1", "x5", "x6", "x7", "x2", "x3")
    statics.sizes = np.array([0.01, *[1.0] * 7])
    assert components_of(model, statics, mode) == ("x0",)
    np.testing.assert_allclose(scaled_mode(np.array([2.0, 4.0]), np.array([1.0, -6.0])), [-2.0 / 3.0, 4.0])
    assert scaled_mode(np.ones(2), np.zeros(2)).tolist() == [0.0, 0.0]


def whole_path(
    statics: LoadedStatics, q: Array, to: float, *, most: int = 60, stability: bool = True, report: Any = None
) -> EquilibriumPath:
    """Return a path with its branches, of a structure without outputs and bodies."""
    model: Any = SimpleNamespace(functions=(), v_names=("v.first", "v.second"))
    varied: Any = SimpleNamespace(
        name="load", unit="N", shown_unit=" N", at_each=lambda s: (np.zeros((len(s), 0)), np.zeros(len(s)), s)
    )
    start = first_point(statics, LoadedState(np.array(q), np.zeros(0), np.zeros(0), 0.0), np.sign(to))
    limits = StepLimits(0.3, 0.1 * abs(to))
    return _follow_path(model, varied, statics, start, to, limits, most, stability, report)


def test_a_path_has_its_critical_points_between_its_rows_and_branches_of_the_same_kind() -> None:
    told: list[tuple[int, int]] = []
    path = whole_path(pairs(1.5), [0.0, 0.0], 2.0, report=lambda *done: told.append(done))
    assert path.success and path.message == "the path arrives at load = 2 N" and not path.interrupted
    assert told == sorted(told) and told[-1] == (1000, 1000) and len(told) == len(path.values) - 1
    assert [item.value for item in path.critical] == pytest.approx([1.0, 1.5], rel=1e-9)
    assert [item.components for item in path.critical] == [("first",), ("second",)]
    for item in path.critical:
        assert path.values[item.after - 1] < item.value < path.values[item.after]
    np.testing.assert_array_equal(path.negative, 1 * (path.values > 1.0) + (path.values > 1.5))
    lowest = np.array([1.0, 1.5]) - path.values[:, np.newaxis]
    nearest = np.take_along_axis(lowest, np.argmin(np.abs(lowest), axis=1)[:, np.newaxis], 1)[:, 0]
    np.testing.assert_allclose(path.lowest, nearest, rtol=1e-8)
    branch = path.branch(1, 1.8)
    assert branch.success and 1.5 * branch.q[-1, 1] / np.sin(branch.q[-1, 1]) == pytest.approx(1.8)
    plain = whole_path(pairs(1.5), [0.0, 0.0], 2.0, stability=False)
    assert not plain.critical and set(plain.negative) == {-1} and np.all(np.isnan(plain.lowest))
    np.testing.assert_array_equal(plain.values, path.values)


def test_paths_that_do_not_arrive_say_where_they_end() -> None:
    few = whole_path(truss(), [0.2, 0.0], 12.0, most=4)
    assert len(few.values) == 4 and not few.success
    end = f"the path ends at load = {few.values[-1]:.6g} N, not at 12: "
    assert few.message == f"{end}4 points are not enough; try: max_points=8, or a larger max_step"

    def stop(done: int, total: int) -> None:
        if done > 100:
            raise KeyboardInterrupt

    cut = whole_path(truss(), [0.2, 0.0], 12.0, report=stop)
    assert cut.interrupted and cut.message.endswith("not at 12: interrupted")
    assert len(cut.negative) == len(cut.values) and all(item.after < len(cut.values) for item in cut.critical)
    # a slope without end: the spring gives way at a load of 1
    soft = structure(
        lambda q, s: np.tanh(q) - s, lambda q, s: np.diag(1.0 / np.cosh(q) ** 2), lambda q, s: -np.ones(1), 1
    )
    lost = whole_path(soft, [0.0], 2.0, most=200, stability=False)
    assert not lost.success and lost.values[-1] < 1.0 + 1e-9 and "the path ends at load = " in lost.message
