"""Libraries in two: runs begin before the functions that no run calls are compiled, and all have the same bits."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.codegen.targets.c.target import written_library
from eomgen.errors import ToolchainError
from eomgen.pipeline import libraries, programs
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build_in, write_c
from eomgen.pipeline.requests import LibraryRequest
from eomgen.pipeline.scenes import SCENES
from eomgen.system.terms import Selection
from eomgen.toolchain.builder import Builder
from eomgen.toolchain.cache import Cache
from eomgen.toolchain.compiler import RunningCompilers
from eomgen.toolchain.library import Library, Successor

SCENE = Path(__file__).parents[2] / "examples" / "four_bar" / "scene.toml"
Build = Callable[..., Model]


@pytest.fixture
def build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Build:
    """Return a function that builds the four-bar linkage in two, however short its functions are."""
    monkeypatch.setattr(programs, "_MUCH", 1)

    def made(cache: str = "cache", profile: str = "reproducible") -> Model:
        return build_in(tmp_path / cache, SCENE, profile=profile)

    return made


@pytest.fixture
def release(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Return an event until which compilers in the background wait."""
    begun, work = threading.Event(), Successor._work

    def later(self: Successor, running: RunningCompilers) -> None:
        begun.wait(60.0)
        work(self, running)

    monkeypatch.setattr(Successor, "_work", later)
    return begun


def test_the_stepper_is_written_before_the_functions_are_scheduled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[str] = []
    monkeypatch.setattr(Builder, "begin_source", lambda self, name, texts, straight: begun.append(name))
    monkeypatch.setattr(libraries, "_LONG", 1)
    scene, every = eomgen.load(SCENE), Selection(None, "")
    request = LibraryRequest(scene, SCENES, every, "generalized_alpha", Builder("fast", cache=Cache(tmp_path)))
    job = libraries.LibraryJob(request, partial(write_c, request))
    program, _ = job.program
    written = dict(written_library(program, tmp_path, apart=True))
    assert begun == ["four_bar_step.c"]
    assert list(job.texts) == ["eomgen_real.h", "four_bar.h", "four_bar_step.c"]
    assert {name: written[name] for name in job.texts} == job.texts


def _sources(library: Library) -> set[str]:
    return {file.name for file in library.folder.glob("*.c")}


@pytest.mark.slow
def test_runs_do_not_wait_for_functions_that_they_do_not_call(
    build: Build, release: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = build()
    assert {"partials", "velocity_partials", "residual"} <= model.library.lacking
    run = model.simulate(0.02)
    energy = model.energy(model.initial_q, model.initial_v)
    assert model.library.lacking
    of_runs = model.library
    release.set()
    partials = model.partials(model.initial_q, model.initial_v, np.zeros(model.nv))
    after = model.simulate(0.02)
    assert not model.library.lacking
    assert model.library.digest == of_runs.digest
    assert _sources(model.library) > _sources(of_runs)
    monkeypatch.setattr(programs, "_MUCH", 10**9)
    whole = build("other cache")
    assert not whole.library.lacking
    expected = whole.partials(model.initial_q, model.initial_v, np.zeros(model.nv))
    assert [item.tobytes() for item in partials] == [item.tobytes() for item in expected]
    assert run.q.tobytes() == after.q.tobytes() == whole.simulate(0.02).q.tobytes()
    assert energy == whole.energy(model.initial_q, model.initial_v)


@pytest.mark.slow
def test_another_process_finds_the_library_of_runs_and_compiles_the_rest_when_it_is_called(
    build: Build, release: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = build().library
    builds: list[Mapping[str, Any]] = []
    own = Builder.build

    def counted(self: Builder, *arguments: Any, **options: Any) -> Any:
        builds.append(options)
        return own(self, *arguments, **options)

    monkeypatch.setattr(Builder, "build", counted)
    model = build()
    assert model.library.digest == first.digest
    assert model.simulate(0.01).success
    assert not builds
    assert not release.is_set()
    coupling = model.coupling(model.initial_q, model.initial_v)
    assert len(builds) == 1
    assert build().library.lacking == frozenset()  # all functions are in the cache
    assert len(builds) == 1
    batch = np.repeat(model.initial_q[np.newaxis], 3, axis=0), np.repeat(model.initial_v[np.newaxis], 3, axis=0)
    assert np.array_equal(model.coupling(*batch)[2], coupling)


@pytest.mark.slow
def test_faults_of_the_rest_are_raised_by_the_call_of_a_function_that_is_missing(
    build: Build, release: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = build()

    def fails(*_: object, **__: object) -> None:
        raise ToolchainError("the compiler ran out of memory", "fewer functions")

    with monkeypatch.context() as patched:
        patched.setattr(Builder, "build", fails)
        release.set()
        assert model.library.successor is not None
        assert model.library.successor.wait(60.0)
        assert model.simulate(0.01).success  # without a warning
        with pytest.raises(ToolchainError, match="the compiler ran out of memory"):
            model.coupling(model.initial_q, model.initial_v)
    shutil.rmtree(model.library.folder.parent / "failed", ignore_errors=True)
    assert model.coupling(model.initial_q, model.initial_v).shape == (3,)


@pytest.mark.slow
def test_profiles_for_few_compilers_are_whole(build: Build) -> None:
    assert not build(profile="quick").library.lacking
