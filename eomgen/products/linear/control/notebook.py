"""Regulators, observers and output feedback in a notebook: parts of pages; and figures of stability margins, open loops
in the complex plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.figures import axes_of_caller, draw_grid
from eomgen.base.html import page, table
from eomgen.products.linear.control.margins import Margins
from eomgen.products.linear.state_space import StateSpace


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
    """Return an HTML table of gain, phase, delay and modulus margins, a row for each loop."""
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


#: Ends of a figure.
_REACH = 2.6


def plot_margins(margins: Mapping[str, Margins], axes: object = None) -> list[Any]:
    """Draw the loop at each input, with the point -1, the unit circle and the circle of the modulus margin about -1.
    Rings with frequencies give the direction of each curve. Limits hold -1 and the unit circle; a loop that is larger
    leaves the frame, and the legend says so. Returns the list of axes, one for each input: the caller's, or axes of a
    new figure."""
    names = list(margins)
    drawn = axes_of_caller("plot", axes, names, (5.2 * len(names), 5.7))
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 181))
    for axis, (name, item) in zip(drawn, margins.items(), strict=True):
        near = np.where(np.abs(item.loop) < 4.0 * _REACH, item.loop, np.nan)
        inside = np.maximum(np.abs(item.loop.real), np.abs(item.loop.imag)) < _REACH
        curve = "open loop" if np.all(inside) else "open loop, which leaves the frame"
        axis.plot(near.real, near.imag, color="#0B62C4", linewidth=1.5, label=curve)
        mirrored = {"linewidth": 0.8, "linestyle": (0, (4, 3)), "label": "at negative frequencies"}
        axis.plot(near.real, -near.imag, color="#0B62C4", **mirrored)
        axis.plot(turn.real, turn.imag, color="#777777", linewidth=0.8, label="unit circle")
        around = -1.0 + item.modulus_margin * turn
        nearest = f"modulus margin {item.modulus_margin:.3g}: least distance from -1"
        axis.plot(around.real, around.imag, color="#C4430B", linewidth=0.9, label=nearest)
        limit = {"marker": "+", "color": "#C4430B", "markersize": 9, "linestyle": "none"}
        axis.plot([-1.0], [0.0], label="-1: limit of stability", **limit)
        axis.set(xlim=(-_REACH, _REACH), ylim=(-_REACH, _REACH), aspect="equal", xlabel="real part")
        axis.set_ylabel("imaginary part")
        _annotate_direction(axis, item, inside)
        gain = f"stable for gains times {item.gain_reduction:.3g} to {item.gain_margin:.3g}"
        said = f"phase margin {item.phase_margin:.3g}°, delay margin {1e3 * item.delay_margin:.3g} ms"
        axis.set_title(f"open loop at {name}\n{gain}\n{said}", fontsize=9, loc="left")
        axis.legend(loc="upper right", fontsize=7.5)
        draw_grid(axis)
    return drawn


def _annotate_direction(axis: Any, item: Margins, inside: NDArray[np.bool_]) -> None:
    """Write frequencies in Hz at up to four points of a loop on an axis. `inside` (n,) is whether a point of the loop
    is within the frame."""
    places: list[complex] = []
    for frequency, point in zip(item.frequencies[inside], item.loop[inside].tolist(), strict=True):
        if len(places) < 4 and all(abs(point - earlier) > 0.3 * _REACH for earlier in places):
            places.append(point)
            axis.plot([point.real], [point.imag], "o", color="#0B62C4", markersize=3.5)
            look = {"fontsize": 7, "color": "#0B62C4", "textcoords": "offset points"}
            axis.annotate(f"{frequency / (2.0 * np.pi):.3g} Hz", (point.real, point.imag), (2, -11), **look)
