"""Fastest rates along a run, and findings on steps that do not resolve them, against eigenvalues by hand and SciPy's
stiff integrators of equations written here."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import eomgen
from eomgen.products.doubts import unseen_laws
from eomgen.simulation.accuracy.step_path import StepPath

Array = NDArray[np.float64]
MASS, STIFFNESS, BELT, STATIC, COULOMB = 1.0, 400.0, 0.1, 5.0, 3.0


def names_of(run: Any) -> set[str]:
    return {finding.name for finding in run.findings}


def belt(stribeck: float, velocity: float, *, driven: bool = True) -> Any:
    """Return a block on a belt at constant speed, held by a spring."""
    friction = {"coulomb": COULOMB, "static": STATIC, "stribeck": stribeck, "velocity": velocity}
    builder = eomgen.SceneBuilder("belt", gravity=[0, 0, 0]).body("block", MASS)
    if driven:
        builder.body("belt", 100.0)
        builder.joint("belt", "prismatic", "base", "belt", axis=[1, 0, 0], drive=f"{BELT} * t")
        builder.joint("contact", "prismatic", "belt", "block", axis=[1, 0, 0], friction=friction)
        builder.point("wall", "base", [-1, 0, 0]).point("eye", "block")
        builder.spring("spring", "wall", "eye", stiffness=STIFFNESS, length=1.0)
        return builder.output("x", formula="position.eye[0]").build()
    builder.joint("contact", "prismatic", "base", "block", axis=[1, 0, 0], friction=friction)  # in axes of the belt
    builder.effort("spring", "contact", f"-{STIFFNESS} * (q.contact + {BELT} * t)")
    return builder.output("x", formula=f"q.contact + {BELT} * t").build()


def slip_stick(stribeck: float, velocity: float, times: Array) -> Array:
    """Return the place of the block by Radau; equations and numbers of ``belt``."""

    def rates(t: float, y: Array) -> list[float]:
        slip = y[1] - BELT
        level = COULOMB + (STATIC - COULOMB) * math.exp(-((slip / stribeck) ** 2))
        return [y[1], (-STIFFNESS * y[0] - level * math.tanh(slip / velocity)) / MASS]

    span = float(times[0]), float(times[-1])
    return np.asarray(solve_ivp(rates, span, [0.0, BELT], "Radau", times, rtol=1e-8, atol=1e-11).y[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "step", "finding", "driven"),
    [("rk4_partitioned", 5e-3, "unresolved_damping", True), ("generalized_alpha", 1e-2, "passed_growth", False)],
)
def test_steps_that_pass_over_friction_are_told_and_those_that_resolve_it_are_right(
    method: str, step: float, finding: str, driven: bool
) -> None:
    narrow, wide = (2e-4, 1e-5), (4e-2, 4e-3)
    told = {"unresolved_damping", "passed_growth"}
    for widths, h in ((narrow, step), (wide, 1e-3)):
        run = eomgen.build(belt(*widths, driven=driven), method=method, profile="quick").simulate(2.0, h)
        exact = slip_stick(*widths, run.t)
        off = float(np.max(np.abs(run.outputs["x"] - exact)) / np.ptp(exact))
        if widths == narrow:
            assert finding in names_of(run) and off > 0.1
            continue
        assert not told & names_of(run)
        assert off < max(3.0 * float(run.error.outputs["x"]) / np.ptp(exact), 1e-6)


def test_searches_within_steps_are_left_out_with_the_estimate_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    model = eomgen.build(belt(2e-4, 1e-5, driven=False), method="rk4", profile="quick")
    run = model.simulate(0.5, 5e-3, error_estimate=False)
    monkeypatch.setattr("eomgen.simulation.accuracy.fastest_rates.fastest_rates", None)
    for name in ("unseen_laws.unseen_law", "unseen_events.unseen_events", "remarks.fast_laws"):
        monkeypatch.setattr(f"eomgen.products.doubts.{name}", None)
    assert run.success and not {finding.name for finding in run.findings} & {"unresolved_damping", "fast_law"}
    assert str(run.error) == (
        "not known: it was switched off, and with it the search for laws of time that are faster than the steps and"
        " rates that the steps do not resolve"
    )
    monkeypatch.undo()
    assert "unresolved_damping" in {finding.name for finding in run.model.alike()}


@pytest.mark.parametrize("steps", [4, 60])
def test_a_check_factorizes_no_more_systems_than_the_run_has_steps(steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A pulse that is narrow between two steps: its effect fades by Jacobians, three times eight states at least."""
    states: list[int] = []
    own = unseen_laws.rate_partials

    def counted(path: StepPath, blocks: Any, moves: Any) -> Array:
        states.append(len(blocks.t))
        return own(path, blocks, moves)

    monkeypatch.setattr(unseen_laws, "rate_partials", counted)
    builder = eomgen.SceneBuilder("pulse", gravity=[0, 0, 0]).body("cart", 1.0)
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], initial={"velocity": 1.0})
    builder.effort("wall", "rail", "-1000 * exp(-((q.rail - 0.025) / 0.0005)**2)")
    run = eomgen.build(builder.build(), method="generalized_alpha", profile="quick").simulate(0.01 * steps, 0.01)
    assert "unseen_law" in names_of(run)
    assert sum(states) <= max(24, steps)
