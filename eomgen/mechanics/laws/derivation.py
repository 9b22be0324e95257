"""The laws of bodies, beams and contacts, derived with SymPy, and the module of derived laws: ``python -m
eomgen.mechanics.laws.derivation eomgen/mechanics/laws/derived.py``.

Every acceleration field that a rigid body can have is affine in the position s in the body: A + U s. With shape
functions (1, s) the mass enters only through the shape integrals m = int dm, d = int s dm and S = int s s^T dm (Lieh
1994; the 4 x 4 pseudo-inertia). Mass matrix, coupling, gravity and base-motion terms all are this one kernel with other
fields (A, U).

A material point at s (deformed) of a frame with the acceleration field A + U s and angular velocity w accelerates with
A + U s + 2 w x s' + s''; s' and s'' as the frame sees them. Virtual displacements are dx + dtheta x s + sum_k phi_k
deta_k. The part A + U s of force and moment is the rigid body's kernel with the deformed shape integrals; the rest is
here.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import sympy

from eomgen.symbolic.kernel import Kernel
from eomgen.symbolic.symbolic_kernel import kernel_of, module_of


def rotation() -> Kernel:
    """Derive the rotation matrix of a unit quaternion (w, x, y, z), from x' = p x p*.

    The diagonal is written 1 - 2(..), which is orthogonal to first order in the quaternion's length error.
    """
    w, x, y, z = sympy.symbols("w x y z", real=True)
    p = sympy.Quaternion(w, x, y, z)
    columns = []
    for unit in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        turned = p * sympy.Quaternion(0, *unit) * p.conjugate()
        columns.append([sympy.expand(part) for part in (turned.b, turned.c, turned.d)])  # nine products of two symbols
    results = []
    for row in range(3):
        for column in range(3):
            entry = columns[column][row]
            if row == column:
                entry = sympy.expand(entry - (w**2 + x**2 + y**2 + z**2)) + 1  # |p| = 1; a sum of four squares
            results.append(_factor_two(entry))
    return kernel_of(results)


def _factor_two(entry: sympy.Expr) -> sympy.Expr:
    """Write a quadratic entry as [1 +] 2 (..), one multiplication by two instead of one per term."""
    constant = entry.subs(dict.fromkeys(entry.free_symbols, 0))
    half = sympy.Add(*((term / 2) for term in sympy.Add.make_args(entry - constant)))
    return constant + sympy.Mul(2, half, evaluate=False)


def virtual_work() -> Kernel:
    """Derive inertia force and moment of a rigid body from the virtual work.

    The virtual work of the inertia forces is the integral of (A + U s) . (dx + dtheta x s) over the mass; the factors
    of dtheta and dx are the moment about the origin and the force. Symbols: A0..A2, U00..U22, m, d0..d2, S00..S22
    (upper triangle).

    Returns
    -------
    Kernel with results N0, N1, N2, F0, F1, F2.
    """
    s = sympy.Matrix(sympy.symbols("s0:3"))
    A = sympy.Matrix(sympy.symbols("A0:3"))
    U = sympy.Matrix(3, 3, lambda i, j: sympy.Symbol(f"U{i}{j}"))
    dx, dtheta = sympy.Matrix(sympy.symbols("dx0:3")), sympy.Matrix(sympy.symbols("dtheta0:3"))
    field = A + U * s
    work = sympy.Poly((field.T * (dx + dtheta.cross(s)))[0], *s, *dtheta, *dx)
    collected: dict[sympy.Symbol, dict[sympy.Symbol, sympy.Expr]] = {symbol: {} for symbol in (*dtheta, *dx)}
    for powers, coefficient in work.terms():
        shape, variation = _integral(powers[:3]), (*dtheta, *dx)[powers[3:].index(1)]
        integrals = collected[variation]
        integrals[shape] = integrals.get(shape, sympy.Integer(0)) + coefficient
    results = []
    for integrals in collected.values():
        shapes = sorted(integrals, key=lambda symbol: symbol.name, reverse=True)
        results.append(sympy.Add(*(shape * integrals[shape] for shape in shapes)))
    return kernel_of(results)


def regressor() -> Kernel:
    """Derive the virtual work of a rigid body's inertia forces per unit of each inertial parameter.

    The acceleration field is A + (r~ + C) s with a symmetric C, the variation l + w x s. The parameters are m, d and
    the inertia tensor I = tr(S) 1 - S, which is S = tr(I) / 2 1 - I. Symbols: A0..A2, r0..r2, C00..C22 (upper
    triangle), w0..w2, l0..l2.

    Returns
    -------
    Kernel with results for m, d0, d1, d2, I00, I11, I22, I01, I02, I12.
    """
    s, A, r, w, along = (sympy.Matrix(sympy.symbols(f"{name}0:3")) for name in "sArwl")
    C = sympy.Matrix(3, 3, lambda i, j: sympy.Symbol(f"C{min(i, j)}{max(i, j)}"))
    work = sympy.Poly(((A + r.cross(s) + C * s).T * (along + w.cross(s)))[0], *s)
    entries = [sympy.Symbol(f"I{i}{j}") for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    tensor = dict(zip(("00", "11", "22", "01", "02", "12"), entries, strict=True))
    half = (entries[0] + entries[1] + entries[2]) / 2
    second = {sympy.Symbol(f"S{of}"): (half if of[0] == of[1] else 0) - entry for of, entry in tensor.items()}
    total = sympy.expand(sum(_integral(powers) * factor for powers, factor in work.terms()).subs(second))
    linear = [sympy.Symbol("m"), *sympy.symbols("d0:3"), *entries]
    return kernel_of([sympy.collect(total.coeff(symbol), [*along, *w]) for symbol in linear])


def kinetic_energy() -> Kernel:
    """Derive the kinetic energy 1/2 int |v + omega x s|^2 dm of a rigid body, with symbols v0..v2, w0..w2 and the shape
    integrals m, d = int s dm, S = int s s^T dm. Returns a Kernel with one result."""
    s = sympy.Matrix(sympy.symbols("s0:3"))
    v, omega = sympy.Matrix(sympy.symbols("v0:3")), sympy.Matrix(sympy.symbols("w0:3"))
    speed = v + omega.cross(s)
    square = sympy.Poly((speed.T * speed)[0] / 2, *s)
    total = sympy.Integer(0)
    for powers, coefficient in square.terms():
        total += _integral(powers) * coefficient
    return kernel_of([total])


def _integral(powers: tuple[int, ...]) -> sympy.Symbol:
    """Return the shape integral of the monomial s0^powers[0] s1^powers[1] s2^powers[2]."""
    factors = [axis for axis, power in enumerate(powers) for _ in range(power)]
    return sympy.Symbol({0: "m", 1: "d{}", 2: "S{}{}"}[len(factors)].format(*factors))


_S = sympy.Matrix(sympy.symbols("s0:3"))
_V = sympy.Matrix(sympy.symbols("v0:3"))
_R = sympy.Matrix(sympy.symbols("r0:3"))
_PHI = sympy.Matrix(sympy.symbols("f0:3"))
_W = sympy.Matrix(sympy.symbols("w0:3"))


def _integrate_over_mass(integrand: sympy.Expr, fields: tuple[sympy.Matrix, ...]) -> sympy.Expr:
    """Return an integrand with monomials of the fields' components replaced by integrals over the mass: ``f0 s1``
    becomes the symbol ``f0s1``."""
    components = [component for field in fields for component in field]
    total = sympy.Integer(0)
    for powers, coefficient in sympy.Poly(sympy.expand(integrand), *components).terms():  # of three-vectors
        factors = [c.name for c, power in zip(components, powers, strict=True) for _ in range(power)]
        total += coefficient * sympy.Symbol("".join(factors))
    return total


def _with_coriolis_halved(integral: sympy.Expr) -> sympy.Expr:
    """Write the terms in w of an integral as 2 (..), one multiplication by two, collected by the components of w."""
    rest = integral.subs(dict.fromkeys(_W, 0))
    coriolis = sympy.collect(sympy.expand((integral - rest) / 2), list(_W))
    return sympy.Add(sympy.Mul(2, coriolis, evaluate=False), rest, evaluate=False)


def relative_motion() -> Kernel:
    """Derive moment and force of 2 w x s' + s'' in integrals ``v0``, ``r0``, ``v1s0`` (int s'_1 s_0), ``r1s0`` and w.

    Returns
    -------
    Kernel with results N0, N1, N2, F0, F1, F2.
    """
    acceleration = 2 * _W.cross(_V) + _R
    results = []
    for vector in (_S.cross(acceleration), acceleration):
        for component in vector:
            integral = _integrate_over_mass(component, (_V, _R, _S))
            results.append(_with_coriolis_halved(integral))
    return kernel_of(results)


def elastic_row() -> Kernel:
    """Derive the virtual work of A + U s + 2 w x s' + s'' along one elastic coordinate.

    A and U are the frame's acceleration and the matrix of angular terms, w the angular velocity, s the elastic
    displacement. The kernel has arguments ``f0`` (int phi_0), ``f0s1``, ``f0v1``, ``f0r1``, A0..A2, U00..U22, w0..w2.
    """
    A = sympy.Matrix(sympy.symbols("A0:3"))
    U = sympy.Matrix(3, 3, lambda i, j: sympy.Symbol(f"U{i}{j}"))
    work = _PHI.dot(A + U * _S + 2 * _W.cross(_V) + _R)
    integral = _integrate_over_mass(work, (_PHI, _S, _V, _R))
    return kernel_of([_with_coriolis_halved(integral)])


def relative_energy() -> Kernel:
    """Derive the kinetic energy of relative motion: 1/2 int |u + w x s + s'|^2 - |u + w x s|^2 dm.

    In integrals ``v0``, ``v1s0``, ``v0v0``, the frame's velocity ``u0..u2`` and w.
    """
    u = sympy.Matrix(sympy.symbols("u0:3"))
    carried = u + _W.cross(_S)
    added = _V.dot(carried) + _V.dot(_V) / 2
    return kernel_of([_integrate_over_mass(added, (_V, _S))])


def onset() -> Kernel:
    """Derive the smooth onset s(u), u = d / w in [0, 1], and the potential of the spring force k d s(d / w) by k w^2.
    Returns a Kernel of u with these two results."""
    u, x = sympy.symbols("u x")
    a, b, c, d = sympy.symbols("a b c d")
    cubic = a + b * u + c * u**2 + d * u**3
    ends = [cubic.subs(u, 0), cubic.diff(u).subs(u, 0), cubic.subs(u, 1) - 1, cubic.diff(u).subs(u, 1)]
    rise = sympy.factor(cubic.subs(sympy.solve(ends, (a, b, c, d))))
    potential = sympy.factor(sympy.integrate(x * rise.subs(u, x), (x, 0, u)))
    return kernel_of([rise, potential])


COMMAND = "python -m eomgen.mechanics.laws.derivation eomgen/mechanics/laws/derived.py"
DERIVATIONS: Mapping[str, Callable[[], Kernel]] = {
    "rotation_of_quaternion": rotation,
    "virtual_work_of_rigid_body": virtual_work,
    "regressor_of_rigid_body": regressor,
    "kinetic_energy_of_rigid_body": kinetic_energy,
    "virtual_work_of_relative_motion": relative_motion,
    "virtual_work_along_elastic_coordinate": elastic_row,
    "kinetic_energy_of_relative_motion": relative_energy,
    "onset_of_contact": onset,
}
_ABOUT = f"""Laws derived by SymPy, so that no build imports it: written by
``{COMMAND}``."""


def module() -> str:
    """Return the text of the module of all laws."""
    return module_of(_ABOUT, "LAWS", {name: derive() for name, derive in DERIVATIONS.items()})


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(module(), encoding="utf-8")
