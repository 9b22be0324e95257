"""Functions of models as callables: of the tape over NumPy here, of compiled code in other tests.

``evaluate(function, inputs)`` takes a mapping from input block to array (..., size) and gives a mapping from output
block to array (..., *shape). Oracles and checks are written against this signature only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.symbolic.evaluate import evaluate
from eomgen.system.system import System

Array = NDArray[Any]
Evaluate = Callable[[str, Mapping[str, Array]], dict[str, Array]]


def tape_evaluator(system: System) -> Evaluate:
    """Return the functions of a system, run operation by operation over NumPy arrays of any type and batch shape."""

    def run(function: str, inputs: Mapping[str, Array]) -> dict[str, Array]:
        blocks = system.functions[function].outputs
        values = evaluate(system.tape, system.functions[function].refs, inputs)
        outputs, start = {}, 0
        for block in blocks:
            part = values[..., start : start + len(block.refs)]
            outputs[block.name] = part.reshape(*part.shape[:-1], *block.shape)
            start += len(block.refs)
        return outputs

    return run


def relative_error(computed: Array, expected: Array, axes: int = 1, floor: float = 0.0) -> float:
    """Return the largest norm-wise relative error over a batch.

    Parameters
    ----------
    axes : how many of the last axes belong to one state
    floor : smallest size to compare with, for expected values that may vanish by structure
    """
    computed, expected = np.broadcast_arrays(computed, expected)
    over = tuple(range(-axes, 0))
    difference = np.sqrt(np.sum(np.abs(computed - expected) ** 2, axis=over))
    size = np.maximum(np.sqrt(np.sum(np.abs(expected) ** 2, axis=over)), floor)
    return float(np.max(difference / np.maximum(size, 1e-300)))
