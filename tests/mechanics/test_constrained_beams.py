"""Beams without shear or stretch: their rows against SciPy's logarithms, all that follows from them against complex
steps."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.target import generate_files
from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from eomgen.system.system import System
from tests.mechanics.checks import check_partials
from tests.mechanics.test_cosserat_beams import logarithm, states_near
from tests.models.cosserat import ROLL_UP, beam_scene
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.states import derivative, jacobian

pytestmark = pytest.mark.slow

TERMS = (
    "residual", "partials", "poses", "energy", "constraint", "constraint_velocity", "constraint_jacobian",
    "constraint_bias", "velocity_partials",
)  # fmt: skip  # a table
WITHOUT = {"kirchhoff": ("shear_y", "shear_z"), "inextensible": ("stretch", "shear_y", "shear_z")}
CASES = [("kirchhoff", 1, "free"), ("kirchhoff", 3, "revolute"), ("inextensible", 3, "fixed")]
PLACES = {"kirchhoff": [4, 5], "inextensible": [3, 4, 5]}


def section_of(model: str) -> dict[str, Any]:
    """Return the keys of a beam of a model, with the stiffness of the strains that it has."""
    stiffness = {strain: value for strain, value in ROLL_UP.items() if strain not in WITHOUT[model]}
    return {"model": model, "stiffness": stiffness}


def check_logarithms(model: str, rows: Array, poses: Array, at_rest: Array) -> None:
    """Compare constraints with the logarithms of the poses of neighbouring nodes."""
    for found, nodes in zip(rows, poses, strict=True):
        gaps = [(logarithm(*pair) - at_rest)[PLACES[model]] for pair in pairwise(nodes)]
        np.testing.assert_allclose(found, np.ravel(gaps), atol=1e-11)


def constrained_beam(model: str, elements: int, joint: str, **beam: Any) -> System:
    own = {**section_of(model), "curvature": [0.02, -0.1, 0.05], "damping": {"bending_y": 5.0}}
    scene = beam_scene(elements, {"force": ["30 * load", "-20 * load", "10 * load"]}, {**own, **beam})
    scene["joints"]["clamp"] |= {"type": joint, **({"axis": [0.0, 0.6, 0.8]} if joint == "revolute" else {})}
    return derive(from_data(scene), TERMS)


def states(system: System, rng: np.random.Generator) -> dict[str, Array]:
    return states_near(system, rng) | {"lam": 100.0 * rng.normal(size=(6, len(system.multipliers)))}


@pytest.mark.parametrize(("model", "elements", "joint"), CASES)
def test_rows_are_the_logarithms_of_relative_poses(
    model: str, elements: int, joint: str, rng: np.random.Generator
) -> None:
    system = constrained_beam(model, elements, joint)
    evaluate, state = tape_evaluator(system), states(system, rng)
    found, poses = evaluate("constraint", state)["Phi"], evaluate("poses", state)["pose"]
    at_rest = 10.0 / elements * np.array([0.02, -0.1, 0.05, 1.0, 0.0, 0.0])
    order = [list(system.bodies).index(name) for name in ("rope", *(f"rope.{k}" for k in range(1, elements + 1)))]
    check_logarithms(model, found, poses[:, order], at_rest)
    assert system.row_units == ("m",) * len(system.multipliers)
    still = evaluate("constraint", {**state, "q": np.array(system.initial_q)})["Phi"]
    np.testing.assert_allclose(still, 0.0, atol=1e-14)


@pytest.mark.parametrize(("model", "joint"), [("kirchhoff", "revolute"), ("inextensible", "free")])
def test_what_follows_from_the_rows_are_their_derivatives(model: str, joint: str, rng: np.random.Generator) -> None:
    system = constrained_beam(model, 3, joint)
    evaluate, state = tape_evaluator(system), states(system, rng)
    B = evaluate("constraint_jacobian", state)["B"]
    assert relative_error(B, jacobian(evaluate, system.factors, "constraint", "Phi", state, "q"), axes=2) < 1e-13
    rate = derivative(evaluate, system.factors, "constraint", state, {"q": state["v"]})["Phi"]
    assert relative_error(evaluate("constraint_velocity", state)["w"], rate) < 1e-12
    Z = jacobian(evaluate, system.factors, "constraint_velocity", "w", state, "q")
    assert relative_error(evaluate("velocity_partials", state)["Z"], Z, axes=2) < 1e-12
    along = derivative(evaluate, system.factors, "constraint_velocity", state, {"q": state["v"]})["w"]
    assert relative_error(evaluate("constraint_bias", state)["g"], along) < 1e-11
    loaded, free = (evaluate("residual", {**state, "lam": lam})["r"] for lam in (state["lam"], 0.0 * state["lam"]))
    assert relative_error(loaded - free, np.einsum("nij,ni->nj", B, state["lam"])) < 1e-12


@pytest.mark.parametrize(("model", "elements", "joint"), CASES)
def test_tangents_with_multipliers_are_exact(model: str, elements: int, joint: str, rng: np.random.Generator) -> None:
    system = constrained_beam(model, elements, joint)
    check_partials(system, states(system, rng))


@pytest.mark.parametrize("model", list(WITHOUT))
def test_long_beams_have_the_nonzeros_of_the_same_partials(model: str, rng: np.random.Generator) -> None:
    data = beam_scene(12, {"force": [1.0, 0.0, 0.0]}, section_of(model), type="free")
    system = derive(from_data(data), ["iteration", "jacobian_values", *TERMS])
    state = {name: block[:2] for name, block in states(system, rng).items()}
    evaluate = tape_evaluator(system)
    sparse = evaluate("iteration", state)
    assert np.array_equal(evaluate("jacobian_values", state)["B"], sparse["B"])
    whole = evaluate("partials", state)
    whole |= {"B": evaluate("constraint_jacobian", state)["B"], "Z": evaluate("velocity_partials", state)["Z"]}
    assert set(sparse) == set(whole)
    for name, values in sparse.items():
        rows, columns = np.transpose(system.patterns[name])
        filled = np.zeros_like(whole[name])
        filled[:, rows, columns] = values
        assert relative_error(filled, whole[name], axes=2) < 1e-13, name
    nodes = np.abs(np.subtract(*np.transpose(system.patterns["K"]) // 6))
    assert np.max(nodes) == 1


def test_loops_over_elements_need_no_workspace() -> None:
    """Kernels of the accelerations' partials repeat themselves so often that they would become loops in loops."""
    data = beam_scene(3, {"force": [1.0, 0.0, 0.0]}, section_of("inextensible"))
    system = derive(from_data(data), ["acceleration_partials"])
    files = generate_files(to_program(system))
    text = "".join(files[name] for name in sorted(files) if name.startswith("exact_beam") and name.endswith(".c"))
    bodies = re.findall(r"void exact_beam_loop\d+\((.*?)\n}\n", text, flags=re.DOTALL)
    assert bodies
    assert not [body for body in bodies if re.search(r"\bw\[", body)]
