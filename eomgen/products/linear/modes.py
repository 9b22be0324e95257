"""Modes of a state-space matrix: frequency, damping ratio and complex shape, with bounds of their rounding errors;
their table and their picture."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array, Complex
from eomgen.base.calls import NamedAttributes, checked_calls
from eomgen.base.data import dataclass
from eomgen.base.figures import axes_of_caller, draw_grid, new_figure, pyplot_figure, save_figure
from eomgen.base.html import page, table
from eomgen.base.rounding import COMPUTED
from eomgen.errors import Problem, UsageError
from eomgen.products.linear.eigenvalues import (
    balance,
    decomposition,
    order_of_eigenvalues,
    unbalance,
    verdict,
)
from eomgen.products.linear.freedom import times

#: Headings of ``table_row``.
HEADINGS = ("mode", "undamped frequency, Hz", "damping ratio", "eigenvalue, 1/s", "moves most, by kinetic energy")
#: Largest numbers of modes and coordinates in one figure: more cannot be distinguished.
_MODES, _COORDINATES = 12, 14


@checked_calls()
@dataclass(frozen=True)
class Modes(NamedAttributes):
    """One mode for each real eigenvalue and for each conjugate pair, slowest first.

    Attributes
    ----------
    eigenvalues : (n,) complex, 1/s, imaginary parts not negative
    angular_frequency : (n,) |eigenvalue|, rad/s, undamped: of an oscillation that without damping
    frequency : (n,) undamped, |eigenvalue| / 2 pi, Hz; ``damped_frequency`` is of the oscillation as it is seen
    damping_ratio : (n,) -Re / |eigenvalue|: 1 for decay without oscillation, -1 for growth without oscillation, 0 for a
        zero eigenvalue
    uncertainty : (n,) of the eigenvalues by rounding; smaller eigenvalues are zero
    shapes : (nv, n) complex changes of all coordinates, left-trivialised; the largest is 1
    state_shapes : (ns, n) complex, with velocities and internal states, in the same scale
    coordinates : names of the rows of ``shapes``
    weights : (nv,) roots of inertias, which make coordinates of different units comparable
    """

    eigenvalues: Complex
    angular_frequency: Array
    frequency: Array
    damping_ratio: Array
    uncertainty: Array
    shapes: Complex
    state_shapes: Complex
    coordinates: tuple[str, ...]
    weights: Array

    def __len__(self) -> int:
        return len(self.eigenvalues)

    def __repr__(self) -> str:
        oscillating = [f"{value:.4g}" for value in self.frequency[self.oscillating][:6]]
        more = ", ..." if int(np.sum(self.oscillating)) > len(oscillating) else ""
        heard = f": {', '.join(oscillating)}{more} Hz undamped" if oscillating else ""
        return f"<Modes: {len(self)}, {self.stability}{heard}>"

    def _repr_html_(self) -> str:
        rows = [table_row(self, k) for k in range(len(self))]
        return page(f"{len(self)} modes, {self.stability}", table(HEADINGS, rows))

    def plot(self, axes: object = None) -> list[Any]:
        """Draw the shapes of at most 12 modes and return matplotlib's axes, one for each drawn mode.

        Modes that do not move coordinates, of internal states alone, are left out. Of more than 12 modes, decaying
        modes without oscillation come last. At most 14 coordinates are drawn, with the most kinetic energy of the mode.

        Parameters
        ----------
        axes : sequence of matplotlib Axes, optional
            One for each drawn mode; a new figure of pyplot if none are given.

        Returns
        -------
        list of matplotlib Axes
            One for each drawn mode; may be empty.

        Raises
        ------
        UsageError
            Another number of axes than of drawn modes, or objects that are not axes.

        Examples
        --------
        >>> modes = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).modes()
        >>> len(modes.plot())
        2
        """
        shown = _shown_modes(self)
        if axes is None:
            _, drawn = _panels(pyplot_figure, self, len(shown))
        else:
            drawn = axes_of_caller("plot", axes, [f"mode {k + 1}" for k in shown])
        for axis, k in zip(drawn, shown, strict=True):
            _draw_shape(axis, self, k)
        return drawn

    @property
    def undamped_frequency(self) -> Array:
        """(n,) Undamped frequencies |eigenvalue| / 2 pi, Hz: ``frequency`` by its full name."""
        return self.frequency

    @property
    def damped_frequency(self) -> Array:
        """(n,) Damped frequencies |Im eigenvalue| / 2 pi, Hz: of the oscillation in time; 0 without oscillation."""
        return np.asarray(np.abs(self.eigenvalues.imag) / (2.0 * np.pi))

    @property
    def oscillating(self) -> NDArray[np.bool_]:
        """(n,) Whether a mode oscillates."""
        result: NDArray[np.bool_] = np.abs(self.eigenvalues.imag) > self.uncertainty
        return result

    @property
    def stability(self) -> str:
        """``stable`` if all modes decay by more than their ``uncertainty``, ``unstable`` if a mode grows by more, else
        ``marginal``: also with a free rigid-body motion. Without modes ``stable``."""
        return verdict(self.eigenvalues.real, self.uncertainty)

    @property
    def band(self) -> tuple[float, float]:
        """Frequencies to plot, Hz: from a tenth of the lowest nonzero undamped frequency of a mode, oscillating or not,
        to ten times the highest; (0.01, 100) without such a frequency."""
        frequencies = self.frequency[np.abs(self.eigenvalues) > self.uncertainty]
        if not len(frequencies):
            return 0.01, 100.0
        return 0.1 * float(np.min(frequencies)), 10.0 * float(np.max(frequencies))

    def dominant(self, mode: int, count: int = 3) -> list[tuple[str, complex]]:
        """Return the coordinates that take the largest part in a mode.

        Parts are compared by the roots of the kinetic energies of coordinates.

        Parameters
        ----------
        mode : int
            Number of the mode, from 0.
        count : int, optional
            Largest number of coordinates.

        Returns
        -------
        list of tuple of str and complex
            Name and entry of ``shapes`` of each coordinate, the largest part first; the first entry need not be 1.
            Parts of at most 0.05 of the largest are left out. Empty if all entries are exactly 0; a mode of internal
            states alone may have entries by rounding, which are listed.

        Raises
        ------
        UsageError
            A number of no mode.

        Examples
        --------
        >>> modes = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).modes()
        >>> [name for name, part in modes.dominant(1)]
        ['wheel', 'body']
        """
        if mode not in range(len(self)):
            numbers = f"numbers from 0 to {len(self) - 1}"
            raise UsageError(Problem("mode", f"there is no mode {mode!r} [E0373]", numbers))
        sizes = self.weights * np.abs(self.shapes[:, mode])
        order = np.argsort(-sizes, kind="stable")[:count]
        kept = [k for k in order if sizes[k] > 0.05 * sizes[order[0]]]
        return [(self.coordinates[k], complex(self.shapes[k, mode])) for k in kept]


def modes(A: Array, of_coordinates: Array, coordinates: Sequence[str], inertias: Array) -> Modes:
    """Return the modes of sdot = A s, slowest first, with bounds of the rounding errors of the eigenvalues.

    Parameters
    ----------
    A : (ns, ns)
    of_coordinates : (nv, ns), dq = of_coordinates s
    coordinates : names of the components of dq
    inertias : (nv,) diagonal of the inertia matrix
    """
    if not len(A):
        empty = np.zeros((len(coordinates), 0), complex)
        weights = np.sqrt(np.abs(inertias))
        return modes_of(
            np.zeros(0, complex), np.zeros(0), empty, np.zeros((0, 0), complex), tuple(coordinates), weights
        )
    balanced, back = balance(A)
    values, right, uncertainty = decomposition(balanced)
    kept = order_of_eigenvalues(values, uncertainty)
    kept = kept[values[kept].imag >= 0.0]
    original = unbalance(back, right[:, kept])
    shapes = times(of_coordinates, original)
    largest = np.argmax(np.abs(shapes), axis=0)
    of_largest = shapes[largest, np.arange(len(kept))]
    states = original[np.argmax(np.abs(original), axis=0), np.arange(len(kept))]
    # modes of internal states do not move bodies
    unit = np.where(np.abs(of_largest) > COMPUTED * np.abs(states), of_largest, states)
    weights = np.sqrt(np.abs(inertias))
    return modes_of(values[kept], uncertainty[kept], shapes / unit, original / unit, tuple(coordinates), weights)


def modes_of(
    values: Complex,
    uncertainty: Array,
    shapes: Complex,
    state_shapes: Complex,
    coordinates: tuple[str, ...],
    weights: Array,
) -> Modes:
    """Return modes with the frequencies and damping ratios of their eigenvalues.

    Parameters
    ----------
    values : (n,) complex ndarray
        Eigenvalues, 1/s, imaginary parts not negative.
    uncertainty : (n,) ndarray
        Rounding errors of the eigenvalues, 1/s; smaller eigenvalues are zero.
    shapes, state_shapes : (nv, n) and (ns, n) complex ndarray
        Changes of the coordinates, left-trivialised, and of all states, in the same scale.
    coordinates : tuple of str
        Names of the rows of ``shapes``.
    weights : (nv,) ndarray
        Roots of inertias, which make coordinates of different units comparable.
    """
    size = np.abs(values)
    zero = size <= uncertainty
    ratio = np.where(zero, 0.0, -values.real / np.where(zero, 1.0, size))
    frequency = size / (2.0 * np.pi)
    return Modes(values, size, frequency, ratio, uncertainty, shapes, state_shapes, coordinates, weights)


def draw_modes(modes: Modes, title: str, path: Path) -> Path:
    """Draw the shapes of at most 12 modes, bars of amplitude by coordinate with phases, into a file; return the
    path."""
    shown = _shown_modes(modes)
    figure, axes = _panels(new_figure, modes, len(shown))
    for axis, k in zip(axes, shown, strict=True):
        _draw_shape(axis, modes, k)
    left_out, count = len(modes) - len(shown), len(modes.coordinates)
    notes = [f"{left_out} more are not drawn"] if left_out else []
    if count > _COORDINATES:
        notes.append(f"of {count} coordinates, of each mode the {_COORDINATES} with most kinetic energy")
    figure.suptitle(f"{title}: shapes of modes" + (f" ({'; '.join(notes)})" if notes else ""), fontsize=11)
    return save_figure(figure, path)


def _shown_modes(modes: Modes) -> list[int]:
    return [k for k in oscillating_first(modes, _MODES) if np.any(np.abs(modes.shapes[:, k]) > COMPUTED)][:_MODES]


def oscillating_first(modes: Modes, few: int) -> list[int]:
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


def _panels(figure_of: Callable[[tuple[float, float]], Any], modes: Modes, count: int) -> tuple[Any, list[Any]]:
    """Return a new figure and its `count` visible axes, in up to three columns. `figure_of` makes a figure from (width,
    height) in inches; the height grows with the number of coordinates."""
    columns = min(3, max(1, count))
    rows = max(1, -(-count // columns))
    height = 1.1 + 0.28 * min(len(modes.coordinates), _COORDINATES)
    figure = figure_of((4.6 * columns + 0.6, 0.8 + rows * height))
    axes = figure.subplots(rows, columns, squeeze=False).ravel().tolist()
    for axis in axes[count:]:
        axis.set_visible(False)
    return figure, axes[:count]


def _draw_shape(axis: Any, modes: Modes, k: int) -> None:
    chosen = np.sort(np.argsort(-modes.weights * np.abs(modes.shapes[:, k]), kind="stable")[:_COORDINATES])
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
    draw_grid(axis, along="x")
    axis.set_title(caption(modes, k), fontsize=10, loc="left")


def degrees(value: complex) -> int:
    """Return the phase in whole degrees, -179 to 180."""
    phase = round(math.degrees(cmath.phase(value)))
    return 180 if phase == -180 else phase


def caption(modes: Modes, k: int) -> str:
    """Return mode `k` (from 0) in a few words: undamped frequency and damping ratio, the rate at which the mode decays
    or grows, or "no stiffness" for an eigenvalue that is zero within its uncertainty."""
    value = modes.eigenvalues[k]
    if modes.oscillating[k]:
        ratio = _significant(modes.damping_ratio[k], COMPUTED)
        return f"mode {k + 1}: {modes.frequency[k]:.5g} Hz undamped, damping ratio {ratio:.4g}"
    if abs(value) <= modes.uncertainty[k]:
        return f"mode {k + 1}: no stiffness"
    return f"mode {k + 1}: {'decays' if value.real < 0.0 else 'grows'} with {abs(value.real):.4g} 1/s"


def table_row(modes: Modes, k: int) -> tuple[str, ...]:
    """Return mode `k` (from 0) as texts of a table with the columns ``HEADINGS``."""
    value, bound, oscillating = modes.eigenvalues[k], modes.uncertainty[k], bool(modes.oscillating[k])
    zero, imaginary = bool(abs(value) <= bound), f" ± {value.imag:.9g}j" if oscillating else ""
    parts = (f"{name} {abs(x):.3g}" + (f" at {degrees(x)}°" if degrees(x) else "") for name, x in modes.dominant(k))
    return (
        str(k + 1),
        f"{modes.frequency[k]:.9g}" if oscillating else "0" if zero else "",
        "" if zero else f"{_significant(modes.damping_ratio[k], COMPUTED):.6g}",
        "0" if zero else f"{_significant(value.real, bound):.9g}{imaginary}",
        ", ".join(parts),
    )


def _significant(value: float, uncertainty: float) -> float:
    """Return a number, and zero for one within its uncertainty."""
    return value if abs(value) > uncertainty else 0.0
