"""Contacts between two moving bodies: power, partials, momentum, and values at the edges of the laws."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe
from eomgen.products.testing.demands import partials_error, power_error
from tests.contacts.pairs import BODIES, NORMAL, SHAPES, TANGENTIAL, contact, pair, scene_of, states_of
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.states import derivative, random_states, rotation_of

#: NumPy evaluates both branches of a choice.
pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")
#: Laws of slip, which need an axis.
OF_WHEELS = ("brush", "magic_formula")
CASES = [
    *(("sphere", law, "coulomb") for law in NORMAL),
    *(("disc" if law in OF_WHEELS else "sphere", "hunt_crossley", law) for law in TANGENTIAL),
    *((shape, "linear", "formula") for shape in SHAPES),
]
SLOW = pytest.mark.slow_except(
    "sphere-hunt_crossley-bristles", "torus on a surface-linear-formula", "cylinder-linear-formula"
)


@pytest.mark.slow
@SLOW
@pytest.mark.parametrize(("shape", "normal", "tangential"), CASES, ids=lambda text: text)
def test_power_and_partials_are_of_one_law(shape: str, normal: str, tangential: str, rng: np.random.Generator) -> None:
    scene = pair(shape, normal, tangential)
    states = states_of(scene, rng)
    assert power_error(scene, states) <= 1e-12 and partials_error(scene, states) <= 1e-12


@pytest.mark.parametrize("parent", ["base", "table"])
def test_forces_are_equal_and_opposite_at_one_point(parent: str, rng: np.random.Generator) -> None:
    """Without gravity, momentum and moment of momentum about the origin stay as they are; also if one body carries the
    other."""
    scene = pair("ellipsoid", "hunt_crossley", "viscous", parent=parent, gravity=[0, 0, 0])
    system = derive(scene, ["forward_dynamics", "force"])
    evaluate, states = tape_evaluator(system), states_of(scene, rng)
    if parent == "table":  # a force between table and ball does no work on their common motion
        force = evaluate("force", states)["Q"]
        assert np.abs(force[:, 6:]).max() > 1.0
        np.testing.assert_allclose(force[:, :6], 0.0, atol=1e-10)
        return
    states["a"] = evaluate("forward_dynamics", states)["vdot"]
    assert np.abs(states["a"]).max() > 1.0
    mass, inertia = np.array([3.0, 2.0]), np.array([[0.2, 0.3, 0.25], [0.128, 0.13, 0.12]])
    total, moment = np.zeros((4, 3)), np.zeros((4, 3))
    for k, offset in enumerate(([0.1, 0.0, 0.0], [0.0, 0.0, 0.0])):
        R, place = rotation_of(states["q"][:, 7 * k : 7 * k + 4]), states["q"][:, 7 * k + 4 : 7 * k + 7]
        w, v = states["v"][:, 6 * k : 6 * k + 3], states["v"][:, 6 * k + 3 : 6 * k + 6]
        wdot, vdot = states["a"][:, 6 * k : 6 * k + 3], states["a"][:, 6 * k + 3 : 6 * k + 6]
        s = np.array(offset)
        acceleration = vdot + np.cross(w, v) + np.cross(wdot, s) + np.cross(w, np.cross(w, s))
        force = mass[k] * np.einsum("kij,kj->ki", R, acceleration)
        turning = inertia[k] * wdot + np.cross(w, inertia[k] * w)
        total += force
        moment += np.einsum("kij,kj->ki", R, turning) + np.cross(place + np.einsum("kij,j->ki", R, s), force)
    np.testing.assert_allclose(total, 0.0, atol=1e-10)
    np.testing.assert_allclose(moment, 0.0, atol=1e-10)


def test_absolute_coordinates_have_the_same_forces(rng: np.random.Generator) -> None:
    scenes = [pair("torus", "linear", "formula", offset=0.0, coordinates=kind) for kind in ("joint", "absolute")]
    states = states_of(scenes[0], rng)
    joint, absolute = (tape_evaluator(derive(scene, ["force"]))("force", states)["Q"] for scene in scenes)
    assert np.abs(joint).max() > 10.0
    np.testing.assert_allclose(absolute, joint, rtol=1e-11, atol=1e-10)


@pytest.mark.slow
@pytest.mark.slow_except("bristles-hunt_crossley")
@pytest.mark.parametrize("normal", NORMAL)
@pytest.mark.parametrize("tangential", TANGENTIAL)
def test_partials_are_finite_in_the_air_at_the_onset_and_at_rest(
    normal: str, tangential: str, rng: np.random.Generator
) -> None:
    """First and second ones, also in an exponent that is tunable."""
    keys = f'{NORMAL[normal]}, exponent = "n"' if normal in ("hunt_crossley", "lankarani_nikravesh") else ""
    law = f'type = "{normal}", {keys}' if keys else normal
    base = '{ body = "base", axis = [0, 0, 1] }'
    text = f"""format = 1
name = "ball"
parameters = {{ n = {{ value = 1.5, tunable = true }} }}
bodies.ball = {{ mass = 2, inertia = [0.128, 0.13, 0.12] }}
joints.ball = {{ type = "free", parent = "base", child = "ball" }}
{contact("floor", base, 'body = "ball"', law, tangential, "disc" if tangential in OF_WHEELS else "sphere")}"""
    scene = scene_of(text)
    terms = ["residual", "partials", "parameter_partials", "second_partials"]
    system = derive(scene, [*terms, *(["internal_rate", "internal_partials"] if scene.states else [])])
    evaluate = tape_evaluator(system)
    heights = np.array([0.5, 0.4, 0.35, 0.39, 0.39])
    q = np.zeros((5, 7))
    q[:, 0], q[:, 6] = 1.0, heights
    v = np.zeros((5, 6))
    v[3] = rng.normal(size=6)
    sizes = {"a": 6, "u": 0, "z": len(scene.states)}
    state = {"q": q, "v": v, "t": np.zeros((5, 1)), "p": np.full((5, 1), 1.5)}
    state |= {name: np.zeros((5, size)) for name, size in sizes.items()}
    state["weights"] = rng.normal(size=(5, 6 + sizes["z"]))
    state["direction"] = rng.normal(size=(5, 40))
    for name in system.functions:
        if name != "base":
            for result, values in evaluate(name, state).items():
                assert np.isfinite(values).all(), (name, result)


def test_an_ellipsoid_of_equal_axes_is_a_sphere(rng: np.random.Generator) -> None:
    scenes = [pair(shape, "hertz", "coulomb") for shape in ("sphere", "round")]
    states = states_of(scenes[0], rng)
    sphere, ellipsoid = (tape_evaluator(derive(scene, ["force"]))("force", states)["Q"] for scene in scenes)
    np.testing.assert_allclose(ellipsoid, sphere, rtol=1e-12, atol=1e-10)


@pytest.mark.parametrize("shape", ["sphere", "torus on a surface", "ellipsoid", "point"])
def test_pictures_show_bodies_and_surfaces(shape: str) -> None:
    drawing = describe(pair(shape, "hertz", "")).drawing
    kinds = {"sphere": "sphere", "torus on a surface": "wheel", "ellipsoid": "ellipsoid"}
    assert [(item.body, item.kind) for item in drawing.shapes] == [("ball", kinds.get(shape))] * (shape != "point")
    assert [item.name for item in drawing.contact_surfaces] == ["floor"] * ("surface" in shape)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_rate_of_the_gap_is_its_derivative(shape: str, rng: np.random.Generator) -> None:
    outputs = {"seen": {"formula": ["gap.floor", "gap_rate.floor"]}}
    scene = pair(shape, "hertz", "", outputs=outputs)
    system = derive(scene, ["outputs"])
    evaluate, states = tape_evaluator(system), states_of(scene, rng)
    gap, rate = evaluate("outputs", states)["y"].T
    known = np.isfinite(gap)
    change = derivative(evaluate, system.factors, "outputs", states, {"q": states["v"]})["y"][:, 0]
    assert np.count_nonzero(known) >= 2 and np.ptp(gap[known]) > 1e-3
    np.testing.assert_allclose(change[known], rate[known], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("shape", ["cylinder", "hollow"])
def test_places_in_a_housing_are_where_geometry_has_them(shape: str, rng: np.random.Generator) -> None:
    names = ("gap", "contact_x", "contact_y", "contact_z", "slip_velocity_x", "slip_velocity_y")
    outputs = {"seen": {"formula": [f"{name}.floor" for name in names]}}
    scene = pair(shape, "hertz", "", outputs=outputs)
    states = states_of(scene, rng)
    found = tape_evaluator(derive(scene, ["outputs"]))("outputs", states)["y"]
    z = np.array([0.1, 0.2, 1.0]) / np.linalg.norm([0.1, 0.2, 1.0])
    x = np.array([1.0, 0.0, 0.0]) - z[0] * z
    frame = np.stack([x / np.linalg.norm(x), np.cross(z, x / np.linalg.norm(x)), z], axis=1)
    for k, (q, v) in enumerate(zip(states["q"], states["v"], strict=True)):
        turned = rotation_of(q[np.newaxis, :4])[0], rotation_of(q[np.newaxis, 7:11])[0]
        first, second = turned[0] @ [0.1, 0.2, -0.3] + q[4:7], turned[1] @ [0.1, 0.05, 0.02] + q[11:14]
        axes = turned[0] @ frame
        offset = second - first
        if shape == "cylinder":
            offset = offset - (offset @ axes[:, 2]) * axes[:, 2]
        outward = offset / np.linalg.norm(offset)
        point = second + (0.4 if shape == "cylinder" else 0.0) * outward
        moving = [
            turned[body] @ v[6 * body + 3 : 6 * body + 6]
            + np.cross(turned[body] @ v[6 * body : 6 * body + 3], point - q[7 * body + 4 : 7 * body + 7])
            for body in range(2)
        ]
        along = axes[:, 2] if shape == "cylinder" else np.cross(axes[:, 1], outward)
        along = along / np.linalg.norm(along)
        slip = [along @ (moving[1] - moving[0]), np.cross(along, outward) @ (moving[1] - moving[0])]
        expected = [0.001 - np.linalg.norm(offset), *(axes.T @ (point - first)), *slip]
        np.testing.assert_allclose(found[k], expected, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_hollow_sphere_pushes_inward_along_each_axis(axis: int) -> None:
    """Axes of slip do not exist on y of the first frame; the normal force does."""
    first = '{ body = "base", axis = [0, 0, 1], x_axis = [1, 0, 0] }'
    bodies = BODIES.format(parent="base", offset=0)
    entry = contact("floor", first, 'body = "ball"', 'type = "linear", stiffness = 1e4', "coulomb", "hollow")
    system = derive(scene_of(bodies + entry, gravity=[0, 0, 0]), ["force"])
    place = 0.003 * np.eye(3)[axis]
    state = {"q": np.array([[*[1.0, 0, 0, 0, 0, 0, 0], 1.0, 0, 0, 0, *place]]), "v": np.zeros((1, 12))}
    force = tape_evaluator(system)("force", state | {"t": np.zeros((1, 1))})["Q"][0, 9:]
    np.testing.assert_allclose(force, -20.0 * np.eye(3)[axis], atol=1e-12)


def test_the_linear_law_is_that_of_tyres(rng: np.random.Generator) -> None:
    law = "stiffness = 900, damping = 40, onset = 0.2"
    text = """format = 1
name = "wheel"
bodies.wheel = { mass = 5, inertia = [0.1, 0.18, 0.1] }
joints.wheel = { type = "free", parent = "base", child = "wheel" }
points.hub = { body = "wheel" }
tyres.tyre = { center = "hub", radius = 0.4, stiffness = 900, damping = 40, onset = 0.2 }
outputs.loads = { formula = ["load.tyre", "normal_force.floor"] }
"""
    scene = scene_of(
        text + contact("floor", '{ body = "base", axis = [0, 0, 1] }', 'body = "wheel"', f'type = "linear", {law}')
    )
    system = derive(scene, ["outputs"])
    states = random_states(system, 40, rng)
    states["q"][:, 6] = rng.uniform(-0.2, 0.6, 40)
    tyre, floor = tape_evaluator(system)("outputs", states)["y"].T
    assert 5 < np.count_nonzero(tyre) < 38
    np.testing.assert_allclose(floor, tyre, rtol=1e-13, atol=1e-12)
