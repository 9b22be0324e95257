"""Caches know a scene by its data: one that was changed field by field is another."""

import operator
from dataclasses import replace

import numpy as np
import pytest

import eomgen
from eomgen.formula.nodes import Number
from eomgen.scene.scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return eomgen.load("examples/four_bar/scene.toml")


def test_a_scene_read_twice_has_one_digest(scene: Scene) -> None:
    assert eomgen.load("examples/four_bar/scene.toml").digest == scene.digest != b""


def test_rules_that_are_functions_of_c_are_part_of_a_digest() -> None:
    servo = eomgen.load("examples/pi_servo/scene.toml")  # a rule of its limits is operator.ge
    assert any(getattr(item.rule, "breaks", None) is operator.ge for item in servo.requirements)
    assert eomgen.load("examples/pi_servo/scene.toml").digest == servo.digest != b""


def test_every_field_that_equations_follow_from_changes_the_digest(scene: Scene) -> None:
    body = scene.bodies[0]
    changed = [
        replace(scene, gravity=(Number(0.0), Number(0.0), Number(np.nextafter(-9.81, 0.0)))),
        replace(scene, gravity=(Number(0.0), Number(-0.0), Number(-9.81))),
        replace(scene, bodies=(replace(body, mass=Number(3.0)), *scene.bodies[1:])),
        replace(scene, coordinates="absolute"),
        replace(scene, groups={"a": "SE3"}),
        replace(scene, outputs=()),
        replace(scene, constraints=()),
        replace(scene, name="other"),
        replace(scene, simulation=replace(scene.simulation, step=1e-7)),
    ]
    digests = {scene.digest, *(item.digest for item in changed)}
    assert len(digests) == 1 + len(changed)


def test_what_is_only_said_does_not(scene: Scene) -> None:
    assert replace(scene, notes=("a note",), source={}, description="text").digest == scene.digest


def test_a_replaced_scene_gets_a_model_of_its_own() -> None:
    scene = eomgen.load("examples/spherical_pendulum/scene.toml")
    first = eomgen.build(scene, terms=["mass"], profile="quick")
    body = replace(scene.bodies[0], mass=Number(17.0))
    second = eomgen.build(replace(scene, bodies=(body,)), terms=["mass"], profile="quick")
    q = first.neutral()
    assert not np.allclose(first.mass(q), second.mass(q))


def test_an_unknown_class_in_a_scene_is_no_silent_digest(scene: Scene) -> None:
    with pytest.raises(TypeError, match="a object in a scene has no digest"):
        _ = replace(scene, groups={"a": object()}).digest
