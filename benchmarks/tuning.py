"""tune against a full sweep: whether it meets the demand, how near the best it comes, and what it costs.

    python -m benchmarks.tuning [--scenes NAME,NAME] [--budget 40] [--out tuning.json]

For each scene one sweep (``eomgen.tradeoff``, all axes) and one ``eomgen.tune`` for each demand. ``to best``: the time
of what tune chose over that of the cheapest point of the sweep that meets the demand on the scene's own run.
``verified``: over that of the cheapest point whose error leaves as much room as tune's verification runs asked for.
Costs are seconds of computation over the sweep's, builds not counted.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import eomgen
from eomgen.errors import EomgenError

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
DEMANDS = (1e-2, 1e-4, 1e-6, 1e-8)
#: A pendulum that hits a stop.
STOPPED: dict[str, Any] = {
    "format": 1,
    "name": "stopped",
    "bodies": {"rod": {"mass": 1.0, "center_of_mass": [0, 0, -0.3], "inertia": [0.02, 0.02, 0.002]}},
    "joints": {
        "hinge": {
            "type": "revolute",
            "parent": "base",
            "child": "rod",
            "axis": [0, -1, 0],
            "initial": {"position": 1.2},
            "limits": {"lower": -0.3, "upper": 2.0, "stiffness": 2000.0, "damping": 1.0, "onset": 1e-2},
        }
    },
    "simulation": {"step": 1e-3, "duration": 2.0},
}
#: Name -> scene, output, end in s: trees, loops, beams, vehicles, controllers, a stop.
SCENES: dict[str, tuple[Any, str, float | None]] = {
    "heavy top": (EXAMPLES / "heavy_top/joint_coordinates.toml", "centre_of_mass", 1.0),
    "double pendulum": (EXAMPLES / "double_pendulum_on_shaking_base/scene.toml", "state", 4.0),
    "spatial slider-crank": (EXAMPLES / "slider_crank_spatial/scene.toml", "slider", 0.2),
    "four-bar": (EXAMPLES / "four_bar/scene.toml", "state", 1.0),
    "spin-up beam": (EXAMPLES / "spin_up_beam/scene.toml", "tip_deflection", 20.0),
    "quarter car on a bump": (EXAMPLES / "quarter_car_on_bump/scene.toml", "state", None),
    "active quarter car": (EXAMPLES / "active_quarter_car/scene.toml", "state", 2.0),
    "half car on a road": (EXAMPLES / "half_car_on_measured_road/scene.toml", "state", 2.0),
    "PI servo": (EXAMPLES / "pi_servo/scene.toml", "state", None),
    "stop": (STOPPED, "state", None),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--budget", type=float, default=40.0)
    parser.add_argument("--out", type=Path, default=None)
    given = parser.parse_args()
    rows: list[dict[str, Any]] = []
    print(f"{'scene':24}{'demand':>8}{'met':>5}{'to best':>9}{'verified':>9}{'cost':>8}  chosen")
    for name in given.scenes.split(","):
        rows += compared(name, given.budget)
        if given.out is not None:
            given.out.write_text(json.dumps(rows, indent=2) + "\n")
    told = [row for row in rows if row["ratio"] is not None]
    met = sum(row["met"] for row in told)
    near = sum(row["ratio"] <= 1.5 for row in told)
    fair = sum(row["fair"] <= 1.5 for row in told)
    cheap = sum(row["cost"] <= 0.05 for row in told)
    print(
        f"of {len(told)}: {met} met, {near} within 1.5 x of the best ({fair} with that room), {cheap} for 5 % or less"
    )


def compared(name: str, budget: float) -> list[dict[str, Any]]:
    """Return a row for each demand on one scene."""
    scene, output, end = SCENES[name]
    try:
        study = eomgen.tradeoff(scene, outputs=[output], t_end=end, budget=budget)
    except EomgenError as error:
        print(f"{name:24}sweep: {error}")
        return []
    sweep = sum(point.took for point in study.points)
    return [row(name, scene, output, end, demand, study, sweep) for demand in DEMANDS]


def row(
    name: str, scene: Any, output: str, end: float | None, demand: float, study: eomgen.Tradeoff, sweep: float
) -> dict[str, Any]:
    """Return what tune gives for one demand, beside the sweep."""
    best = study.best(demand)
    found: dict[str, Any] = {"scene": name, "demand": demand, "sweep": sweep, "ratio": None, "met": False}
    try:
        tuned = eomgen.tune(scene, demand, output=output, t_end=end)
    except EomgenError as error:
        print(f"{name:24}{demand:8g}  {error}{'' if best else ' (nor does the sweep)'}"[:200], flush=True)
        return {**found, "refused": str(error)}
    assert isinstance(tuned, eomgen.Tuned)
    worse = max([1.0, *(run.error / max(tuned.error, 1e-300) for run in tuned.verified)])
    ratio = math.nan if best is None or not best.seconds else tuned.seconds / best.seconds
    sure = study.best(demand / worse)
    fair = ratio if sure is None or not sure.seconds else tuned.seconds / sure.seconds
    cost = tuned.spent[0] / sweep
    print(
        f"{name:24}{demand:8g}{'yes' if tuned.met else 'NO':>5}{ratio:9.2f}{fair:9.2f}{100 * cost:7.1f}%  {tuned.label}"
        f" (best: {best.label if best else 'none'})",
        flush=True,
    )
    return {
        **found, "ratio": ratio, "fair": fair, "met": tuned.met, "cost": cost, "chosen": tuned.label,
        "best": best.label if best else None, "runs": tuned.spent[1], "spent": tuned.spent[0],
    }  # fmt: skip  # a table


if __name__ == "__main__":
    main()
