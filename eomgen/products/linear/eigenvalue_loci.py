"""Root loci: eigenvalues of linear models over a parameter, each followed from value to value."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.base.figures import axes_of_caller, draw_grid, new_figure, save_figure
from eomgen.base.progress import Progress
from eomgen.base.rounding import COMPUTED
from eomgen.errors import EomgenError, Problem
from eomgen.products.linear.campbell_plot import Campbell, Crossing  # noqa: F401  # public here
from eomgen.products.linear.linearization import Linearization

#: Marks of roots at the first and the last value.
_ENDS: tuple[tuple[int, dict[str, Any]], ...] = (
    (0, {"marker": "x", "color": "#C8102E"}),
    (-1, {"marker": "o", "facecolors": "none", "edgecolors": "#C8102E"}),
)


class MergedWarnings:
    """Warnings of the linear models at many values; warnings that differ in numbers alone are one.

    Parameters
    ----------
    job : str
        First words of each warning.
    parameter : str
        Name of the varied parameter.
    values : sequence of float
        Values of the caller, which are counted; a search for crossings has linear models at others, too.
    """

    def __init__(self, job: str, parameter: str, values: Sequence[float]) -> None:
        self.job, self.parameter, self.values = job, parameter, frozenset(map(float, values))
        self.caught: dict[str, list[tuple[float, str, type[Warning]]]] = {}

    @contextmanager
    def at(self, value: float) -> Iterator[None]:
        """Return a context that keeps the warnings raised within, under the parameter's value. An EomgenError raised
        within is raised again with parameter and value in the message; warnings before an error are lost.
        """
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                yield
        except EomgenError as error:
            text = f"at {self.parameter} = {value:.6g}"
            problems = [Problem(f"{text}: {p.where}".rstrip(": "), p.what, p.hint) for p in error.problems]
            raise type(error)(problems) from None
        for item in caught:
            self.add(value, str(item.message), item.category)

    def add(self, value: float, text: str, category: type[Warning]) -> None:
        """Keep a warning under the parameter's value."""
        kind = re.sub(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?", "#", text)
        self.caught.setdefault(kind, []).append((value, text, category))

    def warn(self, stacklevel: int) -> None:
        """Issue each kept kind of warning once, with the range of the values concerned and the text of the first
        one."""
        for kind in self.caught.values():
            (value, text, category), every = kind[0], {value for value, _, _ in kind}
            at = sorted(every & self.values or every)
            among = f"at {len(at)} values of {self.parameter} from {at[0]:.6g} to {at[-1]:.6g}"
            first = f"at {self.parameter} = {value:.6g}"
            where = f"{self.job}: {among}, {first} for instance" if len(at) > 1 else f"{self.job}: {first}"
            warnings.warn(f"{where}: {text} [W0040]", category, stacklevel=stacklevel)


@dataclass(frozen=True)
class RootLocus:
    """Eigenvalues over a parameter.

    Attributes
    ----------
    parameter : name
    values : (n,)
    eigenvalues : (n, ns) complex, 1/s; a column is one root, followed by least distance from value to value
    stability : (n,) ``stable``, ``marginal`` or ``unstable`` for each value
    interrupted : whether Ctrl-C has ended the work early, with the first n of the values
    """

    parameter: str
    values: Array
    eigenvalues: Complex
    stability: tuple[str, ...]
    interrupted: bool = False

    def __repr__(self) -> str:
        first, last = f"{self.values[0]:.6g}", f"{self.values[-1]:.6g}"
        roots = f"{self.eigenvalues.shape[1]} roots at {len(self.values)} values of {self.parameter}"
        kinds = ", ".join(dict.fromkeys(self.stability)) + "; interrupted" * self.interrupted
        return f"<RootLocus: {roots}, {first} to {last}; {kinds}>"

    def plot(self, axes: object = None) -> list[Any]:
        """Draw the upper half plane of roots, coloured by the parameter, and return matplotlib's axes, a list of one.

        Crosses are the roots at the first value, rings at the last. The figure gets a colour bar, on axes of its own.

        Parameters
        ----------
        axes : matplotlib Axes, optional
            A new figure of pyplot if none are given.

        Returns
        -------
        list of matplotlib Axes
            One.

        Raises
        ------
        UsageError
            An object that is not axes, or more than one.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> locus = model.root_locus("damper", np.linspace(0.0, 4000.0, 5), t=30.0)
        >>> len(locus.plot())
        1
        """
        drawn = axes_of_caller("plot", axes, [f"roots over {self.parameter}"], (8.4, 6.0))
        _draw_roots(drawn[0], self, "")
        return drawn


def root_locus(
    parameter: str,
    values: Sequence[float],
    linearized: Callable[[float, Linearization | None], Linearization],
    report: Progress | None = None,
) -> RootLocus:
    """Return the eigenvalues of linear models over values of a parameter, each root followed from value to value.

    Warnings of the linear models are merged.

    Parameters
    ----------
    parameter : str
        Name of the parameter.
    values : sequence of float
        Values (n,) of the parameter.
    linearized : callable
        From a value, and the linear model at the previous value, to the linear model at this value.
    report : called with (values done, all values)

    Returns
    -------
    RootLocus
        After Ctrl-C, which ``interrupted`` shows, at the values so far.

    Raises
    ------
    EomgenError
        Errors of ``linearized``, with the value in the message.
    KeyboardInterrupt
        Ctrl-C before the first value is done.
    """
    points: list[tuple[Complex, str]] = []
    before: Linearization | None = None
    doubts = MergedWarnings("root locus", parameter, values)
    interrupted = False
    try:
        for number, value in enumerate(map(float, values), 1):
            with doubts.at(value):
                before = linearized(value, before)
                roots = np.linalg.eigvals(before.state_space().A).astype(complex)
                stability_there = before.modes().stability
            order = np.lexsort((roots.real, np.abs(roots)))
            if points:  # in the order of the previous roots, with the least sum of distances
                _, order = linear_sum_assignment(np.abs(points[-1][0][:, np.newaxis] - roots))
            points.append((roots[order], stability_there))
            if report is not None:
                report(number, len(values))
    except KeyboardInterrupt:
        if not points:
            raise
        interrupted = True
    doubts.warn(stacklevel=5)
    rows, stability = zip(*points, strict=True)
    done = np.array(values[: len(rows)], dtype=float)
    return RootLocus(parameter, done, np.array(rows), stability, interrupted)


def draw_root_locus(locus: RootLocus, unit: str, title: str, path: Path) -> Path:
    """Draw the roots in the upper half plane, coloured by the parameter: crosses at its first value, rings at its last.

    Parameters
    ----------
    locus : RootLocus
        Parameter values and eigenvalues.
    unit : str
        Unit of the parameter.
    title : str
        Name above the figure.
    path : Path
        File to write; the ending chooses the format.
    """
    figure = new_figure((8.4, 6.0))
    _draw_roots(figure.subplots(), locus, unit)
    figure.suptitle(f"{title}: roots over {locus.parameter}", fontsize=11)
    return save_figure(figure, path)


def _draw_roots(axis: Any, locus: RootLocus, unit: str) -> None:
    """Draw the roots of the upper half plane on an axis, coloured by the parameter, with lines between near neighbours.
    Crosses mark the first value, rings the last one. Colours are logarithmic for values of equal ratios. `unit` is the
    parameter's, for the colour bar."""
    from matplotlib.colors import LogNorm, Normalize  # noqa: PLC0415  # slow to import

    low, high = float(np.min(locus.values)), float(np.max(locus.values))
    ratios = locus.values[1:] / locus.values[:-1] if np.all(locus.values > 0.0) else np.zeros(0)
    logarithmic = len(ratios) > 1 and np.allclose(ratios, ratios[0], rtol=COMPUTED) and ratios[0] != 1.0
    norm = (LogNorm if logarithmic else Normalize)(low, high)
    exact = np.abs(locus.eigenvalues.real) > COMPUTED * np.abs(locus.eigenvalues)
    eigenvalues = np.where(exact, locus.eigenvalues, 1j * locus.eigenvalues.imag)
    tolerance = COMPUTED * (1.0 + float(np.linalg.norm(eigenvalues)))
    extent = float(np.ptp(eigenvalues.real) + np.ptp(eigenvalues.imag))
    drawn = None
    for root in eigenvalues.T:
        upper = root.imag >= -tolerance
        # at roots that meet and part, a long line would suggest a branch that does not exist
        near = np.abs(np.diff(root)) <= 0.08 * extent
        for k in np.flatnonzero(near & upper[1:] & upper[:-1]):
            axis.plot(root.real[k : k + 2], root.imag[k : k + 2], color="#bbbbbb", linewidth=0.8, zorder=1)
        colours = locus.values[upper]
        drawn = axis.scatter(root.real[upper], root.imag[upper], c=colours, cmap="viridis", norm=norm, s=12, zorder=2)
        for end, looks in _ENDS:
            if upper[end]:
                axis.scatter([root[end].real], [root[end].imag], s=46, linewidths=1.3, zorder=3, **looks)
    axis.axvline(0.0, color="#222222", linewidth=1.0, zorder=1)
    axis.set_xlabel("real part, 1/s")
    axis.set_ylabel("imaginary part, rad/s")
    axis.margins(0.06)
    if not np.any(eigenvalues.real):
        height = float(np.abs(eigenvalues).max(initial=0.0)) or 1.0
        axis.set_xlim(-0.1 * height, 0.1 * height)
    draw_grid(axis)
    if drawn is not None:
        label = locus.parameter if unit in ("", "1") else f"{locus.parameter}, {unit}"
        axis.figure.colorbar(drawn, ax=axis, label=label)
    first, last = locus.values[0], locus.values[-1]
    axis.set_title(f"× {locus.parameter} = {first:.6g}   ○ {locus.parameter} = {last:.6g}", fontsize=10, loc="left")
