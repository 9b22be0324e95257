"""A million runs of a double pendulum on a shaking base: time of a run, memory, and the same bits on all cores.

    python -m benchmarks.million_runs [--samples 1000000]

Masses and initial velocities are drawn; 1000 steps of RK4 a run; statistics of the place of the tip at 101 times and
the extremes of each run are kept. Wall time; the memory is the largest of the process.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import resource
import sys
import time
from pathlib import Path

import eomgen

SCENE = Path(__file__).parents[1] / "examples" / "double_pendulum_on_shaking_base" / "scene.toml"
VARY = {"m2": "normal(0.6, 5%)", "v.shoulder": "uniform(-1, 1)", "v.elbow": "uniform(-1, 1)"}
COLUMNS = ["tip"]
STEPS = 1000


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=1_000_000, help="runs (1000000)")
    samples = parser.parse_args().samples
    model = eomgen.build(SCENE)
    model.simulate_many(0.1, 1e-3, vary=VARY, samples=64, method="rk4")
    for workers in sorted({1, os.cpu_count() or 1}):
        began = time.perf_counter()
        ensemble = model.simulate_many(
            1e-3 * STEPS, 1e-3, vary=VARY, samples=samples, columns=COLUMNS, points=101, method="rk4", workers=workers
        )
        seconds = time.perf_counter() - began
        digest = hashlib.sha256()
        for name in sorted(ensemble.results):
            digest.update(ensemble.results[name].tobytes())
        for name in ensemble.columns:
            digest.update(ensemble.mean(name).tobytes())
        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024.0 if sys.platform == "linux" else 1024.0**2)
        print(
            f"{workers} cores: {seconds:.1f} s, {1e6 * seconds / samples:.1f} us a run,"
            f" {1e9 * seconds / samples / STEPS:.1f} ns a step; {used:.0f} MB; {digest.hexdigest()[:16]}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
