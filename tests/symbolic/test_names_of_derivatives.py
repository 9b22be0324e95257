"""Names of intermediate values on the tape, and of their derivatives."""

from __future__ import annotations

from eomgen.symbolic.calculus.partials import forward_partials, jacobian_vector
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import ONE, Tape


def test_derivatives_of_a_named_value_have_the_number_of_the_direction() -> None:
    tape = Tape()
    x, y = Algebra(tape).block("q", 2)
    product = x * y * y
    tape.name((-product).ref, "energy")
    seeds = {InputSymbol("q", 0): {0: ONE}, InputSymbol("q", 1): {1: ONE}}
    (tangent,) = forward_partials(tape, [product.ref], seeds)
    assert tape.names[abs(product.ref)] == "minus_energy"
    names = {direction: tape.names[abs(ref)] for direction, ref in tangent.items() if tape.names.get(abs(ref))}
    signs = {direction: ref > 0 for direction, ref in tangent.items()}
    assert names == {
        0: "minus_energy_d0" if signs[0] else "energy_d0",
        1: "minus_energy_d1" if signs[1] else "energy_d1",
    }


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
