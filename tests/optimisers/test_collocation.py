"""Direct collocation of a closed loop with the multipliers as unknowns, which needs no tree of equations: a four-bar
that is thrown so that its crank arrives at an angle."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import eomgen

SCENE = Path(__file__).parents[2] / "examples" / "four_bar" / "scene.toml"
TIME, TARGET = 0.1, 0.6


def thrown(functions: Any, start: np.ndarray, nodes: int) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """Return IPOPT's statistics, the initial velocity of least size, and the configuration at the end.

    Implicit Euler of index 3: q, v, a and multipliers of each node are unknowns, residual and constraints equations.
    """
    h, n, rows = TIME / nodes, len(start), 2
    q, v = ca.MX.sym("q", n, nodes + 1), ca.MX.sym("v", n, nodes + 1)
    a, lam = ca.MX.sym("a", n, nodes), ca.MX.sym("lam", rows, nodes)
    equations = [q[:, 0] - start, functions["constraint"](q[:, 0] + h * v[:, 0])]
    for k in range(nodes):
        equations += [
            q[:, k + 1] - q[:, k] - h * v[:, k + 1],
            v[:, k + 1] - v[:, k] - h * a[:, k],
            functions["residual"](q[:, k + 1], v[:, k + 1], a[:, k], lam[:, k]),
            functions["constraint"](q[:, k + 1]),
        ]
    equations.append(q[0, -1] - start[0] - TARGET)
    unknowns, options = ca.veccat(q, v, a, lam), {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes"}}
    nlp = {"x": unknowns, "f": ca.sumsqr(v[:, 0]), "g": ca.vertcat(*equations)}
    solver = ca.nlpsol("thrown", "ipopt", nlp, options)
    guess = np.concatenate([np.tile(start, nodes + 1), np.zeros(unknowns.numel() - n * (nodes + 1))])
    found = np.array(solver(x0=guess, lbg=0.0, ubg=0.0)["x"]).ravel()
    places = n * (nodes + 1)
    return solver.stats(), found[places : places + n], found[places - n : places]


@pytest.mark.slow
def test_a_four_bar_is_thrown_with_its_multipliers_as_unknowns() -> None:
    functions = eomgen.casadi(SCENE, ["residual", "constraint"], profile="quick")
    assert list(functions) == ["residual", "constraint"]
    assert functions["residual"].name_in() == ["q", "v", "a", "lam"]
    model = eomgen.build(SCENE, profile="quick")
    errors = []
    for nodes in (20, 40):
        statistics, velocity, end = thrown(functions, model.initial_q, nodes)
        assert statistics["success"] and statistics["iter_count"] < 40
        assert end[0] == pytest.approx(model.initial_q[0] + TARGET, abs=1e-8)
        assert np.max(np.abs(model.evaluate("constraint", end)["Phi"])) < 1e-8
        run = model.simulate(TIME, 1e-4, initial={"v": model.consistent(model.initial_q, velocity).v})
        errors.append(np.max(np.abs(run.q[-1] - end)))
    assert errors[1] < 0.6 * errors[0] < 0.02  # a method of order 1


@pytest.mark.slow
def test_a_crank_is_turned_with_the_torque_that_casadis_symbols_have() -> None:
    """The linkage ends as it began, so the work of the torque vanishes to the order of the method."""
    own_demo = runpy.run_path(str(SCENE.parents[1] / "turned_four_bar" / "demo.py"))
    functions = eomgen.casadi(SCENE, ["residual", "constraint"], profile="quick")
    start, works = eomgen.build(SCENE, profile="quick").initial_q, []
    for intervals in (20, 40):
        best, native = (own_demo["turned"](given, start, intervals) for given in (functions, own_demo["native"]()))
        assert best.success and best.iterations == native.iterations < 20
        assert best.cost == pytest.approx(native.cost, rel=1e-9)
        assert best.q == pytest.approx(native.q, abs=1e-7) and best.torque == pytest.approx(native.torque, abs=1e-6)
        assert best.q[-1, 0] - start[0] == pytest.approx(2.0 * np.pi, abs=1e-9)
        pin = np.linalg.norm(best.multipliers, axis=1)
        assert pin == pytest.approx(np.linalg.norm(native.multipliers, axis=1), rel=1e-5)
        works.append(abs(best.torque @ np.diff(best.q[:, 0])))
    assert works[1] < 0.25 * works[0] < 0.02
