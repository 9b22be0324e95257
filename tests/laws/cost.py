"""Cost of laws in C: runs of the car in a side wind by its C files, against the same laws as formulas.

    python -m tests.laws.cost

Processor times of runs without error estimates, in pairs; the ratio is the median over the pairs.
"""

from __future__ import annotations

import resource
import statistics
import tomllib
from typing import Any

import eomgen
from tests.examples.test_car_in_side_wind import FOLDER, SCENE, TYRE, by_formulas

RUNS = {"generalized_alpha": 5e-5, "rk4": 1e-4, "rosenbrock": 2e-4}
PAIRS = 15
_FORCES = ("front_x", "front_y", "rear_x", "rear_y")


def _tyres_by_formulas() -> dict[str, Any]:
    """Return the scene with the tyres as definitions, and the air in C."""
    data, formulas = tomllib.loads(SCENE.read_text(encoding="utf-8")), by_formulas()["definitions"]
    del data["laws"]["tyre"]
    data["laws"]["air"]["source"] = str(FOLDER / "air.c")
    data["definitions"] |= {key.format(n=n): formulas[key.format(n=n)] for key in TYRE for n in ("front", "rear")}
    data["definitions"] |= {name: formulas[name] for name in _FORCES}
    return data


def _air_by_formulas() -> dict[str, Any]:
    """Return the scene with the table of the air as definitions, and the tyres in C."""
    data, written = by_formulas(), tomllib.loads(SCENE.read_text(encoding="utf-8"))
    data["laws"] = {"tyre": {**written["laws"]["tyre"], "source": str(FOLDER / "tyre.c")}}
    data["definitions"] |= {name: written["definitions"][name] for name in _FORCES}
    for key in TYRE:
        for n in ("front", "rear"):
            del data["definitions"][key.format(n=n)]
    return data


def _seconds(model: Any, step: float) -> float:
    before = resource.getrusage(resource.RUSAGE_SELF)
    model.simulate(3.5, step, error_estimate=False, record_every=100)
    after = resource.getrusage(resource.RUSAGE_SELF)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    scenes = {"tyre": _tyres_by_formulas(), "air": _air_by_formulas(), "both": by_formulas()}
    print(f"{'method':20s} {'law':5s} {'in C, s':>9s} {'formula, s':>11s} {'ratio':>7s}")
    for method, step in RUNS.items():
        in_c = eomgen.build(SCENE, method=method)
        for name, data in scenes.items():
            formula = eomgen.build(data, method=method)
            _seconds(in_c, step), _seconds(formula, step)
            pairs = [(_seconds(in_c, step), _seconds(formula, step)) for _ in range(PAIRS)]
            first, second = (statistics.median(column) for column in zip(*pairs, strict=True))
            ratio = statistics.median(a / b for a, b in pairs)
            print(f"{method:20s} {name:5s} {first:9.4f} {second:11.4f} {ratio:7.3f}", flush=True)


if __name__ == "__main__":
    main()
