"""Laws as SymPy derives them, and as they are stored."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sympy

import eomgen
from eomgen.mechanics.laws.derivation import COMMAND, DERIVATIONS, module
from eomgen.mechanics.laws.derived import LAWS
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.symbolic_kernel import kernel_of
from eomgen.symbolic.tape import Tape
from tests.models.scenes import PENDULUM_TOML


def test_the_stored_laws_are_what_sympy_derives() -> None:
    path = Path(eomgen.__file__).parent / "mechanics" / "laws" / "derived.py"
    assert path.read_text(encoding="utf-8") == module(), COMMAND
    assert list(LAWS) == list(DERIVATIONS)


def test_a_kernel_gives_the_numbers_of_its_expressions() -> None:
    x, y = sympy.symbols("x y")
    expressions = [
        sympy.sqrt(x) + y**3 / 7 - 2 * x * y * sympy.sin(x),
        sympy.atan2(y, x) * sympy.pi,
        sympy.Abs(-x - y) + sympy.exp(sympy.sign(y)),
    ]
    kernel, tape = kernel_of(expressions), Tape()
    algebra = Algebra(tape)
    values = {"x": Scalar(tape, tape.input("q", 0)), "y": Scalar(tape, tape.input("q", 1))}
    refs = [scalar.ref for scalar in kernel.instantiate(algebra, values)]
    found = evaluate(tape, refs, {"q": np.array([0.7, 1.3])})
    exact = [float(expression.evalf(30, subs={x: 0.7, y: 1.3})) for expression in expressions]
    np.testing.assert_allclose(np.array(found, dtype=np.float64), exact, rtol=1e-15, atol=1e-15)


def test_a_kernel_refuses_what_a_tape_cannot_hold() -> None:
    with pytest.raises(TypeError, match=r"^a kernel cannot hold gamma$"):
        kernel_of([sympy.gamma(sympy.Symbol("x"))])


_DERIVED = """
import sys
import eomgen
functions = list(eomgen.derive({path!r}).functions)
print(functions[:2], [name for name in ("sympy", "mpmath", "scipy") if name in sys.modules])
"""


@pytest.mark.slow
def test_equations_are_derived_without_sympy_and_scipy(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    command = [sys.executable, "-c", _DERIVED.format(path=str(path))]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "['mass', 'coupling'] []"
