"""Virtual work and kinetic energy of a rigid body, derived with SymPy by integration over its mass.

Every acceleration field that a rigid body can have is affine in the position s in the body: A + U s. With shape
functions (1, s) the mass enters only through the shape integrals m = int dm, d = int s dm and S = int s s^T dm (Lieh
1994; the 4 x 4 pseudo-inertia). Mass matrix, coupling, gravity and base-motion terms all are this one kernel with other
fields (A, U).
"""

from __future__ import annotations

import sympy

from eomgen.symbolic.kernel import Kernel
from eomgen.symbolic.symbolic_kernel import kernel_of


def virtual_work() -> Kernel:
    """Derive inertia force and moment of a rigid body from its virtual work.

    The virtual work of the inertia forces is the integral of (A + U s) . (dx + dtheta x s) over the mass; its factors
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
    """Derive the virtual work of a rigid body's inertia forces per unit of each of its inertial parameters.

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
    """Derive 1/2 int |v + omega x s|^2 dm in the shape integrals m, d = int s dm, S = int s s^T dm."""
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
