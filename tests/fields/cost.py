"""The time of a gradient beside that of its two transforms: ``python -m tests.fields.cost 64`` for 64^3 cells.

Processor time of one thread, medians of ratios of pairs that are taken in turn; not a test, since tests compile without
optimisation.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from collections.abc import Callable

import numpy as np

from eomgen.base.threads import THREADS_VARIABLE
from eomgen.fields import FieldPosterior
from eomgen.products.fields.posteriors.mesh import transforms
from tests.fields.density import counted


def main(cells: int, pairs: int, library: str, precision: str) -> None:
    os.environ[THREADS_VARIABLE] = "1"
    made, truth = counted(cells, 0.04)
    posterior = FieldPosterior(
        made.mesh, made.energy_of_cell, made.operators, made.data, transforms=library, precision=precision
    )
    mesh, slope = posterior.mesh, np.zeros(posterior.mesh.half, complex)
    own = transforms(mesh, library, 1, single=precision == "single")

    def seconds(call: Callable[[], object]) -> float:
        began = time.process_time()
        call()
        return time.process_time() - began

    def both() -> None:
        own.spectrum(0, own.field(0))

    ratios, times, wholes = [], [], []
    for _ in range(pairs):
        own.buffer[...] = truth  # since transforms write over it
        times.append(seconds(both))
        wholes.append(seconds(lambda: posterior.add_gradient(1e-3, truth, slope)))
        ratios.append(wholes[-1] / times[-1])
    print(
        f"{cells}^3 cells, {library}, {precision}: a gradient takes {statistics.median(wholes) * 1e3:.3f} ms, and"
        f" {statistics.median(ratios):.3f} of its transforms' {statistics.median(times) * 1e3:.3f} ms ({pairs} pairs,"
        f" load {os.getloadavg()[0]:.1f})"
    )


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("cells", type=int, nargs="?", default=64)
    arguments.add_argument("--pairs", type=int, default=21)
    arguments.add_argument("--transforms", default="scipy")
    arguments.add_argument("--precision", default="double")
    given = arguments.parse_args()
    main(given.cells, given.pairs, given.transforms, given.precision)
