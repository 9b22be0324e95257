"""A plugin of pytest for trials: records how a run of tests ends, and ends it when its processor time is used up."""

from __future__ import annotations

import json
import os
import resource
from collections.abc import Generator
from pathlib import Path

import pytest

REPORT, LIMIT = Path(os.environ["EOMGEN_TRIAL_REPORT"]), float(os.environ["EOMGEN_TRIAL_LIMIT"])
#: A mutant may have no end and take all memory.
MEMORY = 6_000_000_000
record: dict[str, object] = {"failed": "", "whole": False, "tests": 0}


def _processor_time() -> float:
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def pytest_configure() -> None:
    ceiling = int(3.0 * LIMIT) + 5
    resource.setrlimit(resource.RLIMIT_CPU, (ceiling, ceiling))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.failed and not record["failed"]:
        record["failed"] = report.nodeid


def pytest_collectreport(report: pytest.CollectReport) -> None:
    if report.failed and not record["failed"]:
        record["failed"] = report.nodeid or "collection"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    if _processor_time() > LIMIT:
        item.session.shouldstop = "the processor time of this trial is used up"
    else:
        record["tests"] = int(str(record["tests"])) + 1
    return (yield)


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    record["whole"] = not session.shouldstop and exitstatus in (0, 5)
    record["seconds"] = _processor_time()
    REPORT.write_text(json.dumps(record), encoding="utf-8")
