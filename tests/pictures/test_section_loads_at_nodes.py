"""Section loads at nodes and clamps: second order or exact, against statics by hand, integrals of loads, reactions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from tests.models.cosserat import ROLL_UP, beam_scene, rest
from tests.oracles.evaluation import Array, tape_evaluator

LENGTH = 10.0
#: So stiff that shapes stay straight to eight digits.
STIFF = {name: 1e7 * value for name, value in ROLL_UP.items()}
NONE = {"force": [0.0, 0.0, 0.0]}


def forces_at_rest(elements: int, load: dict[str, Any], tip: dict[str, Any] = NONE, gravity: float = 0.0) -> Array:
    """Return the section forces at both ends of each element of a cantilever at rest, (elements, 2, 3)."""
    scene = beam_scene(elements, tip, {"stiffness": STIFF})
    scene |= {"gravity": [0.0, 0.0, -gravity], "distributed_loads": {"snow": {"beam": "rope", **load}}}
    system = derive(from_data(scene), ("section_loads", "residual", "partials"))
    state = {"q": rest(system, 1), "p": np.ones(1)} | {block: np.zeros(system.nv) for block in "va"}
    found = tape_evaluator(system)("section_loads", state)
    ends, halves = found["load_at_ends"], found["load_on_halves"]
    return np.stack([ends[:, 0] + halves[:, 0], ends[:, 1] - halves[:, 1]], axis=1)[..., 3:]


@pytest.mark.parametrize("elements", [1, 4])
def test_shear_of_a_cantilever_is_exact_at_all_nodes(elements: int) -> None:
    """(q + mass per length times g)(l - x) for constant loads; the integral of a polynomial beyond x."""
    x = np.linspace(0.0, 1.0, elements + 1)
    forces = forces_at_rest(elements, {"force": [0.0, 0.0, -2.0]}, gravity=9.81)[..., 2]
    exact = -(2.0 + 9.81) * LENGTH * (1.0 - x)
    np.testing.assert_allclose(forces, np.stack([exact[:-1], exact[1:]], axis=1), atol=1e-5)
    forces = forces_at_rest(elements, {"force": [0.0, 3.0, 0.0], "profile": [1.0, -2.0, 5.0]})[..., 1]
    beyond = 3.0 * LENGTH * np.polynomial.Polynomial([1.0, -2.0, 5.0]).integ()
    exact = beyond(1.0) - beyond(x)
    np.testing.assert_allclose(forces, np.stack([exact[:-1], exact[1:]], axis=1), atol=1e-5)


@pytest.mark.slow
def test_shear_under_a_load_by_formula_is_of_second_order() -> None:
    """Errors at the clamp and in the middle against the integral of 4 sin(3 s) beyond, on a fine grid."""
    s = np.linspace(0.0, 1.0, 20001)
    q = 4.0 * np.sin(3.0 * s)
    whole = LENGTH * np.concatenate([[0.0], np.cumsum(0.5 * (q[1:] + q[:-1]) * np.diff(s))])
    errors = []
    for elements in (2, 4, 8):
        forces = forces_at_rest(elements, {"force": [0.0, 0.0, "4 * sin(3 * s)"]})[..., 2]
        at = forces[0, 0], forces[elements // 2, 0], forces[elements // 2 - 1, 1]
        errors.append(np.abs(np.array(at) - (whole[-1] - whole[[0, 10000, 10000]])))
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(np.abs(orders - 2.0) < 0.15), orders


def test_a_point_load_at_an_inner_node_is_a_jump_with_both_sides_right() -> None:
    """A load of 7 N at 5 m beside 1 N/m: 15 N and 12 N before it, 5 N behind it."""
    forces = forces_at_rest(4, {"force": [0.0, 0.0, 1.0]}, {"force": [0.0, 0.0, 7.0], "point": [5.0, 0.0, 0.0]})[..., 2]
    np.testing.assert_allclose(forces.ravel(), [17.0, 14.5, 14.5, 12.0, 5.0, 2.5, 2.5, 0.0], atol=1e-5)


@pytest.mark.parametrize("x", [0.0, 1.0, 2.5, 6.0, LENGTH])
def test_outputs_of_a_section_are_the_statics_of_the_part_beyond(x: float) -> None:
    """A straight beam under a force F and a moment T at the end: T + (l - x) e_x x F, F, and both over the stiffness
    in the middle of the element."""
    force, moment = np.array([5.0, -3.0, 7.0]), np.array([2.0, 11.0, -13.0])
    kinds = ("section_moment", "section_force", "section_curvature", "section_strain")
    scene = beam_scene(4, {"force": [*force], "torque": [*moment]}, {"stiffness": STIFF})
    scene["outputs"] = {kind: {kind: "rope", "at": x} for kind in kinds}
    system = derive(from_data(scene), ("outputs", "residual", "partials"))
    state = {"q": rest(system, 1), "p": np.ones(1)} | {block: np.zeros(system.nv) for block in "va"}
    given = tape_evaluator(system)("outputs", state)["y"].reshape(4, 3)
    arm = np.array([LENGTH, 0.0, 0.0])
    middle = 2.5 * (min(x // 2.5, 3.0) + 0.5)
    turning, straining = (
        np.array([STIFF[name] for name in names])
        for names in (("torsion", "bending_y", "bending_z"), ("stretch", "shear_y", "shear_z"))
    )
    curvature = (moment + np.cross((1.0 - middle / LENGTH) * arm, force)) / turning
    np.testing.assert_allclose(given[0], moment + np.cross((1.0 - x / LENGTH) * arm, force), atol=1e-4)
    np.testing.assert_allclose(given[1], force, atol=1e-4)
    np.testing.assert_allclose(given[2], curvature, rtol=1e-4)
    np.testing.assert_allclose(given[3], force / straining, rtol=1e-4)


def spinning(model: str) -> dict[str, Any]:
    """Return a beam on a hinge, with weight, damping by its own speed and outputs of its first section."""
    stiffness = {name: value for name, value in ROLL_UP.items() if model == "cosserat" or "shear" not in name}
    if model == "inextensible":
        del stiffness["stretch"]
    scene = beam_scene(
        3,
        NONE,
        {"model": model, "stiffness": stiffness, "center_of_mass": [0.05, -0.02], "stiffness_damping": 1e-3},
        type="revolute",
        axis=[0.0, 1.0, 0.0],
    )
    return scene | {
        "gravity": [0.0, 0.0, -9.81],
        "distributed_loads": {"drag": {"beam": "rope", "force": ["-0.2 * velocity.here[0]", 0.0, "-0.1 * s"]}},
        "outputs": {
            "force": {"section_force": "rope", "at": 0.0},
            "moment": {"section_moment": "rope", "at": 0.0},
            "reaction_force": {"reaction_force": "clamp"},
            "reaction_moment": {"reaction_moment": "clamp"},
        },
    }


@pytest.mark.long
@pytest.mark.parametrize("model", ["cosserat", "inextensible"])
def test_in_motion_a_joint_transmits_the_loads_of_the_first_section(model: str) -> None:
    """Outputs in C: the joint's reaction holds the node's half of the element's mass, load and weight."""
    solution = eomgen.build(spinning(model), profile="quick").simulate(0.4, 2e-3, error_estimate=False)
    outputs = solution.outputs
    cosine, sine = np.cos(solution.q[:, 0]), np.sin(solution.q[:, 0])  # reactions are in axes of the base
    for name in ("force", "moment"):
        x, y, z = -outputs[f"reaction_{name}"].T
        transmitted = np.stack([cosine * x - sine * z, y, sine * x + cosine * z], axis=1)
        np.testing.assert_allclose(outputs[name], transmitted, atol=1e-9 * np.abs(transmitted).max())
        np.testing.assert_allclose(outputs[name], solution.section_loads["rope"].at(0.0)[name == "force"], atol=1e-9)
    assert np.abs(outputs["force"]).max() > 10.0


@pytest.mark.long
def test_a_spinning_beam_bears_its_centrifugal_force() -> None:
    """Mass per length times omega^2 (l^2 - x^2) / 2 at all nodes of a beam that does not stretch."""
    scene = spinning("inextensible") | {"gravity": [0.0, 0.0, 0.0], "distributed_loads": {}, "outputs": {}}
    del scene["beams"]["rope"]["center_of_mass"]
    model = eomgen.build(scene, profile="quick")
    speed, x = 3.0, np.linspace(0.0, LENGTH, 4)
    v = np.concatenate([[speed], *([0.0, speed, 0.0, 0.0, 0.0, -speed * place] for place in x[1:])])
    loads = model.section_loads(model.initial_q, v)["rope"]
    exact = 0.5 * speed**2 * (LENGTH**2 - x**2)
    np.testing.assert_allclose(
        loads.force_at_ends[..., 0], np.stack([exact[:-1], exact[1:]], axis=1), rtol=1e-9, atol=1e-7
    )


@pytest.mark.long
def test_beams_without_shear_tell_curvature_and_loads_by_positions_alone() -> None:
    scene = spinning("inextensible")
    scene["joints"]["clamp"] = {"type": "fixed", "parent": "base", "child": "rope"}
    model = eomgen.build(scene, profile="quick")
    found = model.equilibrium()
    loads = model.section_loads(found.q)["rope"]
    np.testing.assert_allclose(loads.moment[:, 1], 500.0 * loads.curvature[:, 1], rtol=1e-9)
    given = model.section_loads(found.q, multipliers=found.multipliers, a=np.zeros(model.nv))["rope"]
    np.testing.assert_allclose(loads.force_at_ends, given.force_at_ends, atol=1e-4)
    assert np.abs(given.force_at_ends[0, 0]).max() > 50.0
