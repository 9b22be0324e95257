"""Identification from inverse dynamics: linear least squares of measured efforts over inertial and friction parameters.

With measured q, v, a and efforts, tau = Y pi + tau0 is linear in pi, and no run, no start and no search is needed
(Khalil and Dombre 2002, chapter 12). Rows of each effort weigh by the deviation of their residuals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import first_of, nearest, shown
from eomgen.compiled.arguments import check_name
from eomgen.errors import Problem, UsageError
from eomgen.products.studies.defaults import NAMED
from eomgen.products.studies.identification.estimation import (
    Combination,
    DependentColumns,
    LeastSquares,
    Predictions,
)
from eomgen.products.studies.identification.experiment import deviations_of
from eomgen.products.studies.identification.judgement import Judgement, notes_of_combinations
from eomgen.products.studies.identification.measurements import Data, columns_of, times_of
from eomgen.products.studies.identification.result import Identification, Record

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model


@dataclass(frozen=True)
class MeasuredMotion:
    """A measured motion with efforts.

    Attributes
    ----------
    name : of the file without the ending, or ``run1``
    t : (n,) s
    q, v, a : (n, nq), (n, nv), (n, nv)
    tau : (n, nv) efforts beyond the inputs'
    u : (n, nu) inputs, None if the scene has none
    """

    name: str
    t: Array
    q: Array
    v: Array
    a: Array
    tau: Array
    u: Array | None


def identified_by_torque(
    model: Model,
    data: Sequence[Data],
    parameters: Sequence[str],
    values: Mapping[str, float],
    deviations: Mapping[str, float] | float | None,
    missing: str,
    confidence: float,
) -> Identification:
    """Return parameters of the regressor from measured motions and efforts.

    Parameters
    ----------
    parameters : of ``regressor_parameters``; all parameters, as base parameters, if none is named
    values : of tunable parameters; parameters without a value keep the scene's
    deviations, missing, confidence : as of ``identify``

    Raises
    ------
    FileError, UsageError
    """
    motions = [_motion(model, entry, number, missing) for number, entry in enumerate(data)]
    pi = {name: float(value) for name, value in model.regressor_parameters(parameters=dict(values)).items()}
    for name in parameters:
        check_name("parameter of the regressor", name, list(pi))
    regressors = [
        model.regressor(motion.q, motion.v, motion.a, motion.t, motion.u, parameters=dict(values)) for motion in motions
    ]
    Y, known = (
        np.concatenate([regressor.matrix for regressor in regressors]),
        np.concatenate([regressor.remainder for regressor in regressors]),
    )
    tau = np.concatenate([motion.tau for motion in motions])
    names, start, units, matrix = _unknowns(model, parameters, pi, values)
    held = np.array([0.0 if not parameters or name in parameters else value for name, value in pi.items()])
    sigma = deviations_of(efforts_of(model), deviations)
    A, right = (Y @ matrix).reshape(-1, len(names)), (tau - known - Y @ held).ravel()
    unknowns = EffortUnknowns(model, names, units, start, A, right, motions)
    predict, limits = Predictions(unknowns.predict), (np.full(len(names), -np.inf), np.full(len(names), np.inf))
    result = LeastSquares(predict, right, unknowns.columns, limits, sigma, linear=True).fit(start)
    return Judgement(unknowns, None, result, predict, limits, sigma is not None, confidence).result()


@dataclass(frozen=True)
class EffortUnknowns:
    """Unknown parameters of the regressor, in which efforts are linear; see ``ExperimentUnknowns``.

    Attributes
    ----------
    matrix, data : (rows, n), and (rows,) efforts less the known part
    motions : measured motions, whose efforts are the rows, time by time
    """

    model: Model
    names: Sequence[str]
    units: Sequence[str]
    start: Array
    matrix: Array
    data: Array
    motions: Sequence[MeasuredMotion]

    @property
    def column_units(self) -> dict[str, str]:
        """Units of the columns of efforts."""
        units = ["N m" if unit.startswith("rad") else "N" for unit in self.model.v_units]
        return dict(zip(efforts_of(self.model), units, strict=True))

    @property
    def columns(self) -> NDArray[Any]:
        """(rows,) places of columns of efforts."""
        return np.arange(len(self.data)) % len(self.column_units)

    def predict(self, x: Array) -> tuple[Array, Array]:
        """Return efforts (rows,) at unknowns x (n,), and the derivatives (rows, n)."""
        return self.matrix @ x, self.matrix

    def records(self, x: Array, values: Array) -> tuple[Record, ...]:
        """Return measured and modelled efforts of each motion."""
        labels, ends = list(self.column_units), np.cumsum([len(motion.t) for motion in self.motions])
        parts = np.split((self.data - values).reshape(-1, len(labels)), ends[:-1])
        return tuple(
            Record(
                motion.name,
                motion.t,
                dict(zip(labels, motion.tau.T, strict=True)),
                dict(zip(labels, (motion.tau - part).T, strict=True)),
                {},
            )
            for motion, part in zip(self.motions, parts, strict=True)
        )

    def notes(self, weighted: Array, parts: DependentColumns, combinations: Sequence[Combination]) -> list[str]:
        """Return sentences on combinations, unknowns without effect, and the condition of the independent columns
        ``weighted`` (rows, kept)."""
        notes = list(notes_of_combinations(combinations))
        mixed = {name for combination in combinations for name in combination.members}
        lost = [self.names[k] for k in parts.others if self.names[k] not in mixed]
        if lost:
            notes.append(f"these motions do not depend on {first_of(lost, NAMED)} [W0085]")
        condition = float(np.linalg.cond(weighted / np.linalg.norm(weighted, axis=0))) if weighted.size else 1.0
        if condition > 100.0:  # Gautier and Khalil (1992) ask for less
            notes.append(f"motions excite the parameters unevenly: the condition number is {condition:.3g} [W0086]")
        return notes


def efforts_of(model: Model) -> list[str]:
    """Return the names of the columns of efforts, ``tau.hinge``."""
    return [f"tau{name[1:]}" for name in model.v_names]


def _unknowns(
    model: Model, parameters: Sequence[str], pi: Mapping[str, float], values: Mapping[str, float]
) -> tuple[list[str], Array, list[str], Array]:
    """Return names (n), values in the scene (n,), units (n), and the derivatives (all, n) of pi by the unknowns. `pi`
    are all parameters of the regressor by name. Without `parameters` the unknowns are the base parameters, at `values`
    of tunable parameters."""
    columns = list(pi)
    if not parameters:
        base = model.base_parameters(parameters=dict(values))
        return list(base.expressions), base.values, list(base.units), np.eye(len(columns))[:, list(base.columns)]
    places = [columns.index(name) for name in parameters]
    units = [model.description.linear_parameters[position].unit for position in places]
    return list(parameters), np.array([pi[name] for name in parameters]), units, np.eye(len(columns))[:, places]


def _check_columns(model: Model, name: str, columns: Mapping[str, Array], needed: Sequence[str], driven: bool) -> None:
    """Check that a measured motion has the columns of inverse dynamics.

    Parameters
    ----------
    needed : coordinates, velocities and accelerations
    driven : whether there is a column of an input, which stands in for efforts

    Raises
    ------
    UsageError
    """
    efforts = efforts_of(model)
    absent = [label for label in needed if label not in columns]
    if absent:
        fault = (
            f"the columns {first_of(absent, NAMED)} are missing, and inverse dynamics needs all of q, v and a [E1093]"
        )
        raise UsageError(Problem(name, fault, f"columns named {first_of(needed, NAMED)}"))
    lost = [label for label in efforts if label not in columns]
    if len(lost) == len(efforts) and not driven:
        fault = "there is neither a column of efforts nor one of an input [E1094]"
        raise UsageError(Problem(name, fault, f"columns named {first_of([*efforts, *model.inputs], NAMED)}"))
    if 0 < len(lost) < len(efforts):
        raise UsageError(Problem(name, f"the efforts {first_of(lost, NAMED)} are missing [E1095]", "0 without one"))
    strange = next((label for label in columns if label.startswith("tau.") and label not in efforts), None)
    if strange is not None:
        hint = nearest(strange, efforts) or first_of(efforts, NAMED)
        raise UsageError(Problem(f"{name}, column {shown(strange)}", "no joint has this effort [E1096]", hint))


def _motion(model: Model, data: Data, number: int, missing: str) -> MeasuredMotion:
    """Return the measured motion number `number`, without rows in which values are missing. Rows with missing values
    are refused if `missing` is ``refuse``. Raises FileError or UsageError for data that cannot be read or lack
    columns."""
    name, columns = columns_of(data, number)
    t = times_of(name, columns)
    accelerations = [f"a{label[1:]}" for label in model.v_names]
    needed = [*model.q_names, *model.v_names, *accelerations]
    efforts = efforts_of(model)
    of_inputs = {label: columns.get(label, columns.get(f"input.{label}")) for label in model.inputs}
    driven = {label: values for label, values in of_inputs.items() if values is not None}
    torques = [label for label in efforts if label in columns]
    _check_columns(model, name, columns, needed, bool(driven))
    table = np.stack([*(columns[label] for label in (*needed, *torques)), *driven.values()])
    finite = np.all(np.isfinite(table), axis=0)
    if missing == "refuse" and not finite.all():
        fault = f"{np.count_nonzero(~finite)} of {len(t)} rows have missing values [E1097]"
        raise UsageError(Problem(name, fault, 'missing="drop", --missing drop: those rows are left out'))
    rows = np.flatnonzero(finite)
    q, v, a = (
        np.column_stack([columns[label][rows] for label in labels])
        for labels in (model.q_names, model.v_names, accelerations)
    )
    tau = np.column_stack([columns[label][rows] for label in efforts]) if torques else np.zeros_like(v)
    u = None
    if model.nu:
        u = np.array(model.input_values(t[rows]))
        for label, values in driven.items():
            u[:, model.inputs.index(label)] = values[rows]
    return MeasuredMotion(name, t[rows], q, v, a, tau, u)
