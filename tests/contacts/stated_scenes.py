"""Forty scenes with contact and friction whose stated errors are compared with true ones; rates of some by hand."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from tests.contacts.states import OWN
from tests.contacts.test_tangential_laws import VAN
from tests.oracles.evaluation import Array

#: Rates of (q, v, z) by time.
Rates = Callable[[float, Array], Sequence[float]]
Data = dict[str, Any]
G = 9.81
UP, HEADED = {"axis": [0, 0, 1]}, {"axis": [0, 0, 1], "x_axis": [1, 0, 0]}
FLOOR: Data = {"body": "base", **HEADED}
UPWARD: Data = {"body": "base", "axis": [0, 1, 0], "x_axis": [1, 0, 0]}  # of machines in the plane of x and y
WALL: Data = {"body": "base", "position": [0.2, 0, 0], "axis": [-1, 0, 0]}
LINEAR: Data = {"type": "linear", "stiffness": 2e4, "damping": 20.0, "onset": 1e-3}
HUNT: Data = {"type": "hunt_crossley", "stiffness": 1e6, "damping": 0.3}
HERTZ: Data = {"type": "hertz", "modulus": 1e6, "curvature_radius": 0.05}
LANKARANI: Data = {"type": "lankarani_nikravesh", "stiffness": 1e6, "restitution": 0.7, "impact_velocity": 1.5}
OWN_FORCE: Data = {"type": "formula", "force": "2e6 * deflection**2 * max(1 - 0.2 * rate, 0)"}
TYRE: Data = {"type": "linear", "stiffness": 2e5, "damping": 500.0, "onset": 1e-3}
VISCOUS: Data = {"type": "viscous", "damping": 2.0}
BRUSH: Data = {"type": "brush", "coefficients": {"STIFFNESS": 18, "FRICTION": 0.9}}
SLIP: Data = {"type": "linear", "coefficients": {"STIFFNESS_X": 15, "STIFFNESS_Y": 12, "FRICTION": 0.8}}
MAGIC: Data = {"type": "magic_formula", "file": OWN.as_posix()}
TMEASY: Data = {"type": "tmeasy", "coefficients": VAN}


class Case(NamedTuple):
    """A scene with the duration and the steps, s, of its runs; rates by hand, else ``Model.rhs``."""

    name: str
    scene: Data
    duration: float
    step: float
    rates: Rates | None = None


def coulomb(friction: float, velocity: float = 0.01) -> Data:
    return {"type": "coulomb", "friction": friction, "velocity": velocity}


def bristles(friction: float, length: float = 1e-3, damping: float = 0.5, release: float = 0.01) -> Data:
    return {
        "type": "bristles", "friction": friction, "bristle_length": length, "damping": damping, "release": release
    }  # fmt: skip


def contact(first: Data, body: str, normal: Data, tangential: Data | None = None, **keys: Any) -> Data:
    """Return the entry of a contact; ``keys`` of the second frame are in ``at``, the shape is a point by default."""
    return {
        "first": first, "second": {"body": body, **keys.pop("at", {})}, "shape": "point", "normal": normal, **keys,
        **({} if tangential is None else {"tangential": tangential}),
    }  # fmt: skip


def joint(kind: str, child: str, parent: str = "base", **keys: Any) -> Data:
    """Return the entry of a joint, with keys of its start by short names: ``q``, ``v``, ``turn`` and ``hold``."""
    names = {"q": "position", "v": "velocity", "turn": "rotation", "hold": "hold"}
    start = {names[name]: keys.pop(name) for name in names if name in keys}
    return {"type": kind, "child": child, "parent": parent, **keys, "initial": start}


def body(mass: float, *inertia: float, **keys: Any) -> Data:
    return {"mass": mass, **({"inertia": list(inertia)} if inertia else {}), **keys}


def scene(
    bodies: Mapping[str, Data],
    joints: Mapping[str, Data],
    contacts: Mapping[str, Data],
    gravity: Sequence[float] = (0, 0, -G),
    **more: Any,
) -> Data:
    return {
        "format": 1, "name": "contact", "gravity": list(gravity), "bodies": dict(bodies), "joints": dict(joints),
        "contacts": dict(contacts), **more,
    }  # fmt: skip


# -- balls on a rail, with rates by hand ------------------------------------------------------------------------------


def dropped(normal: Data, height: float = 0.1, mass: float = 0.5, **more: Any) -> Data:
    rail = joint("prismatic", "ball", axis=[0, 0, 1], q=height, v=more.pop("v", 0.0))
    floor = contact(FLOOR, "ball", normal, shape="sphere", radius=0.05)
    return scene({"ball": body(mass)}, {"ball": rail}, {"floor": floor}, **more)


def fall(force: Callable[[float, float], float], mass: float = 0.5) -> Rates:
    """Return the rates of a dropped ball under a force of deflection and rate of the gap."""

    def rates(_: float, y: Array) -> list[float]:
        depth = max(0.05 - y[0], 0.0)
        return [y[1], -G + force(depth, y[1]) / mass]

    return rates


def smooth(share: float) -> float:
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


def linear(depth: float, rate: float) -> float:
    return smooth(depth / 1e-3) * max(2e4 * depth - 20.0 * rate, 0.0)


def hunt(depth: float, rate: float) -> float:
    return 1e6 * depth**1.5 * max(1.0 - 0.45 * rate, 0.0)


def lankarani(depth: float, rate: float) -> float:
    return 1e6 * depth**1.5 * max(1.0 - 0.75 * 0.51 * rate / 1.5, 0.0)


def hertz(depth: float, rate: float) -> float:
    return 4.0 / 3.0 * 1e6 * math.sqrt(0.05) * depth**1.5


def own(depth: float, rate: float) -> float:
    return 2e6 * depth**2 * max(1.0 - 0.2 * rate, 0.0)


# -- blocks ------------------------------------------------------------------------------------------------------------


def belt(tangential: Data, speed: float = 0.1) -> Data:
    """Return a block on a spring, pressed on a heavy belt in motion."""
    rails = {
        "belt": joint("prismatic", "belt", axis=[1, 0, 0], v=speed),
        "block": joint("prismatic", "block", axis=[1, 0, 0], position=[0, 0, 0], stiffness=200.0, damping=1.0),
    }
    pressed = {"type": "formula", "force": "10"}
    drive = contact({"body": "belt", **HEADED}, "block", pressed, tangential)
    return scene({"belt": body(1e6), "block": body(1.0)}, rails, {"drive": drive}, (0, 0, 0))


def belt_coulomb(_: float, y: Array) -> list[float]:
    slip = y[3] - y[2]
    force = -0.5 * 10.0 * slip / math.hypot(slip, 0.01)
    return [y[2], y[3], -force / 1e6, force - 200.0 * y[1] - y[3]]


def belt_bristles(_: float, y: Array) -> list[float]:
    slip, b, length = y[3] - y[2], y[4], 1e-3
    part = smooth(2.0 * abs(b) / length - 1.0)
    rate = slip - part * max(b * slip, 0.0) / max(b * b, 1e-30) * b
    force = -10.0 * (0.5 / length * b + 0.5 * rate)
    return [y[2], y[3], -force / 1e6, force - 200.0 * y[1] - y[3], rate, 0.0]


def block(tangential: Data, slope: float, **start: Any) -> Data:
    """Return a planar block on two edges on an incline."""
    edges = {
        f"edge_{k}": contact(UPWARD, "block", LINEAR, tangential, at={"position": [x, -0.05, 0]})
        for k, x in enumerate((-0.1, 0.1))
    }
    plane = joint("planar", "block", axis=[0, 0, 1], x_axis=[1, 0, 0], **start)
    pull = (G * math.sin(slope), -G * math.cos(slope), 0.0)
    return scene({"block": body(2.0, 0.01, 0.01, 0.01)}, {"block": plane}, edges, pull)


def table(tangential: Data | None, normal: Data = LINEAR, **start: Any) -> Data:
    """Return a free block on four corners."""
    corners = {
        f"corner_{k}": contact(FLOOR, "block", normal, tangential, at={"position": [x, y, -0.05]})
        for k, (x, y) in enumerate(((-0.1, -0.08), (0.1, -0.08), (0.1, 0.08), (-0.1, 0.08)))
    }
    return scene({"block": body(2.0, 0.006, 0.008, 0.011)}, {"block": joint("free", "block", **start)}, corners)


# -- free bodies of one shape ------------------------------------------------------------------------------------------


def free(shape: Data, mass: Data, normal: Data, tangential: Data, surface: str = "", **start: Any) -> Data:
    """Return a free body on a plane or a surface."""
    more: Data = {"surface": surface} if surface else {}
    floor = contact(FLOOR, "body", normal, tangential, **shape, **more)
    return scene({"body": mass}, {"body": joint("free", "body", **start)}, {"floor": floor})


BALL, BALL_MASS = {"shape": "sphere", "radius": 0.05}, body(0.5, 5e-4, 5e-4, 5e-4)
EGG, EGG_MASS = {"shape": "ellipsoid", "semi_axes": [0.08, 0.05, 0.04]}, body(0.5, 4e-4, 8e-4, 9e-4)
STONE_MASS = body(0.5, 4e-4, 8e-4, 9e-4, 5e-5, 0.0, 0.0)
COIN, COIN_MASS = {"shape": "disc", "radius": 0.06, "at": {"axis": [0, 0, 1]}}, body(0.3, 2.7e-4, 2.7e-4, 5.4e-4)
RING = {"shape": "torus", "radius": 0.06, "tube_radius": 0.015, "at": {"axis": [0, 0, 1]}}
RING_MASS = body(0.3, 6e-4, 6e-4, 1.1e-3)
TOP = {"shape": "sphere", "radius": 0.015}
TOP_MASS = body(0.02, 3e-6, 3e-6, 2.8e-6, center_of_mass=[0, 0, -0.003])
TOP_NORMAL: Data = {"type": "hunt_crossley", "stiffness": 1e5, "damping": 0.5}
WAVES = "0.02 * cos(8 * x) * cos(6 * y)"


def turned(angle: float, *axis: float) -> list[Data]:
    return [{"axis": list(axis or (1, 0, 0)), "angle": angle}]


def tilted(angle: float) -> tuple[float, float, float]:
    return G * math.sin(angle), 0.0, -G * math.cos(angle)


def topple(tangential: Data) -> Data:
    return free(TOP, TOP_MASS, TOP_NORMAL, tangential, q=[0, 0, 0.0149], v=[0.3, 0.2, 150, 0, 0, 0], turn=turned(0.3))


def bounce(_: float, y: Array) -> list[float]:
    """Return the rates of a ball that spins and bounces under Coulomb friction; q: quaternion, place; v in its axes."""
    w, x, yy, z = y[:4] / np.linalg.norm(y[:4])
    R = np.array([
        [1 - 2 * (yy * yy + z * z), 2 * (x * yy - w * z), 2 * (x * z + w * yy)],
        [2 * (x * yy + w * z), 1 - 2 * (x * x + z * z), 2 * (yy * z - w * x)],
        [2 * (x * z - w * yy), 2 * (yy * z + w * x), 1 - 2 * (x * x + yy * yy)],
    ])  # fmt: skip
    omega, v = R @ y[7:10], R @ y[10:13]
    arm = np.array([0.0, 0.0, -0.05])
    slip = v + np.cross(omega, arm)
    load = hunt(max(0.05 - y[6], 0.0), v[2])
    force = np.array([*(-0.3 * load * slip[:2] / math.sqrt(slip[0] ** 2 + slip[1] ** 2 + 0.01**2)), load])
    a, turning = force / 0.5 - [0.0, 0.0, G], np.cross(arm, force) / 5e-4
    a_body = R.T @ a - np.cross(y[7:10], y[10:13])
    p, q, r = y[7:10]
    rate = 0.5 * np.array([
        -x * p - yy * q - z * r, w * p + yy * r - z * q, w * q + z * p - x * r, w * r + x * q - yy * p
    ])  # fmt: skip
    return [*rate, *v, *(R.T @ turning), *a_body]


# -- housings ----------------------------------------------------------------------------------------------------------


def housed(kind: str, normal: Data, tangential: Data | None, **start: Any) -> Data:
    hollow = contact({"body": "base", "axis": [0, 1, 0], "x_axis": [1, 0, 0]}, "body", normal, tangential,
                     shape="sphere", radius=0.05, housing=kind, clearance=0.1)  # fmt: skip
    return scene({"body": BALL_MASS}, {"body": joint("free", "body", **start)}, {"hollow": hollow})


def slider_crank(clearance: float, tangential: Data | None) -> Data:
    """Return crank, rod and slider without a pin between the latter two, which touch in a bore."""
    bodies = {
        "crank": body(1.0, 6e-3, 6e-3, 1e-2, center_of_mass=[0.05, 0, 0]),
        "rod": body(0.3, 1e-4, 3e-3, 3e-3, center_of_mass=[0.1, 0, 0]),
        "slider": body(0.5),
    }
    joints = {
        "shaft": joint("revolute", "crank", axis=[0, 0, 1], q=0.3, v=20.0),
        "pin": joint(
            "revolute",
            "rod",
            "crank",
            axis=[0, 0, 1],
            position=[0.1, 0, 0],
            q=-0.3 - math.asin(0.5 * math.sin(0.3)),
            v=-25.0,
        ),
        "rail": joint(
            "prismatic",
            "slider",
            axis=[1, 0, 0],
            q=0.1 * math.cos(0.3) + math.sqrt(0.04 - 0.01 * math.sin(0.3) ** 2),
            v=-1.0,
        ),
    }
    stiff = {"type": "lankarani_nikravesh", "stiffness": 1e7, "restitution": 0.6, "impact_velocity": 0.3}
    bore = contact(
        {"body": "slider", **UP},
        "rod",
        stiff,
        tangential,
        at={"position": [0.2, 0, 0]},
        housing="cylinder",
        clearance=clearance,
    )
    return scene(bodies, joints, {"bore": bore}, (0, -G, 0))


def rotor(tangential: Data) -> Data:
    """Return an unbalanced rotor on springs that rubs at a ring."""
    shaft = joint(
        "planar",
        "rotor",
        axis=[0, 0, 1],
        x_axis=[1, 0, 0],
        v=[120.0, 0.0, 0.0],
        stiffness=[0, 5e3, 5e3],
        damping=[0, 4, 4],
    )
    mass = body(1.0, 0.01, 0.01, 0.02, center_of_mass=[0.002, 0, 0])
    ring = contact({"body": "base", **UP}, "rotor", {**LINEAR, "onset": 1e-4}, tangential, shape="sphere",
                   radius=0.05, housing="cylinder", clearance=0.003)  # fmt: skip
    return scene({"rotor": mass}, {"shaft": shaft}, {"ring": ring}, (0, 0, 0))


# -- pendulums, legs, chains, machines ---------------------------------------------------------------------------------

_ROD = body(1.0, 0.01, 0.01, 1e-3, center_of_mass=[0, 0, -0.2])


def pendulum(links: int, normal: Data, tangential: Data | None = None, angle: float = -0.8) -> Data:
    """Return a pendulum whose tip strikes a wall."""
    names = [f"rod_{k}" for k in range(links)]
    joints = {
        f"hinge_{k}": joint(
            "revolute", name, names[k - 1] if k else "base", axis=[0, -1, 0], position=[0, 0, -0.4 if k else 0],
            q=angle if not k else 0.3,
        )
        for k, name in enumerate(names)
    }  # fmt: skip
    wall = contact(WALL, names[-1], normal, tangential, at={"position": [0, 0, -0.4]}, shape="sphere", radius=0.03)
    return scene(dict.fromkeys(names, _ROD), joints, {"wall": wall})


def struck(_: float, y: Array) -> list[float]:
    """Return the rates of a pendulum of one link whose tip strikes the wall under Hunt and Crossley's law."""
    gap, rate = 0.2 - 0.4 * math.sin(y[0]) - 0.03, -0.4 * math.cos(y[0]) * y[1]
    force = hunt(max(-gap, 0.0), rate)
    return [y[1], (-G * 0.2 * math.sin(y[0]) - 0.4 * math.cos(y[0]) * force) / (0.01 + 0.04)]


def leg(tangential: Data) -> Data:
    """Return a leg on a spring that hops ahead."""
    bodies = {"hip": body(5.0, 0.05, 0.05, 0.05), "foot": body(0.5, 1e-3, 1e-3, 1e-3)}
    joints = {
        "hip": joint("planar", "hip", axis=[0, 0, 1], x_axis=[1, 0, 0], q=[0.1, 0, 0.55], v=[0, 0.5, 0]),
        "leg": joint("prismatic", "foot", "hip", axis=[0, -1, 0], q=0.5, stiffness=2e3, damping=5.0, rest=0.5),
    }
    return scene(bodies, joints, {"ground": contact(UPWARD, "foot", LINEAR, tangential)}, (0, -G, 0))


def chain(links: int, tangential: Data, angle: float) -> Data:
    """Return a free chain of links that falls on the floor with the ends of all links."""
    names = [f"link_{k}" for k in range(links)]
    joints = {
        name: joint("revolute", name, names[k - 1], axis=[0, 0, 1], position=[0.2, 0, 0], q=angle, damping=0.005)
        for k, name in enumerate(names) if k
    } | {"first": joint("planar", names[0], axis=[0, 0, 1], x_axis=[1, 0, 0], q=[0.2, 0, 0.1])}  # fmt: skip
    ends = {
        f"end_{k}": contact(UPWARD, name, LINEAR, tangential, at={"position": [0.2, 0, 0]})
        for k, name in enumerate(names)
    } | {"begin": contact(UPWARD, names[0], LINEAR, tangential)}
    link = body(0.3, 1e-4, 1e-3, 1e-3, center_of_mass=[0.1, 0, 0])
    return scene(dict.fromkeys(names, link), joints, ends, (0, -G, 0))


def carried(normal: Data, tangential: Data) -> Data:
    """Return a ball on a table on springs; both move."""
    bodies = {"table": body(2.0, 0.05, 0.05, 0.05), "ball": BALL_MASS}
    joints = {
        "table": joint(
            "planar",
            "table",
            axis=[0, 1, 0],
            x_axis=[1, 0, 0],
            stiffness=[30, 400, 2e3],
            damping=[0.1, 2, 5],
            v=[0.5, 0, 0],
        ),
        "ball": joint("free", "ball", q=[0.02, 0, 0.08]),
    }
    top = contact({"body": "table", **HEADED}, "ball", normal, tangential, shape="sphere", radius=0.05)
    return scene(bodies, joints, {"top": top})


def plank(tangential: Data) -> Data:
    """Return a plank that rocks on a fixed ball."""
    ball = contact({"body": "plank", "axis": [0, -1, 0], "x_axis": [1, 0, 0], "position": [0, -0.01, 0]}, "base",
                   LINEAR, tangential, shape="sphere", radius=0.2)  # fmt: skip
    start = joint("planar", "plank", axis=[0, 0, 1], x_axis=[1, 0, 0], q=[0.2, 0.0, 0.211])
    return scene({"plank": body(1.0, 0.01, 0.01, 0.01)}, {"plank": start}, {"ball": ball}, (0, -G, 0))


def linkage() -> Data:
    """Return a four-bar linkage whose coupler strikes a stop."""
    bodies = {
        "crank": body(1.0, 3e-3, 3e-3, 5e-3, center_of_mass=[0.05, 0, 0]),
        "coupler": body(0.5, 1e-3, 5e-3, 5e-3, center_of_mass=[0.15, 0, 0]),
        "rocker": body(0.5, 1e-3, 5e-3, 5e-3, center_of_mass=[0.1, 0, 0]),
    }
    joints = {
        "a": joint("revolute", "crank", axis=[0, 0, 1], q=1.0, v=8.0, hold=True),
        "b": joint("revolute", "coupler", "crank", axis=[0, 0, 1], position=[0.1, 0, 0], q=-0.5),
        "d": joint("revolute", "rocker", axis=[0, 0, 1], position=[0.3, 0, 0], q=1.5),
    }
    loop = {
        "type": "revolute", "first": {"body": "coupler", "position": [0.3, 0, 0], "axis": [0, 0, 1]},
        "second": {"body": "rocker", "position": [0.2, 0, 0], "axis": [0, 0, 1]},
    }  # fmt: skip
    stop = contact({"body": "base", "position": [0.16, 0, 0], "axis": [1, 0, 0]}, "rocker", HUNT, coulomb(0.2, 0.05),
                   at={"position": [0.2, 0, 0]}, shape="sphere", radius=0.02)  # fmt: skip
    return scene(bodies, joints, {"stop": stop}, (0, -G, 0), constraints={"loop": loop})


def wheel(tangential: Data, speed: float, brake: float, sideways: float = 0.0, slope: float = 0.0) -> Data:
    """Return a loaded wheel that drifts sideways, braked from half a tenth of a second on."""
    names = ("trolley", "drift", "hub", "wheel")
    joints = {
        "rail": joint("prismatic", "trolley", axis=[1, 0, 0], v=speed),
        "drift": joint("prismatic", "drift", "trolley", axis=[0, 1, 0], v=sideways, damping=50.0),
        "lift": joint("prismatic", "hub", "drift", axis=[0, 0, 1], q=0.295),
        "axle": joint("revolute", "wheel", "hub", axis=[0, 1, 0], v=speed / 0.305),
    }
    road = contact(FLOOR, "wheel", TYRE, tangential, shape="disc", radius=0.31, at={"axis": [0, 1, 0]})
    moment = f"-{brake} / 2 * (1 + tanh(20 * (t - 0.1))) * tanh(v.axle)"
    masses = (body(20.0), body(5.0), body(255.0), body(20.0, 0.6, 1.1, 0.6))
    return scene(dict(zip(names, masses, strict=True)), joints, {"road": road}, tilted(slope),
                 efforts={"brake": {"joint": "axle", "effort": moment}})  # fmt: skip


CASES = (
    Case("ball, linear", dropped(LINEAR), 0.6, 1e-3, fall(linear)),
    Case("ball, Hunt and Crossley", dropped(HUNT, 0.15), 0.6, 5e-4, fall(hunt)),
    Case("ball, Lankarani and Nikravesh", dropped(LANKARANI, 0.2), 0.6, 5e-4, fall(lankarani)),
    Case("ball, Hertz", dropped(HERTZ, 0.12), 0.5, 5e-4, fall(hertz)),
    Case("ball, formula", dropped(OWN_FORCE, 0.1), 0.5, 1e-3, fall(own)),
    Case("belt, Coulomb", belt(coulomb(0.5)), 2.0, 1e-3, belt_coulomb),
    Case("belt, bristles", belt(bristles(0.5)), 2.0, 1e-3, belt_bristles),
    Case("block slides on an incline", block(coulomb(0.3), 0.5, q=[0, 0, 0.0504]), 0.5, 5e-4),
    Case("block stops on bristles", block(bristles(0.6), 0.2, q=[0, 0, 0.0505], v=[0, 0.6, 0]), 0.4, 5e-4),
    Case("block tips", block(coulomb(0.8), 0.1, q=[0.3, 0, 0.085], v=[0, 0.5, 0]), 0.4, 5e-4),
    Case("table drops on four corners", table(coulomb(0.4), q=[0, 0, 0.08], turn=turned(0.2, 1, 0.5, 0)), 0.4, 5e-4),
    Case("table spins on bristles", table(bristles(0.3), q=[0, 0, 0.0503], v=[0, 0, 6, 0.3, 0, 0]), 0.4, 5e-4),
    Case(
        "ball spins and bounces",
        free(BALL, BALL_MASS, HUNT, coulomb(0.3), q=[0, 0, 0.1], v=[5, 40, 0, 1, 0, 0]),
        0.5,
        5e-4,
        bounce,
    ),
    Case(
        "ball bounces on bristles",
        free(BALL, BALL_MASS, HUNT, bristles(0.5), q=[0, 0, 0.1], v=[0, 20, 0, 0.5, 0, 0]),
        0.4,
        2.5e-4,
    ),
    Case(
        "billiard ball begins to roll",
        free(BALL, BALL_MASS, LINEAR, coulomb(0.2), q=[0, 0, 0.0496], v=[0, -10, 0, 2, 0.3, 0]),
        0.6,
        1e-3,
    ),
    Case(
        "ball rolls over waves",
        free(BALL, BALL_MASS, LINEAR, coulomb(0.5, 0.05), surface=WAVES, q=[-0.3, 0.1, 0.06], v=[0, 0, 0, 0.8, 0, 0]),
        0.6,
        5e-4,
    ),
    Case(
        "ellipsoid on waves",
        free(
            EGG,
            EGG_MASS,
            LINEAR,
            coulomb(0.4, 0.05),
            surface="0.01 * cos(4 * x)",
            q=[-0.1, 0, 0.08],
            v=[1, 2, 0, 0.3, 0, 0],
        ),
        0.5,
        5e-4,
    ),
    Case(
        "rattleback",
        free(EGG, STONE_MASS, LINEAR, bristles(0.6), q=[0, 0, 0.0398], v=[0.1, 0.5, -5, 0, 0, 0]),
        0.5,
        5e-4,
    ),
    Case(
        "coin whirls",
        free(COIN, COIN_MASS, HUNT, coulomb(0.3, 0.02), q=[0, 0, 0.04], v=[0, 0, 15, 0, 0, 0], turn=turned(0.7)),
        0.4,
        2.5e-4,
    ),
    Case(
        "disc rolls on bristles",
        free(COIN, COIN_MASS, LINEAR, bristles(0.8), q=[0, 0, 0.056], v=[0.3, 1, 12, 0, 0, 0], turn=turned(1.2)),
        0.4,
        5e-4,
    ),
    Case(
        "ring drops",
        free(RING, RING_MASS, HUNT, coulomb(0.4, 0.02), q=[0, 0, 0.09], v=[0, 0, 10, 0.2, 0, 0], turn=turned(0.9)),
        0.4,
        2.5e-4,
    ),
    Case(
        "ring rolls over waves",
        free(
            RING,
            RING_MASS,
            LINEAR,
            coulomb(0.8, 0.05),
            surface="0.01 * cos(6 * x)",
            q=[0, 0, 0.085],
            v=[0, 0, 12, 0.8, 0, 0],
            turn=turned(1.5),
        ),
        0.4,
        5e-4,
    ),
    Case("tippe-top, Coulomb", topple(coulomb(0.3, 0.05)), 0.5, 2.5e-4),
    Case("tippe-top, viscous", topple({**VISCOUS, "damping": 5.0}), 0.5, 2.5e-4),
    Case(
        "ball in a tube",
        housed("cylinder", HERTZ, coulomb(0.2, 0.05), q=[0.05, 0, 0.02], v=[0, 10, 0, 0.5, 0.2, 0]),
        0.6,
        5e-4,
    ),
    Case(
        "ball in a hollow ball", housed("sphere", HUNT, VISCOUS, q=[0.03, 0.02, 0.05], v=[0, 0, 0, 1, 0, 0]), 0.6, 5e-4
    ),
    Case("slider-crank with clearance", slider_crank(1e-3, None), 0.3, 1e-4),
    Case("slider-crank with friction in its clearance", slider_crank(5e-4, coulomb(0.1, 0.05)), 0.2, 1e-4),
    Case("rotor rubs", rotor(coulomb(0.1, 0.1)), 0.4, 2.5e-4),
    Case("pendulum strikes a wall", pendulum(1, HUNT), 1.0, 1e-3, struck),
    Case("double pendulum strikes a wall", pendulum(2, LINEAR, coulomb(0.3, 0.02)), 0.8, 5e-4),
    Case("hopping leg", leg(bristles(0.8)), 1.0, 1e-3),
    Case("chain drops", chain(4, coulomb(0.4, 0.05), 0.3), 0.4, 5e-4),
    Case("ball on a table in motion", carried(HUNT, bristles(0.5)), 0.5, 5e-4),
    Case("plank rocks on a ball", plank(bristles(0.7)), 0.6, 1e-3),
    Case("four-bar linkage strikes a stop", linkage(), 0.4, 5e-4),
    Case("wheel brakes, brush", wheel(BRUSH, 20.0, 400.0, 0.4), 0.5, 1e-3),
    Case("wheel locks, Magic Formula", wheel(MAGIC, 15.0, 1500.0, 0.5), 0.5, 1e-3),
    Case("wheel brakes, TMeasy", wheel(TMEASY, 20.0, 600.0, 0.3), 0.5, 1e-3),
    Case("wheel stops on a slope, law of slip", wheel(SLIP, 2.0, 800.0, 0.0, -0.1), 0.8, 1e-3),
)
