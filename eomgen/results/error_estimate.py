"""``ErrorEstimate``: the discretisation error of a run, estimated by runs at other steps or tolerances.
``SampleErrors``: errors of a study's samples, estimated on a few of its runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field

#: Observed order below which there is none, how far an order may be from the method's, and the part of the motion above
#: which that matters.
NO_ORDER, OTHER_ORDER, NOTICED = 0.5, 0.75, 0.03
#: Error target of hints, relative to the motion.
AIM = 0.01
#: References of relative errors, unless the motion is too small.
OWN, NONE = "its motion", "its motion, which is none"
_NUMBERS = ("order", "declared_order", "relative", "seconds", "cost")
_WORDS = ("available", "reason", "remedy", "method", "unresolved", "passed_over")
_LARGEST = ("largest", "largest_velocity", "largest_output")
_STATES = ("q", "increment", "v", "z", "multipliers")


def array_groups(arrays: Mapping[str, Array]) -> dict[str, Any]:
    """Return the arrays of a file by name; arrays with the name ``group.member`` as a mapping for each group."""
    result: dict[str, Any] = {}
    for name, array in arrays.items():
        group, _, member = name.partition(".")
        if member:
            result.setdefault(group, {})[member] = array
        else:
            result[name] = array
    return result


@dataclass(frozen=True)
class LargestError:
    """The largest error of the coordinates and internal states, relative to the motion of the coordinate or state.

    Attributes
    ----------
    name : of the coordinate, the rotation, or the internal state
    error, unit : the largest estimated error of the coordinate, the rotation or the state
    time : s, when
    share : part of the motion of the coordinate, or of the rotation, or of the internal state, or of a measure instead
    measure : name of the reference of ``share``: the motion, or a larger measure if the motion is too small
    """

    name: str
    error: float
    unit: str
    time: float
    share: float
    measure: str = OWN

    def __str__(self) -> str:
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        size = f"{self.error:.2g}{unit} of {self.name} at t = {self.time:.6g} s"
        if self.share == np.inf and self.measure == NONE:
            return f"{size}, which does not move in this run"
        percent = 100.0 * self.share
        share = f"{percent:.0f}" if 100.0 <= percent < 1e6 else f"{percent:.2g}"
        return f"{size}, {share} % of {self.measure}"


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated absolute errors over the run, at the rows that all compared runs have.

    If ``available`` is False, ``reason`` says why, numbers are NaN and arrays over time are empty.

    Attributes
    ----------
    t : (n,) s, the rows compared
    q_at : (n, nq), quaternions component by component
    increment_at : (n, nv), as increments of the configuration: rotations in rad
    v_at : (n, nv)
    z_at : (n, nz)
    multipliers_at : (n, number of constraints)
    outputs_at : name -> (n,) or (n, size)
    relative_at : (n,), the largest error of a coordinate or an internal state as a part of the motion of the coordinate
        or state
    order : observed in q, or in the internal states if ``largest`` is one; NaN if none is seen
    declared_order : of the method; NaN if the method chooses its steps
    relative : the largest of ``relative_at``
    largest : which, how much and when
    largest_velocity : the same of the velocities, as a part of the largest velocity of the same unit; of elastic
        coordinates, with small rates compared with joints, as a part of the coordinate's own largest rate
    largest_output : the same of the outputs, as a part of the range of each; None without any
    method : how the estimate was obtained
    seconds : s, time that the estimate took
    cost : the same as a part of the run's own time
    unresolved : excited motion too fast for the steps, not included in the numbers above; empty if none
    remedy : hint in the run's message if runs at other steps give no estimate; empty otherwise
    passed_over : description of an event whose number differs in shorter steps; empty if none
    """

    available: bool = False
    reason: str = ""
    remedy: str = ""
    t: Array = field(default_factory=lambda: np.zeros(0))
    q_at: Array = field(default_factory=lambda: np.zeros((0, 0)))
    increment_at: Array = field(default_factory=lambda: np.zeros((0, 0)))
    v_at: Array = field(default_factory=lambda: np.zeros((0, 0)))
    z_at: Array = field(default_factory=lambda: np.zeros((0, 0)))
    multipliers_at: Array = field(default_factory=lambda: np.zeros((0, 0)))
    outputs_at: Mapping[str, Array] = field(default_factory=dict)
    relative_at: Array = field(default_factory=lambda: np.zeros(0))
    order: float = float("nan")
    declared_order: float = float("nan")
    relative: float = float("nan")
    largest: LargestError | None = None
    largest_velocity: LargestError | None = None
    largest_output: LargestError | None = None
    method: str = ""
    seconds: float = 0.0
    cost: float = 0.0
    unresolved: str = ""
    passed_over: str = ""

    @classmethod
    def missing(cls, reason: str, nq: int = 0, nv: int = 0, nz: int = 0, multipliers: int = 0) -> Self:
        """Return an estimate without numbers, with the reason, for a system of given sizes."""
        q, v, z, lam = (np.zeros((0, size)) for size in (nq, nv, nz, multipliers))
        return cls(reason=reason, q_at=q, increment_at=v, v_at=v, z_at=z, multipliers_at=lam)

    @property
    def q(self) -> Array:
        """Largest error of each component of q over the run, (nq,)."""
        return _largest(self.q_at)

    @property
    def increment(self) -> Array:
        """Largest error of q over the run as an increment, (nv,): rotations in rad."""
        return _largest(self.increment_at)

    @property
    def v(self) -> Array:
        """Largest error of each component of v over the run, (nv,)."""
        return _largest(self.v_at)

    @property
    def z(self) -> Array:
        """Largest error of each internal state over the run, (nz,)."""
        return _largest(self.z_at)

    @property
    def multipliers(self) -> Array:
        """Largest error of each multiplier over the run, (number of constraints,)."""
        return _largest(self.multipliers_at)

    @property
    def outputs(self) -> dict[str, Array]:
        """Largest error of each output over the run: name -> () or (size,)."""
        return {name: _largest(array) for name, array in self.outputs_at.items()}

    def __repr__(self) -> str:
        return f"<ErrorEstimate: {self}>"

    def __str__(self) -> str:
        if not self.available or self.largest is None:
            return f"not known: {self.reason}"
        return f"{self.largest}; {self.evidence}"

    @property
    def evidence(self) -> str:
        """The order observed with the declared order, if errors fall with the step and no faster than the method's, the
        runs of the estimate, and the time that these runs took, in words; without meaning if the errors are not
        known."""
        seen = NO_ORDER <= self.order <= self.declared_order + OTHER_ORDER
        order = f"order {self.order:.2f} of {self.declared_order:g}, " if seen else ""
        return f"{order}by {self.method}, in {self.seconds:.2g} s"

    @property
    def every(self) -> list[LargestError]:
        """The largest errors of coordinates and internal states, and of outputs; empty if the errors are not known."""
        return [error for error in (self.largest, self.largest_output) if self.available and error is not None]

    @property
    def worst(self) -> LargestError | None:
        """The larger of both, as a part of the motion; None if the errors are not known."""
        return max(self.every, key=lambda error: error.share, default=None)

    @property
    def unordered(self) -> bool:
        """Whether runs at other steps differ noticeably, in states or outputs, and not less at smaller steps."""
        ordered = self.order >= NO_ORDER or np.isnan(self.declared_order)
        return not ordered and (worst := self.worst) is not None and worst.share > NOTICED

    def above(self, part: float) -> float:
        """Return the first compared time at which the error of a coordinate or an internal state is above a part of its
        motion.

        Parameters
        ----------
        part : float
            Of the motion, compared with ``relative_at``; outputs and velocities are not looked at.

        Returns
        -------
        float
            Time, s; infinite if the error stays below, or is not known.
        """
        places = np.flatnonzero(self.relative_at > part)
        return float(self.t[places[0]]) if len(places) else float("inf")

    def refinement(self, aim: float, share: float | None = None) -> float:
        """Return the factor of the step that reduces a relative error to an aim, by the smaller of the orders observed
        and declared, but at least by order 1.

        Parameters
        ----------
        aim, share : float
            Relative errors; ``relative`` if ``share`` is None.

        Returns
        -------
        float
            Factor, at most 1; 1 if neither order is known, as without an estimate, or without an error.
        """
        share = self.relative if share is None else share
        order = np.fmin(self.order, self.declared_order)
        return 1.0 if np.isnan(order) or not share else float(min(1.0, (aim / share) ** (1.0 / max(order, 1.0))))

    def summary(self) -> dict[str, Any]:
        """Return the estimate without arrays over time, in JSON types.

        Returns
        -------
        dict
            As of ``described``, with the largest errors over the run: ``q``, ``increment``, ``v``, ``z`` and
            ``multipliers``, a list of components each, and ``outputs``, a number or a list by name. If ``available`` is
            False, components are NaN, or all lists are empty, as without any estimate made; ``outputs`` is empty.
        """
        return {
            **self.described(),
            **{name: getattr(self, name).tolist() for name in _STATES},
            "outputs": {name: array.tolist() for name, array in self.outputs.items()},
        }

    def described(self) -> dict[str, Any]:
        """Return the estimate without its arrays and without the errors of components, in JSON types.

        Returns
        -------
        dict
            Attributes by name: ``available`` and texts; ``largest``, ``largest_velocity`` and ``largest_output`` as
            dictionaries of the attributes of ``LargestError``; numbers. None for a number that is NaN, and for a
            largest error that is not known; without an estimate ``seconds`` and ``cost`` are 0.
        """
        numbers = {name: None if np.isnan(value := getattr(self, name)) else float(value) for name in _NUMBERS}
        words = {name: getattr(self, name) for name in _WORDS}
        result = {name: getattr(self, name) for name in _LARGEST}
        return {**words, **{name: item and dict(vars(item)) for name, item in result.items()}, **numbers}

    def arrays(self) -> dict[str, Array]:
        """Return the arrays over time by attribute, for a file; outputs as ``outputs_at.`` with the name."""
        arrays = {
            "t": self.t,
            "relative_at": self.relative_at,
            **{f"{name}_at": getattr(self, f"{name}_at") for name in _STATES},
        }
        return arrays | {f"outputs_at.{name}": array for name, array in self.outputs_at.items()}

    @classmethod
    def from_file(cls, arrays: Mapping[str, Array], summary: Mapping[str, Any]) -> Self:
        """Return the estimate whose ``arrays`` and ``described`` were written to a file."""
        stored: dict[str, Any] = {"outputs_at": {}, **array_groups(arrays)}
        stored |= {name: float("nan" if summary[name] is None else summary[name]) for name in _NUMBERS}
        stored |= {name: summary[name] for name in _WORDS if name in summary}
        stored |= {name: LargestError(**summary[name]) for name in _LARGEST if summary.get(name)}
        return cls(**stored)


def _largest(at: Array) -> Array:
    return np.max(at, axis=0) if len(at) else np.full(at.shape[1:], np.nan)


@dataclass(frozen=True)
class SampleErrors:
    """Estimated discretisation errors of samples.

    Attributes
    ----------
    nominal : ErrorEstimate
        Of the run without variations.
    of_samples : mapping
        Number of the sample -> the estimate of the sample.
    columns : mapping
        Name of the column -> the column's largest error over these runs, in the column's unit; NaN if no run has an
        estimate.
    step : float
        Of the runs, s.
    seconds : float
        Time that the estimates took, s.
    """

    nominal: ErrorEstimate = field(default_factory=lambda: ErrorEstimate.missing("no estimate was made"))
    of_samples: Mapping[int, ErrorEstimate] = field(default_factory=dict)
    columns: Mapping[str, float] = field(default_factory=dict)
    step: float = float("nan")
    seconds: float = 0.0

    @property
    def available(self) -> bool:
        """Whether any of the runs has an estimate."""
        return any(estimate.available for estimate in self._every)

    @property
    def relative(self) -> float:
        """The largest error of a coordinate, a state or an output as a part of the motion of that quantity; NaN if not
        known."""
        worst = self.worst
        return float("nan") if worst is None else worst[1].share

    @property
    def worst(self) -> tuple[int | None, LargestError] | None:
        """Number of the worst sample, None for the run without variations, with the largest error of that sample."""
        estimates = [(None, self.nominal), *self.of_samples.items()]
        result = [(number, error) for number, estimate in estimates for error in estimate.every]
        return max(result, key=lambda pair: pair[1].share, default=None)

    @property
    def _every(self) -> list[ErrorEstimate]:
        return [self.nominal, *self.of_samples.values()]

    def __str__(self) -> str:
        worst = self.worst
        if worst is None:
            return f"the discretisation error of samples is not known: {self.nominal.reason}"
        number, largest = worst
        run = "the run without variations" if number is None else f"sample {number}"
        known = sum(estimate.available for estimate in self._every)
        of = f", the worst of {known} runs with estimates" if known > 1 else ""
        text = f"the estimated error of samples is {largest} ({run}{of})"
        if not largest.share > NOTICED:
            return text
        estimate = self.nominal if number is None else self.of_samples[number]
        factor = estimate.refinement(AIM) if estimate.relative > AIM else 0.5
        return f"{text}; try: a step smaller than {self.step * factor:.2g} s"

    def summary(self) -> dict[str, Any]:
        """Return the errors of samples as JSON data.

        Returns
        -------
        dict
            ``available``; ``reason``, empty if a run has an estimate; ``relative``, ``worst_sample`` and ``largest``
            (attributes of ``LargestError``) of the worst run, None if not known; ``columns``, the largest error by
            column, None if not known; ``without_variations``, and ``samples`` by number as text: estimates as of
            ``ErrorEstimate.described``; ``seconds``. ``worst_sample`` is None, too, if the run without variations is
            the worst.
        """
        worst = self.worst
        return {
            "available": self.available,
            "reason": "" if self.available else self.nominal.reason,
            "relative": None if worst is None else worst[1].share,
            "worst_sample": None if worst is None else worst[0],
            "largest": None if worst is None else dict(vars(worst[1])),
            "columns": {name: None if np.isnan(error) else error for name, error in self.columns.items()},
            "without_variations": self.nominal.described(),
            "samples": {str(number): estimate.described() for number, estimate in self.of_samples.items()},
            "seconds": self.seconds,
        }
