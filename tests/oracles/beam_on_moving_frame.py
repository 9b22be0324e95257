"""A beam on a frame that moves in all six components: Lagrange's equations with the shortening, by SymPy, linear in
deflections.

The frame of the beam (x along it) has velocity v(t) and angular velocity omega(t), both in its own axes. A point is at

    (x - (1/2) int_0^x (y'^2 + z'^2),  phi eta,  chi zeta)

with one shape phi in y and one shape chi in z; the tip carries a point mass and an axial force that turns with the
frame. Lagrange's equations of eta and zeta are what a generator must produce, whatever way it goes. `by_stiffening` is
the same from the formula with geometric stiffness (dossier 1.5, equations 10 and 11).
"""

from __future__ import annotations

import sympy as sp

x, t = sp.symbols("x t", real=True)
LENGTH, MASS, TIP, EI_Y, EI_Z = sp.symbols("L rhoA m_t EI_y EI_z", positive=True)
AXIAL = sp.Symbol("F_x", real=True)
GRAVITY = sp.Matrix(sp.symbols("g_x g_y g_z", real=True))  # in beam axes; no equation takes its rate
V = sp.Matrix([sp.Function(f"v_{axis}")(t) for axis in "xyz"])
OMEGA = sp.Matrix([sp.Function(f"omega_{axis}")(t) for axis in "xyz"])
ETA, ZETA = sp.Function("eta")(t), sp.Function("zeta")(t)

#: Deflection of a clamped beam under a load at its tip and under an even load: polynomials, one at the tip.
PHI = x**2 * (3 * LENGTH - x) / (2 * LENGTH**3)
CHI = x**2 * (6 * LENGTH**2 - 4 * LENGTH * x + x**2) / (3 * LENGTH**4)


def _over_beam(density: sp.Expr) -> sp.Expr:
    """Integrate over the mass of beam and tip."""
    expanded = sp.expand(density)
    return MASS * sp.integrate(expanded, (x, 0, LENGTH)) + TIP * expanded.subs(x, LENGTH)


def _over_length(density: sp.Expr) -> sp.Expr:
    return sp.integrate(sp.expand(density), (x, 0, LENGTH))


def by_lagrange(phi: sp.Expr = PHI, chi: sp.Expr = CHI) -> sp.Matrix:
    """Return the left sides [eta, zeta] of equations with right side zero."""
    xi = sp.Dummy("xi")
    slopes = (sp.diff(phi, x) ** 2 * ETA**2 + sp.diff(chi, x) ** 2 * ZETA**2) / 2
    shortening = sp.integrate(sp.expand(slopes).subs(x, xi), (xi, 0, x))
    at_rest, first, second = sp.Matrix([x, 0, 0]), sp.Matrix([0, phi * ETA, chi * ZETA]), sp.Matrix([-shortening, 0, 0])
    # of order zero; orders one and two follow, the rest cannot matter to linear equations
    velocity = V + OMEGA.cross(at_rest)
    velocity_1 = OMEGA.cross(first) + first.diff(t)
    velocity_2 = OMEGA.cross(second) + second.diff(t)
    kinetic = velocity.dot(velocity_1) + velocity_1.dot(velocity_1) / 2 + velocity.dot(velocity_2)
    bending = EI_Y * (sp.diff(phi, x, 2) * ETA) ** 2 + EI_Z * (sp.diff(chi, x, 2) * ZETA) ** 2
    force = AXIAL * second[0].subs(x, LENGTH)
    total = _over_beam(kinetic + GRAVITY.dot(first + second)) - _over_length(bending) / 2 + force
    return sp.Matrix([sp.expand(sp.diff(total, sp.diff(q, t), t) - sp.diff(total, q)) for q in (ETA, ZETA)])


def by_stiffening(phi: sp.Expr = PHI, chi: sp.Expr = CHI, *, axial_acceleration: bool = True) -> sp.Matrix:
    """Return the same from K + K_geo; without `axial_acceleration` a term of K_geo is missing, for tests of tests."""
    a = V.diff(t) + OMEGA.cross(V) - GRAVITY
    alpha, s, u = OMEGA.diff(t), sp.Matrix([x, 0, 0]), sp.Matrix([0, phi * ETA, chi * ZETA])
    field = a + alpha.cross(s + u) + OMEGA.cross(OMEGA.cross(s + u)) + 2 * OMEGA.cross(u.diff(t)) + u.diff(t, 2)
    turning, pull = OMEGA[1] ** 2 + OMEGA[2] ** 2, a[0] if axial_acceleration else 0
    rows = []
    for row, (shape, q, stiffness) in enumerate(((phi, ETA, EI_Y), (chi, ZETA, EI_Z)), 1):
        slope = sp.diff(shape, x) ** 2
        geometric = MASS * _over_length((turning * (LENGTH**2 - x**2) / 2 - pull * (LENGTH - x)) * slope)
        geometric += (TIP * (turning * LENGTH - pull) + AXIAL) * _over_length(slope)
        bending = stiffness * _over_length(sp.diff(shape, x, 2) ** 2)
        rows.append(sp.expand(_over_beam(shape * field[row]) + (bending + geometric) * q))
    return sp.Matrix(rows)
