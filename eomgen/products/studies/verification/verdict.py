"""The verdict on one closed form: its entries that differ by more than the error bounds of the reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from eomgen.products.studies.verification.claims.claim import Claim
from eomgen.products.studies.verification.differences import LADDER, complex_steps, differences
from eomgen.products.studies.verification.engines import Array, Blocks, Engine
from eomgen.products.studies.verification.form_report import Disagreement, FormReport, Verdict
from eomgen.products.studies.verification.kinks import NonSmoothOperations, Remarks, non_smooth_entries
from eomgen.products.studies.verification.states import States
from eomgen.products.studies.verification.tolerances import BARS, Sizes, sizes_of
from eomgen.system.system import System


def judged(
    claim: Claim, engine: Engine, tape: Engine, system: System, states: States, rng: np.random.Generator
) -> FormReport:
    """Return the report of a claim at states.

    Parameters
    ----------
    engine, tape : the compiled functions, and functions that take complex numbers
    rng : source of random changes for the condition
    """
    remarks, names, state = Remarks(), states.names, dict(states.blocks)
    report = FormReport(claim.name, claim.meaning, claim.family, "no state", second_name=claim.second_name)
    if claim.source is not None and names:
        inside = np.array(np.isfinite(claim.source(engine, state)).all(axis=-1))
        for k in np.flatnonzero(~inside):
            remarks.add(names[k], "not a number")
        state = {name: array[inside] for name, array in state.items()}
        names = tuple(names[k] for k in np.flatnonzero(inside))
    if not names:
        return replace(report, remarks=remarks.texts)
    operations = NonSmoothOperations(
        system, (*claim.functions, "base") if "base" in system.functions else claim.functions
    )
    value = claim.value(engine, state)
    finite = np.array(np.isfinite(value))
    value = np.where(finite, value, 0.0)
    singular = np.array(~finite.all(axis=(-2, -1)))
    failures = _not_numbers(claim, operations, state, names, finite, remarks)
    sizes = sizes_of(claim, engine, state, value, rng)
    undecided = bool(singular.all())
    if claim.source is not None:
        found, exact = differences(claim, engine, state), complex_steps(claim, engine, tape, state)
        non_smooth = non_smooth_entries(claim, engine, operations, state, names, value, finite, found, sizes, remarks)
        smooth = ~(singular | non_smooth.any(axis=(-2, -1)))
        allowed = BARS * found.bar + sizes.differences
        failures += _worst(claim, names, finite & ~non_smooth, value, found.best, allowed, "finite differences")
        sided = non_smooth if claim.sided else np.zeros_like(non_smooth)
        failures += _worst(claim, names, finite & ~sided, value, exact, sizes.exact, "complex step")
        undecided |= bool((finite & ~np.isfinite(exact) & ~np.isfinite(found.bar)).any())
        with np.errstate(all="ignore"):
            by_step = np.max((np.abs(found.ladder - value) / sizes.state)[:, smooth], axis=(1, 2, 3), initial=0.0)
        best, step, slope = _best(by_step) if smooth.any() else (None, None, None)
        report = replace(
            report,
            agreement=best,
            step=step,
            slope=slope,
            complex_step=_largest(exact - value, sizes, smooth),
            errors=tuple(by_step.tolist()),
        )
    if claim.second is not None:
        second = claim.second(engine, state)
        failures += _worst(claim, names, finite, value, second, sizes.exact, claim.second_name)
        report = replace(report, second=_largest(second - value, sizes, ~singular))
    verdict: Verdict = "FAILS" if failures else "undecided" if undecided else "agrees"
    return replace(report, verdict=verdict, remarks=remarks.texts, worst=failures[0] if failures else None)


def _not_numbers(
    claim: Claim,
    operations: NonSmoothOperations,
    state: Blocks,
    names: tuple[str, ...],
    finite: Array,
    remarks: Remarks,
) -> list[Disagreement]:
    """Return the states at which the closed form is not a number without a cause in the formulas; remark the others."""
    failures = []
    for k in np.flatnonzero(~finite.all(axis=(-2, -1))):
        found = operations.singular({name: array[k] for name, array in state.items()})
        for remark in found:
            remarks.add(names[k], "unbounded derivative", remark)
        if not found:
            entry = _named(claim, np.argwhere(~finite[k])[0])
            failures.append(
                Disagreement(names[k], entry, float("nan"), 0.0, "any other way a finite number", float("inf"))
            )
    return failures


def _worst(
    claim: Claim, names: tuple[str, ...], counted: Array, value: Array, expected: Array, allowed: Array, by: str
) -> list[Disagreement]:
    """Return the entry with the largest error relative to its tolerance, if one of those counted exceeds it."""
    with np.errstate(all="ignore"):
        off = np.where(counted & np.isfinite(expected), np.abs(expected - value) / allowed, 0.0)
    if not off.size or not np.max(off) > 1.0:
        return []
    at = np.unravel_index(int(np.argmax(off)), off.shape)
    bar = float(np.broadcast_to(allowed, off.shape)[at])
    return [Disagreement(names[int(at[0])], _named(claim, at[1:]), float(value[at]), float(expected[at]), by, bar)]


def _named(claim: Claim, place: object) -> str:
    row, column = (int(number) for number in np.asarray(place).tolist())
    of_row = claim.rows[row] if row < len(claim.rows) else f"row {row}"
    if not claim.columns:
        return of_row
    return f"{of_row} along {claim.columns[column]}"


def _largest(difference: Array, sizes: Sizes, chosen: Array) -> float | None:
    """Return the largest difference of the chosen states, relative to their sizes; None if none is finite."""
    relative = (np.abs(difference) / sizes.state)[chosen]
    known = relative[np.isfinite(relative)]
    return float(np.max(known)) if known.size else None


def _best(errors: Array) -> tuple[float | None, float | None, float | None]:
    """Return the smallest error, its step, and the slope of the errors at larger steps if they are no round-off."""
    if not np.isfinite(errors).any():
        return None, None, None
    least = int(np.nanargmin(errors))
    best = float(errors[least])
    with np.errstate(all="ignore"):
        logs = np.log10(errors)
    inner = [k for k in range(least) if np.isfinite(logs[k]) and 30.0 * best < errors[k] < 0.1]
    pairs = [k for k in inner if k + 1 in inner]
    across = [k for k in pairs if errors[k + 1] >= errors[k]]  # steps as large as these go over a bend
    slopes = [float(logs[k] - logs[k + 1]) / 0.5 for k in pairs if not across or k > across[-1]]
    return best, float(LADDER[least]), float(np.median(slopes)) if slopes else None
