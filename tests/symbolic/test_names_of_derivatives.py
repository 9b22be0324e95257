"""Names of intermediate values on the tape, and of their derivatives."""

from __future__ import annotations

from eomgen.symbolic.calculus.partials import forward_partials, jacobian_vector
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import ONE, Tape


def test_a_value_of_the_motion_keeps_its_name_as_a_derivative() -> None:
    tape = Tape()
    (x,) = Algebra(tape).block("q", 1)
    double, square = x + x, x * x
    tape.name(square.ref, "square")
    (tangent,) = forward_partials(tape, [square.ref], {InputSymbol("q", 0): {0: ONE}})
    assert abs(double.ref) in map(abs, tangent.values())
    assert tape.names == {square.ref: "square"}


def test_derivatives_along_one_direction_have_no_names() -> None:
    tape = Tape()
    (x,) = Algebra(tape).block("q", 1)
    cube = x * x * x
    tape.name(cube.ref, "cube")
    jacobian_vector(tape, [cube.ref], {InputSymbol("q", 0): ONE})
    assert tape.names == {abs(cube.ref): "cube" if cube.ref > 0 else "minus_cube"}
