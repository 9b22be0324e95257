"""Check every closed form of a scene, as compiled, against differences, complex steps and second derivations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from eomgen.analysis.definiteness import inertia_warning
from eomgen.base.text import nearest, shown
from eomgen.errors import Problem, UsageError
from eomgen.pipeline import pipeline
from eomgen.products.studies.defaults import CHECK_SEED, CHECK_STATES
from eomgen.products.studies.verification.claims.beams import beam_claims
from eomgen.products.studies.verification.claims.bodies import body_claims
from eomgen.products.studies.verification.claims.claim import Claim, Space
from eomgen.products.studies.verification.claims.events import event_claims
from eomgen.products.studies.verification.claims.frames import frame_claims
from eomgen.products.studies.verification.claims.linear_models import linear_claims
from eomgen.products.studies.verification.claims.motion import motion_claims
from eomgen.products.studies.verification.claims.parameters import parameter_claims
from eomgen.products.studies.verification.claims.partials import constraint_claims, packed_claims, partial_claims
from eomgen.products.studies.verification.claims.rates import rate_claims
from eomgen.products.studies.verification.claims.second_partials import FIRST, second_claims
from eomgen.products.studies.verification.claims.sections import section_claims
from eomgen.products.studies.verification.engines import Engine, compiled, on_tape
from eomgen.products.studies.verification.form_report import FormReport
from eomgen.products.studies.verification.kinks import NonSmoothOperations
from eomgen.products.studies.verification.report import CheckReport
from eomgen.products.studies.verification.states import States, draw
from eomgen.products.studies.verification.verdict import judged
from eomgen.system.terms import TERMS, meant_term
from eomgen.toolchain.profiles import STANDARD_PROFILE

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model
    from eomgen.pipeline.pipeline import Described
    from eomgen.system.system import System

#: Velocity components beyond which whole matrices, which no stepper of long trees needs, are not built for the check
#: alone.
LARGE = 128
#: Velocity components up to which the matrices of the closed form are built: they have six rows for each link.
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
) -> CheckReport:
    """Check every closed form of a scene: separated terms, partials, constraints, bodies, energies.

    The compiled functions are held against central differences of other compiled functions over a ladder of steps,
    against complex steps on the tape, and against second derivations if there are any.

    Parameters
    ----------
    states : int
        Number of states: half of them along a short simulated motion, the others drawn around it.
    seed : int
        Of random draws.
    only : sequence of str
        Names of closed forms, or their beginnings; all by default.
    profile : str
        As of ``eomgen.build``.

    Returns
    -------
    CheckReport
        ``passed``, ``failures``, one FormReport for each closed form, ``write(folder)``.

    Raises
    ------
    UsageError
        A number of states or a seed out of range, or an unknown closed form.
    DescriptionError, ModelError, ToolchainError, FileError
        As ``eomgen.build``.
    """
    if states < 1:
        raise UsageError(Problem("states", f"a check needs at least one state, not {states}", f"{CHECK_STATES}"))
    if seed < 0:
        raise UsageError(Problem("seed", f"the seed must not be negative, which {seed} is", f"{CHECK_SEED}"))
    described = pipeline.as_document(scene)[0]
    terms = _terms(described, only)
    system = pipeline.derive(described, terms)
    model = pipeline.build(described, terms, profile=profile, real="double")
    engine, tape = compiled(model, system), on_tape(system)
    rng = np.random.default_rng(seed)
    result, space = draw(model, engine, states, rng)
    claims = _chosen(_claims(space, engine, system, model), only)
    reports = tuple(_explained(judged(claim, engine, tape, system, result, rng), model, result) for claim in claims)
    corners = NonSmoothOperations(
        system, tuple(name for name in _OF_FORMULAS if name in system.functions)
    ).kinks_and_jumps()
    return CheckReport(model.name, result.names, seed, reports, result.notes, tuple(corners))


def _explained(report: FormReport, model: Model, found: States) -> FormReport:
    """Return the report of a claim, with a warning if the inertia matrix is not positive definite."""
    if report.name != "mass.M, definite" or report.worst is None:
        return report
    q = found.blocks["q"][found.names.index(report.worst.state)]
    inertia = inertia_warning(model, q, model.parameter_array(), where=f"at {report.worst.state}")
    if inertia is None:
        return report
    return replace(report, worst=replace(report.worst, explained=f"{inertia.text}; try: {inertia.hint}"))


def _terms(scene: Described, only: Sequence[str]) -> list[str]:
    """Return the terms to build: among terms that only a name brings in, the named ones."""
    size = pipeline.derive(scene, ["residual"]).nv
    if size > LARGE:
        left_out = {term.name for term in _CHECKED if term.on_request or term.quadratic}
    else:
        left_out = {term.name for term in _CHECKED if size > CLOSED and "rigid" in term.exists}
    if only:
        asked = {"rates" if name.startswith(("base_rates", "input_rates")) else name.partition(".")[0] for name in only}
        if any("second_partials".startswith(name) for name in asked):
            asked |= set(FIRST)
        if size <= LARGE:  # of costly terms only the ones named themselves, not ones that begin with a name
            left_out = {term for term in left_out if not any(name.startswith(term) for name in asked)}
        requested = (term.name for term in _CHECKED if term.on_request)
        left_out |= {name for name in requested if not any(name.startswith(begin) for begin in asked)}
    return [term.name for term in _CHECKED if term.name not in left_out]


def _claims(space: Space, engine: Engine, system: System, model: Model) -> list[Claim]:
    return [
        *motion_claims(space, engine, model.scene),
        *partial_claims(space, engine, system),
        *constraint_claims(space, engine),
        *packed_claims(space, engine, system),
        *body_claims(space, engine),
        *frame_claims(space, engine, system, model.scene),
        *beam_claims(space, engine, system, model.scene),
        *section_claims(space, engine, system, model.scene),
        *rate_claims(space, engine),
        *linear_claims(space, engine, system, model.description),
        *parameter_claims(space, engine, system, model.description),
        *second_claims(space, engine, system, model.description),
        *event_claims(space, engine, system),
    ]


def _chosen(claims: Sequence[Claim], only: Sequence[str]) -> list[Claim]:
    """Return the requested claims. Raises UsageError for an unknown name."""
    for name in only:
        if not any(claim.name.startswith(name) for claim in claims):
            known = [*(claim.name for claim in claims), *(term.name for term in _CHECKED)]
            raise UsageError(
                Problem(
                    "only",
                    f"no closed form of this scene is called {shown(name)}",
                    meant if (meant := meant_term(name)) in known else nearest(name, known),
                )
            )
    return [claim for claim in claims if not only or any(claim.name.startswith(name) for name in only)]
