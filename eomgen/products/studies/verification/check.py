"""Check every closed form of a scene, as compiled, against differences, complex steps and second derivations.

The verdict on one closed form: its entries that differ by more than the error bounds of the reference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import count_of
from eomgen.base.calls import meant_term
from eomgen.base.data import replace
from eomgen.base.messages import nearest, shown
from eomgen.errors import Problem, UsageError
from eomgen.pipeline import documents, pipeline
from eomgen.products.studies.defaults import CHECK_SEED, CHECK_STATES
from eomgen.products.studies.verification.claims.beams import beam_claims, section_claims
from eomgen.products.studies.verification.claims.claim import Array, Claim, Engine, Space, compiled_engine, on_tape
from eomgen.products.studies.verification.claims.frames import body_claims, frame_claims
from eomgen.products.studies.verification.claims.linear_models import linear_claims, parameter_claims
from eomgen.products.studies.verification.claims.motion import motion_claims
from eomgen.products.studies.verification.claims.partials import (
    FIRST,
    argument_claims,
    constraint_claims,
    packed_claims,
    partial_claims,
    second_claims,
)
from eomgen.products.studies.verification.claims.rates import event_claims, rate_claims
from eomgen.products.studies.verification.differences import (
    BARS,
    LADDER,
    ClaimAtStates,
    EntrySizes,
    NonSmoothOperations,
    Remarks,
    between_sides,
    complex_steps,
    differences,
    non_smooth_entries,
    sizes_of,
    with_rounding_of_complex_steps,
)
from eomgen.products.studies.verification.report import CheckReport, Disagreement, FormReport, Verdict
from eomgen.products.studies.verification.states import CheckedStates, draw
from eomgen.system.system import System
from eomgen.system.terms import DIFFERENTIATED, TERMS
from eomgen.toolchain.profiles import STANDARD_PROFILE

if TYPE_CHECKING:
    from eomgen.pipeline.documents import Described
    from eomgen.system.system import System


def judge_claim(
    claim: Claim, engine: Engine, tape: Engine, system: System, states: CheckedStates, rng: np.random.Generator
) -> FormReport:
    """Return the report of a claim at states: verdict, largest errors of each comparison, and remarks.

    Compared are central differences and complex steps of the claim's source, and its second derivation. States outside
    the domain of the source are left out with a remark.

    Parameters
    ----------
    claim : the closed form
    engine, tape : the compiled functions, and functions that take complex numbers
    system : with the operations of the functions
    states : blocks and names of states
    rng : source of random changes for the condition
    """
    remarks, names, state = Remarks(), states.names, claim.at(engine, states.blocks) if states.names else {}
    report = FormReport(
        claim.name, claim.meaning, claim.family, "no state", second_name=claim.second.name if claim.second else ""
    )
    if claim.source is not None and names:
        inside = np.array(np.isfinite(claim.source(engine, state)).all(axis=-1))
        for k in np.flatnonzero(~inside):
            remarks.add(names[k], "not a number")
        state = {name: array[inside] for name, array in state.items()}
        names = tuple(names[k] for k in np.flatnonzero(inside))
    if not names:
        return replace(report, remarks=remarks.texts)
    at = ClaimAtStates(claim, engine, tape, state, names)
    base = ("base",) if "base" in system.functions else ()
    operations = NonSmoothOperations(system, (*claim.smooth_functions, *base))
    value = claim.value(engine, state)
    finite = np.array(np.isfinite(value))
    value = np.where(finite, value, 0.0)
    singular = np.array(~finite.all(axis=(-2, -1)))
    failures = _not_numbers(at, operations, finite, remarks)
    sizes = sizes_of(at, value, rng)
    undecided = bool(singular.all())
    if claim.source is not None:
        sizes = replace(sizes, of_laws=operations.step_of_laws())
        by_differences, exact = differences(at), complex_steps(at)
        non_smooth = non_smooth_entries(at, operations, value, finite, by_differences, sizes, remarks)
        smooth = ~(singular | non_smooth.any(axis=(-2, -1)))
        allowed = BARS * by_differences.bar + sizes.differences
        failures += _worst(at, finite & ~non_smooth, value, by_differences.best, allowed, "finite differences")
        sided = non_smooth if claim.sided else np.zeros_like(non_smooth)
        with np.errstate(all="ignore"):
            apart = finite & ~sided & (np.abs(exact - value) > sizes.exact)
            if apart.any():
                sizes = with_rounding_of_complex_steps(sizes, at, exact, rng)
                apart &= np.abs(exact - value) > sizes.exact
            smoothly = ~non_smooth & (np.abs(by_differences.best - value) <= allowed)
        if apart.any():
            between = between_sides(at, value, sizes) | smoothly
            sided |= _at_edges(at, apart & between, operations, remarks)
        smooth &= ~sided.any(axis=(-2, -1))
        failures += _worst(at, finite & ~sided, value, exact, sizes.exact, "complex step")
        undecided |= bool((finite & ~np.isfinite(exact) & ~np.isfinite(by_differences.bar)).any())
        with np.errstate(all="ignore"):
            by_step = np.max(
                (np.abs(by_differences.ladder - value) / sizes.state)[:, smooth], axis=(1, 2, 3), initial=0.0
            )
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
        unknown = finite & ~np.isfinite(second)
        failures += _not_numbers(at, operations, ~unknown, remarks, claim.second.name)
        undecided |= bool(unknown.any())
        failures += _worst(at, finite, value, second, sizes.exact, claim.second.name)
        report = replace(report, second=_largest(second - value, sizes, ~singular))
    verdict: Verdict = "FAILS" if failures else "undecided" if undecided else "agrees"
    return replace(report, verdict=verdict, remarks=remarks.texts, worst=failures[0] if failures else None)


def _at_edges(at: ClaimAtStates, apart: Array, operations: NonSmoothOperations, remarks: Remarks) -> Array:
    """Return the marked entries (S, R, C) at states on edges of formulas, as booleans; the formulas are remarked."""
    at_edges = np.zeros_like(apart)
    for k in np.flatnonzero(apart.any(axis=(-2, -1))):
        for remark, operation in operations.edges(at.one(k)):
            at_edges[k] = apart[k]
            remarks.add(at.names[k], remark, operation)
    return at_edges


def _not_numbers(
    at: ClaimAtStates, operations: NonSmoothOperations, finite: Array, remarks: Remarks, by: str = ""
) -> list[Disagreement]:
    """Return a disagreement for each state with entries that are not finite, unless a formula's derivative is
    unbounded. `finite` (S, R, C) is whether the closed form, or the second derivation ``by``, is a number. Unbounded
    derivatives are remarked instead."""
    failures = []
    for k in np.flatnonzero(~finite.all(axis=(-2, -1))):
        remarked, name = operations.singular(at.one(k)), at.names[k]
        for remark in remarked:
            remarks.add(name, "unbounded derivative", remark)
        if not remarked:
            entry = _entry_name(at.claim, np.argwhere(~finite[k])[0])
            text = f"{entry}: not a number by {by}, at {name}" if by else ""
            known = "any other way a finite number"
            failures.append(Disagreement(name, entry, float("nan"), 0.0, known, float("inf"), text))
    return failures


def _worst(
    at: ClaimAtStates, counted: Array, value: Array, expected: Array, allowed: Array, by: str
) -> list[Disagreement]:
    """Return a list with the entry of the largest error relative to its tolerance; empty if no error exceeds its
    tolerance. Arrays are (S, R, C): `counted` entries of `value` are compared with `expected`, `allowed` is the
    tolerance."""
    with np.errstate(all="ignore"):
        off = np.where(counted & np.isfinite(expected), np.abs(expected - value) / allowed, 0.0)
    if not off.size or not np.max(off) > 1.0:
        return []
    state, *entry = position = np.unravel_index(int(np.argmax(off)), off.shape)
    bar = float(np.broadcast_to(allowed, off.shape)[position])
    values = float(value[position]), float(expected[position])
    return [Disagreement(at.names[int(state)], _entry_name(at.claim, entry), *values, by, bar)]


def _entry_name(claim: Claim, position: object) -> str:
    row, column = (int(number) for number in np.asarray(position).tolist())
    of_row = claim.rows[row] if row < len(claim.rows) else f"row {row}"
    if not claim.columns:
        return of_row
    return f"{of_row} along {claim.columns[column]}"


def _largest(difference: Array, sizes: EntrySizes, chosen: Array) -> float | None:
    """Return the largest difference of the chosen states, relative to the sizes of the states; None if no difference is
    finite."""
    relative = (np.abs(difference) / sizes.state)[chosen]
    known = relative[np.isfinite(relative)]
    return float(np.max(known)) if known.size else None


def _best(errors: Array) -> tuple[float | None, float | None, float | None]:
    """Return the smallest of the errors by step, its step, and the order of the errors at larger steps. All are None
    without a finite error; the order is None if the larger errors are round-off or a bend."""
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


#: Velocity components beyond which whole matrices, which no stepper of long trees needs, are not built for the check
#: alone.
LARGE = 128
#: Largest number of velocity components for which the matrices of the closed form are built, with six rows for each
#: link, and derivatives in all arguments.
CLOSED = 8
#: Functions that together hold all formulas of a scene.
_OF_FORMULAS = ("residual", "internal_rate", "outputs", "base", "energy", "inputs", "events")
#: Rates of other orders are made like rates of the second.
_CHECKED = [term for name, term in TERMS.items() if not (term.source and name[-1].isdigit())]


def check(
    scene: Described,
    *,
    states: int = CHECK_STATES,
    seed: int = CHECK_SEED,
    only: Sequence[str] = (),
    profile: str = STANDARD_PROFILE,
    progress: Callable[[int, int, str], None] | None = None,
) -> CheckReport:
    """Check every closed form of a scene: separated terms, partials, constraints, bodies, energies.

    The compiled functions are held against central differences of other compiled functions over a ladder of steps,
    against complex steps on the tape, and against second derivations if there are any.

    Parameters
    ----------
    scene : str, Path, mapping, Scene or document
        Scene, or the document of another front end.
    states : int
        Number of states: half along a short simulated motion, half drawn around the motion; without states at which the
        equations are not finite.
    seed : int
        Of random draws.
    only : sequence of str
        Names of closed forms, or beginnings of names; all by default. Of scenes with more than 8 velocities,
        derivatives in all arguments and closed matrices are checked by their full names alone; of more than 128,
        neither these nor whole matrices are.
    profile : str
        Profile of the compiler, as of ``eomgen.build``.
    progress : callable
        Called with closed forms checked, all closed forms, and the name of the next one. Ctrl-C after the first closed
        form ends the check: the report has the closed forms so far, and the names of the rest.

    Returns
    -------
    CheckReport
        ``passed``, ``failures`` (undecided forms, and forms without a state, included), ``forms`` with one FormReport
        for each closed form, ``write(folder)``.

    Raises
    ------
    UsageError
        A number of states or a seed out of range, or an unknown closed form.
    DescriptionError, ModelError, ToolchainError, FileError
        As ``eomgen.build``.

    Examples
    --------
    >>> from eomgen.studies import check
    >>> check("examples/double_pendulum_on_shaking_base/scene.toml", states=2, only=["mass"], profile="quick").passed
    True
    """
    count_of("states", states)
    count_of("seed", seed, 0)
    described = documents.as_document(scene)[0]
    terms = _terms(described, only)
    system = pipeline.derive(described, terms)
    model = pipeline.build(described, terms, profile=profile, real="double")
    engine, tape = compiled_engine(model, system), on_tape(system)
    rng = np.random.default_rng(seed)
    result, space = draw(model, system, engine, states, rng)
    claims = _chosen(_claims(space), only)
    reports: list[FormReport] = []
    try:
        for claim in claims:
            if progress is not None:
                progress(len(reports), len(claims), claim.name)
            reports.append(judge_claim(claim, engine, tape, system, result, rng))
    except KeyboardInterrupt:
        if not reports:
            raise
    unchecked = tuple(claim.name for claim in claims[len(reports) :])
    corners = NonSmoothOperations(
        system, tuple(name for name in _OF_FORMULAS if name in system.functions)
    ).kinks_and_jumps()
    return CheckReport(model.name, result.names, seed, tuple(reports), result.notes, tuple(corners), unchecked)


def _terms(scene: Described, only: Sequence[str]) -> list[str]:
    """Return the terms to build for the check of a scene: all, but costly ones only if `only` names them. `only` are
    names, or beginnings of names, of closed forms."""
    size = pipeline.derive(scene, ["residual"]).nv
    left_out = _costly(size)
    if only:
        asked = {"rates" if name.startswith(("base_rates", "input_rates")) else name.partition(".")[0] for name in only}
        if any("second_partials".startswith(name) for name in asked):
            asked |= set(FIRST)
        for term in DIFFERENTIATED:  # one claim holds both
            both = {f"{term}_derivatives", f"{term}_hessian"}
            asked |= both if both & asked else set()
        if size <= LARGE:  # costly terms only by full name, not by the beginning of a name
            left_out = {term for term in left_out if not any(name.startswith(term) for name in asked)}
        requested = (term.name for term in _CHECKED if term.on_request)
        left_out |= {name for name in requested if not any(name.startswith(begin) for begin in asked)}
    return [term.name for term in _CHECKED if term.name not in left_out]


def _costly(size: int) -> set[str]:
    """Return the terms that are built only by name, of a scene with this number of velocities."""
    if size > LARGE:
        return {term.name for term in _CHECKED if term.on_request or term.quadratic}
    return {term.name for term in _CHECKED if size > CLOSED and ("rigid" in term.exists or term.differentiated)}


#: Claims by family.
_FAMILIES: Sequence[tuple[str, Callable[[Space], list[Claim]]]] = (
    ("separated terms and energies", motion_claims),
    ("partials", partial_claims),
    ("constraints", constraint_claims),
    ("partials", packed_claims),
    ("bodies", body_claims),
    ("frames", frame_claims),
    ("beams", beam_claims),
    ("bodies", section_claims),
    ("rates", rate_claims),
    ("linear model", linear_claims),
    ("parameters", parameter_claims),
    ("parameters", second_claims),
    ("partials", argument_claims),
    ("events", event_claims),
)


def _claims(space: Space) -> list[Claim]:
    return [replace(claim, family=family) for family, claims_of in _FAMILIES for claim in claims_of(space)]


def _chosen(claims: Sequence[Claim], only: Sequence[str]) -> list[Claim]:
    """Return the claims whose names begin with one of the names `only`, all without names. Raises UsageError for a name
    without a claim."""
    for name in only:
        if not any(claim.name.startswith(name) for claim in claims):
            known = [*(claim.name for claim in claims), *(term.name for term in _CHECKED)]
            raise UsageError(
                Problem(
                    "only",
                    f"no closed form of this scene is called {shown(name)} [E1132]",
                    meant if (meant := meant_term(name)) in known else nearest(name, known),
                )
            )
    return [claim for claim in claims if not only or any(claim.name.startswith(name) for name in only)]
