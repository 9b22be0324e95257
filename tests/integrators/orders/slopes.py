"""Orders of methods as slopes of errors over numbers of steps, against SciPy's DOP853 on the accelerations alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import eomgen
from eomgen.errors import UsageError
from eomgen.integrators.families.family import Family
from eomgen.integrators.families.register import method_named, row_of
from eomgen.lie import product
from eomgen.system.system import Facts
from tests.integrators.orders.scenes import INPUT, MECHANISMS, Kind, absolute_scene, joint_scene

Array = NDArray[np.float64]
#: Errors by quantity and group.
Errors = Mapping[tuple[str, str], float]

#: Seconds, and rows in them.
END, ROWS = 0.8, 4
#: Steps of runs with fixed ones. Rows lie behind even numbers of them: what nothing damps alternates.
COUNTS = tuple(2 * ROWS * n for n in (1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 90, 128))
#: Tolerance of the coarsest steps at which those that a method chooses are as long as they may be, from row to row of
#: inputs; it shrinks with the step, as iterations are stopped by it.
COARSE = 0.1
#: Order at which series are compared: beyond it few steps are exact.
SERIES_ORDER = 6
#: Relative errors that count: below lies rounding.
LEAST = 3e-13
#: Points of a fit, the finest that count.
POINTS = 3


def tolerance_of(order: int) -> float:
    """Return by how much a slope may miss an order."""
    return 0.1 if order <= 2 else 0.2 if order <= 4 else 0.4


@dataclass(frozen=True)
class Subject:
    """A compiled scene with its reference at ROWS equal times."""

    model: eomgen.Model
    exact: Mapping[str, Array]
    sizes: Errors

    def owners(self, quantity: str) -> dict[str, Array]:
        """Return the components of q's increments, v or the multipliers by the group whose mechanism they are of."""
        if quantity in ("q", "v"):
            names = [factor.name for factor in self.model.factors for _ in range(factor.v_size)]
        else:
            names = list(self.model.multipliers)
        found = {
            group: [k for k, one in enumerate(names) if one.startswith(begin)] for group, begin in MECHANISMS.items()
        }
        return {group: np.array(places) for group, places in found.items() if places}


@cache
def subjects(kind: Kind) -> tuple[Subject, Subject]:
    return _subject(joint_scene(kind)), _subject(absolute_scene(kind))


def _subject(scene: eomgen.Scene) -> Subject:
    model = eomgen.build(scene, profile="quick")
    start = np.concatenate([model.initial_q, model.initial_v, model.initial_z])
    times = END / ROWS * np.arange(1, ROWS + 1)
    found = solve_ivp(lambda t, y: model.rhs(t, y, [0.0]), (0.0, END), start, "DOP853", times, rtol=3e-14, atol=1e-14)
    q, v, z = np.split(found.y.T, [model.nq, model.nq + model.nv], axis=1)
    exact = {"q": q, "v": v}
    if model.multipliers:
        exact["multipliers"] = model.constrained_dynamics(q, v, times, [0.0], z=z)[1]
    still = {name: np.zeros_like(values) for name, values in exact.items()} | {"q": np.tile(model.initial_q, (ROWS, 1))}
    subject = Subject(model, exact, {})
    return Subject(model, exact, differences(subject, still))


def differences(subject: Subject, rows: Mapping[str, Array]) -> dict[tuple[str, str], float]:
    """Return the Euclidean norms over rows and components of what differs from the reference."""
    found = {}
    for quantity, exact in subject.exact.items():
        given = rows[quantity]
        off = product.difference(subject.model.factors, given, exact) if quantity == "q" else given - exact
        for group, places in subject.owners(quantity).items():
            found[quantity, group] = float(np.linalg.norm(off[:, places]))
    return found


def made(name: str) -> Family | str:
    """Return the method of a name of the register, by the parameters that its stepper is compiled with, or why it has
    none."""
    try:
        return method_named(name, **parameters(name))
    except UsageError as error:
        return error.problems[0].what


def parameters(name: str) -> dict[str, float]:
    """Return by which parameters a method runs: those that its stepper is compiled with; of series, an order."""
    row = row_of(name)[1]
    series = {"order": SERIES_ORDER, "tolerance": 0.0} if "order" in row.parameters else {}
    return {**row.compiled_with, **series}


def chooses_steps(name: str) -> bool:
    """Return whether a method chooses its steps by a tolerance, unless its parameters say otherwise."""
    return "tolerance" in row_of(name)[1].parameters and "tolerance" not in parameters(name)


def declared(name: str) -> int:
    """Return the order that a method declares."""
    return int(parameters(name).get("order", method_named(name, **parameters(name)).order))


def refusal(method: Family, facts: Facts) -> str:
    """Return why a method cannot run on a system by the needs that it declares; empty where it can."""
    return "; ".join(need.reason for need in method.needs if bool(getattr(facts, need.fact)) is not need.value)


def slopes(name: str, subject: Subject) -> dict[tuple[str, str], float]:
    """Return the slopes by quantity and group."""
    points = [(count, errors) for count in COUNTS if (errors := _errors(name, subject, count))]
    found = {}
    for key, size in subject.sizes.items():
        fit = [(count, errors[key]) for count, errors in points if errors[key] > LEAST * size][-POINTS:]
        assert len(fit) >= 3, f"{name}, {key}: {len(fit)} errors are above rounding"
        counts, errors = np.log(np.array(fit)).T
        found[key] = -float(np.polyfit(counts, errors, 1)[0])
    return found


def _errors(name: str, subject: Subject, count: int) -> Errors:
    """Return the errors of a run with so many equal steps; nothing where they are too long for the method."""
    options: dict[str, Any] = parameters(name)
    if chooses_steps(name):
        options = {"tolerance": COARSE * COUNTS[0] / count, "inputs": {INPUT: np.zeros(count + 1)}}
    run = subject.model.simulate(
        END, END / count, method=name, record_every=count // ROWS, error_estimate=False, **options
    )
    if not run.success or run.stats.get("own_steps", count) != count:
        return {}
    return differences(subject, {quantity: getattr(run, quantity)[1:] for quantity in subject.exact})
