"""Gives every test its own reproducible random numbers, and the cases of parametrised tests their tiers."""

from __future__ import annotations

import os

# One process of tests for each core: threads of BLAS between them wait for one another, and take half of the time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Most models of tests live for a second: to optimise them takes five times as long as to compile them. Tests that need
# what users get by default say so: compiled/test_examples.py builds examples with every feature as users build them.
os.environ.setdefault("EOMGEN_PROFILE", "quick")

import gc
import sys
import zlib
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

from tests.models.cache import shared_cache  # noqa: F401  # a fixture of all tests

# Equations are millions of small objects without circles: to look for circles among them takes a quarter of the time.
# None are frozen: a build then would count the frozen ones, a million, each time that it stops the collector.
gc.set_threshold(50_000, 20, 20)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that takes a part of the tests."""
    parser.addoption(
        "--part", metavar="K/N", help="tests of part K of N, 0 <= K < N; each test is in the same part of N always"
    )


def _part(item: pytest.Item) -> int:
    """Return a number that chooses the part of a test: the same for cases of a file with the same first identifier,
    since such cases often share a model; 0 for all tests with PyTorch, which takes minutes to install."""
    case = getattr(item, "callspec", None)
    first = case.id.partition("-")[0] if case else ""
    return 0 if "torch" in item.nodeid else zlib.crc32(f"{item.path.name} {first}".encode())


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put tests with JAX behind those that fork, and spare hypothesis the search for constants in all of the package:
    each process would parse 800 files, among them some of acados with faults that Python warns of.

    JAX has threads, and a process with threads had better not fork, as tests of copies of a process do. No test of
    waves does; they stay at the end, since they are short enough to share them well.
    """
    if part := config.getoption("--part"):
        number, parts = map(int, part.split("/"))
        others = [item for item in items if _part(item) % parts != number]
        config.hook.pytest_deselected(items=others)
        kept_out = set(others)
        items[:] = [item for item in items if item not in kept_out]
    items.sort(key=lambda item: (("waves" in item.path.parts), "jax" in item.nodeid.lower()))
    if providers := sys.modules.get("hypothesis.internal.conjecture.providers"):
        providers.is_local_module_file = lambda path: False  # type: ignore[attr-defined]
    if mujoco := sys.modules.get("mujoco"):  # its warnings are lines of a file in the present folder otherwise
        mujoco.set_mju_user_warning(lambda text: None)


#: Mark that each file with cases of a tier names, by the expression that takes the tier.
_MARK_OF_TIER = {"slow and not long": "mark.slow", "long": "mark.long"}


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out files without a case of the chosen tier: to import them takes half a minute."""
    tier = _MARK_OF_TIER.get(config.getoption("markexpr"))
    if tier is None or not collection_path.match("test_*.py"):
        return None
    return tier not in collection_path.read_text(encoding="utf-8") or None


@pytest.hookimpl(wrapper=True)
def pytest_pycollect_makeitem(collector: pytest.Module) -> Generator[None, object, object]:
    """Turn the marks with identifiers of cases (listed in pyproject.toml) into `slow` and `long`."""
    made = yield
    if isinstance(made, list):
        _mark_tiers(collector, [item for item in made if isinstance(item, pytest.Function)])
    return made


def _mark_tiers(collector: pytest.Module, cases: Sequence[pytest.Function]) -> None:
    """Mark the cases of one test.

    Raises
    ------
    pytest.Collector.CollectError
        If a mark has an identifier that none of the cases has.
    """
    identifiers = [case.callspec.id if hasattr(case, "callspec") else "" for case in cases]
    for case, identifier in zip(cases, identifiers, strict=True):
        for mark in list(case.iter_markers()):
            tier, _, choice = mark.name.partition("_")
            if tier not in ("slow", "long") or choice not in ("cases", "except"):
                continue
            if unknown := [name for name in mark.args if name not in identifiers]:
                raise collector.CollectError(f"{mark.name} of {case.originalname} names no case: {', '.join(unknown)}")
            if (identifier in mark.args) == (choice == "cases"):
                case.add_marker(tier)
        if case.get_closest_marker("long"):
            case.add_marker("slow")
    slow = [case for case in cases if case.get_closest_marker("slow") and not case.get_closest_marker("long")]
    for number, case in enumerate(slow):
        mark = case.get_closest_marker("long_except_every")
        if mark and number % mark.args[0]:
            case.add_marker("long")


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """Return random numbers that depend on the test's name only, so that tests may run alone or in any order."""
    return np.random.default_rng(zlib.crc32(request.node.name.encode()))


if hasattr(os, "sched_setaffinity"):

    @pytest.fixture(autouse=True)
    def all_cores() -> Iterator[None]:
        """Give later tests the cores back after a benchmark that stays on one: a run in one process draws no figures
        meanwhile, and two workers on one core take twice as long."""
        before = os.sched_getaffinity(0)
        yield
        os.sched_setaffinity(0, before)
