"""The small scenes of these tests, and their models, built once."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

import eomgen
from eomgen.base.arrays import Array

MASS, LENGTH, INERTIA, DAMPING, GRAVITY = 1.3, 0.5, 0.02, 0.05, 9.81
SHAKE, RATE = 0.05, 7.0

PENDULUM_TOML = f"""
format = 1
name = "shaken"
description = "pendulum on a shaking base"
gravity = [0, 0, -{GRAVITY}]

[parameters]
length = {{ value = {LENGTH}, unit = "m", tunable = true }}
shake = {{ value = {SHAKE}, unit = "m", tunable = true }}

[inputs.torque]
formula = "0.2*sin(3*t)"
unit = "N m"

[base]
position = ["shake*sin({RATE}*t)", 0, 0]

[bodies.link]
mass = {MASS}
center_of_mass = [0, 0, "-length"]
inertia = [0.025, {INERTIA}, 0.008]

[joints.hinge]
type = "revolute"
parent = "base"
child = "link"
axis = [0, 1, 0]
damping = {DAMPING}
initial = {{ position = [0.4], velocity = [0.1] }}

[efforts.motor]
joint = "hinge"
effort = "torque"

[points.tip]
body = "link"
position = [0, 0, "-2*length"]

[outputs.tip]
position = "tip"
unit = "m"

[outputs.angle]
formula = "q.hinge"
unit = "rad"

[simulation]
step = 1e-3
duration = 2.0
"""


def pendulum_scene() -> eomgen.Scene:
    """Return the scene of PENDULUM_TOML, made in Python."""
    builder = eomgen.SceneBuilder("shaken", description="pendulum on a shaking base", gravity=[0, 0, -GRAVITY])
    builder.parameter("length", LENGTH, tunable=True, unit="m").parameter("shake", SHAKE, tunable=True, unit="m")
    builder.input("torque", "0.2*sin(3*t)", unit="N m")
    builder.base(position=[f"shake*sin({RATE}*t)", 0, 0])
    builder.body("link", MASS, center_of_mass=[0, 0, "-length"], inertia=[0.025, INERTIA, 0.008])
    initial = {"position": [0.4], "velocity": [0.1]}
    builder.joint("hinge", "revolute", "base", "link", axis=[0, 1, 0], damping=DAMPING, initial=initial)
    builder.effort("motor", "hinge", "torque").point("tip", "link", [0, 0, "-2*length"])
    builder.output("tip", position="tip", unit="m").output("angle", formula="q.hinge", unit="rad")
    return builder.simulation(step=1e-3, duration=2.0).build()


def flyer_scene() -> eomgen.Scene:
    """Return a free body that carries a ball joint and a slider: every group, base at rest, no inputs."""
    builder = eomgen.SceneBuilder("flyer")
    builder.body("hull", 4.0, center_of_mass=[0.1, 0.0, 0.05], inertia=[0.3, 0.4, 0.5])
    builder.body("arm", 1.0, center_of_mass=[0.0, 0.0, -0.4], inertia=[0.05, 0.06, 0.02])
    builder.body("slug", 0.5, inertia=[0.01, 0.01, 0.01])
    orientation = [np.cos(0.3), np.sin(0.3), 0.0, 0.0]
    free = {"position": [0, 0, 1], "orientation": orientation, "velocity": [0.4, -0.2, 0.7, 0.3, 0.1, 0.5]}
    builder.joint("root", "free", "base", "hull", initial=free)
    builder.joint("ball", "spherical", "hull", "arm", position=[0, 0, -0.2], initial={"velocity": [1.0, 0.5, -0.8]})
    builder.joint("slide", "prismatic", "hull", "slug", axis=[1, 0, 0], stiffness=30.0, initial={"position": [0.1]})
    return builder.build()


def breaking_scene() -> eomgen.Scene:
    """Return a slider whose force is no number after t = 0.5 s."""
    builder = eomgen.SceneBuilder("breaking", gravity=[0, 0, 0])
    builder.body("slug", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("slide", "prismatic", "base", "slug", axis=[1, 0, 0])
    return builder.effort("root", "slide", "sqrt(0.5 - t)").simulation(step=1e-3, duration=1.0).build()


@cache
def pendulum() -> eomgen.Model:
    return eomgen.build(pendulum_scene(), profile="quick")


@cache
def flyer() -> eomgen.Model:
    return eomgen.build(flyer_scene(), profile="quick")


@cache
def absolute() -> eomgen.Model:
    """Return the flyer with every body free and the joints as constraints."""
    scene = flyer_scene()
    groups = {body.name: "SE3" for body in scene.bodies}
    changed = replace(
        scene, name="absolute", coordinates="absolute", groups=groups, content=scene.content + b"absolute"
    )
    return eomgen.build(changed, profile="quick")


@cache
def breaking() -> eomgen.Model:
    return eomgen.build(breaking_scene(), profile="quick")


#: Length of a rod of ``jointed_chain``, m.
ROD = 0.1


def jointed_chain(count: int, *, tied: bool) -> eomgen.Scene:
    """Return absolute rods on hinges about y, without gravity: floating, or with the first hinge on the base and a
    distance from the base to the last end."""
    builder = eomgen.SceneBuilder("jointed_chain", coordinates="absolute", gravity=[0, 0, 0])
    for k in range(count):
        builder.body(f"rod{k}", 1.0, center_of_mass=[ROD / 2, 0, 0], inertia=[0.001, 0.002, 0.0021])
        parent, place = (f"rod{k - 1}", [ROD, 0, 0]) if k else ("base", [0, 0, 0])
        if k or tied:
            turned = {"position": -0.2 if k % 2 else 0.2} if k else {"position": 0.1}
            builder.joint(f"hinge{k}", "revolute", parent, f"rod{k}", axis=[0, 1, 0], position=place, initial=turned)
        else:
            builder.joint("root", "free", "base", "rod0", initial={"velocity": [0.1, 0.3, 0.2, 0.5, 0.2, 0.0]})
    if tied:
        ends = {"body": "base"}, {"body": f"rod{count - 1}", "position": [ROD, 0, 0]}
        builder.constraint("tie", "distance", *ends, length=count * ROD * math.cos(0.1))
    return builder.build()


def zigzag(count: int, angle: float) -> Array:
    """Return q of the tied chain with rods at angles of alternating sign to x, (7 count,)."""
    turned = angle * (-1.0) ** np.arange(count)
    along = np.stack([np.cos(turned), 0.0 * turned, -np.sin(turned)], axis=1)
    middles = ROD * (np.cumsum(along, axis=0) - along / 2.0)
    half = turned / 2.0
    return np.column_stack([np.cos(half), 0.0 * half, np.sin(half), 0.0 * half, middles]).ravel()


#: A rod on a pin, of 1 kg.
SWING: dict[str, Any] = {
    "format": 1,
    "name": "swing",
    "bodies": {"rod": {"mass": 1.0, "center_of_mass": [0, 0, -0.5]}},
    "joints": {
        "pin": {"type": "revolute", "parent": "base", "child": "rod", "axis": [0, 1, 0], "initial": {"position": 1.0}}
    },
    "outputs": {"angle": {"formula": "q.pin", "unit": "rad"}},
    "simulation": {"step": 0.01, "duration": 1.28},
}
