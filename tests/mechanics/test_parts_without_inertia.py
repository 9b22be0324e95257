"""Parts without mass and inertia, whose motion the constraints determine, against machines without these parts."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import DescriptionError
from eomgen.scene.load import load_toml

#: A boom on its pivot, and a jack between a foot on the ground and the boom.
BOOM = """format = 1
name = "{name}"
gravity = [0, 0, {gravity}]
parameters.unit = {{ value = {unit}, tunable = false }}
bodies.boom = {{ mass = "120 * unit", inertia = ["10 * unit", "60 * unit", "60 * unit"], center_of_mass = [1, 0, 0] }}
joints.pivot = {{ type = "revolute", parent = "base", child = "boom", axis = [0, 1, 0] }}
points.foot = {{ body = "base", position = [0.3, 0, -0.7] }}
points.head = {{ body = "boom", position = [0.8, 0, 0] }}
springs.oil = {{ first = "foot", second = "head", stiffness = "4e4 * unit", damping = "500 * unit", length = 0.9 }}
"""
#: The jack: cylinder and rod are free bodies without mass.
JACK = """
bodies.cylinder = {{ mass = {mass}, inertia = [{mass}, {mass}, {mass}] }}
bodies.rod = {{ mass = {mass}, inertia = [{mass}, {mass}, {mass}] }}
joints.of_cylinder = {{ type = "free", parent = "base", child = "cylinder", position = [0.3, 0, -0.7] }}
joints.of_rod = {{ type = "free", parent = "base", child = "rod", position = [0.8, 0, 0] }}
constraints.hinge = {{ type = "revolute", first = {{ body = "base", position = [0.3, 0, -0.7], axis = [0, 1, 0] }}, \
second = {{ body = "cylinder", axis = [0, 1, 0] }} }}
constraints.eye = {{ type = "revolute", first = {{ body = "boom", position = [0.8, 0, 0], axis = [0, 1, 0] }}, \
second = {{ body = "rod", axis = [0, 1, 0] }} }}
constraints.stroke = {{ type = "prismatic", {drive} first = {{ body = "cylinder", axis = [0, 0, 1], \
x_axis = [0, 1, 0] }}, second = {{ body = "rod", axis = [0, 0, 1], x_axis = [0, 1, 0] }} }}
"""


def built(text: str) -> Any:
    return eomgen.build(load_toml(text), profile="quick")


def boom(mass: str = "0", drive: str = "", **more: Any) -> str:
    given = {"name": "boom", "gravity": -9.81, "unit": 1.0} | more
    return BOOM.format(**given) + JACK.format(mass=mass, drive=f'drive = "{drive}", ' if drive else "")


@pytest.fixture(scope="module")
def passive() -> Any:
    return built(boom())


def along_the_jack(angle: Any) -> Any:
    """Return the vector from foot to head, (..., 2) in x and z, at angles of the boom."""
    head = 0.8 * np.stack([np.cos(angle), -np.sin(angle)], axis=-1)
    return head - [0.3, -0.7]


@pytest.mark.slow_cases("generalized_alpha")
@pytest.mark.parametrize("method", ["generalized_alpha", "rk45_partitioned"])
def test_a_jack_without_mass_follows_the_boom(passive: Any, method: str) -> None:
    """The boom moves as the boom alone, and the jack lies along the line between its ends."""
    run = passive.simulate(0.6, 2e-3, method=method, initial={"pivot": 0.1})
    assert run.success, run.message
    alone = built(BOOM.format(name="alone", gravity=-9.81, unit=1.0))
    exact = alone.simulate(0.6, 2e-3, method="rk4", initial={"pivot": run.q[0, 0]})
    tolerance = 1e-8 if method == "rk45_partitioned" else 3e-4
    np.testing.assert_allclose(run.q[:, 0], exact.q[:, 0], atol=tolerance)
    vector = along_the_jack(run.q[:, 0])
    np.testing.assert_allclose(passive.pose("rod", run.q)[:, [4, 6]], vector + np.array([0.3, -0.7]), atol=1e-9)
    axis = passive.pose("cylinder", run.q)[:, :4]
    tilt = 2.0 * np.arctan2(axis[:, 2], axis[:, 0])
    np.testing.assert_allclose(np.tan(tilt), vector[:, 0] / vector[:, 1], atol=1e-9)


#: A slider-crank; its connecting rod is a body on a pin of the crank, or the distance between its ends.
CRANK = """format = 1
name = "{name}"
bodies.crank = {{ mass = 2, inertia = [0.1, 0.1, 0.1], center_of_mass = [0.1, 0, 0] }}
bodies.slider = {{ mass = 3, inertia = [0.1, 0.1, 0.1] }}
joints.main = {{ type = "revolute", parent = "base", child = "crank", axis = [0, 1, 0], initial = {{ velocity = 5 }} }}
joints.rail = {{ type = "prismatic", parent = "base", child = "slider", axis = [1, 0, 0], position = [1, 0, 0] }}
"""
ROD = """
bodies.rod = {{ mass = {mass}, inertia = [{mass}, {mass}, {mass}] }}
joints.pin = {{ type = "revolute", parent = "crank", child = "rod", axis = [0, 1, 0], position = [0.3, 0, 0] }}
constraints.wrist = {{ type = "point_on_line", first = {{ body = "slider", axis = [0, 1, 0] }}, \
second = {{ body = "rod", position = [0.7, 0, 0] }} }}
"""
DISTANCE = """
constraints.rod = { type = "distance", length = 0.7, first = { body = "crank", position = [0.3, 0, 0] }, \
second = { body = "slider" } }
"""


@pytest.mark.parametrize(("mass", "step"), [(0.0, 1e-3), (1e-8, 1e-2), (1e-5, 1e-2)])
def test_a_light_rod_acts_as_a_distance(mass: float, step: float) -> None:
    """The default method takes the steps that the machine without the rod takes, halves none, and factors once a step:
    neither the multipliers of the last step nor old factors predict positions of parts that heavy ones move."""
    light = built(CRANK.format(name="light") + ROD.format(mass=mass))
    without = built(CRANK.format(name="without") + DISTANCE)
    run, other = (model.simulate(1.0, step, error_estimate=False) for model in (light, without))
    assert run.success and "halved" not in run.message, run.message
    assert run.stats["factorizations"] <= len(run.t)
    tolerance = 20.0 * mass + (1e-6 if step > 1e-3 else 1e-9)
    np.testing.assert_allclose(run.q[:, light.q_names.index("q.main")], other.q[:, 0], atol=tolerance)
    np.testing.assert_allclose(run.q[:, light.q_names.index("q.rail")], other.q[:, 1], atol=tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha_index3", "rattlie", "rosenbrock", "rk4_partitioned"])
def test_a_rod_without_mass_acts_as_a_distance(method: str) -> None:
    light = built(CRANK.format(name="light") + ROD.format(mass=0))
    without = built(CRANK.format(name="without") + DISTANCE)
    run, other = (model.simulate(1.0, 1e-3, method=method, error_estimate=False) for model in (light, without))
    assert run.success, run.message
    np.testing.assert_allclose(run.q[:, light.q_names.index("q.main")], other.q[:, 0], atol=1e-7)


@pytest.mark.slow
def test_light_jacks_do_not_make_partitioned_coordinates_singular() -> None:
    model = built(boom("1e-3", "0.86 + 0.15 * sin(3 * t)", name="driven"))
    run = model.simulate(1.0, 1e-2, method="rk4_partitioned", error_estimate=False)
    assert run.success and "singular" not in run.message, run.message


@pytest.mark.slow
def test_statics_and_linear_models_are_those_of_the_machine_without_the_jack(passive: Any) -> None:
    alone = built(BOOM.format(name="alone", gravity=-9.81, unit=1.0))
    rest, expected = passive.equilibrium(), alone.equilibrium()
    np.testing.assert_allclose(rest.q[0], expected.q[0], atol=1e-12)
    modes, exact = (model.linearize(at.q).modes().eigenvalues for model, at in ((passive, rest), (alone, expected)))
    np.testing.assert_allclose(np.sort_complex(modes), np.sort_complex(exact), rtol=1e-9)
    energy = passive.energy(rest.q, passive.consistent(rest.q, np.eye(13)[0]).v)["kinetic"]
    v = passive.consistent(rest.q, np.eye(13)[0]).v[0]
    np.testing.assert_allclose(energy, 0.5 * 180.0 * v**2, rtol=1e-12)
    steady = passive.steady_motion()
    np.testing.assert_allclose(steady.q[0], expected.q[0], atol=1e-9)


@pytest.mark.slow
def test_derivatives_of_runs_are_those_of_the_machine_without_the_jack() -> None:
    tunable = (
        'outputs.angle = { formula = "q.pivot" }\nparameters.load = { value = 120, unit = "kg", tunable = true }\n'
    )

    def with_load(text: str) -> Any:
        return built(text.replace('"120 * unit"', '"load"').replace('"4e4 * unit"', "4e4") + tunable)

    jack, alone = with_load(boom()), with_load(BOOM.format(name="alone", gravity=-9.81, unit=1.0))
    with_jack, without = (
        model.sensitivities(0.1, 1e-2, by=["load"], of=["angle"], method="generalized_alpha").outputs["angle"]
        for model in (jack, alone)
    )
    np.testing.assert_allclose(with_jack, without, rtol=1e-8, atol=1e-14)


@pytest.mark.parametrize(
    ("rod", "constraints", "named"),
    [
        ("mass = 0", ["low", "high"], "carries neither mass nor inertia"),  # it may turn about itself
        ("mass = 1", ["low", "high"], "lack mass, or inertia about some axis"),
        ("mass = 0", ["low"], "carries neither mass nor inertia"),
    ],
)
def test_a_motion_that_nothing_determines_is_refused(rod: str, constraints: list[str], named: str) -> None:
    rows = {
        "low": 'constraints.low = { type = "spherical", first = "foot", second = { body = "rod" } }\n',
        "high": 'constraints.high = { type = "point_on_line", first = { body = "rod", axis = [0, 0, 1] }, '
        'second = "head" }\n',
    }
    text = BOOM.format(name="loose", gravity=-9.81, unit=1.0)
    text += f"bodies.rod = {{ {rod} }}\n"
    text += 'joints.of_rod = { type = "free", parent = "base", child = "rod", position = [0.3, 0, -0.7] }\n'
    text += "".join(rows[name] for name in constraints)
    with pytest.raises(DescriptionError, match=re.escape(named)) as caught:
        built(text)
    (problem,) = caught.value.problems
    assert "joints.of_rod" in problem.where and "for the body rod" in problem.hint


def test_a_constraint_elsewhere_does_not_excuse_a_part() -> None:
    text = boom() + "bodies.loose = { mass = 0 }\n"
    text += 'joints.loose = { type = "revolute", parent = "boom", child = "loose", axis = [0, 1, 0] }\n'
    with pytest.raises(DescriptionError, match="the joint loose cannot be moved by a force"):
        built(text)


def test_a_free_spin_of_a_part_behind_another_one_is_refused_by_its_joint() -> None:
    text = (
        BOOM.format(name="spin", gravity=-9.81, unit=1.0)
        + "bodies.cylinder = { mass = 0 }\nbodies.rod = { mass = 0 }\n"
    )
    text += 'joints.ball = { type = "spherical", parent = "base", child = "cylinder", position = [0.3, 0, -0.7] }\n'
    text += 'joints.stroke = { type = "prismatic", parent = "cylinder", child = "rod", axis = [0, 0, 1] }\n'
    text += 'constraints.eye = { type = "spherical", first = "head", second = { body = "rod" } }\n'
    with pytest.raises(DescriptionError, match=r"joints\.ball: a motion of it moves neither mass") as caught:
        built(text)
    assert caught.value.problems[0].hint == "inertia of its parts, or a constraint that holds them"


def test_a_machine_of_parts_without_mass_alone_is_refused() -> None:
    with pytest.raises(DescriptionError, match="the joint pivot cannot be moved by a force"):
        built(re.sub(r'mass = "120 .*?], center', "mass = 0, center", boom()))
