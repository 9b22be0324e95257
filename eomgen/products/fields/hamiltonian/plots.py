"""Pictures of a motion of a Hamiltonian system: coordinates, momenta and outputs over time, and the change of H."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.figures import new_figure, saved
from eomgen.products.fields.hamiltonian.solution import HamiltonianSolution

#: Curves in one panel, of which each has a colour of its own, and points of one curve, at most.
_CURVES, _POINTS = 10, 4000


def draw(solution: HamiltonianSolution, folder: Path) -> list[Path]:
    """Write ``motion.png`` and return its path. Raises FileError."""
    names, units = solution.metadata["names"], solution.metadata["units"]
    panels = [
        ("coordinates", dict(zip(names["q"], solution.q.T, strict=True)), units["q"]),
        ("momenta", dict(zip(names["p"], solution.p.T, strict=True)), units["p"]),
        ("outputs", dict(solution.outputs), units["outputs"]),
    ]
    panels = [panel for panel in panels if panel[1]]
    figure = new_figure((8.0, 1.0 + 2.3 * (len(panels) + 1)))
    every = figure.subplots(len(panels) + 1, 1, sharex=True)
    taken = np.unique(np.linspace(0, len(solution.t) - 1, min(len(solution.t), _POINTS)).astype(int))
    for axes, (label, curves, its_units) in zip(every, panels, strict=False):
        _draw(axes, solution.t[taken], {name: curve[taken] for name, curve in curves.items()})
        unit = set(its_units)
        axes.set_ylabel(f"{label} ({unit.pop()})" if len(unit) == 1 and unit != {""} else label)
    total = solution.energy["total"]
    every[-1].plot(solution.t[taken], (total - total[0])[taken], color="#0B62C4", linewidth=0.8)
    every[-1].set_ylabel("change of H")
    every[-1].set_xlabel("t")
    for axes in every:
        axes.grid(alpha=0.3)
    every[0].set_title(
        f"{solution.metadata['name']}: {solution.metadata['method']}, step {solution.metadata['step']:g}"
    )
    return [saved(figure, folder / "motion.png")]


def _draw(axes: Any, t: Array, curves: dict[str, Array]) -> None:
    for name, curve in list(curves.items())[:_CURVES]:
        axes.plot(t, curve, label=name, linewidth=0.8)
    more = len(curves) - _CURVES
    title = f"{more} more in the table" if more > 0 else None
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize="small", title=title, title_fontsize="small")
