"""Tests of contacts: scenes of a body on another one, by shape and by law."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np

from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from tests.contacts.states import OWN
from tests.oracles.evaluation import Array

SURFACE = 'surface = "0.1 * x * y + 0.2 * cos(x)"'
#: Keys of a contact, and axes of the second frame, by shape and surface.
SHAPES = {
    "point": ('shape = "point"', ""),
    "sphere": ('shape = "sphere"\nradius = 0.4', ""),
    "disc": ('shape = "disc"\nradius = 0.4', ", axis = [0.1, 1, 0]"),
    "torus": ('shape = "torus"\nradius = 0.3\ntube_radius = 0.05', ", axis = [0, 1, 0.1]"),
    "ellipsoid": ('shape = "ellipsoid"\nsemi_axes = [0.3, 0.4, 0.5]', ""),
    "round": ('shape = "ellipsoid"\nsemi_axes = [0.4, 0.4, 0.4]', ""),
    "cylinder": ('shape = "sphere"\nradius = 0.4\nhousing = "cylinder"\nclearance = 0.001', ""),
    "hollow": ('shape = "point"\nhousing = "sphere"\nclearance = 0.001', ""),
    "sphere on a surface": (f'shape = "sphere"\nradius = 0.2\n{SURFACE}', ""),
    "point on a surface": (f'shape = "point"\n{SURFACE}', ""),
    "torus on a surface": (f'shape = "torus"\nradius = 0.2\ntube_radius = 0.05\n{SURFACE}', ", axis = [0, 1, 0.1]"),
}
NORMAL = {
    "linear": "stiffness = 1e4, damping = 10",
    "hunt_crossley": "stiffness = 1e4, damping = 0.1",
    "lankarani_nikravesh": "stiffness = 1e4, restitution = 0.5, impact_velocity = 3",
    "hertz": "modulus = 1e5, curvature_radius = 0.4",
    "formula": 'force = "1e4 * deflection**2 * max(1 - 0.1 * rate, 0)"',
}
TANGENTIAL = {
    "coulomb": "friction = 0.5, velocity = 0.1",
    "viscous": "damping = 0.3",
    "bristles": "friction = 0.5, damping = 0.2",
    "brush": "coefficients = { STIFFNESS = 15, FRICTION = 0.9 }",
    "magic_formula": f'file = "{OWN.as_posix()}"',
    "formula": 'force_x = "-0.2 * load * slip_velocity_x * (1 + camber**2)", '
    'force_y = "-load * (0.1 * slip_velocity_y + 0.01 * spin + 0.03 * velocity_x * wheel_speed + gap)", '
    'moment_x = "0.02 * load", moment_y = "-0.01 * load * wheel_speed", moment_z = "-0.03 * load * spin"',
}
BODIES = """format = 1
name = "pair"
gravity = [0, 0, -9.81]
[bodies.table]
mass = 3
inertia = [0.2, 0.3, 0.25]
center_of_mass = [{offset}, 0, 0]
[joints.table]
type = "free"
parent = "base"
child = "table"
[bodies.ball]
mass = 2
inertia = [0.128, 0.13, 0.12]
[joints.ball]
type = "free"
parent = "{parent}"
child = "ball"
"""


def contact(name: str, first: str, second: str, normal: str, tangential: str = "", shape: str = "sphere") -> str:
    """Return the entry of a contact as TOML; laws by their names in the tables above, or as text of their tables."""
    keys, axes = SHAPES[shape]
    laws = {"normal": (normal, NORMAL), "tangential": (tangential, TANGENTIAL)}
    tables = "\n".join(
        f'{key} = {{ type = "{law}", {known[law]} }}' if law in known else f"{key} = {{ {law} }}"
        for key, (law, known) in laws.items()
        if law
    )
    return f"[contacts.{name}]\nfirst = {first}\nsecond = {{ {second}{axes} }}\n{keys}\n{tables}\n"


def scene_of(text: str, **keys: Any) -> Scene:
    """Return the scene of a TOML text with other keys."""
    return from_data({**tomllib.loads(text), **keys})


def pair(
    shape: str, normal: str, tangential: str, more: str = "", *, parent: str = "base", offset: float = 0.1, **keys: Any
) -> Scene:
    """Return the scene of a ball on a table that both move."""
    first = '{ body = "table", position = [0.1, 0.2, -0.3], axis = [0.1, 0.2, 1], x_axis = [1, 0, 0] }'
    entry = contact("floor", first, 'body = "ball", position = [0.1, 0.05, 0.02]', normal, tangential, shape)
    return scene_of(BODIES.format(parent=parent, offset=offset) + entry + more, **keys)


def states_of(scene: Scene, rng: np.random.Generator, count: int = 4) -> dict[str, Array]:
    """Return states of both bodies near each other."""
    turns = rng.normal(size=(count, 2, 4))
    turns /= np.linalg.norm(turns, axis=2, keepdims=True)
    q = np.concatenate([turns, 0.1 * rng.normal(size=(count, 2, 3))], axis=2).reshape(count, 14)
    v, a = rng.normal(size=(2, count, 12))
    empty = {name: np.zeros((count, 0)) for name in ("u", "p")}
    z = 1e-4 * rng.normal(size=(count, len(scene.states)))
    return {"q": q, "v": v, "a": a, "t": np.zeros((count, 1)), "z": z, **empty}
