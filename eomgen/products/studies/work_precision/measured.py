"""Results: points of a study, the front, slopes, and messages of wrong points."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from eomgen.products.studies.work_precision.configuration import Configuration
from eomgen.products.studies.work_precision.observation import ErrorSize
from eomgen.products.studies.work_precision.running import REACHED

#: Errors above this are wrong, at any cost.
WRONG = 0.1
#: Beginning of the reason for omissions for want of time.
NOT_BUILT = "not built"
#: Demands of the table.
DEMANDS = (1e-2, 1e-4, 1e-6, 1e-8)
#: Points that take part in a slope: errors below the first, and above the second of the reference's uncertainty.
ASYMPTOTIC, ABOVE_UNCERTAINTY = 2e-3, 30.0
_LEAST_ERROR = 1e-12


@dataclass(frozen=True)
class Point:
    """A run of a study.

    Attributes
    ----------
    configuration : of the run
    kind, value : ``step`` in s, or ``tolerance``
    ended : ``reached``, ``stopped``, ``refused`` or ``too long``
    said : message of the run besides that it reached its end, or the reason for which it did not
    error : sizes of the errors by quantity, none below the uncertainty of the reference; empty if the run did not
        reach its end
    seconds : median of the processor's time for all steps, s, outputs, energies and the error estimate apart; None
        if it was not timed
    least : the least of these times
    repeats : how many were taken
    stats : counts of the stepper
    order : declared, of the method
    took : the processor's seconds that the study spent on the point, all repeats included, builds apart
    """

    configuration: Configuration
    kind: str
    value: float
    ended: str
    said: str
    error: Mapping[str, ErrorSize] = field(default_factory=dict)
    seconds: float | None = None
    least: float | None = None
    repeats: int = 0
    stats: Mapping[str, float] = field(default_factory=dict)
    order: int = 0
    took: float = 0.0

    @property
    def label(self) -> str:
        return f"{self.configuration.label}, {self.kind} {self.value:.4g}"

    def error_of(self, quantity: str, measure: str = "largest") -> float:
        """Return the error of a quantity; infinite if there is none."""
        size = self.error.get(quantity)
        value = math.inf if size is None else float(getattr(size, measure))
        return value if math.isfinite(value) else math.inf

    def to_dict(self) -> dict[str, Any]:
        return {
            **self.configuration.to_dict(),
            "kind": self.kind,
            "value": self.value,
            "ended": self.ended,
            "said": self.said,
            "errors": {name: size.to_dict() for name, size in self.error.items()},
            "seconds": self.seconds,
            "least_seconds": self.least,
            "repeats": self.repeats,
            "stats": dict(self.stats),
            "order": self.order,
            "took": self.took,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Point:
        """Return the point that ``to_dict`` gave.

        Raises
        ------
        ValueError, TypeError, KeyError
            These are not the data of a point.
        """
        times = (data["seconds"], data["least_seconds"])
        known = [data[name] for name in ("value", "took", "repeats", "order")] + [x for x in times if x is not None]
        if not all(isinstance(x, int | float) for x in known):
            raise TypeError("times and counts are numbers")
        names = ("formulation", "method", "parameters", "policy", "settings", "real", "profile")
        return cls(
            Configuration(**{name: data[name] for name in names}),
            data["kind"],
            data["value"],
            data["ended"],
            data["said"],
            {name: ErrorSize(**{k: _number(v) for k, v in size.items()}) for name, size in data["errors"].items()},
            data["seconds"],
            data["least_seconds"],
            data["repeats"],
            data["stats"],
            data["order"],
            data["took"],
        )


@dataclass(frozen=True)
class Slope:
    """The order that a configuration shows: fitted over its points in the asymptotic part."""

    configuration: Configuration
    slope: float
    declared: int
    points: int


@dataclass(frozen=True)
class Measured:
    """Speed against accuracy of one scene: measurements and conclusions.

    Attributes
    ----------
    scene : its name
    quantity, measure : the error that the front is of
    span : (start, end, number of times at which the reference is known)
    points : all runs
    reference : run behind the errors, and its uncertainty
    machine : processor, compiler, versions
    compiled : seconds of building by model and method, short if the cache had it
    left_out : omitted runs, and the reasons
    seconds : of the whole study
    """

    scene: str
    quantity: str
    measure: str
    span: tuple[float, float, int]
    points: tuple[Point, ...]
    reference: Mapping[str, Any]
    machine: Mapping[str, str]
    compiled: Mapping[str, float] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    def error(self, point: Point) -> float:
        """Return the error of a point, in the study's quantity and measure."""
        return point.error_of(self.quantity, self.measure)

    @property
    def uncertainty(self) -> float:
        """By how much the reference may be wrong, in the study's quantity and measure."""
        return float(self.reference["uncertainty"].get(self.quantity, {}).get(self.measure) or 0.0)

    @property
    def usable(self) -> tuple[Point, ...]:
        """Points that reached their end and were timed."""
        return tuple(p for p in self.points if p.ended == REACHED and p.seconds is not None)

    @property
    def failures(self) -> tuple[Point, ...]:
        return tuple(p for p in self.points if p.ended != REACHED)

    @property
    def wrong(self) -> tuple[Point, ...]:
        """Points that reached their end and are wrong by more than a tenth."""
        return tuple(p for p in self.points if p.ended == REACHED and not self.error(p) <= WRONG)

    @property
    def not_built(self) -> tuple[str, ...]:
        """Configurations that were left out because there was no time to build them."""
        return tuple(label for label, why in self.left_out.items() if why.startswith(NOT_BUILT))

    @property
    def silent(self) -> tuple[Point, ...]:
        """Wrong points without a warning."""
        return tuple(p for p in self.wrong if not p.said)

    @property
    def front(self) -> tuple[Point, ...]:
        """Points than which none is both faster and more accurate, fastest first; wrong ones are left out.

        Errors below the uncertainty of the reference count as that.
        """
        result: list[Point] = []
        least = WRONG
        for point in sorted(self.usable, key=lambda p: (p.seconds, self.error(p))):
            error = max(self.error(point), self.uncertainty)
            if error < least:
                result.append(point)
                least = error
        return tuple(result)

    def best(self, demand: float) -> Point | None:
        """Return the cheapest point that meets a demand, None if none does."""
        able = [p for p in self.usable if self.error(p) <= demand]
        return min(able, key=lambda p: p.seconds or math.inf, default=None)

    def verdict(self, point: Point) -> str:
        """Return the value of a point: ``front``, ``dominated``, ``wrong, said``, ``wrong, silent``, or how it
        failed."""
        if point.ended != REACHED:
            return point.ended
        if point in self.wrong:
            return "wrong, said" if point.said else "wrong, silent"
        return "front" if point in self.front else "dominated"

    @property
    def slopes(self) -> tuple[Slope, ...]:
        """The order of each configuration with steps of its own choice, over the asymptotic part."""
        groups: dict[str, list[Point]] = {}
        for point in self.points:
            if point.kind == "step" and point.ended == REACHED:
                groups.setdefault(point.configuration.key, []).append(point)
        floor = max(ABOVE_UNCERTAINTY * self.uncertainty, _LEAST_ERROR)
        result = []
        for members in groups.values():
            kept = [p for p in sorted(members, key=lambda p: p.value) if floor < self.error(p) < ASYMPTOTIC][:4]
            if len(kept) >= 3:
                steps, errors = np.log([p.value for p in kept]), np.log([self.error(p) for p in kept])
                slope = float(np.polyfit(steps, errors, 1)[0])
                result.append(Slope(members[0].configuration, slope, members[0].order, len(kept)))
        return tuple(result)

    def to_dict(self) -> dict[str, Any]:
        """Return all of it as JSON data."""
        return {
            "scene": self.scene,
            "quantity": self.quantity,
            "measure": self.measure,
            "span": {"start": self.span[0], "end": self.span[1], "rows": self.span[2]},
            "reference": dict(self.reference),
            "machine": dict(self.machine),
            "seconds": self.seconds,
            "compiled": dict(self.compiled),
            "left_out": dict(self.left_out),
            "points": [{**p.to_dict(), "verdict": self.verdict(p)} for p in self.points],
            "front": [p.label for p in self.front],
            "slopes": [
                {**s.configuration.to_dict(), "slope": s.slope, "declared": s.declared, "points": s.points}
                for s in self.slopes
            ],
        }


def _number(value: float | None) -> float:
    return math.inf if value is None else value
