"""Cause of the failure of a single step, and a remedy."""

from __future__ import annotations

from eomgen.analysis.definiteness import inertia_warning
from eomgen.base.arrays import Array
from eomgen.errors import Problem
from eomgen.integrators.samples import CONTROLLER_FAILED
from eomgen.simulation.judgement.diagnosis import advice, fast_joint, first_non_finite
from eomgen.simulation.judgement.failed_controller import failed_controller
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.stepper import Stepper


def failed_step(run: Run, stepper: Stepper, state: tuple[float, Array, Array, Array, Array], status: int) -> Problem:
    """Return the problem of the step from a state (t, q, v, a, z).

    Parameters
    ----------
    run : with the parameters and inputs of the step
    status : of the stepper
    """
    t, q, v, a, z = state
    if status == CONTROLLER_FAILED:
        failure = failed_controller(stepper)
        fault = f"the step from t = {t:.9g} s, of {stepper.step_size:.9g} s, failed: {failure.fault}"
        return Problem("", fault, failure.hint)
    model, p, step = run.model, run.parameters, stepper.step_size
    block, already, cause = first_non_finite(model, t, (q, v, a, z), step, p, run.signals)
    inertia = None if block else inertia_warning(model, q, p, q, step)
    reason = inertia.text if inertia else fast_joint(model, t, q, v, p, step)
    details = f"; the first block that is not finite is {block}" if block else f"; {reason}" if reason else ""
    hint = inertia.hint if inertia else advice(run.method, status, {**run.settings, "step": step})
    if cause[0]:
        details, hint = details + cause[0], cause[1]
    elif already:
        hint = "other inputs, parameters or coordinates there: no smaller step helps"
    fault = f"the step from t = {t:.9g} s, of {step:.9g} s, failed: {stepper.status_text(status)}{details}"
    return Problem("", fault, hint)
