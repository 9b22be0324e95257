"""Geometrically exact beams whose sections, elements and initial strains differ along the axis, against differential
equations and closed forms."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from eomgen.system.system import System
from tests.mechanics.checks import check_partials
from tests.mechanics.test_cosserat_beams import TERMS, logarithm, states_near
from tests.models.cosserat import ROLL_UP, beam_scene, pose_of_last, rest
from tests.oracles.beam_elements import element_to_second_order
from tests.oracles.evaluation import Array, tape_evaluator
from tests.oracles.states import derivative, rotation_of

PULL = {"force": ["30 * load", "-20 * load", "10 * load"]}
NAMES = ("torsion", "bending_z", "bending_y", "stretch", "shear_y", "shear_z")
LAYERS = np.diag([500.0, 600.0, 700.0, 1e4, 2e4, 3e4])
LAYERS[0, 4] = LAYERS[4, 0] = 300.0
#: A beam of two parts with other lengths of elements, the first of which tapers by a tunable parameter.
PARTS: dict[str, Any] = {
    "length": None,
    "elements": None,
    "pretwist": "0.2 * s",
    "damping": {name: 2.0 + number for number, name in enumerate(NAMES)},
    "parts": [
        {
            "length": 4.0,
            "elements": 3,
            "stiffness": {name: f"{ROLL_UP[name]} * (1 + 0.2 * load - 0.5 * s)" for name in NAMES},
            "prestrain": {"stretch": 0.01, "bending_y": "0.02 * s"},
            "curvature": [0.02, "0.1 * s", 0.0],
        },
        {"length": 3.0, "elements": 2, "stiffness_matrix": LAYERS.tolist(), "mass_per_length": "2 - s"},
    ],
}


def beam_of_parts(**changes: Any) -> System:
    scene = beam_scene(5, PULL, {**PARTS, **changes})
    scene["beams"]["rope"] = {key: value for key, value in scene["beams"]["rope"].items() if value is not None}
    scene["forces"]["tip"]["point"] = [7.0, 0.0, 0.0]
    scene["joints"]["clamp"]["type"] = "free"
    return derive(from_data(scene), TERMS)


def strains_at_start(system: System) -> list[Array]:
    poses = tape_evaluator(system)("poses", {"q": np.array(system.initial_q)})["pose"]
    order = [list(system.bodies).index(name) for name in ("rope", *(f"rope.{k}" for k in range(1, 6)))]
    return [logarithm(*pair) for pair in pairwise(poses[order])]


def test_the_potential_is_that_of_the_sections_of_each_element(rng: np.random.Generator) -> None:
    uniform = PARTS["parts"][0] | {"stiffness": {name: f"{ROLL_UP[name]} * (1 + 0.2 * load)" for name in NAMES}}
    system = beam_of_parts(parts=[uniform, PARTS["parts"][1]])  # sections that vary: tests/scene/test_varying_sections
    evaluate, state = tape_evaluator(system), states_near(system, rng)
    found, poses = evaluate("energy", state)["energy"][:, 1], evaluate("poses", state)["pose"]
    order = [list(system.bodies).index(name) for name in ("rope", *(f"rope.{k}" for k in range(1, 6)))]
    initial = strains_at_start(system)
    lengths, middles = [4 / 3] * 3 + [1.5] * 2, np.array([2 / 3, 2.0, 10 / 3]) / 7
    stiffness = [np.diag([ROLL_UP[name] for name in NAMES]) * 1.2] * 3 + [LAYERS] * 2
    prestrain = [np.array([0, 0, 0.02 * s, 0.01, 0, 0]) for s in middles] + [np.zeros(6)] * 2
    for energy, nodes in zip(found, poses[:, order], strict=True):
        strains = [
            (logarithm(*pair) - start) / length + before
            for pair, start, length, before in zip(pairwise(nodes), initial, lengths, prestrain, strict=True)
        ]
        elements = [
            element_to_second_order(C, np.eye(6), length, start / length)[0]
            for C, length, start in zip(stiffness, lengths, initial, strict=True)
        ]
        parts = zip(lengths, strains, elements, strict=True)
        assert energy == pytest.approx(sum(0.5 * length * e @ C @ e for length, e, C in parts), rel=1e-11)


@pytest.mark.slow
def test_forces_and_tangents_are_those_of_the_potential(rng: np.random.Generator) -> None:
    system = beam_of_parts()
    state = states_near(system, rng)
    check_partials(system, state)
    free = beam_of_parts(damping=None)
    evaluate, still = tape_evaluator(free), state | {"v": 0.0 * state["v"]}
    power = derivative(evaluate, free.factors, "energy", still, {"q": state["v"]})["energy"][:, 1]
    tip = derivative(evaluate, free.factors, "poses", still, {"q": state["v"]})["pose"]
    last = list(free.bodies).index("rope.5")
    work = tip[:, last, 4:] @ np.array([30.0, -20.0, 10.0])
    np.testing.assert_allclose(np.sum(evaluate("force", still)["Q"] * state["v"], axis=-1), work - power, rtol=1e-10)


def test_a_moment_between_equal_nodes_bends_what_is_before_it_to_a_circle() -> None:
    scene = beam_scene(4, {"torque": [0.0, 0.0, "150 * load"], "point": [3.7, 0.0, 0.0]})
    system = derive(from_data(scene), TERMS)
    angle, radius = 3.7 * 150.0 / 500.0, 500.0 / 150.0
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    place = np.array([radius * np.sin(angle), radius * (1.0 - np.cos(angle)), 0.0])
    np.testing.assert_allclose(pose_of_last(system, rest(system, 4))[4:], place + 6.3 * along, atol=1e-9)


def frame_at_end(curvature: Any, length: float) -> tuple[Array, Array]:
    """Return axes and place of the last section of a beam of given curvature, by its differential equations."""

    def slopes(x: float, y: Array) -> Array:
        a, b, c = curvature(x)
        R = y[3:].reshape(3, 3)
        return np.concatenate([R[:, 0], (R @ np.array([[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]])).ravel()])

    start = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    last = solve_ivp(slopes, (0.0, length), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    return last[3:].reshape(3, 3), last[:3]


def last_at_start(shape: dict[str, Any]) -> Array:
    scene = beam_scene(6, {}, shape)
    scene["beams"]["rope"] = {key: value for key, value in scene["beams"]["rope"].items() if value is not None}
    del scene["forces"]
    system = derive(from_data(scene), ("poses",))
    return pose_of_last(system, np.array(system.initial_q))


def test_nodes_lie_on_a_shape_of_varying_curvature() -> None:
    last = last_at_start({"curvature": ["0.1 * s", "0.3 * (1 - s)", "0.05 + 0.2 * s**2"]})
    axes, place = frame_at_end(lambda x: (0.01 * x, 0.3 - 0.03 * x, 0.05 + 0.002 * x * x), 10.0)
    np.testing.assert_allclose(last[4:], place, atol=1e-7)
    np.testing.assert_allclose(rotation_of(last[:4]), axes, atol=1e-7)


def test_pretwist_turns_the_sections_about_the_axis_and_leaves_that_where_it_is() -> None:
    plain, turned = (
        last_at_start({"curvature": [0.0, 0.0, 0.1]}),
        last_at_start({"curvature": [0.0, 0.0, 0.1], "pretwist": "0.7 * s**2"}),
    )
    np.testing.assert_allclose(turned[4:], plain[4:], atol=1e-13)
    expected = rotation_of(plain[:4]) @ Rotation.from_euler("x", 0.7).as_matrix()
    np.testing.assert_allclose(rotation_of(turned[:4]), expected, atol=1e-13)
