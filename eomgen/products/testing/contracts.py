"""Contract tests for authors of other distributions, public as ``eomgen.testing``.

Each function checks one thing that a distribution brings, raises ContractError with the demand that is not met, and
needs no framework of tests: authors call the functions from tests of any framework.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.integrators.families.register import method_named
from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe
from eomgen.mechanics.forces.applied import law_of
from eomgen.pipeline.pipeline import build
from eomgen.products.pictures.scenery import scenery
from eomgen.products.testing.demands import (
    PARTIALS,
    POWER,
    ContractError,
    check_c,
    compile_c,
    demand,
    partials_error,
    power_error,
)
from eomgen.products.testing.joint_types import check_joint_type
from eomgen.products.testing.states import Array, jacobian, random_states, relative_error, tape_evaluator
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.scene.sections import sections_for

__all__ = ["ContractError", "check_force_element", "check_integrator", "check_joint_type", "check_law"]


def check_force_element(scene: Scene, name: str, states: Mapping[str, Array] | None = None) -> None:
    """Check a force element in a scene.

    Demands: the law is the law of the element's class and gives the quantities that the section offers; the power that
    the law adds is the power of the forces (energy and power balance along the motion); partials agree with complex
    steps; builders have a method for the section; pictures show an element that is drawn; the generated C compiles
    without warnings.

    Parameters
    ----------
    scene : Scene
        With the element; power, partials and C are checked of the whole scene. Without constraints, a moving base and
        laws in files; internal states need ``z`` in ``states``.
    name : str
        Name of the element.
    states : mapping, optional
        Blocks ``q``, ``v``, ``t``, ... (n, size) of the states to look at; random ones if not given. With n above 1
        all blocks are needed, ``a``, ``u`` and ``p`` included.

    Raises
    ------
    ContractError
        Naming the element, the demand, and the error.
    ValueError
        ``z`` is missing, or the base moves.
    """
    named = [element for element in scene.elements if element.name == name]
    demand(bool(named), name, f"the scene {scene.name} has no such element")
    element = named[0]
    check_law_of_element(element)
    error = power_error(scene, states)
    demand(error <= POWER, name, f"the power of the law differs from the rate of energy by {error:.2g}, relative")
    error = partials_error(scene, states)
    demand(error <= PARTIALS, name, f"partials of the residual differ from complex steps by {error:.2g}, relative")
    derive(scene, ["outputs"])
    shown = scenery(describe(scene), {})
    drawn = {item["name"] for items in (shown["springs"], shown["tyres"]) for item in items}
    demand(
        (name in drawn) is (element.drawn() is not None),
        name,
        "pictures do not show the element as `drawn` of the class says",
    )
    check_c(scene)


def check_law_of_element(element: ForceElement) -> None:
    """Check that an element's class, section and law fit together: the law is of the class, both offer the same
    quantities, and builders have the section's method. Raises ContractError."""
    kind = type(element)
    row = next((row for row in sections_for([kind.section]) if row.key == kind.section), None)
    if not isinstance(row, ElementSection):
        raise ContractError(f"{kind.section}: there is no such section of force elements")
    law = law_of(kind)
    demand(law.model is kind, kind.section, f"the law is of {law.model.__name__}, not of {kind.__name__}")
    law_offers, offered = sorted(law.offers), sorted(row.offers)
    demand(law_offers == offered, kind.section, f"the law offers {law_offers}, and the section {offered}")
    method = row.method_name
    demand(callable(getattr(SceneBuilder("one"), method, None)), kind.section, f"builders have no method {method}")


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
        Blocks ``q``, ``v``, ``z``, ``t``, ... (n, size) of states at which the laws are defined; four random ones if
        not given, so n is 4 or 1 unless all blocks are given. ``z``, ``lam`` and ``base`` are never random: scenes with
        internal states, constraints or a moving base need these here.
    values, partials : float
        Largest relative errors. Laws without partials have differences: 1e-7 for these.

    Raises
    ------
    ContractError
        Naming the scene, the demand, and the error.
    UsageError
        A law in Python, which the generated C cannot have.
    ValueError
        ``z``, ``lam`` or ``base`` is missing.
    """
    terms = ["residual", "partials"]
    system, formula_system = derive(scene, terms), derive(by_formulas, terms)
    evaluate, formulas = tape_evaluator(system), tape_evaluator(formula_system)
    state = {**random_states(system, 4, np.random.default_rng(0)), **(states or {})}
    error = relative_error(evaluate("residual", state)["r"], formulas("residual", state)["r"])
    demand(error <= values, scene.name, f"residuals differ from the scene with formulas by {error:.2g}, relative")
    exact = evaluate("partials", state)
    for name, block in (("K", "q"), ("C", "v")):
        steps = jacobian(formulas, formula_system.factors, "residual", "r", state, block)
        error = relative_error(exact[name], steps, 2)
        fault = f"partials {name} differ from complex steps through the formulas by {error:.2g}, relative"
        demand(error <= partials, scene.name, fault)
    check_c(scene)


#: A double pendulum with a ball joint: coordinates that are numbers, and a quaternion.
_SCENE: dict[str, Any] = {
    "format": 1,
    "name": "contract",
    "bodies": {
        "upper": {"mass": 1.0, "center_of_mass": [0, 0, -0.3], "inertia": [0.02, 0.03, 0.01]},
        "lower": {"mass": 0.7, "center_of_mass": [0.1, 0, -0.2], "inertia": [0.01, 0.02, 0.015]},
    },
    "joints": {
        "shoulder": {
            **{"type": "revolute", "parent": "base", "child": "upper", "axis": [0, 1, 0]},
            "initial": {"position": 0.6, "velocity": 0.5},
        },
        "elbow": {
            **{"type": "spherical", "parent": "upper", "child": "lower", "position": [0, 0, -0.5]},
            "initial": {"velocity": [1.0, -0.4, 2.0]},
        },
    },
}
_SPAN, _STEP = 0.4, 2e-3


def check_integrator(method: str, order: float, /, **parameters: Any) -> None:
    """Check a method of integration on a double pendulum with a hinge and a ball joint.

    Demands: errors of v at 0.4 s fall with the order as steps are halved from 2 ms to 1 ms, against rk4 in steps of
    0.1 ms; a run in two parts by a checkpoint has the bits of one run; rows of the generated C, compiled alone without
    warnings, have the bits of a run.

    Parameters
    ----------
    method : str
        A name of the method, with fixed steps.
    order : float
        Order of convergence that is expected, within 0.2.
    **parameters : float
        Of the method, as for ``simulate``.

    Raises
    ------
    ContractError
        Naming the method and the demand; also a method that chooses its steps.
    UsageError
        There is no such method or parameter.
    """
    fixed = not method_named(method, **parameters).chooses_steps
    demand(fixed, method, "the method chooses its steps, and an order is measured with steps of one size")
    model = build(from_data(_SCENE), profile="reproducible")
    exact = model.simulate(_SPAN, 1e-4, method="rk4").v[-1]
    runs = [model.simulate(_SPAN, step, method=method, **parameters) for step in (_STEP, _STEP / 2.0)]
    for run in runs:
        demand(run.success, method, f"a run fails: {run.message}")
    errors = [float(np.abs(run.v[-1] - exact).max()) for run in runs]
    slope = float(np.log2(errors[0] / errors[1]))
    demand(abs(slope - order) <= 0.2, method, f"errors fall with order {slope:.2f}, and not {order:g}: {errors}")
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "half.ckpt"
        first = model.simulate(_SPAN / 2.0, _STEP, method=method, checkpoint=file, **parameters)
        whole = first.followed_by(model.resume(file, _SPAN))
        equal = np.array_equal(whole.q, runs[0].q) and np.array_equal(whole.v, runs[0].v)
        demand(equal, method, "a run that is resumed from a checkpoint differs from one run")
    _check_c(method, parameters)


def _check_c(method: str, parameters: dict[str, Any]) -> None:
    scene = from_data({**_SCENE, "simulation": {"method": method, "step": _STEP, **parameters}})
    with tempfile.TemporaryDirectory() as name:
        program = compile_c(scene, Path(name))
        printed = subprocess.run([str(program), "0.1"], capture_output=True, text=True, check=True).stdout
    rows = np.array([line.split(",") for line in printed.splitlines()[1:]], dtype=float)
    run = build(scene, profile="reproducible").simulate(0.1)
    size = run.q.shape[1]
    equal = len(rows) == len(run.q) and np.array_equal(rows[:, 1 : 1 + size], run.q)
    demand(equal, method, "rows of the generated C differ from the rows of a run")
