"""Runs of REBOUND in a process of its own, which ``benchmarks.solar_system`` asks by lines of JSON.

The first line holds G, masses, places and velocities; each further one an integrator with its options, a step, a time
and a number of rows. The answer holds states at the ends of these rows, or, where there are none, seconds.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any


def _simulation(system: dict[str, Any], asked: dict[str, Any]) -> Any:
    import rebound  # noqa: PLC0415  # of the environment in which this runs

    simulation = rebound.Simulation()
    simulation.G = system["G"]
    for mass, place, velocity in zip(system["masses"], system["places"], system["velocities"], strict=True):
        simulation.add(m=mass, **dict(zip(("x", "y", "z", "vx", "vy", "vz"), (*place, *velocity), strict=True)))
    simulation.integrator = asked["integrator"]
    for name, value in asked["options"].items():
        setattr(simulation.integrator, name, value)
    simulation.dt = asked["step"]
    return simulation


def _state(simulation: Any) -> list[list[float]]:
    return [[one.x, one.y, one.z, one.vx, one.vy, one.vz] for one in simulation.particles]


def main() -> None:
    import rebound  # noqa: PLC0415  # as above

    system = json.loads(sys.stdin.readline())
    print(json.dumps({"rebound": rebound.__version__}), flush=True)
    for line in sys.stdin:
        asked = json.loads(line)
        simulation, rows = _simulation(system, asked), asked["rows"]
        states = [_state(simulation)]
        began = time.process_time()
        for row in range(1, max(rows, 1) + 1):
            end = asked["days"] * row / max(rows, 1)
            if asked["fixed"]:
                done = round(asked["days"] * (row - 1) / max(rows, 1) / asked["step"])
                simulation.steps(round(end / asked["step"]) - done)
                simulation.synchronize()
            else:
                simulation.integrate(end)
            if rows:
                states.append(_state(simulation))
        seconds = time.process_time() - began
        print(json.dumps({"states": states} if rows else {"seconds": seconds}), flush=True)


if __name__ == "__main__":
    main()
