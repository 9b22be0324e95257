"""Open loops in the complex plane (H. Nyquist, Regeneration theory, Bell System Technical Journal 11, 1932)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from eomgen.base.figures import axes_of_caller, pyplot_figure
from eomgen.linear.control.margins import Margins

_GRID: dict[str, Any] = {"color": "#dddddd", "linewidth": 0.6}
_REACH = 2.6


def plot_margins(margins: Mapping[str, Margins], axes: object = None) -> list[Any]:
    """Draw the loop at each input, with the point -1, the unit circle and the circle of the modulus margin about -1."""
    names = list(margins)
    given = pyplot_figure((5.2 * len(names), 5.2)).subplots(1, len(names), squeeze=False) if axes is None else axes
    drawn = axes_of_caller("plot", given, names)
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 181))
    for axis, (name, item) in zip(drawn, margins.items(), strict=True):
        near = np.where(np.abs(item.loop) < 4.0 * _REACH, item.loop, np.nan)
        axis.plot(near.real, near.imag, color="#0B62C4", linewidth=1.5)
        axis.plot(near.real, -near.imag, color="#0B62C4", linewidth=0.8, linestyle=(0, (4, 3)))
        axis.plot(turn.real, turn.imag, color="#999999", linewidth=0.8)
        around = -1.0 + item.modulus_margin * turn
        axis.plot(around.real, around.imag, color="#C4430B", linewidth=0.9)
        axis.plot([-1.0], [0.0], marker="+", color="#C4430B", markersize=9)
        axis.set(xlim=(-_REACH, _REACH), ylim=(-_REACH, _REACH), aspect="equal", xlabel="real part")
        axis.set_ylabel("imaginary part")
        gain = f"gain {item.gain_reduction:.3g} to {item.gain_margin:.3g}"
        said = f"phase {item.phase_margin:.3g}°, delay {item.delay_margin:.3g} s, modulus {item.modulus_margin:.3g}"
        axis.set_title(f"open loop at {name}\n{gain}, {said}", fontsize=9, loc="left")
        axis.grid(True, **_GRID)
        axis.set_axisbelow(True)
    return drawn
