"""The register of checks of a run, and the verdict made of it: findings, success, message."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property

from eomgen.results.finding import FAILURE, WARNING, Finding
from eomgen.simulation.judgement import doubts, failures, remarks, start_checks
from eomgen.simulation.judgement.check import ANY_FAILURE, Check
from eomgen.simulation.judgement.failures import end_of
from eomgen.simulation.judgement.finished_run import FinishedRun

#: In the order of findings and of sentences of the message.
CHECKS: tuple[Check, ...] = (*failures.ROWS, *doubts.ROWS, *remarks.ROWS, *start_checks.ROWS)
BY_NAME: Mapping[str, Check] = {check.name: check for check in CHECKS}


class Verdict:
    """Findings of a run; each check is evaluated when its findings are first asked for."""

    def __init__(self, run: FinishedRun) -> None:
        self._run = run
        self._known: dict[str, tuple[Finding, ...]] = {}

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        """All findings, in the order of the register."""
        return tuple(finding for check in CHECKS for finding in self.of(check.name))

    @cached_property
    def success(self) -> bool:
        """Whether no check fails the run; evaluates only checks that can."""
        return not self._failed_before(None)

    @cached_property
    def message(self) -> str:
        """The message of the run: its end, and all findings that are said."""
        said = [finding for finding in self.findings if BY_NAME[finding.name].said]
        return message_of(end_of(self._run) if self._run.complete else "", said)

    def of(self, name: str) -> tuple[Finding, ...]:
        """Return the findings of one check."""
        if name not in self._known:
            self._known[name] = tuple(self._evaluated(BY_NAME[name]))
        return self._known[name]

    def _evaluated(self, check: Check) -> Iterable[Finding]:
        if not self._run.has(check.needs) or any(self._superfluous(name, check) for name in check.unless):
            return
        if check.after and not any(self.of(name) for name in check.after):
            return
        for finding in check.evaluate(self._run):
            fails = check.severity != FAILURE or check.fails(self._run)
            yield finding.rated(check.name, check.severity if fails else WARNING)

    def _superfluous(self, name: str, check: Check) -> bool:
        return self._failed_before(check) if name == ANY_FAILURE else bool(self.of(name))

    def _failed_before(self, last: Check | None) -> bool:
        """Return whether a check before another one, or any check, fails the run."""
        before = CHECKS if last is None else CHECKS[: CHECKS.index(last)]
        able = (check.name for check in before if check.severity == FAILURE)
        return any(finding.severity == FAILURE for name in able for finding in self.of(name))


def message_of(opening: str, findings: Iterable[Finding]) -> str:
    """Return a message of an opening and findings; without an opening the first finding is the opening.

    The first failure is contrasted with a run that reached its end by ", but"; every other sentence begins behind a
    semicolon. Findings that continue one another have one hint.
    """
    message, failed = opening, not opening
    for sentence in _sentences(findings):
        fails = any(finding.severity == FAILURE for finding in sentence)
        joint = "" if not message else ", but " if fails and not failed else "; "
        words = sentence[0].text + "".join(BY_NAME[one.name].continues + one.text for one in sentence[1:])
        message += joint + str(Finding(text=words, hint=sentence[-1].hint))
        failed = failed or fails
    return message


def _sentences(findings: Iterable[Finding]) -> list[list[Finding]]:
    """Return findings grouped into sentences."""
    sentences: list[list[Finding]] = []
    for finding in findings:
        if sentences and BY_NAME[finding.name].continues and BY_NAME[sentences[-1][-1].name].continues:
            sentences[-1].append(finding)
        else:
            sentences.append([finding])
    return sentences
