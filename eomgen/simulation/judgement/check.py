"""Check: one row of the register of checks of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from eomgen.results.finding import WARNING, Finding, Severity
from eomgen.simulation.judgement.finished_run import FinishedRun

#: In ``Check.unless``: every check before this one that can fail a run.
ANY_FAILURE = "any failure"


@dataclass(frozen=True)
class Check:
    """One check of a run.

    Attributes
    ----------
    name : str
        Of its findings.
    evaluate : callable
        Returns the findings of a run: none, one, or one for each cause. They need neither name nor severity.
    needs : tuple of str
        Facts of ``FinishedRun.FACTS``; a run that lacks one of them is not checked.
    severity : str
        Of its findings. A check that fails some runs and warns of others has ``failure``, and its findings are failures
        if ``fails`` is true.
    unless, after : tuple of str
        Checks before this one that make it superfluous by a finding, or of which one must have a finding.
    continues : str
        Text that joins a finding to the sentence of the finding before it, if both have such a text. The joint
        sentence ends with the hint of its last finding.
    said : bool
        Whether its findings are part of the message.
    fails : callable
        Whether findings of the severity ``failure`` fail a run.
    """

    name: str
    evaluate: Callable[[FinishedRun], Iterable[Finding]]
    needs: tuple[str, ...] = ("complete",)
    severity: Severity = WARNING
    unless: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    continues: str = ""
    said: bool = True
    fails: Callable[[FinishedRun], bool] = lambda run: True
