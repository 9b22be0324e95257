"""Mistakes in Python with Hamiltonian models and motions: each has one message, and none is a traceback."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.hamiltonian.test_hamiltonian import HENON_HEILES, model


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda m: m.simulate([0, 10]), r"t_end: a finite number is needed, not \[0, 10\]"),
        (lambda m: m.simulate(1.0, method=3), "method: a method is called by its name, not 3"),
        (lambda m: m.simulate(1.0, method="rk45", tolerance="x"), "tolerance: a finite number is needed, not 'x'"),
        (
            lambda m: m.simulate(1.0, initial=[1, 2]),
            r'initial: numbers by name are needed, .*; try: initial={"x": 0\.1}',
        ),
        (lambda m: m.simulate(1.0, initial={"q": [[1], [1, 2]]}), "initial.q: .* is not an array of numbers"),
        (lambda m: m.simulate(1.0, parameters=3), "parameters: numbers by name are needed, not 3"),
        (lambda m: m.simulate(1.0, rtol=1e-6), "there is no argument 'rtol'; try: tolerance"),
        (lambda m: m.energy("a", "b"), "henon_heiles.hamiltonian: 'a' is not an array of numbers"),
        (lambda m: m.run(), r"a HamiltonianModel has no 'run'; try: simulate\(t_end"),
        (lambda m: m.grad, r"try: gradient\(q, p\), which gives dH/dq and dH/dp"),
        (lambda m: m.simulate(1.0).plot(), "a HamiltonianSolution has no 'plot'; try: columns"),
        (lambda m: m.simulate(1.0).outputs["momentum"], "there is no output 'momentum'; try: angular_momentum"),
        (lambda m: m.simulate(1.0).energy["H"], "there is no part of H 'H'"),
        (lambda m: [*m.simulate(1.0)], "is one object, and not several to be unpacked; try: run = model"),
        (lambda m: eomgen.build(HENON_HEILES, method="rk9"), "there is no method 'rk9' of Hamiltonian systems"),
    ],
)
def test_mistakes_in_python_have_one_clear_message(call: Callable[[Any], object], text: str) -> None:
    with pytest.raises(eomgen.UsageError, match=text):
        call(model("henon_heiles"))


def test_what_is_meant_is_taken() -> None:
    compiled = model("henon_heiles")
    run = compiled.simulate(np.float64(1.0), np.float64(0.1), record_every=np.int64(5))  # type: ignore[arg-type]
    assert len(run.t) == 3
    again = pickle.loads(pickle.dumps(run))
    np.testing.assert_array_equal(again.q, run.q)
    assert set(again.energy) == {"kinetic", "potential", "total"} and again.error_estimate.available
    assert not hasattr(run, "_repr_html_")
