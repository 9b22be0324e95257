"""Figures of a linear model, as PNG or on the axes of a caller: mode shapes, root locus, frequency responses,
spectra."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array, Complex
from eomgen.base.figures import axes_of_caller, axis_label, new_figure, pyplot_figure, saved
from eomgen.products.linear.notebook import ShownModes
from eomgen.products.linear.spectra import PowerSpectrum

#: Largest numbers of modes and coordinates in one figure: more cannot be distinguished.
_MODES, _COORDINATES = 12, 14
#: Roots of neighbouring values are joined by a line if the distance is below this part of the figure.
_JUMP = 0.08
#: Real parts are zero below this part of an eigenvalue.
_ROUNDING = 1e-9
_GRID: dict[str, Any] = {"color": "#dddddd", "linewidth": 0.6}


class DrawnModes(ShownModes, Protocol):
    """Plotted fields of ``Modes``: see there."""

    @property
    def shapes(self) -> Complex: ...
    @property
    def coordinates(self) -> tuple[str, ...]: ...
    @property
    def weights(self) -> Array: ...


class DrawnRoots(Protocol):
    """Plotted fields of a ``RootLocus``: see there."""

    @property
    def parameter(self) -> str: ...
    @property
    def values(self) -> Array: ...
    @property
    def eigenvalues(self) -> Complex: ...


def draw_modes(modes: DrawnModes, title: str, path: Path) -> Path:
    """Draw the shape of each mode: amplitudes by coordinate, with phases next to the amplitudes."""
    shown = _shown(modes)
    figure = new_figure(_size(modes, len(shown)))
    _shapes(_grid(figure, len(shown)), modes, shown)
    left_out, count = len(modes) - len(shown), len(modes.coordinates)
    notes = [f"{left_out} more are not drawn"] if left_out else []
    if count > _COORDINATES:
        notes.append(f"of {count} coordinates, of each mode the {_COORDINATES} with most kinetic energy")
    figure.suptitle(f"{title}: shapes of modes" + (f" ({'; '.join(notes)})" if notes else ""), fontsize=11)
    return saved(figure, path)


def plot_modes(modes: DrawnModes, axes: object = None) -> list[Any]:
    """Draw the shape of each mode; see ``Modes.plot``."""
    shown = _shown(modes)
    if axes is None:
        drawn = _grid(pyplot_figure(_size(modes, len(shown))), len(shown))
    else:
        drawn = axes_of_caller("plot", axes, [f"mode {k + 1}" for k in shown])
    _shapes(drawn, modes, shown)
    return drawn


def _shown(modes: DrawnModes) -> list[int]:
    return [k for k in oscillating_first(modes, _MODES) if np.any(np.abs(modes.shapes[:, k]) > 1e-9)][:_MODES]


def oscillating_first(modes: ShownModes, few: int) -> list[int]:
    """Return the numbers of modes in the order of listing.

    Modes are listed by increasing eigenvalue. With more than ``few`` modes, non-oscillating modes, of which stiffness
    damping makes hundreds, come last.

    Parameters
    ----------
    modes : Modes
    few : int
        Modes that are all listed.

    Returns
    -------
    list of int
    """
    numbers = list(range(len(modes)))
    if len(numbers) <= few:
        return numbers
    decaying = (modes.eigenvalues.real < -modes.uncertainty) & ~modes.oscillating
    return sorted(numbers, key=lambda k: bool(decaying[k]))


def _size(modes: DrawnModes, shown: int) -> tuple[float, float]:
    """Return the width and the height of the figure, inches."""
    columns, count = _columns(shown), min(len(modes.coordinates), _COORDINATES)
    return 4.6 * columns + 0.6, 0.8 + max(1, -(-shown // columns)) * (1.1 + 0.28 * count)


def _columns(shown: int) -> int:
    return min(3, max(1, shown))


def _grid(figure: Any, shown: int) -> list[Any]:
    columns = _columns(shown)
    axes = list(np.atleast_1d(figure.subplots(max(1, -(-shown // columns)), columns, squeeze=False)).ravel())
    for axis in axes[shown:]:
        axis.set_visible(False)
    return axes[:shown]


def _shapes(axes: list[Any], modes: DrawnModes, shown: list[int]) -> None:
    count = min(len(modes.coordinates), _COORDINATES)
    for axis, k in zip(axes, shown, strict=True):
        _shape(axis, modes, k, count)


def _shape(axis: Any, modes: DrawnModes, k: int, count: int) -> None:
    chosen = np.sort(np.argsort(-modes.weights * np.abs(modes.shapes[:, k]), kind="stable")[:count])
    values = modes.shapes[chosen, k]
    height = np.arange(len(chosen))[::-1]
    axis.barh(height, np.abs(values), color="#0B62C4", height=0.6)
    for y, value in zip(height, values, strict=True):
        if abs(value) > 1e-3:
            axis.text(abs(value) + 0.02, y, f"{degrees(value)}°", va="center", fontsize=8, color="#444444")
    axis.set_yticks(height, [modes.coordinates[index] for index in chosen], fontsize=9)
    axis.set_xlim(0.0, 1.2)
    axis.set_ylim(-0.6, len(chosen) - 0.4)
    axis.set_xlabel("amplitude (rad, m; largest is 1), phase", fontsize=9)
    axis.grid(True, axis="x", **_GRID)
    axis.set_axisbelow(True)
    axis.set_title(caption(modes, k), fontsize=10, loc="left")


def degrees(value: complex) -> int:
    """Return the phase in whole degrees, -179 to 180."""
    phase = round(math.degrees(cmath.phase(value)))
    return 180 if phase == -180 else phase


def caption(modes: DrawnModes, k: int) -> str:
    """Return a mode in a few words: undamped frequency and damping, the rate at which the mode decays or
    grows, or no stiffness, for an eigenvalue that is zero within its uncertainty."""
    value = modes.eigenvalues[k]
    if modes.oscillating[k]:
        return f"mode {k + 1}: {modes.frequency[k]:.5g} Hz undamped, damping ratio {_rounded(modes.damping_ratio[k])}"
    if abs(value) <= modes.uncertainty[k]:
        return f"mode {k + 1}: no stiffness"
    return f"mode {k + 1}: {'decays' if value.real < 0.0 else 'grows'} with {abs(value.real):.4g} 1/s"


def _rounded(ratio: float) -> str:
    return "0" if abs(ratio) < 1e-9 else f"{ratio:.4g}"


def draw_root_locus(locus: DrawnRoots, unit: str, title: str, path: Path) -> Path:
    """Draw the upper half plane of roots, coloured by the parameter; crosses at the first value, rings at the last
    value."""
    figure = new_figure((8.4, 6.0))
    _roots(figure.subplots(), locus, unit)
    figure.suptitle(f"{title}: roots over {locus.parameter}", fontsize=11)
    return saved(figure, path)


def plot_root_locus(locus: DrawnRoots, axes: object = None) -> list[Any]:
    """Draw the upper half plane of roots; see ``RootLocus.plot``."""
    given = pyplot_figure((8.4, 6.0)).subplots() if axes is None else axes
    drawn = axes_of_caller("plot", given, [f"roots over {locus.parameter}"])
    _roots(drawn[0], locus, "")
    return drawn


def _roots(axis: Any, locus: DrawnRoots, unit: str) -> None:
    from matplotlib.colors import LogNorm, Normalize  # noqa: PLC0415  # slow to import, and only drawing needs it

    low, high = float(np.min(locus.values)), float(np.max(locus.values))
    ratios = locus.values[1:] / locus.values[:-1] if np.all(locus.values > 0.0) else np.zeros(0)
    logarithmic = len(ratios) > 1 and np.allclose(ratios, ratios[0], rtol=1e-9) and ratios[0] != 1.0
    norm = (LogNorm if logarithmic else Normalize)(low, high)
    exact = np.abs(locus.eigenvalues.real) > _ROUNDING * np.abs(locus.eigenvalues)
    eigenvalues = np.where(exact, locus.eigenvalues, 1j * locus.eigenvalues.imag)
    tolerance = _ROUNDING * (1.0 + float(np.max(np.abs(eigenvalues), initial=0.0)))
    extent = float(np.ptp(eigenvalues.real) + np.ptp(eigenvalues.imag))
    drawn = None
    for root in eigenvalues.T:
        upper = root.imag >= -tolerance
        # at roots that meet and part, a long line would suggest a branch that does not exist
        near = np.abs(np.diff(root)) <= _JUMP * extent
        for k in np.flatnonzero(near & upper[1:] & upper[:-1]):
            axis.plot(root.real[k : k + 2], root.imag[k : k + 2], color="#bbbbbb", linewidth=0.8, zorder=1)
        colours = locus.values[upper]
        drawn = axis.scatter(root.real[upper], root.imag[upper], c=colours, cmap="viridis", norm=norm, s=12, zorder=2)
        for end, marker in ((0, "x"), (-1, "o")):
            if upper[end]:
                faces = {"facecolors": "none"} if marker == "o" else {}
                colour = {"edgecolors": "#C8102E"} if marker == "o" else {"color": "#C8102E"}
                axis.scatter(
                    [root[end].real], [root[end].imag], marker=marker, s=46, linewidths=1.3, zorder=3, **faces, **colour
                )
    axis.axvline(0.0, color="#222222", linewidth=1.0, zorder=1)
    axis.set_xlabel("real part, 1/s")
    axis.set_ylabel("imaginary part, rad/s")
    axis.margins(0.06)
    if not np.any(eigenvalues.real):
        height = float(np.abs(eigenvalues).max(initial=0.0)) or 1.0
        axis.set_xlim(-0.1 * height, 0.1 * height)
    axis.grid(True, **_GRID)
    axis.set_axisbelow(True)
    if drawn is not None:
        label = locus.parameter if unit in ("", "1") else f"{locus.parameter}, {unit}"
        axis.figure.colorbar(drawn, ax=axis, label=label)
    first, last = locus.values[0], locus.values[-1]
    axis.set_title(f"× {locus.parameter} = {first:.6g}   ○ {locus.parameter} = {last:.6g}", fontsize=10, loc="left")


def draw_responses(
    frequencies: Array, responses: Mapping[tuple[str, str], Complex], units: Mapping[str, str], title: str, path: Path
) -> Path:
    """Draw magnitude and phase of frequency responses, one column for each, and return the path.

    Parameters
    ----------
    frequencies : (n,) Hz
    responses : (n,) complex, by (input, output)
    units : by name of an input or output
    title : name of the model
    path : of the PNG
    """
    figure = new_figure((6.2 * len(responses) + 0.4, 6.4))
    axes = _columns_of_two(figure, len(responses))
    for column, ((of_input, output), values) in zip(axes.T, responses.items(), strict=True):
        over = _ratio(units.get(output, ""), units.get(of_input, ""))
        _response(column[0], column[1], frequencies, values, f"{output} for {of_input}", over)
    figure.align_ylabels(list(axes.ravel()))
    figure.suptitle(f"{title}: frequency responses", fontsize=11)
    return saved(figure, path)


def plot_response(frequencies: Array, values: Complex, pair: tuple[str, str], axes: object = None) -> list[Any]:
    """Draw magnitude and phase of the response of an output to an input; see ``Linearization.plot_response``."""
    given = _columns_of_two(pyplot_figure((6.6, 6.4)), 1) if axes is None else axes
    drawn = axes_of_caller("plot_response", given, ["magnitude", "phase"])
    _response(drawn[0], drawn[1], frequencies, values, f"{pair[1]} for {pair[0]}", "")
    return drawn


def _columns_of_two(figure: Any, count: int) -> NDArray[np.object_]:
    axes: NDArray[np.object_] = figure.subplots(
        2, count, squeeze=False, sharex=True, gridspec_kw={"height_ratios": [3, 2]}
    )
    return axes


def _response(magnitude: Any, phase: Any, frequencies: Array, values: Complex, title: str, over: str) -> None:
    from matplotlib.ticker import MultipleLocator  # noqa: PLC0415  # slow to import, and only drawing needs it

    size = np.abs(values)
    if np.any(size > 0.0):
        magnitude.loglog(frequencies, np.where(size > 0.0, size, np.nan), color="#0B62C4", linewidth=1.4)
    else:
        magnitude.semilogx(frequencies, size, color="#0B62C4", linewidth=1.4)
    angles = np.degrees(np.unwrap(np.angle(values)))
    phase.semilogx(frequencies, angles, color="#0B62C4", linewidth=1.4)
    middle, half = 0.5 * (angles.max() + angles.min()), max(0.55 * np.ptp(angles), 100.0)
    phase.set_ylim(middle - half, middle + half)
    magnitude.set_ylabel(axis_label("magnitude", over))
    magnitude.set_title(title, fontsize=10, loc="left")
    phase.set_ylabel("phase, °")
    phase.yaxis.set_major_locator(MultipleLocator(90.0 if np.ptp(phase.get_ylim()) <= 540.0 else 180.0))
    phase.set_xlabel("frequency, Hz")
    phase.set_xlim(frequencies[0], frequencies[-1])
    for axis in (magnitude, phase):
        axis.grid(True, which="both", **_GRID)
        axis.set_axisbelow(True)


def draw_spectra(spectra: Sequence[PowerSpectrum], title: str, path: Path) -> Path:
    """Draw power spectral densities on a random road, in one panel each, stacked vertically."""
    figure = new_figure((7.4, 0.6 + 3.6 * len(spectra)))
    for axis, item in zip(figure.subplots(len(spectra), 1, squeeze=False)[:, 0], spectra, strict=True):
        item.plot(axis)
    figure.suptitle(f"{title}: spectra on a random road", fontsize=11)
    return saved(figure, path)


def _ratio(over: str, under: str) -> str:
    """Return the unit of a response; empty if a unit is not known or both are the same."""
    return f"{over} per {under}" if over and under and over != under else ""
