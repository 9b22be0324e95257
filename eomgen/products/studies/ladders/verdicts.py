"""Cells of a map, and the verdict on each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from eomgen.products.studies.ladders.runs import CRASH, HANG, RAISED, REACHED, REFUSED, STOPPED, UNFINISHED, Ended

#: Verdicts: the error is within its bound; it is above, below 10 %; the run says that it is doubtful; it ended with a
#: message; it was refused with one; it took too long and was interrupted; no reference tells; it failed.
HOLDS, COARSE, WARNED, ENDED, REJECTED, LONG, UNKNOWN, FAILS = (
    "holds",
    "coarse",
    "warned",
    "stopped",
    "refused",
    "unfinished",
    "unknown",
    "fails",
)
VERDICTS: Mapping[str, str] = {
    HOLDS: "the error is within its bound",
    COARSE: "1 to 10 % wrong",
    WARNED: "more than 10 % wrong, and the run says that it is doubtful",
    ENDED: "ended with a message",
    REJECTED: "refused with a message",
    LONG: "too slow, interrupted",
    UNKNOWN: "ran; no two references agree",
    FAILS: "hang, crash, not finite without a word, or more than 10 % wrong and called success",
}
#: Error, relative to the motion, from which on a run has to say something.
WRONG = 0.1


@dataclass(frozen=True)
class Cell:
    """One ladder's value with one method.

    Attributes
    ----------
    ladder, value, method : which
    verdict : one of ``VERDICTS``
    error, velocity_error : relative to the motion and to the largest velocity; None if none is known
    bound : up to which it holds
    said : message of the run, reason of its end
    reference : its reference
    seconds : of the run
    """

    ladder: str
    value: float
    method: str
    verdict: str
    error: float | None
    velocity_error: float | None
    bound: float
    said: str
    reference: str
    seconds: float

    @property
    def name(self) -> str:
        """As ``--cell`` takes it."""
        return f"{self.ladder}:{self.value:.9g}:{self.method}"


def verdict(ended: Ended, error: float | None, bound: float) -> str:
    """Return the verdict of a cell, by its error on the scale of positions."""
    kinds = {REFUSED: REJECTED, UNFINISHED: LONG, HANG: FAILS, CRASH: FAILS, RAISED: FAILS}
    if ended.how in kinds:
        return kinds[ended.how]
    if ended.how == STOPPED:
        return ENDED if ended.said else FAILS
    if ended.how != REACHED or not ended.finite:
        return FAILS
    if error is None:
        return WARNED if ended.said else UNKNOWN
    if error <= bound:
        return HOLDS
    if error <= WRONG:
        return COARSE
    return WARNED if ended.said else FAILS


def counts(cells: Sequence[Cell]) -> dict[str, int]:
    """Return cells by verdict."""
    result = Counter(cell.verdict for cell in cells)
    return {name: result[name] for name in VERDICTS if result[name]}
