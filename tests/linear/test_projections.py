"""Constraints projected out of any partials, against the whole linear system with its multipliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.errors import ModelError
from eomgen.lie.product import Factor, bracket_matrix
from eomgen.products.linear.freedom import Freedom, Measures, Partials, freedom
from eomgen.products.linear.linearization import Linearization, LinearNames, Reference
from eomgen.products.linear.state_space import first_order

NV, NZ, NU, NW, NY = 7, 2, 3, 2, 4


def random_partials(rng: np.random.Generator, rows: int, holonomic: int) -> Partials:
    """Return partials in which every block has numbers of its own."""
    sizes = {"q": NV, "v": NV, "a": NV, "z": NZ, "lam": rows, "u": NU, "w": NW}
    root = rng.normal(size=(NV, NV))
    blocks = {name: rng.normal(size=(NV, NV)) for name in "CK"} | {"M": root @ root.T + np.eye(NV)}
    blocks |= {"B": rng.normal(size=(NV, NU)), "E": rng.normal(size=(NV, NW)), "Rz": rng.normal(size=(NV, NZ))}
    blocks |= {f"F{letter}": rng.normal(size=(NZ, sizes[letter])) for letter in "qvzuw"}
    blocks |= {f"Y{letter}": rng.normal(size=(NY, size)) for letter, size in sizes.items()}
    blocks |= {name: rng.normal(size=(rows, NV)) for name in ("J", "Z", "Aq", "Av")}
    blocks["Z"][:holonomic] *= 0.3
    return Partials.of(blocks, NU, NW, NY, holonomic)


def measures_of(rng: np.random.Generator, met: int, turning: bool = False) -> Measures:
    """Return velocities of joints between absolute bodies, of which ``met`` rows of constraints leave no more; or the
    components of v for none."""
    ball = (Factor("SO3", "ball", 0, 4, 0, 3), Factor("R", "rest", 4, 4, 3, 4))
    factors = ball if turning else (Factor("R", "all", 0, NV - met, 0, NV - met),)
    if not met:
        v, a = (rng.normal(size=NV) if turning else np.zeros(NV) for _ in range(2))
        return Measures.components(factors, v, a)
    P, Z, Av, Aq = (rng.normal(size=(NV - met, NV)) for _ in range(4))
    return Measures(factors, np.zeros(NV - met), np.zeros(NV - met), P, Z, Av, Aq)


#: Rows of constraints, of which so many are at position level, and so many are met by the measures.
CASES = [(0, 0, 0), (3, 3, 0), (3, 1, 0), (4, 3, 2), (5, 5, 3)]


@pytest.mark.parametrize(("rows", "holonomic", "met"), CASES)
def test_neighbouring_motions_meet_the_constraints_at_all_levels(
    rows: int, holonomic: int, met: int, rng: np.random.Generator
) -> None:
    p, measures = random_partials(rng, rows, holonomic), measures_of(rng, met)
    f = freedom(measures, p)
    assert (len(f.coordinates), len(f.velocities)) == (NV - holonomic, NV - rows)
    assert f.holonomic == (rows == holonomic) and set(f.velocities) <= set(f.coordinates)
    np.testing.assert_allclose(p.J[:holonomic] @ f.R, 0.0, atol=1e-10)
    for part in (p.J @ f.S, p.J @ f.T + p.Z @ f.R, p.J @ f.U + p.Av @ f.S, p.J @ f.V + p.Av @ f.T + p.Aq @ f.R):
        np.testing.assert_allclose(part, 0.0, atol=1e-9)
    x, y = list(f.coordinates), list(f.velocities)
    np.testing.assert_allclose((measures.P @ f.R)[x], np.eye(len(x)), atol=1e-10)
    np.testing.assert_allclose((measures.P @ f.S)[y], np.eye(len(y)), atol=1e-10)
    # y are the changes of the measured velocities, ydot the changes of their rates
    np.testing.assert_allclose((measures.P @ f.T + measures.Z @ f.R)[y], 0.0, atol=1e-9)
    np.testing.assert_allclose((measures.P @ f.U + measures.Av @ f.S)[y], 0.0, atol=1e-9)
    of_x = measures.P @ f.V + measures.Av @ f.T + measures.Aq @ f.R
    np.testing.assert_allclose(of_x[y], 0.0, atol=1e-8)
    # coordinates change with the measured velocities
    np.testing.assert_allclose(f.N, (measures.P @ f.S)[x], atol=1e-10)
    np.testing.assert_allclose(f.W, (measures.P @ f.T + measures.Z @ f.R)[x], atol=1e-9)
    assert f.unconstrained == (rows == 0)


@pytest.mark.parametrize(("rows", "holonomic", "met"), CASES)
def test_the_state_space_is_the_whole_system_with_its_multipliers(
    rows: int, holonomic: int, met: int, rng: np.random.Generator
) -> None:
    """For any x, y, z, u and w: M da + C dv + K dq + Rz dz + J^T dlam = B du + E dw, J da + Av dv + Aq dq = 0."""
    p = random_partials(rng, rows, holonomic)
    measures = measures_of(rng, met)
    f = freedom(measures, p)
    form = first_order(p, f, ["y"] * (NV - rows))
    x, y, z, u, w = (rng.normal(size=n) for n in (NV - holonomic, NV - rows, NZ, NU, NW))
    dq, dv = f.R @ x, f.S @ y + f.T @ x
    whole = np.block([[p.M, p.J.T], [p.J, np.zeros((rows, rows))]])
    right = np.concatenate([p.B @ u + p.E @ w - p.C @ dv - p.K @ dq - p.Rz @ z, -p.Av @ dv - p.Aq @ dq])
    da, lam = np.split(np.linalg.solve(whole, right), [NV])
    rate_of_measures = measures.P @ da + measures.Av @ dv + measures.Aq @ dq
    xdot = (measures.P @ dv + measures.Z @ dq)[list(f.coordinates)]
    zdot = p.Fq @ dq + p.Fv @ dv + p.Fz @ z + p.Fu @ u + p.Fw @ w
    s = np.concatenate([x, y, z])
    expected = np.concatenate([xdot, rate_of_measures[list(f.velocities)], zdot])
    np.testing.assert_allclose(form.A @ s + form.B @ u + form.E @ w, expected, rtol=1e-8, atol=1e-8)
    out = p.Yq @ dq + p.Yv @ dv + p.Ya @ da + p.Yz @ z + p.Ylam @ lam + p.Yu @ u + p.Yw @ w
    np.testing.assert_allclose(form.C @ s + form.D @ u + form.F @ w, out, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(form.R_all @ s, dq, atol=1e-10)


def linear_of(p: Partials, f: Freedom) -> Linearization:
    names = tuple(f"c{k}" for k in range(NV))
    signals = [tuple(f"{letter}{k}" for k in range(n)) for letter, n in (("z", NZ), ("u", NU), ("w", NW), ("y", NY))]
    none = np.zeros(0)
    reference = Reference(0.0, none, none, none, none, none, none, "motion")
    return Linearization(reference, p, f, LinearNames(names, names, *signals))


@pytest.mark.parametrize("rows", [0, 3])
@pytest.mark.parametrize("turning", [False, True])
def test_the_second_order_is_the_first_order_in_other_variables(
    rows: int, turning: bool, rng: np.random.Generator
) -> None:
    """With x' = y + W x and the rate of W; components of a turning body change with its angular velocity."""
    p, measures = random_partials(rng, rows, rows), measures_of(rng, 0, turning)
    f = freedom(measures, p)
    if turning and not rows:
        np.testing.assert_allclose(f.W, -bracket_matrix(measures.factors, measures.v), atol=1e-14)
        np.testing.assert_allclose(f.W_rate, -bracket_matrix(measures.factors, measures.a), atol=1e-14)
    lin, n = linear_of(p, f), NV - rows
    A = lin.state_space().A[: 2 * n, : 2 * n]
    back = np.block([[np.eye(n), np.zeros((n, n))], [f.W, np.eye(n)]])
    change = np.block([[np.zeros((n, 2 * n))], [f.W_rate, np.zeros((n, n))]])
    found = np.vstack([np.eye(n, 2 * n, n), -np.linalg.solve(lin.M0, np.hstack([lin.K0, lin.C0]))])
    np.testing.assert_allclose(found, (back @ A + change) @ np.linalg.inv(back), atol=1e-8)
    for name, forces in (("B0", p.B), ("E0", p.E), ("Z0", p.Rz)):
        np.testing.assert_allclose(getattr(lin, name), f.S.T @ forces, atol=1e-12)
    with pytest.raises(ModelError, match="constraints leave 4 velocities and 6 coordinates free, so there is no model"):
        linear_of(replace(p := random_partials(rng, 3, 1)), freedom(measures, p)).M0  # noqa: B018


def test_wanted_coordinates_are_independent_as_far_as_rows_allow(rng: np.random.Generator) -> None:
    p, measures = random_partials(rng, 3, 3), measures_of(rng, 0)
    for wanted in ([0, 1, 2, 3], [3, 4, 5, 6], [0, 2, 4, 6]):
        assert list(freedom(measures, p, wanted).coordinates) == wanted
    # a heavy component stays independent, so that metres and radians compare by kinetic energy
    heavy = replace(p, M=np.diag([1e8, 1.0, 1.0, 1.0, 1.0, 1.0, 1e8]))
    assert {0, 6} <= set(freedom(measures, heavy).coordinates)
    J = np.vstack([p.J[:2], p.J[0] + 2.0 * p.J[1]])
    for rows in (J, np.vstack([p.J] * 3)):
        alike = {name: np.zeros_like(rows) for name in ("Z", "Aq", "Av")}
        with pytest.raises(ModelError, match="constraints depend on each other in this state"):
            freedom(measures, replace(p, J=rows, holonomic=len(rows), **alike))
