"""Results of an identification, as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from eomgen.base.arrays import Array
from eomgen.products.studies.identification.combinations import Combination


@dataclass(frozen=True)
class Estimate:
    """One unknown.

    Attributes
    ----------
    name, unit : names; a component of an initial state is ``q.hinge``, of several runs ``q.hinge of run1``
    value, deviation : estimate and its standard deviation, infinite if the data do not decide it
    low, high : confidence interval, infinite likewise
    bias : change by the steps of the runs, estimated by runs at half of them; nan if these fail
    start : start of the search
    state : ``determined``, ``undetermined``, or ``on its bound``, with an interval of the bound alone
    """

    name: str
    unit: str
    value: float
    deviation: float
    low: float
    high: float
    bias: float
    start: float
    state: str


@dataclass(frozen=True)
class Column:
    """A measured column.

    Attributes
    ----------
    name, unit : of an output's component
    samples : over all runs
    deviation : of its noise, given or estimated
    rms : of the residuals
    autocorrelation : of the residuals one sample apart, 0 for white noise
    """

    name: str
    unit: str
    samples: int
    deviation: float
    rms: float
    autocorrelation: float


@dataclass(frozen=True)
class Record:
    """Data of one run, and the model's outputs at the estimates.

    Attributes
    ----------
    name : of its file, or ``run1``
    t : (n,) s
    data, model : by column, (n,) each; data are nan if they are missing
    initial : state that the run begins with, as of ``simulate``
    """

    name: str
    t: Array
    data: Mapping[str, Array]
    model: Mapping[str, Array]
    initial: Mapping[str, Array]

    @property
    def residuals(self) -> dict[str, Array]:
        """Data minus model by column, (n,)."""
        return {name: values - self.model[name] for name, values in self.data.items()}


@dataclass(frozen=True)
class Findings:
    """Parameters and initial states that fit measured data best.

    Attributes
    ----------
    scene : its name
    estimates : parameters first, then initial states of each run
    correlation : (n, n) of the estimates, nan if one is undetermined or on its bound
    combinations : determined combinations of the undetermined ones
    columns : measured quantities
    records : data and model of each run
    confidence : of the intervals
    noise : ``given`` or ``estimated``
    degrees_of_freedom : samples less unknowns that the data determine
    runs, failed : runs with derivatives, and failed ones among them
    notes : doubts
    """

    scene: str
    estimates: tuple[Estimate, ...]
    correlation: Array
    combinations: tuple[Combination, ...]
    columns: tuple[Column, ...]
    records: tuple[Record, ...]
    confidence: float
    noise: str
    degrees_of_freedom: int
    runs: int
    failed: int
    notes: tuple[str, ...]
