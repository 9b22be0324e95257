"""Rest of exact beams on a base that turns evenly: sparse load steps, with centrifugal and gyroscopic forces.

All velocities are relative to the base, so this is rest with one more load. No inertia matrix is inverted, which rotary
inertias far below the bending stiffness would make useless.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from eomgen.analysis.equilibrium_warnings import Measures
from eomgen.analysis.loaded_statics import loaded_statics
from eomgen.analysis.steady_motion import SteadyMotion
from eomgen.base.arrays import Array
from eomgen.compiled.terms import Inputs
from eomgen.errors import NumericalError, Problem
from eomgen.solvers.bordered_newton import Rest, sparse
from eomgen.solvers.equilibrium_path import PathEndError, StepLimits
from eomgen.solvers.load_steps import by_load_steps
from eomgen.solvers.tangent_stiffness import compliance

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Fractions of a turn of the base for the check of constant forces, and the largest displacement of the rest by changed
#: forces, in rad or scene lengths.
_LATER, _STEADY = (0.11, 0.37, 1.0, 2.6), 1e-7
#: Largest load steps.
_STEPS = StepLimits(factor=0.5)
#: Slices of a base's state: angular velocity and angular acceleration.
_TURNING, _CHANGING = slice(7, 10), slice(13, 16)
#: Largest angular acceleration of an evenly turning base, relative to the squared rate.
_EVEN = 1e-9


def turns_evenly(model: CompiledModel, p: Array, t: float) -> bool:
    """Return whether the base turns at t with a constant rate."""
    if "base" not in model.functions:
        return False
    base = model.base(t, parameters=p)
    rate = float(np.linalg.norm(base[_TURNING]))
    return rate > 0.0 and float(np.linalg.norm(base[_CHANGING])) <= _EVEN * rate**2


def rest_on_base(model: CompiledModel, q: Array, z: Array, p: Array, t: float, u: Inputs) -> SteadyMotion:
    """Return the rest relative to an evenly turning base, by load steps from q and z.

    Raises
    ------
    NumericalError
        Load steps do not lead to rest, the stiffness is singular, or forces change as the base turns; the message names
        the component.
    """
    base = model.base(t, parameters=p)
    still = np.zeros(model.nv)
    statics = loaded_statics(model, Measures(model, p, t, base), q, u, still)
    start = Rest(q, np.zeros(len(model.multipliers)), z, 1.0)
    try:
        rest, path, _ = by_load_steps(statics, start, _STEPS)
    except PathEndError as end:
        fault = f"no rest was found on the base, which turns: load steps end, for {end.why}"
        raise NumericalError(
            Problem("steady motion", fault, "an initial state nearer to it, or more elements")
        ) from None
    tangents = statics.tangents(rest)
    flexible = compliance(sparse(tangents.K), sparse(tangents.B))
    if flexible is None:
        fault = "nothing holds the scene on its base, for its stiffness is singular"
        raise NumericalError(Problem("steady motion", fault, "steady_motion with velocities"))
    rate = float(np.linalg.norm(base[_TURNING]))
    now = statics.balance(rest).residual
    for share in _LATER:
        seconds = share * 2.0 * np.pi / rate
        moved = flexible(_residual_later(model, rest, u, p, t + seconds) - now) / statics.sizes
        k = int(np.argmax(np.abs(moved)))
        if abs(moved[k]) > _STEADY:
            fault = (
                f"forces change as the base turns: at t = {t + seconds:.6g} s they would move"
                f" {model.v_names[k].removeprefix('v.')} by {abs(moved[k]):.3g} of a rad or of the scene's length"
            )
            hint = "gravity along the axis of the base, or none, and loads that turn with the base; or simulate"
            raise NumericalError(Problem("steady motion", fault, hint))
    message = f"at rest on the base, which turns at {rate:.6g} rad/s, after {len(path) - 1} load steps"
    return SteadyMotion(rest.q, still, rest.z, rest.multipliers, t, 0.0, len(path) - 1, (), (), message, None, still)


def _residual_later(model: CompiledModel, rest: Rest, u: Inputs, p: Array, later: float) -> Array:
    """Return the residual of the equilibrium equations at a rest, (nv,), at another time."""
    measures = Measures(model, p, later, model.base(later, parameters=p))
    then = loaded_statics(model, measures, rest.q, u, np.zeros(model.nv))
    return then.balance(rest).residual
