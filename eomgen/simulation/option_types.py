"""Keyword options of runs, as type checkers and editors know them; ``Model`` documents them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, TypedDict

from eomgen.compiled.terms import Parameters
from eomgen.progress import Progress
from eomgen.simulation.stepping.controllers import Controller
from eomgen.simulation.stepping.inputs import LawOverTime, Signal

__all__ = [
    "Continuation",
    "EnsembleOptions",
    "LawOverTime",
    "MethodOptions",
    "ResumeOptions",
    "RunOptions",
    "SensitivityOptions",
]

#: What others call options of runs, and their names here.
KNOWN_ELSEWHERE: Mapping[str, str] = {
    "u": "inputs",
    "t0": "t_start",
    "p": "parameters",
    **dict.fromkeys(("dt", "h"), "step"),
    **dict.fromkeys(("solver", "integrator"), "method"),
    **dict.fromkeys(("rtol", "atol", "tol", "eps"), "tolerance"),
    **dict.fromkeys(("max_iterations", "largest_step", "max_step"), "settings"),
    **dict.fromkeys(("q", "v", "z", "q0", "v0", "x0", "y0"), "initial"),
}


class MethodOptions(TypedDict, total=False):
    """Parameters of methods, settings of steppers, and where a motion starts."""

    rho_inf: float | None
    alpha: float | None
    beta: float | None
    gamma: float | None
    order: int | None
    tolerance: float | None
    inputs: Mapping[str, Signal] | None
    controllers: Mapping[str, Controller] | None
    t_start: float
    settings: Mapping[str, float] | None
    start: str | None


class Continuation(TypedDict, total=False):
    """Progress, checkpoints, and the estimate of the error."""

    progress: Progress | bool | None
    checkpoint: str | os.PathLike[str] | None
    checkpoint_every: int | None
    error_estimate: bool


class RunOptions(MethodOptions, Continuation, total=False):
    """Of ``Model.simulate``, besides the end and the step."""

    method: str | None
    initial: Mapping[str, Any] | None
    parameters: Parameters
    record_every: int | None


class EnsembleOptions(MethodOptions, total=False):
    """Of ``Model.simulate_many``, besides what varies."""

    method: str | None
    initial: Mapping[str, Any] | None
    parameters: Parameters
    record_every: int | None
    error_estimate: bool


class SensitivityOptions(TypedDict, total=False):
    """Of ``Model.sensitivities``, besides the end, the step and what is differentiated."""

    method: str | None
    rho_inf: float | None
    alpha: float | None
    beta: float | None
    gamma: float | None
    initial: Mapping[str, Any] | None
    parameters: Parameters
    inputs: Mapping[str, Signal] | None
    record_every: int | None
    t_start: float
    settings: Mapping[str, float] | None


class ResumeOptions(Continuation, total=False):
    """Of ``Model.resume``, besides the file and the end."""

    parameters: Parameters
    inputs: Mapping[str, Signal] | None
    controllers: Mapping[str, Controller] | None
