"""The check, before a run of fixed steps, that they resolve its contacts."""

from __future__ import annotations

from typing import Any

from eomgen.base.limits import Limit
from eomgen.compiled.initial_state import InitialState
from eomgen.errors import EomgenError
from eomgen.results.finding import Finding
from eomgen.simulation.judgement.finished_run import Check, FinishedRun
from eomgen.simulation.stepping.run import Run
from eomgen.system.terms import NONZEROS

UNRESOLVED = Limit(1.0, "1", "step times angular frequency of an impact", "three steps to an impact")
GROWTH = Limit(0.1, "1", "growth of explicit steps in one radian of a contact's motion", "a factor of 2 in a period")
#: Larger scenes are left out: the time of the inertia grows with the cube.
_MOST_VELOCITIES = 500


def contacts_of(run: Run) -> list[Any]:
    """Return the contacts of a run of fixed steps."""
    model, contacts = run.model, run.model.description.parts.get("contacts", ())
    if not contacts or run.method.chooses_steps:
        return []
    of_inertia = "mass" in model.functions or NONZEROS["mass"] in model.functions
    terms = ("poses", "constraint_jacobian" if model.multipliers else "forward_dynamics")
    known = of_inertia and all(term in model.functions for term in terms)
    return [*contacts] if known and model.nv <= _MOST_VELOCITIES else []


def unresolved_contacts(run: Run, state: InitialState) -> list[Finding]:
    """Return a finding on contacts that the steps of a run do not resolve; none for states without accelerations."""
    if not (contacts := contacts_of(run)):
        return []
    from eomgen.products.contacts.closed_contacts import ClosedContacts  # noqa: PLC0415  # most runs have no contacts

    try:
        return [*ClosedContacts(run, state, contacts).findings(UNRESOLVED, GROWTH)]
    except (EomgenError, KeyError, ValueError):  # the gap, or the inertia, has no value there
        return []


def sentences(run: Run, state: InitialState) -> list[str]:
    """Return the finding of ``unresolved_contacts`` as a sentence for the notes of a start."""
    return [*map(str, unresolved_contacts(run, state))]


def _at_start(run: FinishedRun) -> list[Finding]:
    assert run.beginning is not None  # the check needs it
    return unresolved_contacts(run.run, run.beginning.state)


ROWS = (Check("contact_step [W0311]", _at_start, ("begun", "parts"), noted="start", limits=(UNRESOLVED, GROWTH)),)
