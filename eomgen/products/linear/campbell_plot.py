"""Figure of a Campbell diagram: frequencies over the speed, rays of orders, crossings with their speeds; labels do not
overlap."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.figures import axes_of_caller, axis_label, draw_grid, new_figure, save_figure
from eomgen.base.messages import shown
from eomgen.errors import Problem, UsageError

#: Colour, line style and word of each sense of whirl.
_WHIRL = {1: ("#0B62C4", "-", "forward"), -1: ("#F08C00", "--", "backward"), 0: ("#333333", "-", "")}
Height = TypeVar("Height", float, Array)
_RAY, _CROSSING = "#777777", "#C8102E"
#: Units of the speed axis, per rad/s.
SPEED_UNITS = {"rad/s": 1.0, "rpm": 30.0 / math.pi, "Hz": 0.5 / math.pi}
#: Inches of a new figure.
_SIZE = (8.6, 5.6)
#: Letters in points: size, width and height of a line, with the space to the next line.
_POINTS, _WIDTH, _HEIGHT = 9.0, 5.6, 12.0
#: Curves that end nearer than this part of the figure have one label; crossings nearer than this are one dot.
_TOGETHER = 0.008
#: Candidates for the label of a crossing: which corner or side is at the dot, and points upwards from the dot.
_AROUND = (
    (-1, 7.0), (1, -7.0), (-1, -7.0), (1, 7.0), (0, 11.0), (0, -11.0), (1, 0.0), (-1, 0.0),
    (-1, 15.0), (1, -15.0), (-1, -15.0), (1, 15.0),
)  # fmt: skip  # nearest first
#: Points upwards from which a candidate is far from its dot, and points of lines within its box that it has to save.
_FAR, _SAVED = 12.0, 12
#: Points from the axes to the labels at the right, and inches after the labels.
_GAP, _MARGIN = 8.0, 0.1
#: Half the side of a dot, points.
_DOT = 3.5


class DrawnCrossing(Protocol):
    """Interface of a ``Crossing`` for drawing: order, speed (rad/s), frequency (rad/s), and number of the mode's
    column."""

    @property
    def order(self) -> float: ...
    @property
    def speed(self) -> float: ...
    @property
    def frequency(self) -> float: ...
    @property
    def mode(self) -> int: ...


class DrawnCampbell(Protocol):
    """Interface of a ``Campbell`` for drawing: speeds (n,), damped frequencies (n, modes) in Hz, whirl (n, modes) as 1,
    -1 or 0, orders and crossings. ``number`` turns the column of a mode into the number in labels."""

    @property
    def parameter(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def values(self) -> Array: ...
    @property
    def frequencies(self) -> Array: ...
    @property
    def whirl(self) -> NDArray[np.int_]: ...
    @property
    def orders(self) -> Sequence[float]: ...
    @property
    def crossings(self) -> Sequence[DrawnCrossing]: ...
    @property
    def numbers(self) -> tuple[int, ...]: ...
    def number(self, mode: int) -> int: ...


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

    def check(self, diagram: DrawnCampbell) -> None:
        """Raise UsageError for modes, orders or a speed unit that the diagram does not have, and for unsuitable
        limits."""
        count = diagram.frequencies.shape[1]
        self._check_numbers()
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
        if unit is not None and unit not in SPEED_UNITS:
            raise UsageError(Problem("speed_unit", f"there is no unit {shown(unit)} [E0317]", " or ".join(SPEED_UNITS)))
        if unit is not None and diagram.unit != "rad/s":
            own_unit = diagram.unit or "no unit"
            fault = f"{diagram.parameter} has {own_unit}, and a speed in rad/s is converted [E0375]"
            raise UsageError(Problem("speed_unit", fault, "no speed_unit"))

    def _check_numbers(self) -> None:
        """Raise UsageError if modes, orders or frequencies are given and are not a sequence of numbers."""
        for name, value, example in (
            ("modes", self.modes, "(0, 1)"),
            ("orders", self.orders, "(1, 2)"),
            ("frequencies", self.frequencies, "(0, 40)"),
        ):
            several = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)
            if value is not None and not (
                several and all(isinstance(entry, int | float | np.number) for entry in value)
            ):
                fault = f"several numbers are needed, not {shown(value)} [E0377]"
                raise UsageError(Problem(name, fault, f"{name}={example}"))


_ALL = CampbellView()


def draw_campbell(diagram: DrawnCampbell, title: str, path: Path, view: CampbellView = _ALL) -> Path:
    """Draw the diagram into a file, and return the path.

    Parameters
    ----------
    diagram : DrawnCampbell
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
    view.check(diagram)
    figure = new_figure(_SIZE)
    figure.get_layout_engine().set(w_pad=_MARGIN)
    _Drawing(figure.subplots(), diagram, view).draw()
    figure.suptitle(f"{title}: Campbell diagram", fontsize=11)
    figure.text(0.99, 0.01, f"modes: {numbering(diagram)}", ha="right", va="bottom", fontsize=7.5, color="#444444")
    return save_figure(figure, path)


def numbering(diagram: DrawnCampbell) -> str:
    """Return the meaning of the numbers of modes in words."""
    return "numbers of the table of modes" if diagram.numbers else "oscillations, by frequency at the first speed"


def plot_campbell(diagram: DrawnCampbell, axes: object = None, view: CampbellView = _ALL) -> list[Any]:
    """Draw frequencies over the speed on matplotlib axes, and return a list with the axes; see ``Campbell.plot``.
    `axes` are the caller's; a new figure is made if None. Raises UsageError for a view that the diagram does not
    have."""
    view.check(diagram)
    drawn = axes_of_caller("plot", axes, [f"frequencies over {diagram.parameter}"], _SIZE)
    if axes is None:
        drawn[0].figure.get_layout_engine().set(w_pad=_MARGIN)
    _Drawing(drawn[0], diagram, view).draw()
    return drawn


class _Label(NamedTuple):
    """A label in the margin: the place in the figure that the label belongs to, text and colour."""

    place: float
    text: str
    colour: str


class _Box(NamedTuple):
    """A rectangle within the axes by centre and half sides, in points; ``meets`` is whether two rectangles overlap."""

    x: float
    y: float
    half_width: float
    half_height: float

    def meets(self, other: _Box) -> bool:
        clear_in_x = abs(self.x - other.x) >= self.half_width + other.half_width
        return not clear_in_x and abs(self.y - other.y) < self.half_height + other.half_height


class _Drawing:
    """Drawing of the parts of one Campbell diagram that a view chooses, on one pair of matplotlib axes."""

    def __init__(self, axis: Any, diagram: DrawnCampbell, view: CampbellView) -> None:
        self.axis, self.diagram = axis, diagram
        self.modes = list(range(diagram.frequencies.shape[1])) if view.modes is None else list(view.modes)
        self.orders = sorted(diagram.orders if view.orders is None else view.orders)
        self.unit, self.letter = view.speed_unit or diagram.unit, view.letter
        self.scale = SPEED_UNITS[view.speed_unit] if view.speed_unit else 1.0
        self.frequencies = diagram.frequencies[:, self.modes]
        self.ends = np.array([float(np.min(diagram.values)), float(np.max(diagram.values))])
        self.fixed = view.frequencies is not None
        self.bottom, self.top = view.frequencies or (0.0, _highest(self.frequencies, self.orders, self.ends))
        box = axis.get_window_extent()
        self.size = np.array([box.width, box.height]) * 72.0 / axis.figure.dpi

    def draw(self) -> None:
        """Draw the curves, rays of orders, labels, crossings, axis labels and the legend of senses and dots. A note
        counts the modes above the figure, unless the caller chose the limits."""
        axis = self.axis
        axis.set_xlim(*(self.ends * self.scale))
        axis.set_ylim(self.bottom, self.top)
        senses = self._curves()
        self._rays()
        self._labels_at_the_right()
        self._labels_at_the_top()
        crosses = self._crossings()
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
            axis.annotate(words, (1.0, 1.0), (0.0, 2.0 + _HEIGHT), fontsize=_POINTS, color="#444444", **style)

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

    def _height(self, frequency: Height) -> Height:
        """Return the height of a frequency (Hz, a number or an array) in the figure, 0 at the bottom and 1 at the
        top."""
        height: Height = (frequency - self.bottom) / (self.top - self.bottom)
        return height

    def _labels_at_the_right(self) -> None:
        """Label the rays of orders and the modes at the right end, with labels moved so that none overlap. Modes that
        end close together have one label. Labels of modes are left out if there is no room for all labels, and labels
        of rays likewise."""
        rays = [_Label(self._height(self._ray(order)), f"{order:g}{self.letter}", _RAY) for order in self.orders]
        rays = [item for item in rays if 0.0 <= item.place <= 1.0]
        ends = sorted(
            (self._height(float(column[-1])), mode)
            for mode, column in zip(self.modes, self.frequencies.T, strict=True)
            if not np.isnan(column[-1])
        )
        groups: list[list[tuple[float, int]]] = []
        for height, mode in (item for item in ends if 0.0 <= item[0] <= 1.0):
            if groups and height - groups[-1][0][0] < _TOGETHER:
                groups[-1].append((height, mode))
            else:
                groups.append([(height, mode)])
        number = self.diagram.number
        modes = [_Label(group[0][0], _mode_label([number(mode) for _, mode in group]), "#111111") for group in groups]
        gap = _HEIGHT / self.size[1]
        both = sorted([*rays, *modes])
        labels = both if len(both) * gap <= 1.0 else rays if len(rays) * gap <= 1.0 else []
        for label, height in zip(labels, _spread([item.place for item in labels], gap), strict=True):
            self.axis.annotate(
                label.text, (1.0, label.place), (1.0 + _GAP / self.size[0], height), "axes fraction",
                va="center", fontsize=_POINTS, color=label.colour,
                arrowprops={"arrowstyle": "-", "color": "#bbbbbb", "linewidth": 0.7, "shrinkA": 1.0, "shrinkB": 0.0},
            )  # fmt: skip  # place, text, looks

    def _ray(self, order: float) -> float:
        """Return the frequency of a ray at the right end, Hz."""
        return order * abs(float(self.ends[1])) / (2.0 * math.pi)

    def _labels_at_the_top(self) -> None:
        """Label the rays of orders that leave the figure through the top; no labels if there is no room for all."""
        leaving = [order for order in self.orders if self._ray(order) > self.top and self.ends[1] > 0.0]
        width = float(self.ends[1] - self.ends[0])
        places = {order: (self.top * 2.0 * math.pi / order - self.ends[0]) / width for order in leaving[::-1]}
        kept = [(order, height) for order, height in places.items() if height >= 0.0]
        gap = 4.4 * _WIDTH / self.size[0]
        if len(kept) * gap > 1.0:
            return
        for (order, _), height in zip(kept, _spread([height for _, height in kept], gap), strict=True):
            self.axis.annotate(
                f"{order:g}{self.letter}", (height, 1.0), (0.0, 2.0), "axes fraction", textcoords="offset points",
                ha="center", va="bottom", fontsize=_POINTS, color=_RAY,
            )  # fmt: skip  # place, text, looks

    def _crossings(self) -> bool:
        """Draw a dot for each crossing, with its speed as text if there is a free place next to the dot. Left out are
        crossings outside the limits, of modes or orders that are not drawn, or almost on another dot. Returns whether
        there is any dot."""
        single: list[tuple[Array, float, float]] = []
        for item in self.diagram.crossings:
            frequency, drawn = item.frequency / (2.0 * np.pi), item.mode in self.modes and item.order in self.orders
            point = self._points(item.speed, frequency)
            near = any(np.all(np.abs(point - neighbour) < _TOGETHER * self.size) for neighbour, _, _ in single)
            if drawn and self.bottom <= frequency <= self.top and not near:
                single.append((point, item.speed, frequency))
        self.axis.plot(
            [speed * self.scale for _, speed, _ in single],
            [frequency for _, _, frequency in single],
            "o", color=_CROSSING, markeredgecolor="white", markeredgewidth=0.8, markersize=6.5, zorder=3, clip_on=False,
            label=axis_label("crossing", self.unit) if single else None,
        )  # fmt: skip  # place, looks
        lines = self._points_of_lines()
        taken = [_Box(float(point[0]), float(point[1]), _DOT, _DOT) for point, _, _ in single]
        for point, speed, frequency in single:
            text = _number(speed * self.scale)
            box = _free(point, text, taken, lines, self.size)
            if box is None:
                continue
            taken.append(box)
            away = (box.x - point[0], box.y - point[1])
            self.axis.annotate(
                text, (speed * self.scale, frequency), away, "data", textcoords="offset points", ha="center",
                va="center", fontsize=_POINTS - 1.0, color=_CROSSING, zorder=4,
                bbox={"boxstyle": "square,pad=0.05", "facecolor": "white", "edgecolor": "none", "alpha": 0.75},
            )  # fmt: skip  # place, text, looks
        return bool(single)

    def _points(self, speed: float, frequency: float) -> Array:
        across = (speed - self.ends[0]) / (self.ends[1] - self.ends[0])
        return np.asarray(np.array([across, self._height(frequency)]) * self.size)

    def _points_of_lines(self) -> Array:
        """Return points (n, 2) along all curves and rays, dense enough to decide whether a line crosses a label."""
        speeds = np.linspace(float(self.ends[0]), float(self.ends[1]), 300)
        values, outside = self.diagram.values, {"left": np.nan, "right": np.nan}
        curves = [np.interp(speeds, values, column, **outside) for column in self.frequencies.T]
        curves += [order * np.abs(speeds) / (2.0 * np.pi) for order in self.orders]
        if not curves:
            return np.zeros((0, 2))
        across = np.linspace(0.0, 1.0, len(speeds)) * self.size[0]
        points = np.concatenate([np.column_stack([across, self._height(line) * self.size[1]]) for line in curves])
        return np.asarray(points[np.isfinite(points[:, 1])])


def _free(point: Array, text: str, taken: Iterable[_Box], lines: Array, size: Array) -> _Box | None:
    """Return the box of a label next to a dot that overlaps none of the boxes `taken` and meets the fewest lines.
    `point` (2,) is the dot, `lines` (n, 2) are points along curves, `size` (2,) is the extent of the axes, all in
    points; `text` gives the width. None if each candidate overlaps a box or leaves the axes."""
    half = (0.5 * _WIDTH * len(text), 0.5 * _HEIGHT)
    best: tuple[int, _Box] | None = None
    for side, up in _AROUND:
        right = side * (half[0] + (_DOT if up else 2.0 * _DOT) - 1.0)
        box = _Box(float(point[0] + right), float(point[1] + up), *half)
        inside = half[0] <= box.x <= size[0] - half[0] and half[1] <= box.y <= size[1] - half[1]
        if not inside or any(box.meets(label_box) for label_box in taken):
            continue
        crossed = int(np.sum(np.all(np.abs(lines - (box.x, box.y)) < half, axis=1))) + _SAVED * (abs(up) > _FAR)
        if best is None or crossed < best[0]:
            best = crossed, box
    return best[1] if best is not None else None


def _number(speed: float) -> str:
    """Return a speed with four digits and more, without an exponent."""
    return f"{speed:.0f}" if abs(speed) >= 1e3 else f"{speed:.4g}"


def _mode_label(numbers: Sequence[int]) -> str:
    """Return the label of modes that end together: ``mode 2``, ``modes 2-4``."""
    if len(numbers) == 1:
        return f"mode {numbers[0]}"
    ordered = sorted(numbers)
    if ordered[-1] - ordered[0] == len(ordered) - 1:
        return f"modes {ordered[0]}-{ordered[-1]}"
    return f"modes {', '.join(map(str, ordered[:3]))}{', ...' if len(ordered) > 3 else ''}"


def _spread(places: Sequence[float], gap: float) -> list[float]:
    """Return increasing places from 0 to 1 with at least `gap` between neighbours, with the least sum of squared
    shifts. `places` are the wanted places in increasing order."""
    if not places:
        return []
    from scipy.optimize import isotonic_regression  # noqa: PLC0415  # slow to import

    shifts = gap * np.arange(len(places))
    apart = isotonic_regression(np.asarray(places) - shifts).x
    return [float(height) for height in np.clip(apart, 0.0, 1.0 - shifts[-1]) + shifts]


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
