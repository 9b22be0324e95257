"""``HamiltonianSolution``: a recorded motion of a Hamiltonian system, with its plots and estimates of the errors that
the size of steps makes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedAttributes, checked_calls, not_unpacked
from eomgen.base.csv_tables import write_table
from eomgen.base.data import asdict, dataclass, field
from eomgen.base.figures import axis_label, new_figure, save_figure
from eomgen.base.files import write_arrays
from eomgen.base.json_text import finite
from eomgen.base.rounding import SUMMED
from eomgen.errors import Problem, UsageError

#: Part of the motion above which a motion is no longer followed.
LOST = 0.1

#: Rows of the motion in a multiple of the step, after each ``every`` steps of the run and at the end; None after a
#: failure.
Rows = Callable[[float, int], "Array | None"]


@dataclass(frozen=True)
class StepErrors:
    """Estimated errors of coordinates and momenta, as parts of the range of each.

    Attributes
    ----------
    available : bool
        False if there is no estimate: ``reason`` is the cause, and numbers are NaN.
    relative : float
        The largest error of a coordinate or momentum as a part of the range over the run.
    name : str
        Of which.
    error : float
        Absolute value of this error.
    order, declared_order : float
        Observed in the runs (NaN if two runs give none), and of the method.
    lost_at : float
        The first time with an error above a tenth of a motion; infinite if there is none.
    method : str
        The runs of the estimate.
    t, relative_at : (rows,)
        Times that the runs have in common, and the largest share at each.
    """

    available: bool = False
    reason: str = ""
    relative: float = math.nan
    name: str = ""
    error: float = math.nan
    order: float = math.nan
    declared_order: float = math.nan
    lost_at: float = math.inf
    method: str = ""
    t: Array = field(default_factory=lambda: np.zeros(0))
    relative_at: Array = field(default_factory=lambda: np.zeros(0))

    def __str__(self) -> str:
        if not self.available:
            return f"not known: {self.reason}"
        seen = "" if math.isnan(self.order) else f"order {self.order:.2f} of {self.declared_order:g}, "
        if math.isfinite(self.lost_at):
            return f"above {100 * LOST:.0f} % of the motion from t = {self.lost_at:.6g} on; {seen}by {self.method}"
        return f"{self.error:.2g} of {self.name}, {100 * self.relative:.2g} % of its motion; {seen}by {self.method}"

    def summary(self) -> dict[str, Any]:
        """Return all but the arrays, in JSON types; unknown values are None."""
        told: dict[str, Any] = finite({k: item for k, item in asdict(self).items() if k not in ("t", "relative_at")})
        return told


def estimate_errors(
    rows_of_run: Array, step: float, every: int, steps: int, order: int, names: Sequence[str], rows: Rows
) -> StepErrors:
    """Return the estimated errors of a run in equal steps by runs in steps twice and four times as long, or else half
    as long.

    Differences of runs of order r fall by 2^r from one to the next. If the longer steps do not show this order, or are
    not possible, the run is compared with a run in half steps.

    Parameters
    ----------
    rows_of_run : (rows, 2 n), q and p after every ``every`` steps and after the last
    step, every, steps : size of steps, steps between rows, number of steps
    order : of the method
    names : of the columns
    rows : makes a run in a multiple of the step, from the multiple and the number of original steps between rows; None
        after a failure
    """
    if steps < 1:
        return StepErrors(reason="the run made no step")
    ends = [*range(0, steps, every), steps]
    scale = _scale(rows_of_run)
    common = [row for row, end in enumerate(ends) if end % 4 == 0]
    if steps % 4 == 0 and steps >= 16:
        spacing = math.lcm(every, 4)
        twice, four = (rows(multiple, spacing) for multiple in (2.0, 4.0))
        if twice is not None and four is not None:
            here = rows_of_run[common]
            apart, further = (np.abs(left - right) / scale for left, right in ((here, twice), (twice, four)))
            small = float(apart.max()) < SUMMED
            seen = math.log2(float(further.max()) / float(apart.max())) if not small else math.nan
            if small or (abs(seen - order) < 0.75 and float(further.max()) < LOST):
                made = f"runs in steps of {2 * step:.6g} and {4 * step:.6g}"
                t = [ends[k] * step for k in common]
                return _step_errors(apart / (2**order - 1), scale, t, names, seen, order, made)
    finer = rows(0.5, every)
    if finer is None:
        return StepErrors(reason=f"a run in steps of {step / 2:.6g} failed", declared_order=order)
    apart = np.abs(rows_of_run - finer) / scale * 2**order / (2**order - 1)
    made, t = f"a run in steps of {step / 2:.6g}", [end * step for end in ends]
    return _step_errors(apart, scale, t, names, math.nan, order, made)


def by_tolerance(rows: Array, finer: Array | None, t: Array, tolerance: float, names: Sequence[str]) -> StepErrors:
    """Return the estimated errors of a run with adaptive steps, by the rows ``finer`` of a run at a tenth of the
    tolerance (None after a failure). Both have rows (rows, 2 n) at the times ``t``; ``names`` are the columns."""
    made, scale = f"a run at tolerance {tolerance / 10.0:.3g}", _scale(rows)
    if finer is None:
        return StepErrors(reason=f"{made} failed")
    return _step_errors(np.abs(rows - finer) / scale, scale, t.tolist(), names, math.nan, math.nan, made)


def _scale(rows: Array) -> Array:
    """Return the range of each column of rows (rows, 2 n); the largest magnitude for a column at rest, at least
    1e-308."""
    result = np.ptp(rows, axis=0)
    return np.asarray(np.where(result > 0, result, np.maximum(np.abs(rows).max(axis=0), np.finfo(float).tiny)))


def _step_errors(
    shares: Array, scale: Array, t: Sequence[float], names: Sequence[str], seen: float, order: float, method: str
) -> StepErrors:
    at = shares.max(axis=1)
    which = int(shares.max(axis=0).argmax())
    lost = np.flatnonzero(at > LOST)
    error, lost_at = float(shares[:, which].max() * scale[which]), float(t[lost[0]]) if len(lost) else math.inf
    largest, times = float(at.max()), np.asarray(t, float)
    return StepErrors(True, "", largest, names[which], error, seen, order, lost_at, method, times, at)


@checked_calls("model.simulate(...), which makes one", filename="path", file="path")
@dataclass(frozen=True)
class HamiltonianSolution(NamedAttributes):
    """A motion with diagnostics.

    Attributes
    ----------
    t : (rows,)
    q, p : (rows, n)
        Coordinates and momenta.
    energy : mapping
        ``kinetic`` (of momenta alone), ``potential`` (of coordinates alone), ``coupled`` if there is such a part,
        and ``total``, their sum H; (rows,) each.
    outputs : mapping
        By name, (rows,) each.
    stats : mapping
        ``steps``, ``gradients`` (evaluations of forces), ``iterations`` (of implicit steps), ``products`` (of the
        Hessian of H, in Newton's method), ``wall_time`` in s.
    success : bool
        Whether the motion reached the end.
    message : str
        The end of the run, and doubts.
    metadata : mapping
        Names, units, method, step, parameters.
    error_estimate : StepErrors
        Discretisation errors of coordinates and momenta; printed in words.
    interrupted : bool
        Whether Ctrl-C has ended the run early.
    """

    t: Array
    q: Array
    p: Array
    energy: Mapping[str, Array]
    outputs: Mapping[str, Array]
    stats: Mapping[str, float]
    success: bool
    message: str
    metadata: Mapping[str, Any] = field(default_factory=dict)
    error_estimate: StepErrors = field(default_factory=StepErrors)
    interrupted: bool = False

    def __repr__(self) -> str:
        return f"HamiltonianSolution({self.metadata['name']}: {self.message}, {len(self.t)} rows)"

    if not TYPE_CHECKING:  # type checkers know the attributes

        def __iter__(self) -> object:
            raise not_unpacked(self, "run = model.simulate(...), and run.t, run.q, run.p")

    @property
    def energy_error(self) -> float:
        """The largest change of H, relative to |H| at the start, or to the largest part of H if H is 0 at the start."""
        total = self.energy["total"]
        scale = abs(total[0]) or max(float(np.abs(part).max()) for part in self.energy.values()) or 1.0
        return float(np.abs(total - total[0]).max() / scale)

    def columns(self) -> dict[str, Array]:
        """Return all recorded quantities as columns by name: time, coordinates, momenta, outputs, energies."""
        names = self.metadata["names"]
        columns = {"t": self.t}
        columns |= {name: self.q[:, k] for k, name in enumerate(names["q"])}
        columns |= {name: self.p[:, k] for k, name in enumerate(names["p"])}
        columns |= {f"outputs.{name}": column for name, column in self.outputs.items()}
        return columns | {f"energy.{name}": column for name, column in self.energy.items()}

    def save(self, path: str | Path) -> Path:
        """Write columns, metadata and error estimate as ``.npz``, or the columns as ``.csv``; an existing file is
        replaced.

        Raises
        ------
        UsageError
            Another suffix.
        FileError
            The path cannot be written.
        """
        path = Path(path)
        columns = self.columns()
        if path.suffix == ".csv":
            write_table(path, list(columns), np.column_stack(list(columns.values())))
        elif path.suffix == ".npz":
            write_arrays(path, columns, outcome_of(self))
        else:
            kind = path.suffix or "a file without a suffix"
            fault = f"a motion of a Hamiltonian system cannot be saved as {kind} [E0794]"
            raise UsageError(Problem(str(path), fault, ".npz or .csv"))
        return path


def outcome_of(solution: HamiltonianSolution) -> dict[str, Any]:
    """Return all but the columns, in JSON types: message, success, counts, metadata and the estimate of errors."""
    told = {"message": solution.message, "success": solution.success, "stats": dict(solution.stats)}
    return {**told, **solution.metadata, "error_estimate": solution.error_estimate.summary()}


def draw(solution: HamiltonianSolution, folder: Path) -> list[Path]:
    """Write ``motion.png`` to ``folder``: coordinates, momenta, outputs and the change of H over time; return the path
    in a list. Raises FileError."""
    names, units = solution.metadata["names"], solution.metadata["units"]
    panels = [
        ("coordinates", dict(zip(names["q"], solution.q.T, strict=True)), units["q"]),
        ("momenta", dict(zip(names["p"], solution.p.T, strict=True)), units["p"]),
        ("outputs", dict(solution.outputs), units["outputs"]),
    ]
    panels = [panel for panel in panels if panel[1]]
    figure = new_figure((8.0, 1.0 + 2.3 * (len(panels) + 1)))
    every = figure.subplots(len(panels) + 1, 1, sharex=True)
    taken = np.unique(np.linspace(0, len(solution.t) - 1, min(len(solution.t), 4000)).astype(int))
    for axes, (label, curves, its_units) in zip(every, panels, strict=False):
        for name, curve in list(curves.items())[:10]:  # with distinct colours
            axes.plot(solution.t[taken], curve[taken], label=name, linewidth=0.8)
        more, unit = len(curves) - 10, set(its_units)
        title = f"{more} more in the table" if more > 0 else None
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize="small", title=title, title_fontsize="small")
        axes.set_ylabel(axis_label(label, unit.pop() if len(unit) == 1 else ""))
    total = solution.energy["total"]
    every[-1].plot(solution.t[taken], (total - total[0])[taken], color="#0B62C4", linewidth=0.8)
    every[-1].set(xlabel="t", ylabel="change of H")
    for axes in every:
        axes.grid(alpha=0.3)
    every[0].set_title("{name}: {method}, step {step:g}".format_map(solution.metadata))
    return [save_figure(figure, folder / "motion.png")]
