"""Robots whose data are published: the Panda and the Puma 560 in modified Denavit-Hartenberg parameters, and chains of
n links.

Panda: Gaz, Cognetti, Oliva, Robuffo Giordano, De Luca, IEEE RA-L 4 (2019) 4147. Puma: Armstrong, Khatib, Burdick, ICRA
1986. RX-90 geometry: Khalil and Dombre, Modeling, Identification and Control of Robots (2002).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from eomgen.scene.bodies.model import Body
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from tests.oracles.evaluation import Array
from tests.oracles.formulas import rigid_body, vector

Row = tuple[float, float, float]

PANDA_GEOMETRY: tuple[Row, ...] = (
    (0, 0, 0.333), (-90, 0, 0), (90, 0, 0.316), (90, 0.0825, 0), (-90, -0.0825, 0.384), (90, 0, 0), (90, 0.088, 0),
)  # fmt: skip  # a table
#: mass, centre of mass, inertia (xx, yy, zz, xy, xz, yz) about it
PANDA_BODIES = (
    (4.970684, (3.875e-3, 2.081e-3, -0.1750), (0.70337, 0.70661, 9.117e-3, -1.39e-4, 6.772e-3, 1.9169e-2)),
    (0.646926, (-3.141e-3, -2.872e-2, 3.495e-3), (7.962e-3, 2.811e-2, 2.5995e-2, -3.925e-3, 1.0254e-2, 7.04e-4)),
    (3.228604, (2.7518e-2, 3.9252e-2, -6.6502e-2), (3.7242e-2, 3.6155e-2, 1.083e-2, -4.761e-3, -1.1396e-2, -1.2805e-2)),
    (3.587895, (-5.317e-2, 0.104419, 2.7454e-2), (2.5853e-2, 1.9552e-2, 2.8323e-2, 7.796e-3, -1.332e-3, 8.641e-3)),
    (1.225946, (-1.1953e-2, 4.1065e-2, -3.8437e-2), (3.5549e-2, 2.9474e-2, 8.627e-3, -2.117e-3, -4.037e-3, 2.29e-4)),
    (1.666555, (6.0149e-2, -1.4117e-2, -1.0517e-2), (1.964e-3, 4.354e-3, 5.433e-3, 1.09e-4, -1.158e-3, 3.41e-4)),
    (0.735522, (1.0517e-2, -4.252e-3, 6.1597e-2), (1.2516e-2, 1.0027e-2, 4.815e-3, -4.28e-4, -1.196e-3, -7.41e-4)),
)
PANDA_AMPLITUDES = (
    -1.2943753211777664,
    0.7175341454355011,
    -0.5691380764966176,
    0.5848944158627155,
    1.6216297151633214,
    -0.9187855709752027,
    0.4217605991935227,
)
PANDA_FREQUENCIES = (
    1.7073873117335832,
    3.079992797637052,
    2.1084514453622774,
    3.5903916041026207,
    1.4183262544423447,
    2.285625793808507,
    5.927533308659986,
)

PUMA_GEOMETRY: tuple[Row, ...] = (
    (0, 0, 0), (-90, 0, 0.2435), (0, 0.4318, -0.0934), (90, -0.0203, 0.4331), (-90, 0, 0), (90, 0, 0),
)  # fmt: skip  # a table
PUMA_BODIES = (
    (0.0, (0, 0, 0), (0, 0, 0.35, 0, 0, 0)),
    (17.4, (0.068, 0.006, -0.016), (0.13, 0.524, 0.539, 0, 0, 0)),
    (4.8, (0, -0.070, 0.014), (0.066, 0.0125, 0.086, 0, 0, 0)),
    (0.82, (0, 0, -0.019), (1.8e-3, 1.8e-3, 1.3e-3, 0, 0, 0)),
    (0.34, (0, 0, 0), (0.3e-3, 0.3e-3, 0.4e-3, 0, 0, 0)),
    (0.09, (0, 0, 0.032), (0.15e-3, 0.15e-3, 0.04e-3, 0, 0, 0)),
)
RX90_GEOMETRY: tuple[Row, ...] = ((0, 0, 0), (90, 0, 0), (0, 0.450, 0), (-90, 0, 0.450), (90, 0, 0), (-90, 0, 0))


def placement(twist_degrees: float, length: float, offset: float) -> tuple[tuple[Row, ...], Row]:
    """Return orientation and position of a modified Denavit-Hartenberg frame at zero angle; right angles are exact."""
    exact = {0: (1.0, 0.0), 90: (0.0, 1.0), -90: (0.0, -1.0)}
    angle = math.radians(twist_degrees)
    c, s = exact.get(
        round(twist_degrees) if twist_degrees == round(twist_degrees) else 1, (math.cos(angle), math.sin(angle))
    )
    return ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)), (length, -offset * s, offset * c)


def serial_arm(name: str, geometry: Sequence[Row], bodies: Sequence[Body], gravity: Row) -> Scene:
    """Return an arm of revolute joints about the z axes of modified Denavit-Hartenberg frames."""
    joints = []
    for k, row in enumerate(geometry):
        orientation, position = placement(*row)
        parent = "base" if k == 0 else bodies[k - 1].name
        joints.append(
            Joint(
                f"joint{k + 1}",
                "revolute",
                parent,
                bodies[k].name,
                position=vector(position),
                orientation=orientation,
                initial_position=(0.0,),
                initial_velocity=(0.0,),
            )
        )
    return Scene(name, tuple(bodies), tuple(joints), gravity=vector(gravity))


def panda() -> Scene:
    bodies = [rigid_body(f"link{k + 1}", *data) for k, data in enumerate(PANDA_BODIES)]
    return serial_arm("panda", PANDA_GEOMETRY, bodies, (0.0, 0.0, -9.80665))


def panda_of_origin_tensors() -> Scene:
    """Return the Panda with the tensors of the data read about the origins of the links' frames: not physical, but
    published."""
    bodies = []
    for k, (mass, center, tensor) in enumerate(PANDA_BODIES):
        x, y, z = center
        steiner = (y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)
        moved = tuple(entry - mass * part for entry, part in zip(tensor, steiner, strict=True))
        bodies.append(rigid_body(f"link{k + 1}", mass, center, moved))
    return serial_arm("panda_of_origin_tensors", PANDA_GEOMETRY, bodies, (0.0, 0.0, -9.80665))


def panda_state(t: float) -> dict[str, Array]:
    """Return the published test trajectory, cosines in every joint, with derivatives of the accelerations."""
    a, w = np.array(PANDA_AMPLITUDES), np.array(PANDA_FREQUENCIES)
    cosine, sine = a * np.cos(w * t), a * np.sin(w * t)
    return {"q": cosine, "v": -w * sine, "a": -(w**2) * cosine, "j": w**3 * sine, "s": w**4 * cosine}


def puma() -> Scene:
    bodies = [rigid_body(f"link{k + 1}", *data) for k, data in enumerate(PUMA_BODIES)]
    return serial_arm("puma", PUMA_GEOMETRY, bodies, (0.0, 0.0, -9.81))


def general_bodies(count: int, seed: int = 1) -> list[Body]:
    """Return bodies without any symmetry: each of seven random masses in a box."""
    rng = np.random.default_rng(seed)
    bodies = []
    for k in range(count):
        masses, places = rng.uniform(0.2, 0.6, 7), rng.uniform(-0.2, 0.3, (7, 3))
        bodies.append(body_of_masses(f"link{k + 1}", masses, places))
    return bodies


def body_of_masses(name: str, masses: Array, places: Array) -> Body:
    """Return the rigid body made of point masses."""
    center = masses @ places / masses.sum()
    r = places - center
    tensor = np.einsum(
        "k,kij->ij", masses, np.eye(3) * np.sum(r * r, axis=1)[:, None, None] - r[:, :, None] * r[:, None, :]
    )
    entries = (tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2])
    return rigid_body(name, float(masses.sum()), center.tolist(), [float(entry) for entry in entries])


def rx90() -> Scene:
    return serial_arm("rx90", RX90_GEOMETRY, general_bodies(6), (0.0, 0.0, -9.81))


def general_arm(count: int) -> Scene:
    """Return an arm without any special angle, length or symmetry."""
    rng = np.random.default_rng(2)
    rows = [
        (float(row[0]), float(row[1]), float(row[2])) for row in rng.uniform((20, 0.1, 0.1), (70, 0.5, 0.5), (count, 3))
    ]
    return serial_arm(f"arm_{count}", rows, general_bodies(count, 3), (0.3, -0.4, -9.81))


def spatial_chain(count: int) -> Scene:
    """Return a chain of equal, general bodies whose axes are turned by a right angle from link to link."""
    body = general_bodies(1, 4)[0]
    bodies = [Body(f"link{k + 1}", body.mass, body.center_of_mass, body.inertia) for k in range(count)]
    return serial_arm(f"spatial_{count}", [(90.0, 0.3, 0.1)] * count, bodies, (0.0, 0.0, -9.81))


def planar_chain(count: int) -> Scene:
    """Return a chain of equal rods in a vertical plane, all axes parallel."""
    bodies = [rigid_body(f"link{k + 1}", 0.7, (0.25, 0, 0), (0, 0.7 / 48, 0.7 / 48, 0, 0, 0)) for k in range(count)]
    rows = [(0.0, 0.0 if k == 0 else 0.5, 0.0) for k in range(count)]
    return serial_arm(f"planar_{count}", rows, bodies, (0.0, -9.81, 0.0))
