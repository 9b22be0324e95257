"""Results of a study of random vibration, as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from eomgen.base.arrays import Array
from eomgen.results.sample_errors import SampleErrors


@dataclass(frozen=True)
class Distribution:
    """P(y <= threshold) and P(y > threshold) by one method.

    Attributes
    ----------
    below, above : (thresholds,), not a number if the method has none
    low, high : of P(y <= threshold), (thresholds,): bounds of 95 % confidence if samples were counted, else empty
    """

    below: Array
    above: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class Cost:
    """Solutions of the equations of motion, and of their linear ones backwards and forwards in time."""

    runs: int
    adjoints: int
    tangents: int


@dataclass(frozen=True)
class Process:
    """A random process of the scene: its kind, number of variables, and part of the variance that they capture."""

    name: str
    kind: str
    variables: int
    captured: float
    eigenvalues: tuple[float, ...]


@dataclass(frozen=True)
class Findings:
    """The distribution of an output at one time.

    Attributes
    ----------
    scene, output, unit : names
    t : s
    processes : the scene's
    thresholds : (n,)
    moments : of each method: mean, standard deviation, skewness, excess kurtosis
    distributions : of each method
    indices : reliability index of each threshold, (n,), not a number if none was looked for
    times, autocovariance : (m,) in s, and the covariance with the output at ``t`` by method, (m,)
    first_passage : of each level: its probability over the run by method; ``preferred`` is the one to take
    costs : by method
    notes : doubts
    error : SampleErrors
        Estimated discretisation errors of a few samples.
    errors : of each method: its error relative to the corrected probability at each threshold, on the side that is
        less probable, (n,); NaN if there is no corrected one
    lost_variance : float
        Share of the output's variance, to first order about the mean, that is lost with the modes left out of the
        processes; NaN if none is left out, or if it is not known.
    """

    scene: str
    output: str
    unit: str
    t: float
    processes: tuple[Process, ...]
    thresholds: Array
    moments: Mapping[str, tuple[float, float, float, float]]
    distributions: Mapping[str, Distribution]
    indices: Array
    times: Array
    autocovariance: Mapping[str, Array]
    first_passage: Mapping[float, Mapping[str, float]]
    costs: Mapping[str, Cost]
    notes: Sequence[str]
    error: SampleErrors
    errors: Mapping[str, Array]
    lost_variance: float = math.nan
