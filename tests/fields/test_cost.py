"""What a gradient makes besides the results of its two transforms."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from eomgen.fields import FieldPosterior
from tests.fields.density import counted


@pytest.mark.parametrize("transforms", ["scipy", "fftw"])
def test_a_gradient_makes_no_arrays_but_those_of_its_transforms(transforms: str) -> None:
    made, truth = counted(16, 0.04)
    posterior = FieldPosterior(made.mesh, made.energy_of_cell, made.operators, made.data, transforms=transforms)
    slope = np.zeros(posterior.mesh.half, complex)
    posterior.add_gradient(1.0, truth, slope)
    peaks = []
    tracemalloc.start()
    try:
        for _ in range(5):  # other threads compile libraries, and allocate now and then
            before = tracemalloc.get_traced_memory()[0]
            tracemalloc.reset_peak()
            posterior.add_gradient(1.0, truth, slope)
            peaks.append(tracemalloc.get_traced_memory()[1] - before)
    finally:
        tracemalloc.stop()
    field, spectrum = 8 * posterior.mesh.size, slope.nbytes  # of SciPy; another field would be 32 768
    assert min(peaks) < (10_000 if transforms == "fftw" else field + spectrum + 10_000)
