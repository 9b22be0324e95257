"""Equilibria along a parameter: values, displacements, stability and critical points, with table, file and figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.csv_tables import write_table
from eomgen.base.data import dataclass, field
from eomgen.base.figures import axes_of_caller, axis_label, draw_grid, new_figure, pyplot_figure, save_figure
from eomgen.base.files import write_text
from eomgen.base.json_text import json_text
from eomgen.base.messages import nearest, shown
from eomgen.errors import Problem, UsageError

_STABLE, _UNSTABLE, _LIMIT, _BIFURCATION = "#0B62C4", "#F08C00", "#B00020", "#1B7F3B"


def _plain(value: Any) -> Any:
    """Return a value as the lists, dicts, numbers and texts of JSON; NaN stays."""
    if isinstance(value, Critical):
        value = {**vars(value), "multiplicity": value.multiplicity}
        del value["modes"]
    if isinstance(value, Mapping):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


@dataclass(frozen=True)
class Critical:
    """A point at which a path loses or regains stability.

    Attributes
    ----------
    kind : ``limit point``, if the parameter turns round, or ``bifurcation``, if another path branches off
    value : of the parameter
    q : (nq,)
    mode : (nv,) displacement with zero stiffness at the point, with a largest component of 1 rad, or of the scene's
        length
    columns : of the path, at the point
    after : row of the path's arrays after the point
    components : names of the mode's largest components, largest first
    modes : (nv, n) basis of all displacements with zero stiffness at the point; n > 1 if several stiffnesses vanish
        together, as for a round column, which buckles in two planes
    """

    kind: str
    value: float
    q: Array
    mode: Array
    columns: Mapping[str, float]
    after: int
    components: tuple[str, ...]
    modes: Array

    @property
    def multiplicity(self) -> int:
        """How many stiffnesses are zero at once."""
        return int(self.modes.shape[1])


@dataclass(frozen=True, repr=False)
class EquilibriumPath:
    """Equilibria that are connected with each other, in order along the path.

    Attributes
    ----------
    parameter, unit : name and unit of the varied parameter
    values : (n,) of the parameter
    q, z, multipliers : (n, nq), (n, nz), (n, rows)
    columns : named numbers along the path, (n,) each: the scene's outputs, and positions of bodies, ``body.x``, in m
    units : of the columns
    outputs : names of the columns that are outputs of the scene
    negative : (n,) number of directions with negative stiffness; -1 if not computed
    lowest : (n,) eigenvalue of the stiffness relative to the mass with the least magnitude, (rad/s)^2; NaN if not
        computed
    critical : limit points and bifurcations, in order
    success : whether the path arrives at the value asked for
    message : the end of the path, and the reason
    interrupted : whether Ctrl-C has ended the search early
    """

    parameter: str
    unit: str
    values: Array
    q: Array
    z: Array
    multipliers: Array
    columns: Mapping[str, Array]
    units: Mapping[str, str]
    outputs: tuple[str, ...]
    negative: NDArray[np.int_]
    lowest: Array
    critical: tuple[Critical, ...]
    success: bool
    message: str
    _branch: Callable[[int, float, float], EquilibriumPath] = field(repr=False)
    interrupted: bool = False

    def __repr__(self) -> str:
        return f"<EquilibriumPath: {len(self.values)} equilibria; {self.message}>"

    @property
    def initial(self) -> dict[str, Array]:
        """The last equilibrium, in the form of ``simulate(initial=...)``."""
        still = {"q": self.q[-1]}
        return still | ({"z": self.z[-1]} if self.z.shape[1] else {})

    def branch(self, number: int, to: float, size: float = 1.0) -> EquilibriumPath:
        """Return the path that branches off at a critical point.

        Parameters
        ----------
        number : int
            Number of the critical point in ``critical``, from 0, or negative from the end.
        to : float
            Value of the parameter at which the branch is to end, SI units.
        size : float
            First step along the critical point's ``mode``, in twentieths of a radian or of the scene's length; the sign
            selects the side. If this leads to no equilibrium, steps of 2, 0.4, 4 and 0.1 times this size are tried.

        Returns
        -------
        EquilibriumPath
            The equilibria along the branch, from the end of the first step on, with ``max_step``, ``max_points`` and
            ``stability`` of this path; ``success`` is False if the branch ends before ``to``.

        Raises
        ------
        UsageError
            There is no such critical point.
        NumericalError
            No equilibrium is found near the critical point.
        """
        if not -len(self.critical) <= number < len(self.critical):
            fault = f"there is no critical point {number}: the path has {len(self.critical)} [E0056]"
            raise UsageError(Problem("branch", fault, "a number of EquilibriumPath.critical, from 0"))
        return self._branch(number % len(self.critical), size, to)

    def column(self, name: str) -> Array:
        """Return a column by name, (n,). Raises UsageError for one that is not there.

        Parameters
        ----------
        name : str
            Name of a column, as of ``columns``, or of the parameter.

        Returns
        -------
        (n,) ndarray
            One value for each equilibrium.
        """
        if name == self.parameter:
            return self.values
        if name not in self.columns:
            known = list(self.columns)
            fault = f"the path has no column {shown(name)} [E0057]"
            hint = nearest(name, known) or f"one of {', '.join(known[:8])}"
            raise UsageError(Problem("equilibrium_path", fault, hint))
        return self.columns[name]

    @property
    def largest_column(self) -> str:
        """Name of the output that changes most, units aside; if none changes, of the position of a body."""
        changes = {name: float(np.ptp(column)) for name, column in self.columns.items()}
        outputs = {name: change for name, change in changes.items() if name in self.outputs and change > 0.0}
        among = outputs or changes
        return max(among, key=among.__getitem__) if among else self.parameter

    def save(self, path: str | Path) -> Path:
        """Write the path as a table ``.csv`` of one row for each point, or as ``.json`` in the form of ``to_dict``.

        The columns of the table are the parameter, ``negative_stiffnesses`` (-1 if not computed), ``lowest_stiffness``
        and ``columns``. ``q`` and critical points are in ``.json`` alone, with null for NaN.

        Parameters
        ----------
        path : str or Path
            File to write; an existing file is replaced.

        Returns
        -------
        Path
            The written file.

        Raises
        ------
        UsageError
            Another ending.
        FileError
            The file cannot be written.
        """
        path = Path(path)
        if path.suffix == ".csv":
            names = [self.parameter, "negative_stiffnesses", "lowest_stiffness", *self.columns]
            columns = [self.values, self.negative.astype(float), self.lowest, *self.columns.values()]
            write_table(path, names, np.column_stack(columns))
        elif path.suffix == ".json":
            write_text(path, json_text(self.to_dict()) + "\n")
        else:
            raise UsageError(Problem(str(path), "a path of equilibria is written as .csv or .json [E0058]", "path.csv"))
        return path

    def to_dict(self) -> dict[str, Any]:
        """Return the points and the critical points as a dict for JSON.

        Returns
        -------
        dict
            All but ``z``, ``multipliers``, ``outputs``, ``interrupted`` and the ``modes`` of critical points.
            ``negative`` and ``lowest`` are named ``negative_stiffnesses`` and ``lowest_stiffness``; NaN stays.
        """
        left_out = ("z", "multipliers", "outputs", "interrupted", "_branch")
        longer = {"negative": "negative_stiffnesses", "lowest": "lowest_stiffness"}
        return {longer.get(name, name): _plain(item) for name, item in vars(self).items() if name not in left_out}

    def plot(self, over: str | Sequence[str] = "", axes: object = None, path: str | Path | None = None) -> list[Any]:
        """Draw the parameter over columns, unstable parts dashed, critical points marked; return matplotlib's axes.

        Parameters
        ----------
        over : name or names of columns
            By default the output that changes most, units aside; if no output changes, a position of a body.
        axes : matplotlib Axes, one for each column
            A new figure if none are given, of pyplot without ``path``.
        path : str or Path, optional
            File of a figure, .png, .svg or .pdf; with ``axes`` of the whole figure of the first.

        Returns
        -------
        list of matplotlib Axes
            One for each panel.

        Raises
        ------
        UsageError
            A column that is not there, another number of axes, or an ending that matplotlib does not support.
        FileError
            The file cannot be written.
        """
        names = [over] if isinstance(over, str) and over else list(over) or [self.largest_column]
        columns = [self.column(name) for name in names]
        if axes is None:
            size = (5.2 * len(names), 4.2)
            figure = new_figure(size) if path is not None else pyplot_figure(size)
            drawn = list(np.atleast_1d(figure.subplots(1, len(names))))
        else:
            drawn = axes_of_caller("plot", axes, names)
        for ax, name, column in zip(drawn, names, columns, strict=True):
            self._draw(ax, name, column)
        if path is not None:
            save_figure(drawn[0].figure, Path(path))
        return drawn

    def _draw(self, ax: Any, name: str, column: Array) -> None:
        """Draw the parameter over a column on matplotlib's axes: stable and unstable parts, and critical points."""
        vertices = []  # of the line, with the negative stiffnesses from there on
        for row, point in enumerate(zip(column, self.values, strict=True)):
            vertices.append((*point, self.negative[row]))
            turns = [
                (item.columns.get(name, item.value), item.value) for item in self.critical if item.after == row + 1
            ]
            vertices += [(*turn, self.negative[row + (k == len(turns))]) for k, turn in enumerate(turns, 1)]
        for (x, y, negative), (next_x, next_y, _) in pairwise(vertices):
            colour, line, word = (_UNSTABLE, "--", "unstable") if negative > 0 else (_STABLE, "-", "stable")
            label = word if negative >= 0 else None
            ax.plot([x, next_x], [y, next_y], line, color=colour, linewidth=1.6, label=label)
        for item in self.critical:
            colour, mark = (_LIMIT, "o") if item.kind == "limit point" else (_BIFURCATION, "D")
            position = [item.columns.get(name, item.value)], [item.value]
            ax.plot(*position, mark, color=colour, markersize=6, label=item.kind)
        ax.set_xlabel(axis_label(name, self.units.get(name, "")))
        ax.set_ylabel(axis_label(self.parameter, self.unit))
        draw_grid(ax)
        handles, labels = ax.get_legend_handles_labels()
        if first := dict(zip(reversed(labels), reversed(handles), strict=True)):  # one entry for each word
            words = dict.fromkeys(labels)
            ax.legend([first[word] for word in words], words, frameon=False, fontsize=8)
