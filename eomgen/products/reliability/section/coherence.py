"""Reading of coherences between random processes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from eomgen.base.text import key_of
from eomgen.products.reliability.random_processes import (
    Coherence,
    CoherenceTable,
    Covariance,
    CrossCovariance,
    ExponentialCoherence,
    least_eigenvalue,
)
from eomgen.products.reliability.section import schema as written
from eomgen.scene.reading.values import Values

#: An eigenvalue of a matrix of coherences below which no processes have them.
_NEGATIVE = -1e-9


class Coherences:
    """Reads coherences of groups of processes and reports their faults."""

    def __init__(self, values: Values) -> None:
        self.values = values
        self.report = values.report

    def read(
        self, names: Sequence[str], entries: Mapping[str, written.RandomProcess]
    ) -> list[list[Coherence | None]] | None:
        """Return the coherences of the processes of a group with one another; None if there is a fault."""
        before = len(self.report.noted)
        result: list[list[Coherence | None]] = [[None] * len(names) for _ in names]
        said: dict[tuple[int, int], object] = {}
        for i, name in enumerate(names):
            for other, given in (entries[name].coherence or {}).items():
                key, j = f"{key_of('random', name)}.coherence", names.index(other) if other in names else i
                pair = min(i, j), max(i, j)
                if i == j or said.setdefault(pair, given) != given:
                    fault = f"its coherence with {other} is one thing here and another there"
                    self.report.add(key, fault, "one of them")
                    continue
                result[i][j] = result[j][i] = self._one(key, other, given)
        if len(self.report.noted) > before:
            return None
        least, frequency = least_eigenvalue(result)
        if least < _NEGATIVE:
            fault = f"no processes have the coherences of {', '.join(names)}: an eigenvalue of their matrix at the"
            fault += f" frequency {frequency:.3g} is {least:.3g}, negative"
            hint = "coherences of all pairs: a pair that is not named has 0"
            self.report.add(f"{key_of('random', names[-1])}.coherence", fault, hint)
            return None
        return result

    def _one(self, key: str, other: str, given: float | Sequence[Sequence[float | str]]) -> Coherence | None:
        """Return the coherence with another process: exponential of a decay, or a table."""
        if isinstance(given, int | float):
            if not given > 0.0:
                fault = f"the decay {given:.6g} of the coherence with {other} is not positive"
                self.report.add(key, fault, "a decay such as 0.5, or a correlation of the same at all frequencies")
                return None
            return ExponentialCoherence(float(given))
        before = len(self.report.noted)
        pairs = [self.values.constants(f"{key}.{other}[{k}]", pair) for k, pair in enumerate(given)]
        if len(self.report.noted) > before:
            return None
        f, c = np.array(pairs, dtype=float).reshape(-1, 2).T
        if len(f) < 2 or f[0] < 0.0 or np.any(np.diff(f) <= 0.0) or np.any(np.abs(c) > 1.0):
            fault = (
                f"the coherence with {other} is two points or more, of rising frequencies from 0 on, between -1 and 1"
            )
            self.report.add(key, fault, "[[0, 1], [2.0, 0.4], [10.0, 0]]")
            return None
        return CoherenceTable(f, c)


def crossed(
    covariance: Covariance, coherences: Sequence[Sequence[Coherence | None]], window: float
) -> list[list[Covariance]]:
    """Return the covariances of processes of the same one with one another."""
    none = CoherenceTable(np.array([0.0, 1.0 / window]), np.zeros(2))
    return [
        [covariance if i == j else CrossCovariance(covariance, one or none, window) for j, one in enumerate(row)]
        for i, row in enumerate(coherences)
    ]
