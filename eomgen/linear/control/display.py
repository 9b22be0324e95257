"""Parts of how regulators, observers and output feedback show themselves in a notebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.base.arrays import Array
from eomgen.base.html import page, table
from eomgen.linear.control.margins import Margins
from eomgen.linear.state_space import StateSpace


def gains_html(space: StateSpace, gains: Array, columns: Sequence[str]) -> str:
    """Return gains (ns, number of columns), a row for each state."""
    rows = [
        (name, space.unit("states", name), *(f"{value:.6g}" for value in row))
        for name, row in zip(space.states, gains, strict=True)
    ]
    return table(("gain", "unit of the state", *columns), rows)


def deviations_html(space: StateSpace, deviations: Mapping[str, float]) -> str:
    """Return the standard deviations of the errors of estimates by state."""
    rows = [(name, f"{size:.4g}", space.unit("states", name)) for name, size in deviations.items()]
    return table(("estimate of", "standard deviation of its error", "unit"), rows)


def margins_html(margins: Mapping[str, Margins]) -> str:
    """Return the margins of each loop."""
    rows = [
        (
            name,
            f"{item.gain_reduction:.4g} to {item.gain_margin:.4g}",
            f"{item.phase_margin:.4g}",
            f"{item.delay_margin:.4g}",
            f"{item.modulus_margin:.4g}",
        )
        for name, item in margins.items()
    ]
    return table(("loop at", "gain", "phase, °", "delay, s", "modulus"), rows)


def eigenvalues_html(title: str, space: StateSpace) -> str:
    """Return the eigenvalues of a model, one of each pair."""
    upper = [complex(value) for value in space.eigenvalues if value.imag >= 0.0]
    unit = "1/s" if space.sample is None else "from sample to sample"
    rows = [(f"{value.real:.6g}" + (f" ± {value.imag:.6g}j" if value.imag else ""),) for value in upper]
    return page(f"{title}, {space.stability}", table((f"eigenvalue, {unit}",), rows))
