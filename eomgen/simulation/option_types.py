"""Keyword options that studies hand on to runs, for type checkers and editors; ``simulate`` documents them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypedDict

from eomgen.compiled.terms import Parameters
from eomgen.simulation.stepping.controllers import Controller
from eomgen.simulation.stepping.inputs import LawOverTime, Signal

__all__ = ["EnsembleOptions", "LawOverTime", "SensitivityOptions"]

#: Names of the options of runs in other tools, and their names here.
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


class _RunOptions(TypedDict, total=False):
    method: str | None
    rho_inf: float | None
    alpha: float | None
    beta: float | None
    gamma: float | None
    initial: Mapping[str, Any] | None
    parameters: Parameters
    inputs: Mapping[str, Signal] | None
    record_every: int | None
    settings: Mapping[str, float] | None


class EnsembleOptions(_RunOptions, total=False):
    """Keyword options of ``Model.simulate_many`` that are passed on unchanged to ``simulate``, for type checkers."""

    order: int | None
    tolerance: float | None
    controllers: Mapping[str, Controller] | None
    t_start: float | str
    start: str | None


class SensitivityOptions(_RunOptions, total=False):
    """Keyword options of ``random_vibration`` that are passed on unchanged to ``Model.sensitivities``, for type
    checkers."""

    t_start: float
