"""Examples of SymPy's documentation and of PyDy, and the benchmark bicycle of SymPy's own tests."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sympy.physics import mechanics as me
from sympy.physics.mechanics.tests import test_kane3

import eomgen
from tests.sympy_mechanics.corpus import LEFT_OUT, Row, ran

#: All examples with a result, as ``python -m tests.sympy_mechanics.corpus`` printed these, with the versions.
RECORDED = json.loads((Path(__file__).parent / "corpus.json").read_text(encoding="utf-8"))
TESTS = "sympy.physics.mechanics.tests."


def recorded() -> list[Row]:
    """Return the rows of the record."""
    return [Row(**row) for row in RECORDED["rows"]]


def test_all_examples_are_equal() -> None:
    """To 1e-12; calls in which examples contradict themselves are left out, each with the contradiction."""
    rows = recorded()
    assert len(rows) == 104
    assert {row.result for row in rows} == {"equal"}
    for row in rows:
        assert row.error is not None
        assert row.error < 1e-12, row
    assert RECORDED["left out"].keys() == LEFT_OUT.keys()
    assert sum(row.example.startswith("symbrim/") for row in rows) == 6
    assert any(row.example.endswith("carvallo-whipple.rst") for row in rows)


@pytest.mark.slow
@pytest.mark.parametrize("module", ["test_lagrange2", "test_kane4", "test_kane2", "test_models", "test_lagrange"])
@pytest.mark.long_except("test_lagrange2", "test_kane4")
def test_examples_within_sympy_are_as_recorded(module: str) -> None:
    """SymPy's wheel carries these, so the record is measured again."""
    fresh = {(row.example, row.number): row for row in ran(TESTS + module)}
    own = [row for row in recorded() if row.example.startswith(f"{TESTS}{module}::")]
    assert own
    for row in own:
        now = fresh[row.example, row.number]
        assert now.result == row.result == "equal", now


class _CaughtError(Exception):
    """The bicycle is described."""


def bicycle(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the KanesMethod of SymPy's bicycle before its equations are formed, which takes a minute."""
    seen: list[Any] = []

    def stop(method: Any, bodies: Any, loads: Any) -> None:
        method._bodylist, method._forcelist = bodies, loads
        seen.append(method)
        raise _CaughtError

    monkeypatch.setattr(me.KanesMethod, "kanes_equations", stop)
    with pytest.raises(_CaughtError):
        test_kane3.test_bicycle()
    return seen[0]


@pytest.mark.long
def test_the_benchmark_bicycle_has_its_eigenvalues(monkeypatch: pytest.MonkeyPatch) -> None:
    """M, C1, K0, K2 of Meijaard, Papadopoulos, Ruina and Schwab, Proc. R. Soc. A 463 (2007) 1955, printed to 15 digits,
    from rest to 8 m/s; holonomic and velocity constraints, wheels without angles."""
    rear, front, base, trail, tilt = 0.3, 0.35, 1.02, 0.08, np.pi / 2 - np.pi / 10
    sine, cosine = np.sin(tilt), np.cos(tilt)
    axes = np.array([[cosine, -sine], [sine, cosine]])  # along and across the steering axis
    fork, frame, head = (axes @ np.subtract(place, (0.0, rear)) for place in ((base, front), (0.3, 0.9), (0.9, 0.7)))
    offset = front * cosine - trail * sine
    values = {
        "WRrad": rear, "WFrad": front, "htangle": tilt, "forkoffset": offset, "forklength": fork[0],
        "framelength": fork[1] - offset, "framecg1": -frame[0], "framecg3": frame[1], "forkcg1": -head[0],
        "forkcg3": head[1] - fork[1] + offset, "Iwr11": 0.0603, "Iwr22": 0.12, "Iwf11": 0.1405, "Iwf22": 0.28,
        "Ifork11": 0.05892, "Ifork22": 0.06, "Ifork33": 0.00708, "Ifork31": 0.00756, "Iframe11": 9.2, "Iframe22": 11.0,
        "Iframe33": 2.8, "Iframe31": -2.4, "mfork": 4.0, "mframe": 85.0, "mwf": 3.0, "mwr": 2.0, "g": 9.81,
    }  # fmt: skip  # a table
    document = eomgen.from_sympy(bicycle(monkeypatch), parameters=values, name="whipple")
    assert len(document.rows.positions) == 1
    assert len(document.rows.velocities) == 2
    model = eomgen.build(document, profile="quick")
    M = np.array([[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]])
    K0 = np.array([[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]])
    K2 = np.array([[0.0, 76.59734589573222], [0.0, 2.65431523794604]])
    C1 = np.array([[0.0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]])
    for speed in (0.0, 2.5, 5.0, 8.0):
        K, C = np.linalg.solve(M, 9.81 * K0 + speed**2 * K2), np.linalg.solve(M, speed * C1)
        expected = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]]))
        rates = {"u3_integral": speed / rear, "u6_integral": speed / front}
        v = [rates.get(name, 0.0) for name in document.coordinates]
        found = model.linearize(document.initial_q, v).modes().eigenvalues
        found = np.concatenate([found, found.conj()])
        for value in expected:
            assert np.min(np.abs(found - value)) < 1e-12 * abs(value)
