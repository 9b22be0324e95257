"""Random spacecraft in Basilisk: a hub in free flight with two panels on sprung and damped hinges."""

from __future__ import annotations

from functools import cache
from importlib import import_module

import numpy as np

import eomgen
from eomgen.pipeline.model import Model
from tests.oracles.evaluation import Array
from tests.oracles.states import random_unit_quaternions, rotation_of

SECONDS = 5.0
#: Step of Basilisk's Runge-Kutta method, s.
STEP = 0.002
#: Modules of Basilisk: the spacecraft, its panels, the simulation, units.
BASILISK = (
    "simulation.spacecraft", "simulation.hingedRigidBodyStateEffector", "utilities.SimulationBaseClass",
    "utilities.macros",
)  # fmt: skip  # a list of words
Numbers = dict[str, float]


def motion(seed: int) -> dict[str, float]:
    """Compare the motion over five seconds at its end: hinge angles and rates, attitude, angular velocity, place."""
    data, rng = _numbers(seed), np.random.default_rng([seed, 1])
    attitude, omega = random_unit_quaternions(rng, 1)[0], rng.uniform(-0.5, 0.5, 3)
    angles, rates = rng.uniform(-0.3, 0.3, 2), rng.uniform(-0.2, 0.2, 2)
    start, end = _basilisk(data, attitude, omega, angles, rates)
    solution = _model().simulate(
        SECONDS,
        0.01,
        method="taylor",
        parameters=data,
        initial={
            "q": [*attitude, *start["place"], *angles],
            "v": [*omega, *(rotation_of(attitude).T @ start["velocity"]), *rates],
        },
        error_estimate=False,
    )
    assert solution.success, solution.message
    q, v, R = solution.q[-1], solution.v[-1], rotation_of(solution.q[-1, :4])
    own = {
        "place": q[4:7], "attitude": R, "velocity": R @ v[3:6], "angular velocity": v[:3], "hinge angles": q[7:],
        "hinge rates": v[6:],
    }  # fmt: skip  # a table
    return {name: float(np.linalg.norm(own[name] - end[name]) / np.linalg.norm(end[name])) for name in own}


def _numbers(seed: int) -> Numbers:
    """Return the parameters of the spacecraft of a seed by their names."""
    rng = np.random.default_rng(seed)
    data = {"mass": float(rng.uniform(200.0, 900.0))}
    data |= _triple("hub", _inertia(data["mass"], rng.uniform(0.5, 1.5, 3))) | _triple("c", rng.uniform(-0.2, 0.2, 3))
    for k in (1, 2):
        mass, d, stiffness, damping = rng.uniform((20.0, 0.5, 50.0, 0.0), (90.0, 1.5, 400.0, 20.0)).tolist()
        data |= {f"m{k}": mass, f"d{k}": d, f"k{k}": stiffness, f"c{k}": damping}
        data |= _triple(f"panel{k}", _inertia(mass, rng.uniform(0.3, 1.2, 3)))
        data |= _triple(f"hinge{k}", rng.uniform(-1.0, 1.0, 3))
    return data


def _triple(name: str, values: Array) -> Numbers:
    return {f"{name}{axis}": float(value) for axis, value in zip("xyz", values, strict=True)}


def _inertia(mass: float, sizes: Array) -> Array:
    """Return the principal moments of inertia of an ellipsoid with some half axes."""
    return np.asarray(0.2 * mass * (np.sum(sizes**2) - sizes**2))


@cache
def _model() -> Model:
    """Return eomgen's spacecraft, with a parameter for each number."""
    builder = eomgen.SceneBuilder("spacecraft", gravity=[0, 0, 0])
    for name in _numbers(0):
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


def _basilisk(
    data: Numbers, attitude: Array, omega: Array, angles: Array, rates: Array
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return Basilisk's states at the start and at the end."""
    parts = {name: import_module(f"Basilisk.{name}") for name in BASILISK}
    spacecraft, hinges, base, macros = parts.values()
    simulation = base.SimBaseClass()
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
        panel = hinges.HingedRigidBodyStateEffector()
        panel.mass, panel.d, panel.k, panel.c = (data[f"{word}{k}"] for word in "mdkc")
        panel.IPntS_S = np.diag([data[f"panel{k}{axis}"] for axis in "xyz"]).tolist()
        panel.r_HB_B = [[data[f"hinge{k}{axis}"]] for axis in "xyz"]
        panel.dcm_HB = _ORIENTATIONS[k].T.tolist()
        panel.thetaInit, panel.thetaDotInit = float(angles[k - 1]), float(rates[k - 1])
        craft.addStateEffector(panel)
        panels.append(panel)
    for k, model in enumerate((craft, *panels)):
        model.ModelTag = f"model{k}"
        simulation.AddModelToTask("task", model)
    simulation.InitializeSimulation()

    def read() -> dict[str, Array]:
        hub, angles = craft.scStateOutMsg.read(), [panel.hingedRigidBodyOutMsg.read() for panel in panels]
        s = np.array(hub.sigma_BN)
        quaternion = np.concatenate([[1.0 - s @ s], 2.0 * s]) / (1.0 + s @ s)
        return {
            "place": np.array(hub.r_BN_N), "velocity": np.array(hub.v_BN_N), "attitude": rotation_of(quaternion),
            "angular velocity": np.array(hub.omega_BN_B), "hinge angles": np.array([it.theta for it in angles]),
            "hinge rates": np.array([it.thetaDot for it in angles]),
        }  # fmt: skip  # a table

    start = read()
    simulation.ConfigureStopTime(macros.sec2nano(SECONDS))
    simulation.ExecuteSimulation()
    return start, read()
