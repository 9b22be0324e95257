"""Symbols of SymPy carry the scene's names, and never the same one for two things."""

from __future__ import annotations

import sympy

import eomgen
from eomgen.symbolic.operations import InputSymbol


def named(system: eomgen.System, term: str) -> set[str]:
    matrix = sympy.Matrix(system.sympy(term, named=False))
    return {symbol.name for symbol in matrix.free_symbols}


def test_names_that_would_collide_give_way_to_places() -> None:
    builder = eomgen.SceneBuilder("clash").parameter("q_slide", 2.0, tunable=True).parameter("u0", 3.0, tunable=True)
    builder.input("push").input("w_0").body("slug", "q_slide + u0")
    builder.joint("slide", "prismatic", "base", "slug", axis=[1, 0, 0])
    builder.effort("drive", "slide", "push * w_0 - q_slide * q.slide")
    system = eomgen.derive(builder.build(), terms=["mass", "force"])
    assert system.symbol_names == {
        InputSymbol("u", 0): "push",
        InputSymbol("v", 0): "v_slide",
        InputSymbol("a", 0): "a_slide",
    }
    p_0, p_1, q0, u1, push = (sympy.Symbol(name, real=True) for name in ("p_0", "p_1", "q0", "u1", "push"))
    assert sympy.Matrix(system.sympy("mass"))[0] == p_0 + p_1
    assert sympy.Matrix(system.sympy("force"))[0] == push * u1 - p_0 * q0
