"""Random spacecraft in Basilisk: a hub in free flight with two panels on sprung and damped hinges."""

from __future__ import annotations

from functools import cache

import numpy as np

import eomgen
from eomgen.pipeline.model import Model
from tests.oracles.evaluation import Array
from tests.oracles.states import random_unit_quaternions, rotation_of

SECONDS = 5.0
#: Step of Basilisk's Runge-Kutta method, s.
STEP = 0.002
Numbers = dict[str, float]


def basilisk_panels(seed: int) -> dict[str, float]:
    """Compare the motion over five seconds at its end: hinge angles and rates, attitude, angular velocity, place."""
    rng = np.random.default_rng(seed)
    places = {}
    data: Numbers = {"mass": rng.uniform(200.0, 900.0)}
    data |= _inertia("hub", data["mass"], rng.uniform(0.5, 1.5, 3))
    data |= dict(zip(("cx", "cy", "cz"), rng.uniform(-0.2, 0.2, 3), strict=True))
    for k in (1, 2):
        data[f"m{k}"] = rng.uniform(20.0, 90.0)
        data |= _inertia(f"panel{k}", data[f"m{k}"], rng.uniform(0.3, 1.2, 3))
        data |= {f"d{k}": rng.uniform(0.5, 1.5), f"k{k}": rng.uniform(50.0, 400.0), f"c{k}": rng.uniform(0.0, 20.0)}
        data |= {f"angle{k}": rng.uniform(-0.3, 0.3), f"rate{k}": rng.uniform(-0.2, 0.2)}
        places |= {f"hinge{k}{axis}": value for axis, value in zip("xyz", rng.uniform(-1.0, 1.0, 3), strict=True)}
    data |= places
    attitude, omega = random_unit_quaternions(rng, 1)[0], rng.uniform(-0.5, 0.5, 3)
    start, end = _basilisk(data, attitude, omega)
    model = _model()
    fixed = [parameter for parameter in data if parameter not in {f"{word}{k}" for word in ("angle", "rate") for k in (1, 2)}]
    angles, rates = ([data[f"{word}{k}"] for k in (1, 2)] for word in ("angle", "rate"))
    R = rotation_of(attitude)
    solution = model.simulate(
        SECONDS,
        0.01,
        method="taylor",
        parameters={name: float(data[name]) for name in fixed},
        initial={"q": [*attitude, *start["place"], *angles], "v": [*omega, *(R.T @ start["velocity"]), *rates]},
        error_estimate=False,
    )
    assert solution.success, solution.message
    q, v = solution.q[-1], solution.v[-1]
    own = {
        "place": q[4:7], "attitude": rotation_of(q[:4]), "velocity": rotation_of(q[:4]) @ v[3:6], "angular velocity": v[:3],
        "hinge angles": q[7:], "hinge rates": v[6:],
    }  # fmt: skip  # a table
    return {name: float(np.linalg.norm(own[name] - end[name]) / np.linalg.norm(end[name])) for name in own}


def _inertia(name: str, mass: float, sizes: Array) -> Numbers:
    """Return principal moments of inertia of an ellipsoid of some mass by the names of parameters."""
    squares = 0.2 * mass * np.array([sizes[1:] @ sizes[1:], sizes[::2] @ sizes[::2], sizes[:2] @ sizes[:2]])
    return {f"{name}{axis}": float(value) for axis, value in zip("xyz", squares, strict=True)}


@cache
def _model() -> Model:
    """Return eomgen's spacecraft, with a parameter for each number."""
    builder = eomgen.SceneBuilder("spacecraft", gravity=[0, 0, 0])
    names = ["mass", "cx", "cy", "cz", *(f"hub{axis}" for axis in "xyz")]
    for k in (1, 2):
        names += [f"m{k}", f"d{k}", f"k{k}", f"c{k}", *(f"{word}{k}{axis}" for word in ("panel", "hinge") for axis in "xyz")]
    for name in names:
        builder.parameter(name, 1.0, tunable=True)
    builder.body("hub", "mass", center_of_mass=["cx", "cy", "cz"], inertia=["hubx", "huby", "hubz"])
    builder.joint("flight", "free", "base", "hub")
    for k in (1, 2):
        inertia = [f"panel{k}{axis}" for axis in "xyz"]
        builder.body(f"panel{k}", f"m{k}", center_of_mass=[f"-d{k}", 0, 0], inertia=inertia)
        builder.joint(
            f"hinge{k}", "revolute", "hub", f"panel{k}", axis=[0, 1, 0], orientation=_ORIENTATIONS[k].tolist(),
            position=[f"hinge{k}{axis}" for axis in "xyz"], stiffness=f"k{k}", damping=f"c{k}",
        )  # fmt: skip  # a table
    return eomgen.build(builder.build(), profile="quick")


#: Axes of the hinges in the hub, as columns: both stand skew.
_ORIENTATIONS = {k: rotation_of(random_unit_quaternions(np.random.default_rng(k), 1))[0] for k in (1, 2)}


def _basilisk(data: Numbers, attitude: Array, omega: Array) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return Basilisk's states at the start and at the end."""
    from Basilisk.simulation import hingedRigidBodyStateEffector, spacecraft
    from Basilisk.utilities import SimulationBaseClass, macros

    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("task", macros.sec2nano(STEP)))
    craft = spacecraft.Spacecraft()
    craft.hub.mHub = data["mass"]
    craft.hub.r_BcB_B = [[data[name]] for name in ("cx", "cy", "cz")]
    craft.hub.IHubPntBc_B = np.diag([data[f"hub{axis}"] for axis in "xyz"]).tolist()
    craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = [[3.0], [-2.0], [1.0]], [[0.3], [0.1], [-0.2]]
    craft.hub.sigma_BNInit = [[value] for value in attitude[1:] / (1.0 + attitude[0])]
    craft.hub.omega_BN_BInit = [[value] for value in omega]
    panels = []
    for k in (1, 2):
        panel = hingedRigidBodyStateEffector.HingedRigidBodyStateEffector()
        panel.mass, panel.d, panel.k, panel.c = (data[f"{word}{k}"] for word in "mdkc")
        panel.IPntS_S = np.diag([data[f"panel{k}{axis}"] for axis in "xyz"]).tolist()
        panel.r_HB_B = [[data[f"hinge{k}{axis}"]] for axis in "xyz"]
        panel.dcm_HB = _ORIENTATIONS[k].T.tolist()
        panel.thetaInit, panel.thetaDotInit = data[f"angle{k}"], data[f"rate{k}"]
        craft.addStateEffector(panel)
        panels.append(panel)
    for k, model in enumerate((craft, *panels)):
        model.ModelTag = f"model{k}"
        simulation.AddModelToTask("task", model)
    simulation.InitializeSimulation()

    def read() -> dict[str, Array]:
        hub, hinges = craft.scStateOutMsg.read(), [panel.hingedRigidBodyOutMsg.read() for panel in panels]
        s = np.array(hub.sigma_BN)
        quaternion = np.concatenate([[1.0 - s @ s], 2.0 * s]) / (1.0 + s @ s)
        return {
            "place": np.array(hub.r_BN_N), "velocity": np.array(hub.v_BN_N), "attitude": rotation_of(quaternion),
            "angular velocity": np.array(hub.omega_BN_B), "hinge angles": np.array([it.theta for it in hinges]),
            "hinge rates": np.array([it.thetaDot for it in hinges]),
        }  # fmt: skip  # a table

    start = read()
    simulation.ConfigureStopTime(macros.sec2nano(SECONDS))
    simulation.ExecuteSimulation()
    return start, read()
