"""Virtual work of an elastic body beyond a rigid one's, derived with SymPy by integration over the mass.

A material point at s (deformed) of a frame with the acceleration field A + U s and angular velocity w accelerates with
A + U s + 2 w x s' + s''; s' and s'' as the frame sees them. Virtual displacements are dx + dtheta x s + sum_k phi_k
deta_k. The part A + U s of force and moment is the rigid body's kernel with the deformed shape integrals; the rest is
here.
"""

from __future__ import annotations

import sympy

from eomgen.symbolic.kernel import Kernel
from eomgen.symbolic.symbolic_kernel import kernel_of

_S = sympy.Matrix(sympy.symbols("s0:3"))
_V = sympy.Matrix(sympy.symbols("v0:3"))
_R = sympy.Matrix(sympy.symbols("r0:3"))
_PHI = sympy.Matrix(sympy.symbols("f0:3"))
_W = sympy.Matrix(sympy.symbols("w0:3"))


def _integrated(integrand: sympy.Expr, fields: tuple[sympy.Matrix, ...]) -> sympy.Expr:
    """Replace monomials of the fields' components by integrals over the mass: ``f0 s1`` becomes the symbol ``f0s1``."""
    components = [component for field in fields for component in field]
    total = sympy.Integer(0)
    for powers, coefficient in sympy.Poly(sympy.expand(integrand), *components).terms():  # of three-vectors
        factors = [c.name for c, power in zip(components, powers, strict=True) for _ in range(power)]
        total += coefficient * sympy.Symbol("".join(factors))
    return total


def _with_coriolis_halved(integral: sympy.Expr) -> sympy.Expr:
    """Write 2 w x s' with one multiplication by two; a handful of products are expanded, so that they can be collected
    by w."""
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
            integral = _integrated(component, (_V, _R, _S))
            results.append(_with_coriolis_halved(integral))
    return kernel_of(results)


def elastic_row() -> Kernel:
    """Derive the virtual work of A + U s + 2 w x s' + s'' along one elastic coordinate.

    In integrals ``f0`` (int phi_0), ``f0s1``, ``f0v1``, ``f0r1``, and A0..A2, U00..U22, w0..w2.
    """
    A = sympy.Matrix(sympy.symbols("A0:3"))
    U = sympy.Matrix(3, 3, lambda i, j: sympy.Symbol(f"U{i}{j}"))
    work = _PHI.dot(A + U * _S + 2 * _W.cross(_V) + _R)
    integral = _integrated(work, (_PHI, _S, _V, _R))
    return kernel_of([_with_coriolis_halved(integral)])


def relative_energy() -> Kernel:
    """Derive the kinetic energy of relative motion: 1/2 int |u + w x s + s'|^2 - |u + w x s|^2 dm.

    In integrals ``v0``, ``v1s0``, ``v0v0``, the frame's velocity ``u0..u2`` and w.
    """
    u = sympy.Matrix(sympy.symbols("u0:3"))
    carried = u + _W.cross(_S)
    added = _V.dot(carried) + _V.dot(_V) / 2
    return kernel_of([_integrated(added, (_V, _S))])
