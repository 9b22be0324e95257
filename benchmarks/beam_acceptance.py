"""Acceptance tests of geometrically exact beams: what was asked, and what is found, with the oracle's figure beside it.

    python -m benchmarks.beam_acceptance [--parts roll_up_at_rest flight ...] [--json out.json]

Roll-up and flying spaghetti are those of Hante, Tumiotto and Arnold, Multibody Syst. Dyn. 54 (2022) 97; the right-angle
cantilever is that of Simo and Vu-Quoc with the steps and tolerances of ODIN's tests. No times are measured.
"""

from __future__ import annotations

import argparse
import json
import math
import runpy
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import eomgen
from benchmarks.measure import table
from tests.models.cosserat import ROLL_UP, beam_scene
from tests.oracles.rolled_strip import MOMENT, Strip, away_from_clamp

EXAMPLES = Path(__file__).parents[1] / "examples"
#: Where the end that is thrown is at 2.5 s and 5 s by elements, in NumPy, of steps of 2^-10 s.
THROWN_END = {
    4: ((3.55778181, 0.14453902, 0.14393421), (19.68905208, 2.61983381, -2.32524228)),
    8: ((3.44348092, 0.18402970, 0.05276752), (19.63434192, 1.78533503, -1.70756265)),
    16: ((3.41719291, 0.19477725, 0.02708423), (19.58065630, 1.57869296, -1.55157278)),
    32: ((3.41086502, 0.19758223, 0.02046807), (19.56466560, 1.52752843, -1.51284367)),
}


@dataclass(frozen=True)
class Row:
    """A quantity: what was asked for, what is found."""

    part: str
    quantity: str
    asked: str
    found: str


def script(name: str) -> Any:
    return SimpleNamespace(**runpy.run_path(str(EXAMPLES / name)))


def shown(values: Sequence[float], form: str = ".2g") -> str:
    return ", ".join(f"{value:{form}}" for value in values)


def slopes(errors: Sequence[float]) -> list[float]:
    return [math.log2(coarse / fine) for coarse, fine in pairwise(errors)]


def roll_up_at_rest() -> list[Row]:
    """Ten beams in ten directions, all in one scene."""
    turns, rows = list(Rotation.random(10, random_state=np.random.default_rng(3))), []
    for elements in (3, 4, 8, 16):
        scene = beam_scene(elements, {})
        beam = scene["beams"].pop("rope")
        scene |= {"joints": {}, "forces": {}}
        for number, turn in enumerate(turns):
            name, axis = f"rope{number}", turn.apply([0.0, MOMENT, 0.0]).tolist()
            scene["beams"][name] = beam
            clamp = {"type": "fixed", "parent": "base", "child": name, "orientation": turn.as_matrix().tolist()}
            scene["joints"][f"clamp{number}"] = clamp
            torque = [f"{component!r} * load" for component in axis]
            scene["forces"][f"tip{number}"] = {"body": name, "point": [10.0, 0.0, 0.0], "torque": torque}
        model = eomgen.build(scene, profile="quick")
        pose = model.evaluate("poses", model.equilibrium().q)["pose"]
        last = pose[[model.bodies.index(f"rope{number}.{elements}") for number in range(len(turns))]]
        gap = np.linalg.norm(last[:, 4:], axis=1).max() / 10.0
        turned = max(
            (turn.inv() * Rotation.from_quat(np.roll(end[:4], -1))).magnitude()
            for turn, end in zip(turns, last, strict=True)
        )
        what = f"{elements} elements: gap of the end by L, its rotation from a whole turn"
        rows.append(Row("roll-up at rest", what, "1e-9, 1e-9", shown([gap, turned])))
    return rows


def roll_up_in_time() -> list[Row]:
    damping = dict.fromkeys(ROLL_UP, 200.0)
    scene = beam_scene(8, {"torque": [0.0, f"{MOMENT!r} * load", 0.0]}, {"damping": damping})
    run = eomgen.build(scene, profile="quick").simulate(
        60.0, 2.0**-10, rho_inf=0.8, record_every=10 * 2**10, error_estimate=False
    )
    pose = run.poses["rope.8"][1:]
    gaps = np.linalg.norm(pose[:, 4:], axis=1) + np.linalg.norm(pose[:, :4] - [-1.0, 0.0, 0.0, 0.0], axis=1)
    times = np.array([10.0, 20.0, 30.0, 40.0, 50.0, 60.0])
    what = "gap and |p + p0| at 10, 20 ... 60 s"
    found = [Row("roll-up, Cd = 100", what, "1e-3 at 30 s", shown(gaps, ".3g"))]
    for name, linear in (("our elements", True), ("elements of one wrench", False)):
        exact = away_from_clamp(Strip(8, 200.0, linear).moved(times))
        found.append(Row("roll-up, Cd = 100", f"the same by SciPy, {name}", "", shown(exact, ".3g")))
    return found


def order_in_time() -> list[Row]:
    spaghetti, rows = script("flying_spaghetti/spaghetti.py"), []
    for kind, coarsest in (("kirchhoff", 8), ("inextensible", 7)):
        model = eomgen.build(spaghetti.scene(16, model=kind), method="rattlie")

        def at(power: int, model: Any = model) -> list[Any]:
            run = model.simulate(
                1.0, 2.0**-power, method="rattlie", record_every=2 ** (power - 6), error_estimate=False
            )
            v = run.v.reshape(len(run.t), 17, 6)
            return [run.q, np.delete(v, 3, axis=2), v[:, :, 3], run.multipliers]

        runs = [at(coarsest + number) for number in range(7)]
        exact = [fine + (fine - coarse) / 3.0 for coarse, fine in zip(*runs[-2:], strict=True)]
        names = ("positions", "velocities but the axial ones", "axial velocities", "section forces")
        for k, name in enumerate(names):
            errors = [float(np.sqrt(np.mean((run[k] - exact[k]) ** 2))) for run in runs[:5]]
            what = f"{name}, slopes from 2^-{coarsest} to 2^-{coarsest + 4} s"
            rows.append(Row(f"16 elements, {kind}", what, "2.0 +- 0.1", shown(slopes(errors), ".2f")))
    return rows


def order_in_space() -> list[Row]:
    spaghetti, ends, rows = script("flying_spaghetti/spaghetti.py"), [], []
    for elements in (4, 8, 16, 32, 64):
        model = eomgen.build(spaghetti.scene(elements), method="rattlie")
        run = model.simulate(5.0, 2.0**-12, method="rattlie", record_every=5 * 2**11, error_estimate=False)
        ends.append(run.poses["noodle"][1:, 4:])
        if elements in THROWN_END:
            off = float(np.abs(ends[-1] - THROWN_END[elements]).max())
            what = f"{elements} elements: the thrown end at 2.5 and 5 s off the digits, m"
            rows.append(Row("spaghetti in space", what, "1e-5", shown([off])))
    apart = [np.linalg.norm(fine - coarse, axis=1) for coarse, fine in pairwise(ends)]
    for k, t in enumerate((2.5, 5.0)):
        found = slopes([float(gap[k]) for gap in apart])
        rows.append(Row("spaghetti in space", f"slopes at {t} s, 4 to 64 elements", "2.0 +- 0.1", shown(found, ".2f")))
    return rows


def free_flight() -> list[Row]:
    spaghetti, rows = script("flying_spaghetti/spaghetti.py"), []
    for group in ("SE3", "R3xSO3"):
        data = spaghetti.scene(16)
        if group == "R3xSO3":
            data["coordinates"], data["beams"]["noodle"]["group"] = "absolute", group
        model, gaps, ranges, trend = eomgen.build(data, method="rattlie"), [], [], 0.0
        ends = []
        for power in (8, 9, 10):
            run = model.simulate(
                15.0, 2.0**-power, method="rattlie", record_every=2 ** (power - 5), error_estimate=False
            )
            free, nodes = run.t >= spaghetti.THROWN, spaghetti.axis_of(run, 16)
            ends.append(nodes[-1])
            centre = spaghetti.centre_of_mass(nodes[free])
            gaps.append(float(np.abs(centre - spaghetti.in_free_flight(run.t[free])).max()))
            energy = run.energy["kinetic"][free] + run.energy["potential"][free]
            ranges.append(float(np.ptp(energy)))
            trend = abs(float(np.polyfit(run.t[free], energy, 1)[0]))
        part, steps = f"free flight, {group}", "at 2^-8, 2^-9, 2^-10 s"
        apart = [float(np.abs(fine - coarse).max()) for coarse, fine in pairwise(ends)]
        rows += [
            Row(part, f"centre of mass off its way {steps}, m", "1e-6", shown(gaps)),
            Row(part, f"range of the energy {steps}, J", "2e-4, slope 2", shown(ranges)),
            Row(part, "trend of the energy, J/s", "none", shown([trend])),
            Row(part, "nodes at 15 s, from step to step, m", "", shown(apart)),
        ]
    return rows


def long_steps() -> list[Row]:
    cantilever, rows = script("right_angle_cantilever/cantilever.py"), []
    model = eomgen.build(cantilever.scene(5), profile="quick")
    fine = model.simulate(10.0, 0.01, record_every=20, rho_inf=0.8, error_estimate=False)
    for name, settings in (("1e-5, 1e-3", {"rtol": 1e-5, "atol": 1e-3}), ("1e-10, 1e-12", {})):
        stepped, counts = model.start(step=0.2, rho_inf=0.8, settings=settings), [0]
        for _ in range(150):
            stepped.step()
            counts.append(stepped.statistics["newton_iterations"])
        taken = np.diff(counts)
        part = f"cantilever, h = 0.2 s, tolerances {name}"
        iterations = f"{np.mean(taken):.1f}, {np.max(taken)}"
        rows.append(Row(part, "150 steps: iterations in the mean, at most", "8, 20", iterations))
        run = model.simulate(10.0, 0.2, rho_inf=0.8, settings=settings, error_estimate=False)
        off = [
            float(
                np.abs(run.outputs[place] - fine.outputs[place])[:, 2].max() / np.abs(fine.outputs[place][:, 2]).max()
            )
            for place in ("elbow", "tip")
        ]
        rows.append(Row(part, "elbow and tip off 0.01 s up to 10 s, by the peak", "0.1", shown(off)))
    return rows


PARTS: dict[str, Callable[[], list[Row]]] = {
    part.__name__: part
    for part in (roll_up_at_rest, roll_up_in_time, order_in_time, order_in_space, free_flight, long_steps)
}


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.beam_acceptance", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args(words)
    rows = [row for part in arguments.parts for row in PARTS[part]()]
    print(
        table(["test", "quantity", "asked", "found"], [[row.part, row.quantity, row.asked, row.found] for row in rows])
    )
    if arguments.json:
        arguments.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
