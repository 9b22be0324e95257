"""The largest moment and force of the sections of each geometrically exact beam over a run."""

from __future__ import annotations

import numpy as np

from eomgen.results.section_plots import Loaded, rows_of

#: Numbers that are held at once.
_NUMBERS = 4_000_000


def largest_section_loads(solution: Loaded) -> dict[str, dict[str, dict[str, float]]]:
    """Return by beam, and by ``moment`` (N m) and ``force`` (N), the largest ``size``, with its ``x``, m, and ``t``, s.

    Looked at are the recorded rows, and both ends of each element.
    """
    model = solution.model
    if model is None:
        return {}
    result: dict[str, dict[str, dict[str, float]]] = {}
    rows = max(1, _NUMBERS // (2 * max(1, solution.q.shape[1])))
    for start in range(0, len(solution.t), rows):
        part = slice(start, start + rows)
        t = solution.t[part]
        for beam, loads in model.section_loads(rows_of(solution, part), solution.multipliers[part]).items():
            nodes = loads.nodes
            for name, ends in (("moment", loads.moment_at_ends), ("force", loads.force_at_ends)):
                sizes = np.nan_to_num(np.linalg.norm(ends, axis=-1), nan=-1.0, posinf=-1.0)
                row, element, end = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
                size = float(sizes[row, element, end])
                if size > result.setdefault(beam, {}).get(name, {"size": -1.0})["size"]:
                    result[beam][name] = {"size": size, "x": float(nodes[element + end]), "t": float(t[row])}
    return result
