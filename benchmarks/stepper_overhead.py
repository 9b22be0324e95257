"""A controller of 1 kHz around the UR5: what a step of compiled code, of ``run.step(u)`` and of ``simulate`` costs.

    python -m benchmarks.stepper_overhead [--rounds 9] [--quick] [--core N] [--json out.json]

The motion under the controller is first held against Pinocchio: its articulated-body algorithm in a classical
Runge-Kutta method of order 4, torques held over each sample.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import eomgen
from benchmarks.measure import machine, pin_to_core
from benchmarks.robots import ROBOTS, PinocchioModel, driven, pinocchio_model, scene
from eomgen.formula.nodes import ZERO, Number, Symbol
from eomgen.pipeline.model import Model
from eomgen.scene.forces.forces import Effort
from eomgen.scene.scene import Scene
from eomgen.simulation.simulator import Simulator
from eomgen.system.signals import Sampling, State

Array = NDArray[np.float64]
ROBOT = ROBOTS["ur5"]
STEP, SAMPLES = 1e-3, 1000
TARGET = np.array([0.5, -1.2, 1.0, -0.4, 0.8, 0.3])
STIFFNESS = np.array([400.0, 400.0, 300.0, 50.0, 50.0, 20.0])
DAMPING = np.array([60.0, 60.0, 40.0, 4.0, 4.0, 1.0])


def build() -> Model:
    """Return the robot with an input for the torque of each joint."""
    return eomgen.build(driven(scene(ROBOT)), ["forward_dynamics"], method="rk4")


def controlled(run: Simulator, samples: int) -> None:
    """Step a robot under a PD controller."""
    for _ in range(samples):
        run.step(STIFFNESS * (TARGET - run.q) - DAMPING * run.v)


def by_pinocchio(peer: PinocchioModel, samples: int) -> tuple[Array, Array]:
    """Return q and v of the same motion by the peer, in eomgen's order."""
    import pinocchio as pin  # noqa: PLC0415  # a peer, which may be missing

    model, data = peer.model, peer.model.createData()
    order = peer.v_order

    def rates(q: Array, v: Array, tau: Array) -> tuple[Array, Array]:
        return v, np.array(pin.aba(model, data, q, v, tau))

    q, v = np.zeros(model.nq), np.zeros(model.nv)
    for _ in range(samples):
        tau = (STIFFNESS[order] * (TARGET[order] - q)) - DAMPING[order] * v
        first = rates(q, v, tau)
        second = rates(q + STEP / 2 * first[0], v + STEP / 2 * first[1], tau)
        third = rates(q + STEP / 2 * second[0], v + STEP / 2 * second[1], tau)
        last = rates(q + STEP * third[0], v + STEP * third[1], tau)
        q, v = (
            start + STEP / 6 * (a + 2 * b + 2 * c + d)
            for start, a, b, c, d in zip((q, v), first, second, third, last, strict=True)
        )
    back = np.argsort(order)
    return q[back], v[back]


def seconds(work: Callable[[], None]) -> float:
    began = time.thread_time()
    work()
    return time.thread_time() - began


def in_the_scene(described: Scene) -> Scene:
    """Return a robot with the controller as sampled states, one for each joint."""
    states, efforts = [], []
    for number, joint in enumerate(described.joints):
        kp, kd, target = (float(values[number]) for values in (STIFFNESS, DAMPING, TARGET))
        name = f"torque_{number}"
        formula = Number(kp) * (Number(target) - Symbol("q", joint.name)) - Number(kd) * Symbol("v", joint.name)
        states.append(State(name, ZERO, sampling=Sampling(formula, STEP)))
        efforts.append(Effort(name, joint.name, Symbol("state", name), 0))
    return replace(described, states=tuple(states), elements=(*described.elements, *efforts))


def contestants(model: Model, sampled: Model, samples: int) -> dict[str, Callable[[], None]]:
    """Return what takes as many steps each."""
    many, one, loop = (model.start(method="rk4", step=STEP) for _ in range(3))
    torque = np.zeros(model.nu)
    names = model.inputs

    def in_one_call() -> None:
        many.restore(begun)
        many.step(torque, samples)

    def one_by_one() -> None:
        one.restore(begun)
        for _ in range(samples):
            one.step(torque)

    def with_controller() -> None:
        loop.restore(begun)
        controlled(loop, samples)

    def by_simulate() -> None:
        q, v = np.zeros(model.nq), np.zeros(model.nv)
        for k in range(max(samples // 50, 1)):
            u = dict(zip(names, STIFFNESS * (TARGET - q) - DAMPING * v, strict=True))
            t = k * STEP
            found = model.simulate(t + STEP, STEP, initial={"q": q, "v": v}, inputs=u, t_start=t, error_estimate=False)
            q, v = found.q[-1], found.v[-1]

    def in_scene() -> None:
        scripted.restore(scripted_begun)
        scripted.step(n=samples)

    many.step(torque)
    begun = many.state
    scripted = sampled.start(method="rk4", step=STEP)
    scripted_begun = scripted.state
    return {
        "compiled steps in one call": in_one_call,
        "run.step(u)": one_by_one,
        "PD controller in NumPy and run.step(u)": with_controller,
        "the same controller in the scene, in one call": in_scene,
        "PD controller and simulate (1 of 50 samples)": by_simulate,
    }


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--core", type=int, default=None)
    parser.add_argument("--quick", action="store_true", help="check numbers, time nothing")
    parser.add_argument("--json", type=Path, default=None)
    chosen = parser.parse_args(arguments)
    described = scene(ROBOT)
    model = build()
    run = model.start(method="rk4", step=STEP)
    controlled(run, SAMPLES)
    q, v = by_pinocchio(pinocchio_model(ROBOT, described), SAMPLES)
    error = float(np.max(np.abs(run.q - q)))
    rates = float(np.max(np.abs(run.v - v)))
    print(f"after {SAMPLES} samples: q differs from Pinocchio's by {error:.2g} rad, v by {rates:.2g} rad/s")
    if error > 1e-12:
        return 1
    if chosen.quick:
        return 0
    pin_to_core(chosen.core)
    sampled = eomgen.build(in_the_scene(described), ["forward_dynamics", "internal_rate"], method="rk4")
    works = contestants(model, sampled, SAMPLES)
    found: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(chosen.rounds):
        for name, work in works.items():
            taken = SAMPLES // 50 if "1 of 50" in name else SAMPLES
            found[name].append(1e6 * seconds(work) / taken)
    base = found["compiled steps in one call"]
    print(machine())
    print(f"us of CPU time per step of {STEP:g} s; medians of {chosen.rounds} rounds")
    rows = {}
    for name, times in found.items():
        ratio = statistics.median(mine / compiled for mine, compiled in zip(times, base, strict=True))
        middle, least = statistics.median(times), min(times)
        beyond = statistics.median(mine - compiled for mine, compiled in zip(times, base, strict=True))
        rows[name] = {"us": middle, "smallest": least, "beyond": beyond, "ratio": ratio, "per_second": 1e6 / middle}
        print(
            f"  {name:46} {middle:8.2f}  least {least:8.2f}  beyond the C {beyond:8.2f}  ratio {ratio:7.2f}"
            f"  {1e6 / middle:9.0f} steps/s"
        )
    if chosen.json:
        chosen.json.write_text(json.dumps({"error": error, "rows": rows}, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
