"""The groups on a tape give the numbers that they give in NumPy, and stay finite when differentiated at zero."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.lie import numeric
from eomgen.lie.groups import SE3, SO3, R3xSO3, real_space
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.tape import Tape
from tests.oracles import lie_on_tape as on_tape


@pytest.fixture(params=[real_space(2), SO3, SE3, R3xSO3], ids=lambda group: group.name)
def group(request):
    return request.param


def increments(group, rng):
    theta = rng.normal(size=(6, group.v_size))
    if group.quaternion:
        theta[:, :3] *= (np.array([0.0, 1e-7, 0.3, 1.5, 3.0, 4.0]) / np.linalg.norm(theta[:, :3], axis=1))[:, None]
    return theta


def inputs(tape, block, size):
    return [tape.input(block, k) for k in range(size)]


def test_functions_of_an_increment(group, rng):
    tape, theta = Tape(), increments(group, rng)
    x = inputs(tape, "v", group.v_size)
    for name in ("exp", "tangent", "tangent_inverse"):
        values = evaluate(tape, getattr(on_tape, name)(tape, group, x), {"v": theta})
        expected = getattr(numeric, name)(group, theta)
        assert values == pytest.approx(expected.reshape(len(theta), -1), abs=2e-15)
    values = evaluate(tape, on_tape.bracket_matrix(tape, group, x), {"v": theta})
    assert np.array_equal(values, numeric.bracket_matrix(group, theta).reshape(len(theta), -1))


def test_functions_of_elements(group, rng):
    tape = Tape()
    first, second = numeric.exp(group, increments(group, rng)), numeric.exp(group, increments(group, rng)[::-1])
    a, b = inputs(tape, "q", group.q_size), inputs(tape, "z", group.q_size)
    blocks = {"q": first, "z": second}
    product = numeric.compose(group, first, second)
    assert evaluate(tape, on_tape.compose(tape, group, a, b), blocks) == pytest.approx(product, abs=1e-15)
    assert evaluate(tape, on_tape.inverse(tape, group, a), blocks) == pytest.approx(
        numeric.inverse(group, first), abs=1e-15
    )
    assert evaluate(tape, on_tape.log(tape, group, a), blocks) == pytest.approx(numeric.log(group, first), abs=3e-15)
    adjoint = numeric.adjoint(group, first).reshape(len(first), -1)
    assert evaluate(tape, on_tape.adjoint(tape, group, a), blocks) == pytest.approx(adjoint, abs=1e-15)


@pytest.mark.parametrize("name", ["exp", "tangent", "tangent_inverse"])
def test_derivatives_on_the_tape_are_those_of_the_complex_step(group, name, rng):
    tape, theta = Tape(), increments(group, rng)[:5]
    x = inputs(tape, "v", group.v_size)
    outputs = getattr(on_tape, name)(tape, group, x)
    partials = forward_partials(tape, outputs, {ref: {k: tape.constant(1.0)} for k, ref in enumerate(x)})
    for k, direction in enumerate(np.eye(group.v_size)):
        column = evaluate(tape, [partial.get(k, tape.constant(0.0)) for partial in partials], {"v": theta})
        moved = getattr(numeric, name)(group, theta + 1e-30j * direction)
        slope = (np.imag(moved) / 1e-30).reshape(len(theta), -1)
        assert column == pytest.approx(slope, abs=2e-13)  # T^-1 has derivatives of order 100 at 4 rad


def test_real_coordinates_cost_an_addition():
    tape, group = Tape(), real_space(2)
    refs = on_tape.compose(tape, group, inputs(tape, "q", 2), on_tape.exp(tape, group, inputs(tape, "v", 2)))
    assert tape.counts(refs).statements == 2
