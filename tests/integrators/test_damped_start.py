"""Starts that only excite motions too fast for the step: overdamped joints that move, stiff springs off their rest.

Accelerations of such starts are of the size of damping by inertia. Taken over into the algorithmic accelerations they
would throw the joint; four steps of implicit Euler, a quarter as long each, damp what they excite.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from tests.models.library import scene

VARIANTS = ("generalized_alpha", "generalized_alpha_f1", "generalized_alpha_f2", "generalized_alpha_spatial")
METHODS = (*((name, {}) for name in VARIANTS), ("hht", {"rho_inf": 0.9}), ("wbz", {"rho_inf": 0.9}))


def hinge(coordinates: str = "joint", **more: Any) -> dict[str, Any]:
    """Return a rod on a hinge with a damper whose size is a parameter."""
    body = {"mass": 1.0, "center_of_mass": [0.3, 0.1, 0.2], "inertia": [0.02, 0.03, 0.04]}
    changes = {"bodies__rod": body, "parameters__c": {"value": 1.0, "tunable": True}, "joints__hinge__damping": "c"}
    changes |= {"joints__hinge__initial__velocity": 1.0, "gravity": [0, 0, -9.81]}
    return scene("pendulum", name="hinge", coordinates=coordinates, **changes, **more)


@cache
def model(coordinates: str = "joint") -> eomgen.Model:
    return eomgen.build(hinge(coordinates))


def crept(c: float, t: float) -> float:
    """Return the angle of the overdamped hinge: its velocity is the torque by the damping, but for the start."""
    inertia = 0.03 + 0.3**2 + 0.2**2

    def torque(q: float) -> float:
        return float(9.81 * (0.3 * np.cos(q) + 0.2 * np.sin(q)))

    start = 0.5 + inertia * (1.0 - torque(0.5) / c) / c
    creep = solve_ivp(lambda _, q: torque(q[0]) / c, (0.0, t), [start], rtol=1e-10, atol=1e-12)
    return float(creep.y[0, -1])


@pytest.mark.slow
@pytest.mark.parametrize("c", [1e3, 1e12])
@pytest.mark.parametrize(("method", "given"), METHODS)
def test_an_overdamped_hinge_creeps(method: str, given: dict[str, float], c: float) -> None:
    run = model().simulate(0.5, 1e-3, method=method, parameters={"c": c}, **given)
    assert run.success and run.message == "reached t = 0.5 s in 500 steps"
    assert run.outputs["angle"][-1] == pytest.approx(crept(c, 0.5), abs=1e-3 / c + 1e-9)
    assert np.max(np.abs(run.outputs["angle"] - 0.5)) < 2.5 / c  # no throw in between


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "generalized_alpha_index3", "generalized_alpha_spatial"])
def test_so_it_does_on_constraints(method: str) -> None:
    for c in (1e3, 1e9):
        run = model("absolute").simulate(0.1, 1e-3, method=method, parameters={"c": c})
        assert run.success and run.message == "reached t = 0.1 s in 100 steps"
        assert run.outputs["angle"][-1] == pytest.approx(crept(c, 0.1), abs=2e-6)


@pytest.mark.slow
def test_an_overdamped_ball_is_not_refused() -> None:
    ball = {"type": "spherical", "parent": "base", "child": "rod", "initial": {"velocity": [1, 2, 3]}}
    torque = {"f": {"body": "rod", "torque": [f"-c * v.hinge[{k}]" for k in range(3)], "axes": "body"}}
    made = eomgen.build(hinge(forces=torque, outputs={}) | {"joints": {"hinge": ball}})
    for c in (1e3, 1e6, 1e9):
        run = made.simulate(0.1, 1e-3, parameters={"c": c})
        assert run.success and run.message.startswith("reached t = 0.1 s in 100 steps")
        assert np.max(np.abs(run.q[:, 1:])) < 2.0 / c


@cache
def spring() -> eomgen.Model:
    data = scene("oscillator", parameters__k={"value": 1.0, "tunable": True}, joints__slide__stiffness="k")
    data["joints"]["slide"]["initial"] = {"position": 1.0}
    return eomgen.build(data)


@pytest.mark.slow_except("0.0-100000000.0")
@pytest.mark.parametrize("phase", [10.0, 1e4, 1e8, 1e12])
@pytest.mark.parametrize("rho_inf", [0.0, 0.5, 0.8, 0.95])
def test_a_stiff_spring_off_its_rest_does_not_overshoot(rho_inf: float, phase: float) -> None:
    """Without the damped start, velocities were 0.02 to 0.25 times position by step, times step times frequency."""
    step = 1e-3
    run = spring().simulate(0.05, step, rho_inf=rho_inf, parameters={"k": (phase / step) ** 2})
    assert np.max(np.abs(run.q[1:])) < 0.02 and np.max(np.abs(run.v)) * step < 0.2
    assert re.search(r"the energy is out of balance by (100|99\.\d) % of the energies at work", run.message)


def test_methods_without_numerical_damping_keep_what_is_excited() -> None:
    run = spring().simulate(1.0, 1e-3, rho_inf=1.0, parameters={"k": 1e10})
    assert run.energy["total"] == pytest.approx(0.5e10, rel=1e-6)


@pytest.mark.slow
def test_the_order_is_kept() -> None:
    """The hinge at steps from those that damp its start to those that follow it."""
    reference = model().simulate(0.2, 1e-6, method="rk4", parameters={"c": 300.0}, record_every=10000).q[-1, 0]
    steps = np.array([4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4])
    errors = [abs(model().simulate(0.2, step, parameters={"c": 300.0}).q[-1, 0] - reference) for step in steps]
    assert np.all(np.array(errors) < 6.0 * steps**2)
    assert np.log2(errors[-2] / errors[-1]) == pytest.approx(2.0, abs=0.1)
