"""The register of checks of a run, and the verdict: findings, success, message."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import chain, pairwise, takewhile

from eomgen.base.limits import doubt_settings
from eomgen.base.products import insert, rows_of
from eomgen.results.finding import FAILURE, WARNING, Finding
from eomgen.simulation.judgement import beams, failures, stated_errors
from eomgen.simulation.judgement.failures import end_of
from eomgen.simulation.judgement.finished_run import ANY_FAILURE, ESTIMATED, Check, FinishedRun
from eomgen.simulation.judgement.starts import CHOSEN_METHOD

#: Group of the checks that products add.
GROUP = "eomgen.checks"
#: Checks of the core.
OWN = (*failures.ROWS, *stated_errors.ROWS, *beams.ROWS, stated_errors.UNKNOWN_ERROR, CHOSEN_METHOD)
_ADDED = rows_of(GROUP, Check)
_PREVIOUS = {check.name: before.name for before, check in pairwise(_ADDED)}
#: In the order of findings and of sentences of the message.
CHECKS: tuple[Check, ...] = insert(
    OWN, _ADDED, lambda check: check.name, lambda check: check.behind or _PREVIOUS.get(check.name, "")
)
#: Notes of a run that no product checks.
UNCHECKED = () if _ADDED else ("checks: not installed",)
BY_NAME: Mapping[str, Check] = {check.name: check for check in CHECKS}
#: Names of all checks that can fail a run.
_ABLE: Sequence[str] = tuple(check.name for check in CHECKS if check.severity == FAILURE)


class Verdict:
    """Findings of a run; each check is evaluated when its findings are needed first."""

    def __init__(self, run: FinishedRun) -> None:
        self._run = run
        self._known: dict[str, tuple[Finding, ...]] = {}
        self._settings = doubt_settings(run.run.model.description.parts)

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        """All findings that are reported, in the order of the register: failures are never silenced, and warnings
        are failures of a strict run."""
        quiet, strict, _ = self._settings
        every = chain.from_iterable(map(self.of, BY_NAME))
        reported = (finding for finding in every if finding.severity == FAILURE or finding.name not in quiet)
        return tuple(finding.as_error() if strict and finding.severity == WARNING else finding for finding in reported)

    @cached_property
    def success(self) -> bool:
        """Whether no check fails the run; evaluates only checks that can."""
        return not _fails(self.findings if self._settings.strict else chain.from_iterable(map(self.of, _ABLE)))

    @cached_property
    def message(self) -> str:
        """The message of the run: its end, and all findings that are said."""
        said = [finding for finding in self.findings if BY_NAME[finding.name].said]
        return message_of(end_of(self._run) if self._run.complete else "", said)

    @cached_property
    def alike(self) -> tuple[Finding, ...]:
        """Findings of the checks whose fault runs at other steps share, evaluated even if the run has no error
        estimate. Another run may be compared with this run."""
        if self._run.has((ESTIMATED,)):
            return tuple(chain.from_iterable(self.of(check.name) for check in CHECKS if check.alike))
        checks = [check for check in CHECKS if check.alike and self._run.has({*check.needs} - {ESTIMATED})]
        return tuple(chain.from_iterable(map(self._evaluate, checks)))

    def notes(self, label: str) -> tuple[Finding, ...]:
        """Return the findings that are notes of the metadata at a place, ``start`` or ``call``."""
        names = (check.name for check in CHECKS if check.noted == label and check.name not in self._settings.quiet)
        return tuple(chain.from_iterable(map(self.of, names)))

    def of(self, name: str) -> tuple[Finding, ...]:
        """Return the findings of one check."""
        result = self._known.get(name)
        if result is None:
            check = BY_NAME[name]
            result = self._known[name] = self._evaluate(check) if self._run.has(check.needs) else ()
        return result

    def _evaluate(self, check: Check) -> tuple[Finding, ...]:
        """Return the findings of a check on the run, with its name and severity; none if an earlier check makes this
        one superfluous, or if a finding of certain earlier checks is required and missing."""
        run, name = self._run, check.name
        for earlier in check.unless:
            if self._fails_before(name) if earlier == ANY_FAILURE else self.of(earlier):
                return ()
        if check.after and not any(map(self.of, check.after)):
            return ()
        findings = tuple(check.evaluate(run))
        severity = WARNING if findings and check.severity == FAILURE and not check.fails(run) else check.severity
        return tuple(finding.rate(name, severity) for finding in findings) if findings else ()

    def _fails_before(self, name: str) -> bool:
        """Return whether a check before this one fails the run."""
        earlier = {*takewhile(name.__ne__, BY_NAME)}
        return _fails(chain.from_iterable(self.of(able) for able in _ABLE if able in earlier))


def _fails(findings: Iterable[Finding]) -> bool:
    return any(finding.severity == FAILURE for finding in findings)


def message_of(opening: str, findings: Iterable[Finding]) -> str:
    """Return the message of a run: an opening sentence, and the texts and hints of findings. Without an opening the
    first finding is the opening. The first failure is contrasted with a run that reached the end by ", but"; every
    other sentence begins after a semicolon. Findings that continue one another have one hint."""
    message, failed = opening, not opening
    for sentence in _sentences(findings):
        fails = _fails(sentence)
        joint = "" if not message else ", but " if fails and not failed else "; "
        words = sentence[0].text + "".join(BY_NAME[finding.name].continues + finding.text for finding in sentence[1:])
        message += joint + str(Finding(text=words, hint=sentence[-1].hint))
        failed = failed or fails
    return message


def _sentences(findings: Iterable[Finding]) -> list[list[Finding]]:
    """Return the findings as lists, one for each sentence: neighbours whose checks both have a joining text share a
    sentence."""
    sentences: list[list[Finding]] = []
    for finding in findings:
        if sentences and BY_NAME[finding.name].continues and BY_NAME[sentences[-1][-1].name].continues:
            sentences[-1].append(finding)
        else:
            sentences.append([finding])
    return sentences
