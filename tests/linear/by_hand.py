"""Linear models from matrices that a test gives: no scene and no compiler."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.lie.product import Factor
from eomgen.products.linear.freedom import Measures, Partials, freedom
from eomgen.products.linear.linearization import Linearization, LinearNames, Reference

Columns = Mapping[str, Sequence[float]]


def linear_model(
    M: Any,
    C: Any,
    K: Any,
    names: Sequence[str],
    inputs: Columns | None = None,
    disturbances: Columns | None = None,
    outputs: Mapping[str, Mapping[str, Sequence[float]]] | None = None,
    units: Sequence[str] = (),
    **reference: Any,
) -> Linearization:
    """Return M x'' + C x' + K x = B u + E w about rest.

    ``inputs`` and ``disturbances`` have columns of B and E by name, ``outputs`` rows by the letter of what they depend
    on, ``q``, ``v``, ``a``, ``u`` and ``w``; ``units`` are of the outputs, ``reference`` are changes of the reference.
    """
    inputs, disturbances, outputs = inputs or {}, disturbances or {}, outputs or {}
    n, still, none = len(names), np.zeros(len(names)), np.zeros(0)
    sizes = {"q": n, "v": n, "a": n, "u": len(inputs), "w": len(disturbances)}
    blocks = {name: np.reshape(np.asarray(matrix, float), (n, n)) for name, matrix in (("M", M), ("C", C), ("K", K))}
    for name, columns in (("B", inputs), ("E", disturbances)):
        blocks[name] = np.reshape(np.array([*columns.values()], float), (len(columns), n)).T
    for letter, size in sizes.items():
        rows = [row.get(letter, np.zeros(size)) for row in outputs.values()]
        blocks[f"Y{letter}"] = np.reshape(np.array(rows, float), (len(outputs), size))
    partials = Partials.of(blocks, len(inputs), len(disturbances), len(outputs))
    about = {"t": 0.0, "q": still, "v": still, "a": still, "z": none, "u": np.zeros(len(inputs)), "multipliers": none}
    known = {
        "measured": ("m",) * n, "velocities": ("m/s",) * n, "states": (), "inputs": ("",) * len(inputs),
        "disturbances": ("",) * len(disturbances), "outputs": tuple(units) or ("",) * len(outputs),
    }  # fmt: skip  # a table
    zeros = {kind: np.zeros(len(of)) for kind, of in known.items()}
    signals = ((), tuple(inputs), tuple(disturbances), tuple(outputs))
    labels = LinearNames(tuple(names), tuple(names), *signals, known, zeros)
    free = freedom(Measures.components([Factor("R", "x", 0, n, 0, n)], still, still), partials)
    return Linearization(Reference(**{**about, "what": "equilibrium", **reference}), partials, free, labels)
