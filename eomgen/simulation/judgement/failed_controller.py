"""Failure of a controller's C function that ended a step, from the counts of the stepper, and a remedy."""

from __future__ import annotations

from typing import NamedTuple

from eomgen.integrators.samples import CONTROLLER_ADVICE, CONTROLLER_FAILED
from eomgen.simulation.stepping.stepper import Stepper


class Failure(NamedTuple):
    """Description of a failure of a function, and its remedy."""

    fault: str
    hint: str


def failed_controller(stepper: Stepper) -> Failure:
    """Return the failure of the last function: the code that it returned, or its number that is not finite.

    Functions of Python raise errors of their own; if none could be raised, only the text of the status is known.
    """
    told = stepper.statistics
    number = int(told.get("failed_controller", 0))
    if not number:
        return Failure(stepper.status_text(CONTROLLER_FAILED), CONTROLLER_ADVICE)
    row = stepper.layout["method"]["samples"]["controllers"][number - 1]
    of = f"the function {row['function']} of {row['source']}" if row["function"] else "the function"
    who = f"{of}, the controller {row['name']},"
    if code := int(told["controller_returned"]):
        return Failure(
            f"{who} returned {code}, and only 0 goes on", f"the reason for which it returns {code}, or return 0"
        )
    place = int(told["controller_not_finite"]) - 1
    behind = place - len(row["outputs"])
    which = f"memory[{behind}]" if behind >= 0 else f"values[{place}], {row['outputs'][place]},"
    given = ", ".join(f"signals[{k}] = {name}" for k, name in enumerate(row["signals"])) or "it has no signals"
    hint = f"a check of its divisions, roots and unset values; {given}"
    return Failure(f"{who} gave {which} a value that is not a finite number", hint)
