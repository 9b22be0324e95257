"""The contract of a law in a file of a scene."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from eomgen.mechanics.derive import derive
from eomgen.products.testing.demands import check_c, demand
from eomgen.products.testing.evaluation import Array, relative_error, tape_evaluator
from eomgen.products.testing.states import jacobian, random_states
from eomgen.scene.scene import Scene


def check_law(
    scene: Scene,
    by_formulas: Scene,
    states: Mapping[str, Array] | None = None,
    *,
    values: float = 1e-12,
    partials: float = 1e-10,
) -> None:
    """Check a scene with laws in files against the same scene with formulas in place of these laws.

    Demands: residuals are equal; partials of the scene with laws agree with complex steps through the formulas, which
    are independent of the partials in the files; the generated C compiles without warnings. Values and partials of the
    C functions are checked for reads and writes beyond the arrays when the equations are derived.

    Parameters
    ----------
    scene, by_formulas : Scene
        The scenes, with the same coordinates, inputs and parameters in the same order.
    states : mapping, optional
        Blocks ``q``, ``v``, ``z``, ``t``, ... (n, size) of states at which the laws are defined; random ones if not
        given.
    values, partials : float
        Largest relative errors. Laws without partials have differences: 1e-7 for these.

    Raises
    ------
    ContractError
        Naming the scene, the demand, and the error.
    """
    terms = ["residual", "partials"]
    system, other = derive(scene, terms), derive(by_formulas, terms)
    evaluate, formulas = tape_evaluator(system), tape_evaluator(other)
    state = {**random_states(system, 4, np.random.default_rng(0)), **(states or {})}
    error = relative_error(evaluate("residual", state)["r"], formulas("residual", state)["r"])
    demand(error <= values, scene.name, f"residuals differ from the scene with formulas by {error:.2g}, relative")
    exact = evaluate("partials", state)
    for name, block in (("K", "q"), ("C", "v")):
        steps = jacobian(formulas, other.factors, "residual", "r", state, block)
        error = relative_error(exact[name], steps, 2)
        fault = f"partials {name} differ from complex steps through the formulas by {error:.2g}, relative"
        demand(error <= partials, scene.name, fault)
    check_c(scene)
