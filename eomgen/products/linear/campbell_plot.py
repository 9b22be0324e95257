"""Campbell diagrams: frequencies of oscillations over the speed of a rotor, their whirl, and crossings with orders;
their figure, in which labels do not overlap.

An order n is an excitation of n times the speed; a speed is critical if a frequency equals an excitation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_calls
from eomgen.base.data import dataclass, field
from eomgen.base.figures import axes_of_caller, axis_label, draw_grid, new_figure, save_figure
from eomgen.base.html import page, table
from eomgen.base.messages import shown
from eomgen.errors import Problem, UsageError
from eomgen.products.linear.plots import AROUND, LETTER, LabelBox, free_box

#: Colour, line style and word of each sense of whirl.
_WHIRL = {1: ("#0B62C4", "-", "forward"), -1: ("#F08C00", "--", "backward"), 0: ("#333333", "-", "")}
_RAY, _CROSSING = "#777777", "#C8102E"
#: Units of the speed axis, per rad/s.
SPEED_UNITS = {"rad/s": 1.0, "rpm": 30.0 / math.pi, "Hz": 0.5 / math.pi}
#: Inches of a new figure.
_SIZE = (8.6, 5.6)
#: Size of letters, points.
_POINTS = 9.0
#: Candidates for labels of curves and rays at the right end, and of rays that leave through the top.
_BESIDE = tuple((1, lines * LETTER[1]) for lines in (0, 1, -1, 2, -2))
_ABOVE = tuple((side, 2.0 + 0.5 * LETTER[1]) for side in (0, 1, -1))


@dataclass(frozen=True)
class CampbellView:
    """Choice of the parts of a Campbell diagram that are drawn; see ``Campbell.plot``. ``frequencies`` are limits in
    Hz, ``modes`` columns of the diagram, ``orders`` some of the diagram's orders; None for all. ``speed_unit`` is
    ``rad/s``, ``rpm`` or ``Hz``; None for the unit of the parameter."""

    frequencies: tuple[float, float] | None = None
    modes: Sequence[int] | None = None
    orders: Sequence[float] | None = None
    speed_unit: str | None = None
    #: Letter of orders in labels: ``x``, or ``P`` as of wind turbines.
    letter: str = "x"

    def check(self, diagram: Campbell) -> None:
        """Raise UsageError for modes, orders or a speed unit that the diagram does not have, and for unsuitable
        limits."""
        count = diagram.frequencies.shape[1]
        for name, value, example in (
            ("modes", self.modes, "(0, 1)"),
            ("orders", self.orders, "(1, 2)"),
            ("frequencies", self.frequencies, "(0, 40)"),
        ):
            numbers = np.asarray([0] if value is None else value)
            if numbers.ndim != 1 or numbers.dtype.kind not in "iuf":
                fault = f"several numbers are needed, not {shown(value)} [E0377]"
                raise UsageError(Problem(name, fault, f"{name}={example}"))
        for number in () if self.modes is None else self.modes:
            if number not in range(count):
                fault = f"there is no mode {number!r} [E0373]"
                raise UsageError(Problem("modes", fault, f"numbers from 0 to {count - 1}"))
        limits = self.frequencies
        if limits is not None and not (len(limits) == 2 and 0.0 <= limits[0] < limits[1]):
            raise UsageError(Problem("frequencies", f"{limits} are not limits in Hz [E0374]", "(0, 40)"))
        for order in () if self.orders is None else self.orders:
            if order not in diagram.orders:
                known = " and ".join(f"{item:g}" for item in diagram.orders) or "none"
                fault = f"the diagram has no order {shown(order)}, its orders are {known} [E0376]"
                raise UsageError(Problem("orders", fault, f"model.campbell(..., orders=({order}, 2))"))
        unit = self.speed_unit
        if unit not in (None, *SPEED_UNITS):
            raise UsageError(Problem("speed_unit", f"there is no unit {shown(unit)} [E0317]", " or ".join(SPEED_UNITS)))
        if unit is not None and diagram.unit != "rad/s":
            own_unit = diagram.unit or "no unit"
            fault = f"{diagram.parameter} has {own_unit}, and a speed in rad/s is converted [E0375]"
            raise UsageError(Problem("speed_unit", fault, "no speed_unit"))


_ALL = CampbellView()


@dataclass(frozen=True)
class Crossing:
    """A speed at which a mode has the frequency of an order.

    Attributes
    ----------
    order : frequency over speed
    speed, frequency : rad/s, both, the frequency damped: ``Campbell.frequencies`` are in Hz
    mode : column of ``Campbell.eigenvalues``
    whirl : ``forward``, ``backward``, or empty
    """

    order: float
    speed: float
    frequency: float
    mode: int
    whirl: str


@checked_calls()
@dataclass(frozen=True, repr=False)
class Campbell:
    """Oscillations over a speed, or over another parameter.

    Attributes
    ----------
    parameter, unit : name and unit of the varied parameter
    values : (n,) in ``unit``; values without a linear model are left out
    eigenvalues : (n, modes) complex, 1/s, imaginary parts positive; not a number if a mode does not oscillate
    whirl : (n, modes) 1 forward, -1 backward, 0 neither or not known
    orders : orders with a search for crossings
    crossings : by order and speed
    stability : (n,) ``stable``, ``marginal`` or ``unstable``
    left_out : by value, why there is no linear model there
    interrupted : whether Ctrl-C has ended the search early, with the values and crossings that were found
    numbers : (modes,) in tables and pictures: as ``Modes`` counts the modes of a reference, else from 1 on
    """

    parameter: str
    unit: str
    values: Array
    eigenvalues: NDArray[np.complex128]
    whirl: NDArray[np.int_]
    orders: tuple[float, ...]
    crossings: tuple[Crossing, ...]
    stability: tuple[str, ...]
    left_out: Mapping[float, str] = field(default_factory=dict)
    interrupted: bool = False
    numbers: tuple[int, ...] = ()

    def number(self, mode: int) -> int:
        """Return the number of a mode, a column of ``eigenvalues``, in tables and pictures.

        Parameters
        ----------
        mode : int
            Column of ``eigenvalues``, from 0.

        Returns
        -------
        int
            Number of the mode in tables and pictures.

        Examples
        --------
        >>> rotor = eomgen.SceneBuilder("rotor", gravity=[0, 0, 0]).body("cross", 0)
        >>> rotor = rotor.body("disc", 5.0, inertia=[0.2, 0.2, 0.3])
        >>> rotor = rotor.joint("tilt", "revolute", "base", "cross", axis=[1, 0, 0], stiffness=7200)
        >>> rotor = rotor.joint("spin", "revolute", "cross", "disc", axis=[0, 0, 1])
        >>> diagram = eomgen.build(rotor.build()).campbell("spin", [0.0, 100.0], orders=(1,))
        >>> diagram.number(0)
        1
        """
        return self.numbers[mode] if self.numbers else mode + 1

    @property
    def angular_frequencies(self) -> Array:
        """(n, modes), rad/s as speeds are: damped frequencies, imaginary parts of the eigenvalues."""
        return np.asarray(self.eigenvalues.imag)

    @property
    def frequencies(self) -> Array:
        """(n, modes), Hz: damped frequencies, ``angular_frequencies`` over 2 pi, if speeds are in rad/s."""
        return self.angular_frequencies / (2.0 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios of the modes, (n, modes)."""
        return np.asarray(-self.eigenvalues.real / np.abs(self.eigenvalues))

    @property
    def critical_speeds(self) -> Array:
        """Speeds equal to the frequency of a mode at this speed, rad/s, increasing."""
        return np.array([item.speed for item in self.crossings if item.order == 1.0])

    @property
    def headings(self) -> tuple[str, ...]:
        """Headings of ``rows``."""
        return ("order", f"{self.parameter}, rad/s", "1/min", "damped frequency, Hz", "mode", "whirl")

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Each crossing as a tuple of texts: order, speed in rad/s, speed in 1/min, damped frequency in Hz, mode number
        by ``number``, whirl (may be empty). An empty list without crossings."""
        return [
            (
                f"{item.order:g}",
                f"{item.speed:.9g}",
                f"{item.speed * 30.0 / np.pi:.9g}",
                f"{item.frequency / (2.0 * np.pi):.9g}",
                str(self.number(item.mode)),
                item.whirl,
            )
            for item in self.crossings
        ]

    def __repr__(self) -> str:
        modes = f"{self.eigenvalues.shape[1]} modes at {len(self.values)} values of {self.parameter}"
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        ends = f"{self.values[0]:.6g} to {self.values[-1]:.6g}{unit}"
        result = ", ".join(f"{item.order:g}x at {item.speed:.6g}{unit}" for item in self.crossings)
        missing = f"; none at {', '.join(f'{value:.6g}' for value in self.left_out)}" if self.left_out else ""
        missing += "; interrupted" if self.interrupted else ""
        height = float(np.nanmax(self.frequencies, initial=0.0))
        return f"<Campbell: {modes}, {ends}, up to {height:.6g} Hz; {result or 'no crossings'}{missing}>"

    def _repr_html_(self) -> str:
        heading = f"{self.eigenvalues.shape[1]} modes over {self.parameter}; crossings with orders"
        return page(heading, table(self.headings, self.rows))

    def plot(
        self,
        axes: object = None,
        *,
        frequencies: tuple[float, float] | None = None,
        modes: Sequence[int] | None = None,
        orders: Sequence[float] | None = None,
        speed_unit: str | None = None,
    ) -> list[Any]:
        """Draw frequencies over the speed, orders as rays, crossings as dots; return matplotlib's axes, a list of one.

        Forward whirl is blue, backward whirl is dashed in orange. Crossings are labelled with their speeds, if there is
        room; modes have their numbers by ``number``, as in ``rows``, at the right if there is room.

        Parameters
        ----------
        axes : matplotlib Axes
            A new figure of pyplot if none are given.
        frequencies : pair of float
            Limits of the frequency axis, Hz. By default the picture ends above all modes, or, if these lie far above
            the rays, above the highest ray and the lowest mode, and says how many modes lie higher.
        modes : sequence of int
            Numbers of the modes drawn, columns of ``eigenvalues`` from 0 on; all by default.
        orders : sequence of float
            Rays and crossings drawn, some of ``orders``; all by default.
        speed_unit : str
            ``rad/s``, ``rpm`` or ``Hz`` of the speed axis and of the labels of crossings; the parameter's own unit by
            default.

        Returns
        -------
        list of matplotlib Axes
            One.

        Raises
        ------
        UsageError
            An object that is not axes, or more than one; limits below 0 or that do not increase; numbers of no modes;
            orders without a search for crossings; an unknown unit, or a unit for a parameter that is not in rad/s.
        """
        return plot_campbell(self, axes, CampbellView(frequencies, modes, orders, speed_unit))


def draw_campbell(diagram: Campbell, title: str, path: Path, view: CampbellView = _ALL) -> Path:
    """Draw the diagram into a file, and return the path.

    Parameters
    ----------
    diagram : Campbell
        Parameter values and followed eigenvalues.
    title : str
        Name above the figure.
    path : Path
        File to write; the ending chooses the format.
    view : CampbellView, optional
        Parts and limits to draw; everything by default.

    Raises
    ------
    UsageError
        A view of parts that the diagram does not have.
    FileError
        The file cannot be written.
    """
    figure = new_figure(_SIZE)
    figure.get_layout_engine().set(w_pad=0.1)
    plot_campbell(diagram, figure.subplots(), view)
    figure.suptitle(f"{title}: Campbell diagram", fontsize=11)
    figure.text(0.99, 0.01, f"modes: {numbering(diagram)}", ha="right", va="bottom", fontsize=7.5, color="#444444")
    return save_figure(figure, path)


def numbering(diagram: Campbell) -> str:
    """Return the meaning of the numbers of modes in words."""
    return "numbers of the table of modes" if diagram.numbers else "oscillations, by frequency at the first speed"


def plot_campbell(diagram: Campbell, axes: object = None, view: CampbellView = _ALL) -> list[Any]:
    """Draw frequencies over the speed on matplotlib axes, and return a list with the axes; see ``Campbell.plot``.
    `axes` are the caller's; a new figure is made if None. Raises UsageError for a view that the diagram does not
    have."""
    view.check(diagram)
    drawn = axes_of_caller("plot", axes, [f"frequencies over {diagram.parameter}"], _SIZE)
    if axes is None:
        drawn[0].figure.get_layout_engine().set(w_pad=0.1)  # inches after the labels at the right
    _Drawing(drawn[0], diagram, view).draw()
    return drawn


class _Drawing:
    """Drawing of the parts of one Campbell diagram that a view chooses, on one pair of matplotlib axes."""

    def __init__(self, axis: Any, diagram: Campbell, view: CampbellView) -> None:
        self.axis, self.diagram = axis, diagram
        self.modes = list(range(diagram.frequencies.shape[1])) if view.modes is None else list(view.modes)
        self.orders = sorted(diagram.orders if view.orders is None else view.orders)
        self.unit, self.letter = view.speed_unit or diagram.unit, view.letter
        self.scale = SPEED_UNITS[view.speed_unit or "rad/s"]
        self.frequencies = diagram.frequencies[:, self.modes]
        self.ends = np.array([float(np.min(diagram.values)), float(np.max(diagram.values))])
        self.fixed = view.frequencies is not None
        self.bottom, self.top = view.frequencies or (0.0, _highest(self.frequencies, self.orders, self.ends))
        box = axis.get_window_extent()
        self.size = np.array([box.width, box.height]) * 72.0 / axis.figure.dpi
        #: Places of dots and labels, in points.
        self.taken: list[LabelBox] = []

    def draw(self) -> None:
        """Draw the curves, rays of orders, labels, crossings, axis labels and the legend of senses and dots. A note
        counts the modes above the figure, unless the caller chose the limits."""
        axis = self.axis
        axis.set_xlim(*(self.ends * self.scale))
        axis.set_ylim(self.bottom, self.top)
        senses = self._curves()
        self._rays()
        crosses = self._crossings()
        self._labels_at_ends()
        axis.set_xlabel(axis_label(self.diagram.parameter, self.unit))
        axis.set_ylabel("damped frequency, Hz")
        draw_grid(axis)
        if senses or crosses:
            axis.legend(fontsize=9, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.03), ncols=4, borderpad=0.0)
        lowest = np.nanmin(self.frequencies, axis=0, initial=np.inf)
        above = int(np.sum(lowest > self.top))
        if above and not self.fixed:
            words = f"{above} mode{'s' * (above > 1)} above {self.top:.3g} Hz"
            style = {"textcoords": "offset points", "xycoords": "axes fraction", "ha": "right", "va": "bottom"}
            axis.annotate(words, (1.0, 1.0), (0.0, 2.0 + LETTER[1]), fontsize=_POINTS, color="#444444", **style)

    def _curves(self) -> set[str]:
        """Draw the frequencies of the modes, with colour and line style by sense of whirl. Returns the words in the
        legend, such as ``forward``, ``backward``, ``no sense of whirl``; empty without whirl."""
        diagram, named = self.diagram, set[str]()
        for mode in self.modes:
            for sense in np.unique(diagram.whirl[:, mode]):
                colour, style, word = _WHIRL[int(sense)]
                has_sense = diagram.whirl[:, mode] == sense
                # at rest there is no whirl: curves begin with the whirl of the neighbouring point
                before = np.concatenate([[False], has_sense[:-1]])
                beside = np.concatenate([has_sense[1:], [False]]) | before
                turned = sense != 0 and before & (diagram.whirl[:, mode] == -sense)  # no gap before another sense
                drawn = has_sense | (beside & (diagram.whirl[:, mode] == 0)) | turned
                if not diagram.whirl[:, mode].any() and diagram.whirl.any():
                    word = "no sense of whirl"
                label = word if word and word not in named else None
                named.add(word)
                heights = np.where(drawn, diagram.frequencies[:, mode], np.nan)
                self.axis.plot(diagram.values * self.scale, heights, style, color=colour, label=label, lw=1.5)
        return named - {""}

    def _rays(self) -> None:
        low, high = self.ends
        line = np.array([low, *([0.0] if low < 0.0 < high else []), high])
        for order in self.orders:
            heights = order * np.abs(line) / (2.0 * np.pi)
            self.axis.plot(line * self.scale, heights, ":", color=_RAY, linewidth=1.1, zorder=1.5)

    def _labels_at_ends(self) -> None:
        """Label rays of orders at the edge of the figure, and modes at the right end, each if there is a free
        place."""
        end = float(self.ends[1])
        for order in self.orders:
            text, ray = f"{order:g}{self.letter}", order * abs(end) / (2.0 * math.pi)
            leaves = self.top * 2.0 * math.pi / order
            if self.bottom <= ray <= self.top:
                self._label((end, ray), text, _BESIDE, _RAY)
            elif self.ends[0] <= leaves < end:
                self._label((leaves, self.top), text, _ABOVE, _RAY)
        for mode, column in zip(self.modes, self.frequencies.T, strict=True):
            if self.bottom <= column[-1] <= self.top:
                self._label((end, float(column[-1])), f"mode {self.diagram.number(mode)}", _BESIDE, "#111111")

    def _label(
        self, at: tuple[float, float], text: str, places: Sequence[tuple[int, float]], colour: str, **looks: Any
    ) -> None:
        """Write a label at a speed and frequency, at the first free one of the places; no label without one. Labels
        around a point are within the axes."""
        point = self._points(*at)
        if box := free_box(point, text, places, self.taken, *([self.size] if places is AROUND else [])):
            self.taken.append(box)
            away = (box.x - point[0], box.y - point[1])
            looks = {"fontsize": _POINTS, "textcoords": "offset points", "annotation_clip": False, **looks}
            there = (at[0] * self.scale, at[1])
            self.axis.annotate(text, there, away, "data", ha="center", va="center", color=colour, **looks)

    def _crossings(self) -> bool:
        """Draw a dot for each crossing, with its speed as text if there is a free place next to the dot. Left out are
        crossings outside the limits, of modes or orders that are not drawn, or almost on another dot. Returns whether
        there is any dot."""
        single: list[tuple[Array, float, float]] = []
        for item in self.diagram.crossings:
            frequency, drawn = item.frequency / (2.0 * np.pi), item.mode in self.modes and item.order in self.orders
            point = self._points(item.speed, frequency)
            near = any(np.all(np.abs(point - neighbour) < 0.008 * self.size) for neighbour, _, _ in single)
            if drawn and self.bottom <= frequency <= self.top and not near:
                single.append((point, item.speed, frequency))
        self.axis.plot(
            [speed * self.scale for _, speed, _ in single],
            [frequency for _, _, frequency in single],
            "o", color=_CROSSING, markeredgecolor="white", markeredgewidth=0.8, markersize=6.5, zorder=3, clip_on=False,
            label=axis_label("crossing", self.unit) if single else None,
        )  # fmt: skip  # place, looks
        self.taken += [LabelBox.dot(*point) for point, _, _ in single]
        looks = {"boxstyle": "square,pad=0.05", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}
        for _, speed, frequency in single:
            text_properties = {"fontsize": _POINTS - 1.0, "zorder": 4, "bbox": looks}
            shown_speed = speed * self.scale  # with four digits and more, without an exponent
            text = f"{shown_speed:.0f}" if abs(shown_speed) >= 1e3 else f"{shown_speed:.4g}"
            self._label((speed, frequency), text, AROUND, _CROSSING, **text_properties)
        return bool(single)

    def _points(self, speed: float, frequency: float) -> Array:
        low, high = (self.ends[0], self.bottom), (self.ends[1], self.top)
        return np.asarray((np.array([speed, frequency]) - low) / np.subtract(high, low) * self.size)


def _highest(frequencies: Array, orders: Sequence[float], ends: Array) -> float:
    """Return the frequency in Hz at which a diagram ends: above all modes, or, if modes lie far above the rays of the
    orders, above these rays and the lowest mode, so that crossings are resolved. `frequencies` (n, modes) are in Hz,
    `ends` (2,) are the lowest and the highest speed in rad/s."""
    top = 1.08 * float(np.nanmax(frequencies, initial=0.0)) or 1.0
    ray = max(orders, default=0.0) * float(np.abs(ends).max()) / (2.0 * np.pi)
    if not ray > 0.0 or not frequencies.size:
        return top
    lowest = float(np.nanmin(np.nanmax(frequencies, axis=0)))
    return min(top, max(1.5 * ray, 1.2 * lowest))
