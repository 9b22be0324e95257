"""One shape in each plane on a frame that moves in all six components: the difference to Lagrange's equations is
exactly zero.

Length and mass are chosen so that all integrals are whole numbers, so nothing is rounded on the way.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp

from eomgen.mechanics.derive import derive
from eomgen.mechanics.shape_functions import integrals as of_shapes
from eomgen.mechanics.shape_functions.shape_integrals import ShapeIntegrals, Station
from eomgen.scene.bodies.model import Base, Beam, Body, Deformation
from eomgen.scene.joints.model import Joint
from eomgen.scene.rotations import Rotation
from eomgen.scene.scene import Scene
from tests.oracles.beam_on_moving_frame import (
    AXIAL,
    CHI,
    EI_Y,
    EI_Z,
    ETA,
    GRAVITY,
    LENGTH,
    MASS,
    OMEGA,
    PHI,
    TIP,
    ZETA,
    V,
    by_lagrange,
    t,
    x,
)
from tests.oracles.formulas import TIME, number, vector

SPAN = 2
SHAPES = tuple(shape.subs(LENGTH, SPAN) for shape in (PHI, CHI))


def over_length(density: sp.Expr) -> sp.Rational:
    return sp.integrate(sp.expand(density), (x, 0, SPAN))


def exact_integrals() -> tuple[dict[str, list[sp.Rational]], int]:
    """Return integrals of both shapes for a unit of mass per length and of stiffness, and what makes all of them
    whole."""
    xi = sp.Dummy("xi")
    shortening = [sp.integrate(sp.expand(sp.diff(f, x) ** 2).subs(x, xi), (xi, 0, x)) for f in SHAPES]
    found = {
        "d": [over_length(f) for f in SHAPES],
        "e": [over_length(x * f) for f in SHAPES],
        "m": [over_length(f * g) for f in SHAPES for g in SHAPES],
        "g0": [over_length(H) for H in shortening],
        "g1": [over_length(x * H) for H in shortening],
        "k": [over_length(sp.diff(f, x, 2) ** 2) for f in SHAPES],
    }
    return found, math.lcm(*(int(value.q) for values in found.values() for value in values))


def generated(monkeypatch: pytest.MonkeyPatch) -> tuple[sp.Matrix, int]:
    """Return the rows of inverse dynamics of a clamped beam on a moving base, and its mass per length."""
    found, whole = exact_integrals()
    scaled = {name: [float(value * whole) for value in values] for name, values in found.items()}
    square = {name: np.diag(scaled[name]) for name in ("g0", "g1", "k")} | {"m": np.reshape(scaled["m"], (2, 2))}
    nothing = np.zeros(2)
    integrals = ShapeIntegrals(
        ("bending_y", "bending_z"),
        lambda _: Station(nothing, nothing, np.zeros((2, 2))),
        lambda _: (),
        0.0,
        0.0,
        0.0,
        np.array(scaled["d"]),
        np.array(scaled["e"]),
        square["m"],
        square["g0"],
        square["g1"],
        np.zeros(0),
        np.zeros(0),
        nothing,
        np.zeros((2, 2)),
        square["k"],
        nothing,
    )
    monkeypatch.setattr(of_shapes, "shape_integrals", lambda _: integrals)
    deformations = tuple(Deformation(kind, "polynomial", 1, number(1.0)) for kind in ("bending_y", "bending_z"))
    beam = Body("beam", number(1.0), vector((0, 0, 0)), (number(0.0),) * 6, Beam(0.0, 2.0, number(1.0), deformations))
    # Components that are zero at all times are left out of the equations: here none is.
    base = Base(
        (TIME, TIME, TIME), tuple(Rotation(axis, TIME) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    )
    scene = Scene("beam", (beam,), (Joint("root", "fixed", "base", "beam"),), vector((0, 0, 0)), base=base)
    rows = derive(scene, ["inverse_dynamics"]).sympy("inverse_dynamics", named=False)
    assert isinstance(rows, sp.MatrixBase)
    return rows, whole


@pytest.mark.slow
def test_difference_to_lagrange_is_exactly_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    rows, whole = generated(monkeypatch)
    symbols = {symbol.name: symbol for symbol in rows.free_symbols}
    components = {f"base_{7 + k}": OMEGA[k] for k in range(3)} | {f"base_{10 + k}": V[k] for k in range(3)}
    components |= {f"base_{13 + k}": OMEGA[k].diff(t) for k in range(3)} | {
        f"base_{16 + k}": V[k].diff(t) for k in range(3)
    }
    for k, coordinate in enumerate((ETA, ZETA)):
        components |= {
            f"{letter}_beam_{k}": coordinate.diff(t, n) if n else coordinate for n, letter in enumerate("qva")
        }
    ours = rows.subs({symbols[name]: value for name, value in components.items() if name in symbols}).applyfunc(
        sp.nsimplify
    )
    data = {LENGTH: SPAN, MASS: whole, TIP: 0, AXIAL: 0, EI_Y: whole, EI_Z: whole, **dict.fromkeys(GRAVITY, 0)}
    lagrange = by_lagrange().subs(data)
    assert (ours - lagrange).expand() == sp.zeros(2, 1)
    assert all(row.has(OMEGA[0], OMEGA[1], OMEGA[2], ETA, ZETA) for row in ours)
