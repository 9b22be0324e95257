"""Relative springs between moving masses: matrices and runs at stiffnesses far beyond the digits of doubles."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import eomgen
from eomgen.integrators.families.family import Family
from eomgen.integrators.families.one_factorization import OneFactorization
from eomgen.integrators.newton import solver
from eomgen.integrators.newton.row_sums import with_row_sums
from eomgen.pipeline.pipeline import build_in
from eomgen.pipeline.step_operations import joined_coordinates

pytestmark = pytest.mark.slow


Links = Sequence[tuple[int, int, float | str]]
#: Of a step of ``rosenbrock``, s.
STEP = 0.37
RNG = np.random.default_rng(0)

#: Masses, springs to the ground, springs between masses, dampers between masses; ``kappa`` is the stiff one.
SYSTEMS: dict[str, tuple[list[float], Mapping[int, float], Links, Links]] = {
    "chain": ([1.0] * 4, {0: 1.0}, [(0, 1, 1.0), (1, 2, "kappa"), (2, 3, 1.0)], []),
    "tree": (
        [1.0, 2.0, 0.5, 3.0, 1.0, 1.5],
        {0: 2.0},
        [(0, 1, "kappa"), (1, 2, "kappa"), (1, 3, 7.0), (3, 4, "kappa"), (3, 5, 0.1)],
        [],
    ),
    "grid": (
        list(RNG.uniform(0.1, 3.0, 16)),
        {0: 1.0, 3: 2.0},
        [
            *((4 * r + c, 4 * r + c + 1, "kappa" if (r + c) % 2 else 2.0) for r in range(4) for c in range(3)),
            *((4 * r + c, 4 * r + c + 4, "kappa" if c % 2 else 0.5) for r in range(3) for c in range(4)),
        ],
        [],
    ),
    "free and damped": ([1.0, 2.0, 3.0], {}, [(0, 1, 1.0)], [(0, 1, "kappa"), (1, 2, 2.0)]),
    "two groups": ([1.0, 2.0, 3.0, 1.0], {3: 1.0}, [(0, 1, "kappa"), (2, 3, "kappa")], []),
    "nearly massless": ([1.0, 1e-30, 1.0], {0: 1.0}, [(0, 1, "kappa"), (1, 2, 3.0)], []),
}


def described(name: str, *, positions: Sequence[float] = (), rest: float = 0.0) -> eomgen.Scene:
    """Return slides on one axis with springs and dampers between them, and loads that are parameters."""
    masses, ground, springs, dampers = SYSTEMS[name]
    builder = eomgen.SceneBuilder("slides", gravity=[0, 0, 0]).parameter("kappa", 1.0, tunable=True)
    for k, mass in enumerate(masses):
        start = {"position": positions[k]} if positions else {}
        builder.parameter(f"f{k}", 0.0, tunable=True)
        builder.body(f"m{k}", mass)
        rail: dict[str, Any] = {"axis": [1, 0, 0], "stiffness": ground.get(k, 0.0), "initial": start}
        builder.joint(f"x{k}", "prismatic", "base", f"m{k}", **rail).effort(f"load{k}", f"x{k}", f"f{k}")
    for kind, links, free in (("q", springs, rest), ("v", dampers, 0.0)):
        for i, j, size in links:
            pull = f"{size} * ({kind}.x{j} - {kind}.x{i} - {free if size == 'kappa' else 0.0})"
            builder.effort(f"{kind}_{i}_{j}", f"x{i}", pull).effort(f"{kind}_{j}_{i}", f"x{j}", f"-({pull})")
    return builder.build()


@cache
def model(name: str, method: str = "rosenbrock") -> eomgen.Model:
    return eomgen.build(described(name), method=method, profile="quick")


def exact_accelerations(name: str, kappa: float, loads: Sequence[float]) -> list[Fraction]:
    """Return (M + h/2 C + h^2/4 K)^-1 f in rational numbers."""
    masses, ground, springs, dampers = SYSTEMS[name]
    n, gain = len(masses), Fraction(STEP) / 2
    A = [[Fraction(masses[i]) if i == j else Fraction(0) for j in range(n)] for i in range(n)]
    for i, size in ground.items():
        A[i][i] += gain * gain * Fraction(size)
    for links, weight in ((springs, gain * gain), (dampers, gain)):
        for i, j, text in links:
            size = weight * Fraction(kappa if text == "kappa" else float(text))
            for row, column, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
                A[row][column] += sign * size
    b = [Fraction(load) for load in loads]
    for k in range(n):
        for row in range(k + 1, n):
            factor = A[row][k] / A[k][k]
            A[row] = [x - factor * y for x, y in zip(A[row], A[k], strict=True)]
            b[row] -= factor * b[k]
    x = [Fraction(0)] * n
    for k in reversed(range(n)):
        x[k] = (b[k] - sum(A[k][j] * x[j] for j in range(k + 1, n))) / A[k][k]
    return x


def error_of_a_step(made: eomgen.Model, name: str, kappa: float, loads: Sequence[float]) -> float:
    """Return the relative error of the accelerations that a step from rest finds, v/h."""
    given = {f"f{k}": float(load) for k, load in enumerate(loads)}
    rest = [0.0] * len(loads)
    options: dict[str, Any] = {"initial": {"q": rest, "v": rest}, "error_estimate": False}
    run = made.simulate(STEP, STEP, method="rosenbrock", parameters={"kappa": kappa, **given}, **options)
    exact = exact_accelerations(name, kappa, [float(load) for load in loads])
    worst = max(abs(Fraction(float(v) / STEP) - x) for v, x in zip(run.v[-1], exact, strict=True))
    return float(worst / max(map(abs, exact)))


@pytest.mark.long_except_every(2)
@pytest.mark.long_cases("grid")
@pytest.mark.parametrize("name", SYSTEMS)
def test_matrices_are_solved_to_the_last_digits_at_any_stiffness(name: str) -> None:
    loads = np.random.default_rng(1).normal(size=(3, len(SYSTEMS[name][0])))
    for kappa in (0.0, *10.0 ** np.arange(0.0, 31.0, 3.0)):
        for load in loads:
            assert error_of_a_step(model(name), name, float(kappa), list(load)) <= 2e-15, kappa


def plain(scene: eomgen.Scene, folder: Path, method: str, monkeypatch: pytest.MonkeyPatch) -> eomgen.Model:
    """Return a model whose steps eliminate as they do without relative springs."""
    with monkeypatch.context() as patched:
        patched.setattr(OneFactorization, "prepared", Family.prepared)
        return build_in(folder, scene, None, method, "quick")


@pytest.mark.parametrize("name", ["grid", "two groups"])
def test_tables_do_the_same_as_what_is_written_out(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solver, "GROUPS_UNROLLED", 0)
    made = build_in(tmp_path, described(name), None, "rosenbrock", "quick")
    for kappa in (1.0, 1e9, 1e30):
        load = list(np.random.default_rng(2).normal(size=len(SYSTEMS[name][0])))
        assert error_of_a_step(made, name, kappa, load) <= 2e-15


@pytest.mark.long
@pytest.mark.parametrize(("method", "unrolled"), [("rosenbrock", 0), ("corrected_predictor", 64), ("tdg2", 64)])
def test_what_hangs_on_a_group_moves_as_ever(
    method: str, unrolled: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three storeys that springs join, a pendulum on the third, which M couples with it, and an internal state."""
    with Path("examples/shear_frame_with_pendulum/scene.toml").open("rb") as file:
        data = tomllib.load(file)
    data["states"] = {"w": {"rate": "q.x1 - w", "initial": 0.1}}
    data["efforts"]["slow"] = {"joint": "x2", "effort": "1e3 * w"}
    monkeypatch.setattr(solver, "GROUPS_UNROLLED", unrolled)
    made = build_in(tmp_path / "joined", data, None, method, "quick")
    runs = [made, plain(eomgen.load(data), tmp_path / "plain", method, monkeypatch)]
    first, second = (run.simulate(2.0, 5e-3, method=method, error_estimate=False) for run in runs)
    assert np.abs(first.q - second.q).max() <= 1e-12 * np.abs(second.q).max()
    assert made.library.fingerprint != runs[1].library.fingerprint  # bits may be equal


#: Of the chain: q and v at the start, and the length of the stiff spring.
MOVED, RATES, LENGTH = (0.1, 0.1, 0.3, 0.37), (0.3, 0.2, 0.2, -0.1), 0.2


def exact_motion(
    name: str, kappa: float, t: float, start: tuple[Sequence[float], Sequence[float]], rest: float
) -> list[mpmath.mpf]:
    """Return the positions of an undamped system at t in 60 digits, by its modes; stiff springs are slack at rest."""
    masses, ground, springs, _ = SYSTEMS[name]
    n = len(masses)
    with mpmath.workdps(60):
        K, f = mpmath.matrix(n, n), mpmath.matrix(n, 1)
        for i, size in ground.items():
            K[i, i] += mpmath.mpf(size)
        for i, j, text in springs:
            size = mpmath.mpf(kappa if text == "kappa" else text)
            for row, column, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
                K[row, column] += sign * size
            for row, sign in ((i, -1), (j, 1)) if text == "kappa" else ():
                f[row] += sign * size * mpmath.mpf(rest)
        root = [mpmath.sqrt(mpmath.mpf(mass)) for mass in masses]
        slack = mpmath.lu_solve(K, f)
        for i in range(n):
            for j in range(n):
                K[i, j] /= root[i] * root[j]
        squares, modes = mpmath.eigsy(K)
        q, v = (
            modes.T * mpmath.matrix([(mpmath.mpf(x) - y) * of for x, y, of in zip(values, away, root, strict=True)])
            for values, away in ((start[0], slack), (start[1], [0] * n))
        )
        omega = [mpmath.sqrt(x) for x in squares]
        y = [q[k] * mpmath.cos(w * t) + v[k] / w * mpmath.sin(w * t) for k, w in enumerate(omega)]
        return [away + x / of for away, x, of in zip(slack, modes * mpmath.matrix(y), root, strict=True)]


def errors_of_run(made: eomgen.Model, method: str, kappa: float, step: float, name: str = "chain") -> float:
    """Return the largest error of the positions at t = 10 s, m."""
    n = len(SYSTEMS[name][0])
    start, rest = ((MOVED, RATES), LENGTH) if name == "chain" else (([0.1] * n, [0.3] * n), 0.0)
    options: dict[str, Any] = {"initial": {"q": start[0], "v": start[1]}, "error_estimate": False}
    run = made.simulate(10.0, step, method=method, parameters={"kappa": kappa}, **options)
    exact = exact_motion(name, kappa, 10.0, start, rest)
    return max(float(abs(mpmath.mpf(float(x)) - y)) for x, y in zip(run.q[-1], exact, strict=True))


@pytest.mark.parametrize(
    ("method", "step", "bars"),
    [("rosenbrock", 1e-3, (3e-6, 3e-6)), ("tdg2", 0.05, (1e-9, 1e-9)), ("tdg3", 0.05, (1e-13, 1e-13))],
)
def test_runs_with_a_stiff_link_move_as_with_a_rigid_one(method: str, step: float, bars: tuple[float, float]) -> None:
    """Springs of 1e18 and 1e24 N/m, h omega of 1e6 to 1e11: the link pulls with up to 1e8 N that are rounding of q."""
    scene = described("chain", positions=MOVED, rest=LENGTH)
    made = eomgen.build(scene, method=method, profile="quick")
    assert errors_of_run(made, method, 1e18, step) < bars[0]
    assert errors_of_run(made, method, 1e24, step) < bars[1]


@pytest.mark.parametrize("kappa", [1.0, 1e18, 1e24, 1e30])
@pytest.mark.parametrize("name", ["tree", "grid"])
def test_sources_on_links_spread_over_trees_and_meshes(name: str, kappa: float) -> None:
    assert errors_of_run(model(name, "tdg3"), "tdg3", kappa, 0.02, name) < 1e-12


def joined(scene: eomgen.Scene) -> list[list[str]]:
    return joined_coordinates(eomgen.derive(scene))


def pair(ground: float = 0.0, **spring: Any) -> eomgen.Scene:
    """Return two bodies on one rail with a spring between points of them, the first on one to the ground."""
    builder = eomgen.SceneBuilder("pair", gravity=[0, 0, 0])
    for k in range(2):
        builder.body(f"m{k}", 1.0).point(f"p{k}", f"m{k}", [0.0, 0.0, 0.0])
        held = {} if k else {"stiffness": ground}
        builder.joint(f"x{k}", "prismatic", "base", f"m{k}", axis=[1, 0, 0], position=[float(k), 0.0, 0.0], **held)
    return builder.spring("s", "p0", "p1", **spring).build()


def test_what_is_joined_is_what_moves_along_together() -> None:
    assert joined(described("chain")) == [["x0", "x1", "x2", "x3"]]
    assert joined(described("two groups")) == [["x0", "x1"], ["x2", "x3"]]
    assert joined(pair(stiffness=1e20, length=1.0)) == [["x0", "x1"]]
    assert joined(pair(damping=1e20)) == [["x0", "x1"]]


def test_parallel_springs_are_one_link() -> None:
    builder = eomgen.SceneBuilder("parallel", gravity=[0, 0, 0])
    for k in range(2):
        builder.body(f"m{k}", 1.0).joint(f"x{k}", "prismatic", "base", f"m{k}", axis=[1, 0, 0])
    for number, size in enumerate((1e20, 3.0)):
        pull = f"{size!r} * (q.x1 - q.x0) + {number} * (v.x1 - v.x0)"
        builder.effort(f"a{number}", "x0", pull).effort(f"b{number}", "x1", f"-({pull})")
    assert with_row_sums(eomgen.derive(builder.build())).links == ((0, 1),)


def test_shafts_on_one_axis_are_joined() -> None:
    builder = eomgen.SceneBuilder("shaft", gravity=[0, 0, 0])
    for name in ("motor", "load"):
        builder.body(name, 1.0, inertia=[1.0, 1.0, 1.0])
        builder.joint(f"of_{name}", "revolute", "base", name, axis=[0, 0, 1])
    builder.torsion_spring("shaft", "of_motor", "of_load", stiffness=1e22, damping=1.0)
    assert joined(builder.build()) == [["of_motor", "of_load"]]


def test_other_springs_are_not() -> None:
    """Of negative stiffness, of none, between slides across each other, and where a slide carries the other."""
    assert joined(pair(stiffness=-3.0, length=1.0)) == []
    assert joined(pair(force="q.x0 - 2 * q.x1")) == []
    builder = eomgen.SceneBuilder("across", gravity=[0, 0, 0])
    for k, axis in enumerate(([1, 0, 0], [0, 1, 0])):
        builder.body(f"m{k}", 1.0).point(f"p{k}", f"m{k}", [0.0, 0.0, 1.0 * k])
        builder.joint(f"x{k}", "prismatic", "base", f"m{k}", axis=axis)
    assert joined(builder.spring("s", "p0", "p1", stiffness=2.0).build()) == []
    builder = eomgen.SceneBuilder("carried", gravity=[0, 0, 0]).body("m0", 1.0).body("m1", 1.0)
    builder.joint("x0", "prismatic", "base", "m0", axis=[1, 0, 0], stiffness=1.0)
    builder.joint("x1", "prismatic", "m0", "m1", axis=[1, 0, 0], stiffness=1e20)
    assert joined(builder.build()) == []
