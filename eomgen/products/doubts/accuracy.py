"""Checks of accuracy: coordinates whose small motion is not resolved, momenta that are not kept, rounding of
multipliers; and the cause of large errors: beams beyond the linear range, passages near singular positions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.rest.state_warnings import beams_beyond_linear_range
from eomgen.integrators.families.register import Method
from eomgen.products.doubts.momentum import REPORTED_MOMENTUM, momentum_drift
from eomgen.products.doubts.sampled_run import SampledRun
from eomgen.results.finding import Finding
from eomgen.simulation.accuracy.motion_size import REST, at_work
from eomgen.simulation.judgement.failures import FAULTS
from eomgen.simulation.judgement.finished_run import Check, FinishedRun
from eomgen.simulation.judgement.singular_positions import NEARLY, SingularPosition, examined_rows, nearest
from eomgen.simulation.judgement.stated_errors import DOUBTFUL_ERROR, noticed_error, remedy, remedy_of_error, rounds

#: Least motion in parts of its reach in double precision, and in single precision.
FINEST = (REST, 1e3 * float(np.finfo(np.float32).eps))
#: The method whose multipliers have the least rounding.
ROUNDING_LEAST = "generalized_alpha"
ROUNDED = Limit(0.01, "1", "rounding in parts of the multipliers", "a choice: the error at which hints aim")


class UnresolvedComponent(NamedTuple):
    """A coordinate or internal state whose estimated error is large in parts of the motion: name, range of the motion
    (``travel``), error, and unit, which begins with a space."""

    name: str
    travel: float
    error: float
    unit: str


def _unresolved_coordinate(run: FinishedRun) -> Iterator[Finding]:
    unresolved = unresolved_coordinates(run)
    if not unresolved:
        return
    name, travel, error, unit = max(unresolved, key=lambda component: component.error / component.travel)
    more = f" (and {len(unresolved) - 1} more)" if len(unresolved) > 1 else ""
    size = f"its motion of {travel:.2g}{unit} has an estimated error of {error:.2g}{unit}"
    text = f"{name}{more} is not resolved: {size}"
    yield Finding(value=error / travel, text=text, hint=remedy_of_error(run))


def unresolved_coordinates(run: FinishedRun) -> list[UnresolvedComponent]:
    """Return the coordinates of joints and the internal states whose estimated error is large in parts of their motion;
    none without an error estimate, and no coordinate that the error estimate names already. Motion below a billionth of
    the reach of the coordinate at work is rounding."""
    if not run.error.available:
        return []
    result = _hidden_components(run, run.states.q, run.states.z)
    return _hidden_components(run, *run.once(SampledRun).between_rows) if result and run.rows_are_sparse else result


def _hidden_components(run: FinishedRun, q: Array, z: Array) -> list[UnresolvedComponent]:
    """Return the coordinates and internal states with large errors in parts of the motions of q, (n, nq), and z, (n,
    nz), in rows of the run; the one that the error estimate names is left out."""
    model, error = run.run.model, run.error
    reported = noticed_error(error)
    part = FINEST[run.single]
    q_travel, z_travel = (np.ptp(values, axis=0).tolist() for values in (q, z))
    errors, of_states = error.increment.tolist(), error.z.tolist()
    axes = [(factor.q_start, factor.v_start) for factor in model.factors if factor.group == "R"]
    rows = [(model.q_names[k], q_travel[k], errors[j], model.q_units[k], j) for k, j in axes]
    rows += zip(model.z_names, z_travel, of_states, model.z_units, range(-len(of_states), 0), strict=True)
    large = [
        row for row in rows if row[2] > DOUBTFUL_ERROR * row[1] > 0.0 and (reported is None or row[0] != reported.name)
    ]
    if not large:
        return []
    work = at_work(run.run, run.trajectory.rows, run.present)
    reach = np.concatenate([work.ways, work.states])
    return [
        UnresolvedComponent(name, travel, by, "" if unit in ("", "1") else f" {unit}")
        for name, travel, by, unit, column in large
        if travel > part * reach[column]
    ]


def _momentum_drift(run: FinishedRun) -> Iterator[Finding]:
    if len(run.changes):
        return
    inputs = run.run.signals if run.run.takes_rows else None
    t, q, v, _, multipliers, z = run.states
    sparse = run.rows_are_sparse
    drift = momentum_drift(run.run.model, (t, q, v, z), run.run.parameters, inputs, multipliers, sparse)
    if drift is not None and not run.at_rest:
        yield Finding(value=drift.share, text=str(drift), hint=remedy(run))


def _multiplier_rounding(run: FinishedRun) -> Iterator[Finding]:
    if (share := _rounding(run)) > ROUNDED:
        alternative = "" if run.run.name == ROUNDING_LEAST else f"{ROUNDING_LEAST}, "
        double = ", or double precision" if run.single else ""
        text = f"up to {100.0 * share:.2g} % of the multipliers is rounding, which grows as 1/step^2"
        yield Finding(value=share, text=text, hint=f"{alternative}a step larger than {run.longest_part:.3g} s{double}")


def _rounding(run: FinishedRun) -> float:
    """Return the part of the multipliers that is rounding; 0 if all multipliers are zero, or if a law makes motion grow
    too fast for the steps, so that corrections of Newton's method do not shrink."""
    share = float(run.statistics.get("max_rounding", 0.0)) if run.states.multipliers.any() else 0.0
    return 0.0 if share > ROUNDED and passes_growth(run) else share


STEP_OF_GROWTH = Limit(
    1.0,
    "1",
    "step times the fastest rate at which a law of velocities makes motion grow",
    "implicit steps have a pole at 2 at most, beyond which growth turns into decay: Hairer, Wanner, Solving Ordinary"
    " Differential Equations II (1996), IV.3",
)


def passes_growth(run: FinishedRun) -> bool:
    """Return whether a run in fixed steps takes steps longer than the fastest growth that a law of velocities
    causes."""
    return not run.run.method.chooses_steps and run.settings["step"] * run.fastest.growth.rate > STEP_OF_GROWTH


def linear_range_exceeded(model: CompiledModel, t: Array, q: Array, p: Array) -> str:
    """Return a clause, with a remedy, on beams of order 1 that deform too far in some row of a run; empty if none does.
    ``t`` (rows,) in s and ``q`` (rows, nq) are the run, ``p`` parameters. Examined rows are the rows with the largest
    deformation of each beam, the last row, and up to 200 rows between."""
    first = {item.name for item in model.description.coordinates if item.linear}
    parts = [factor.q for factor in model.factors if factor.name in first]
    if not parts:
        return ""
    rows = {int(np.argmax(np.linalg.norm(q[:, part], axis=1))) for part in parts} | {len(t) - 1}
    for row in sorted(rows | set(range(0, len(t), len(t) // 200 + 1))):
        if beams := beams_beyond_linear_range(model, q[row], p):
            named = f"beam{'s' * (len(beams) > 1)} {', '.join(beams)}"
            sentence = f"at t = {t[row]:.6g} s the deflection of {named} is beyond the range of order = 1"
            return f"{sentence}: the inertia matrix is not positive definite; try: order = 2"
    return ""


def _linear_range(run: FinishedRun) -> Iterator[Finding]:
    sentence = linear_range_exceeded(run.run.model, run.states.t, run.states.q, run.run.parameters)
    if sentence and not rounds(run):
        yield Finding.of(sentence)


FOLLOWED = Limit(1e3, "1", "estimated error in parts of the tolerance", "a choice")


def nearest_singular(model: CompiledModel, t: Array, q: Array, p: Array) -> SingularPosition | None:
    """Return the position of a run at which its constraints are most nearly singular; None without a nearly
    singular position.

    Parameters
    ----------
    t, q : (rows,) in s, (rows, nq)
    p : (np,) parameters
    """
    chosen = examined_rows(model, len(t))
    return nearest(model, t[chosen], q[chosen], p, 0)


def way_through(method: Method, step: float) -> str:
    """Return the remedy for a run by a method that has passed near a singular position inaccurately: a step below
    ``step``, s, or another method."""
    alternative = (
        "" if method.passes_singularities else ", or rk4_partitioned, which passes such positions along the velocity"
    )
    return f"a step smaller than {step:.3g} s{alternative}"


def passages(count: int) -> str:
    """Return the remark on a run that has passed ``count`` singular positions; empty for none."""
    if not count:
        return ""
    where = "a position" if count == 1 else f"{count} positions"
    return (
        f"it passed {where} where the constraints are singular, or nearly, and branches cross, each time along its"
        " velocity"
    )


def not_followed(relative: float, tolerance: float) -> str:
    """Return a remark if the error of a run past singular positions does not follow its tolerance; else an empty text.

    Parameters
    ----------
    relative : estimated error as a part of the motion; NaN if unknown
    tolerance : of an adaptive method; infinite for methods without adaptive steps
    """
    if not relative > FOLLOWED * tolerance:
        return ""
    return (
        f"; near them errors do not follow tolerances: the estimated one is {relative:.2g} of the motion at a tolerance"
        f" of {tolerance:.2g}; try: a tolerance of 1e-08, rk4_partitioned, or a run that ends before the first of them"
    )


def _singular_position(run: FinishedRun) -> Iterator[Finding]:
    if rounds(run):
        return
    singular = nearest_singular(run.run.model, run.states.t, run.states.q, run.run.parameters)
    if singular is not None:
        hint = way_through(run.run.method, run.settings["step"])
        yield Finding(value=singular.part, time=singular.time, text=singular.text, hint=hint)


#: The checks that are joined into one sentence.
_FOUND = (
    "halved_steps",
    "discretisation_error",
    "unresolved_coordinate",
    "energy_balance",
    "momentum_drift",
    "constraint_violation",
    "multiplier_rounding",
)
ROWS = (
    Check(
        "unresolved_coordinate [W0216]",
        _unresolved_coordinate,
        unless=FAULTS,
        continues=", and ",
        limits=(DOUBTFUL_ERROR,),
        behind="discretisation_error",
    ),
    Check(
        "momentum_drift [W0218]",
        _momentum_drift,
        unless=FAULTS,
        continues=", and ",
        limits=(REPORTED_MOMENTUM,),
        behind="energy_balance",
    ),
    Check(
        "multiplier_rounding [W0220]",
        _multiplier_rounding,
        ("complete", "constraints"),
        unless=FAULTS,
        continues=", and ",
        limits=(ROUNDED,),
        behind="constraint_violation",
    ),
    Check(
        "linear_range [W0221]",
        _linear_range,
        unless=("multiplier_rounding",),
        after=_FOUND,
        continues="; ",
        behind="multiplier_rounding",
    ),
    Check(
        "singular_position [W0222]",
        _singular_position,
        ("complete", "constraints", "fixed steps"),
        unless=("multiplier_rounding", "linear_range"),
        after=_FOUND,
        continues="; ",
        behind="linear_range",
        limits=(NEARLY,),
    ),
)
