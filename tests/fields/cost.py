"""The time of a gradient beside that of its two transforms: ``python -m tests.fields.cost 64`` for 64^3 cells.

Processor time of one thread, medians of ratios of pairs that are taken in turn; not a test, since tests compile without
optimisation.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable

import numpy as np

from eomgen.threads import THREADS_VARIABLE
from tests.fields.density import counted


def main(cells: int, pairs: int) -> None:
    os.environ[THREADS_VARIABLE] = "1"
    posterior, truth = counted(cells, 0.04)
    mesh, slope, buffer = posterior.mesh, np.zeros(posterior.mesh.half, complex), truth.copy()

    def seconds(call: Callable[[], object]) -> float:
        began = time.process_time()
        call()
        return time.process_time() - began

    def transforms() -> None:
        mesh.spectrum(mesh.field(buffer, overwrite=True), overwrite=True)

    def copied() -> None:
        buffer[...] = truth

    ratios, times = [], []
    for _ in range(pairs):
        copied()  # since transforms write over it
        times.append(seconds(transforms))
        ratios.append(seconds(lambda: posterior.add_gradient(1e-3, truth, slope)) / times[-1])
    print(
        f"{cells}^3 cells: a gradient takes {statistics.median(ratios):.3f} of its transforms'"
        f" {statistics.median(times) * 1e3:.2f} ms ({pairs} pairs, load {os.getloadavg()[0]:.1f})"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 64, int(sys.argv[2]) if len(sys.argv) > 2 else 21)
