"""Spectral radius of one step on linear oscillators, of all methods of the register, measured on compiled steppers.

Methods that are stable at any step stay within 1 from step times frequency 1e-6 to 1e12; others within their limit.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from eomgen.integrators.compositions import composition_named
from eomgen.integrators.families.composition import NAMES as COMPOSITIONS
from eomgen.integrators.families.register import BUILT_IN, method_named
from eomgen.pipeline.model import Model
from eomgen.simulation.stepping.settings import chosen_method, stepper_settings
from eomgen.simulation.stepping.stepper import Stepper

Array = NDArray[np.float64]
PHASES = (1e-6, 1e-4, 1e-2, 0.1, 0.5, 1.0, 2.0, 3.0, 10.0, 1e2, 1e4, 1e6, 1e8, 1e10, 1e12)
DAMPING_RATIOS = (0.0, 0.05, 1.0, 50.0)
#: Parameters that are tried beside the defaults.
OTHERS: Mapping[str, tuple[Mapping[str, float], ...]] = {
    "generalized_alpha": ({"rho_inf": 0.0}, {"rho_inf": 0.5}, {"rho_inf": 0.95}, {"rho_inf": 1.0}),
    "hht": ({"alpha": 0.0}, {"alpha": 1 / 3}),
    "wbz": ({"alpha": 0.1}, {"alpha": 1.0}),
    "newmark": ({"alpha": 0.1}, {"beta": 0.25, "gamma": 0.5}),
    "generalized_alpha_index3": ({"rho_inf": 0.0}, {"rho_inf": 0.5}, {"rho_inf": 0.98}),
    "hht_index3": ({"alpha": 0.05}, {"alpha": 1 / 3}),
    "wbz_index3": ({"alpha": 0.1}, {"alpha": 1.0}),
    "newmark_index3": ({"alpha": 0.1}, {"beta": 0.3025, "gamma": 0.6}),
}
#: Methods that refuse their defaults, which do not damp.
REFUSED = ("newmark_index3", "trapezoidal_index3")
#: Largest step times frequency without damping of methods that have a limit.
LIMITS = {"rk4": 2.8, "rk4_partitioned": 2.8, "rattlie": 1.99}
#: Step times frequency from which the double eigenvalue -1 is known to the root of rounding only: v h is so much larger
#: than what the step leaves of it.
ROUNDED = {"rosenbrock": 1e9}


#: Methods that refuse damping, and their limits.
UNDAMPED = {name: 0.999 * composition_named(name).stability_limit for name in COMPOSITIONS}


@cache
def oscillator(constrained: bool, damped: bool = True) -> Model:
    """Return a mass on a spring; constrained: one that could move across as well, but for a line that it is held on."""
    builder = eomgen.SceneBuilder("oscillator", gravity=[0, 0, 0])
    builder.parameter("k", 1.0, tunable=True).parameter("c", 1.0, tunable=True)
    builder.body("b", 0.5 if constrained else 1.0)
    builder.joint("x", "prismatic", "base", "b", axis=[1, 0, 0], stiffness="k", **({"damping": "c"} if damped else {}))
    if constrained:
        builder.body("held", 0.5).joint("y", "prismatic", "b", "held", axis=[0, 1, 0])
        builder.constraint("line", "point_on_line", {"body": "base", "axis": [1, 0, 0]}, {"body": "held"})
    return eomgen.build(builder.build())


def fixed_steps(constrained: bool) -> list[tuple[str, Mapping[str, float]]]:
    """Return the methods of the register that serve scenes with or without constraints and take the steps they are
    given; with constraints those that do what they do not do without."""
    found: list[tuple[str, Mapping[str, float]]] = []
    for family in BUILT_IN:
        for row in family.names():
            if "constraints" in row.differs and not constrained:  # the same as another one
                continue
            others = OTHERS.get(row.name, ())
            if row.name in REFUSED:
                with pytest.raises(eomgen.UsageError, match="index 3 is weakly unstable"):
                    method_named(row.name)
                found += [(row.name, given) for given in others]
                continue
            method = method_named(row.name)
            wrong = any(need.fact == "constraints" and need.value is not constrained for need in method.needs)
            if not method.chooses_steps and not wrong:
                found += [(row.name, given) for given in ({}, *others)]
    return found


def named(value: object) -> str:
    """Return what a parameter of a test is called."""
    return " ".join(f"{key} {x:.4g}" for key, x in value.items()) or "own" if isinstance(value, Mapping) else str(value)


def amplification(
    method: str, given: Mapping[str, float], step: float, k: float, c: float, constrained: bool = False
) -> Array | None:
    """Return the matrix of one step on (x, v, a), scaled; None where the step is halved or refused."""
    model = oscillator(constrained, damped=method not in UNDAMPED)
    library = model.stepper(method)
    full: dict[str, Any] = dict.fromkeys(("rho_inf", "alpha", "beta", "gamma", "order", "tolerance")) | dict(given)
    chosen = chosen_method(method, full, model.library.layout["defaults"], constrained)
    settings = stepper_settings(library.layout["method"], step, chosen, {})
    stepper = Stepper(library, settings, model.parameter_array({"k": k, "c": c}))
    names = [name for name in ("q", "v", "a") if name in stepper.places]
    rate = max(1.0, step * np.sqrt(k)) / step
    scale = np.array([1.0, rate, rate**2])[: len(names)]
    matrix = np.zeros((len(names), len(names)))
    for column in range(len(names)):
        x = np.zeros(3)
        x[column] = scale[column]
        q, v, a = (np.array([entry, 0.0][: model.nq]) for entry in x)
        if stepper.initialize(0.0, q, v, None):
            return None
        if "a" in names:
            stepper.state[stepper.places["a"]] = a
            stepper.state[stepper.places["history"]] = 0.0  # the step of the method itself, not a damped start
        status, _ = stepper.run(1, 1, None, np.empty((1, stepper.sizes["row"])))
        if status or stepper.statistics.get("halvings"):
            return None
        matrix[:, column] = [float(stepper.state[stepper.places[name]][0]) for name in names] / scale
    return matrix


#: Largest h omega on constraints where rounding splits a double eigenvalue -1: positions of rosenbrock are right to the
#: last digit of h v, whose root, 2e-8, is seen at 1e12.
BY_ROUNDING = {"rosenbrock": 1e10}


@pytest.mark.long_except_every(5)
@pytest.mark.slow
@pytest.mark.parametrize(("method", "given"), fixed_steps(constrained=True), ids=named)
def test_spectral_radius_on_a_constraint_is_at_most_one(method: str, given: Mapping[str, float]) -> None:
    measured, worst = 0, 0.0
    for phase in PHASES:
        if phase > (LIMITS | BY_ROUNDING).get(method, np.inf):
            continue
        for step in (1.0, 1e-6):
            matrix = amplification(method, given, step, (phase / step) ** 2, 0.0, constrained=True)
            if matrix is not None:
                measured += 1
                worst = max(worst, float(np.max(np.abs(np.linalg.eigvals(matrix)))))
    assert worst <= 1.0 + 1e-12
    assert measured >= 12


@pytest.mark.long_except_every(4)
@pytest.mark.slow
@pytest.mark.parametrize(("method", "given"), fixed_steps(constrained=False), ids=named)
def test_spectral_radius_is_at_most_one(method: str, given: Mapping[str, float]) -> None:
    limit = (LIMITS | UNDAMPED).get(method, np.inf)
    measured, worst = 0, 0.0
    for ratio in DAMPING_RATIOS if method not in UNDAMPED else (0.0,):
        for phase in (*PHASES, *([limit] if method in UNDAMPED else [])):
            if phase * (1.0 if ratio <= 0.05 else 2.0 * ratio) > limit:
                continue
            for step in (1.0, 1e-6):
                frequency = phase / step
                matrix = amplification(method, given, step, frequency**2, 2.0 * ratio * frequency)
                if matrix is not None:
                    measured += 1
                    bound = 1.0 + (1e-12 if phase < ROUNDED.get(method, np.inf) else 1e-7)
                    worst = max(worst, float(np.max(np.abs(np.linalg.eigvals(matrix)))) / bound)
    assert worst <= 1.0
    assert measured >= (90 if limit == np.inf else 8)
