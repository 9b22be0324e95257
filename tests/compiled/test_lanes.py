"""Batches in lanes: every function to the bits of the scalar library, whatever stands beside a sample; companions come
when they pay, and without one nothing changes."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.compiled import functions
from eomgen.compiled.functions import Functions, LaneCompanions
from eomgen.errors import ToolchainError, UsageError
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build_in
from eomgen.toolchain import builder
from eomgen.toolchain.compiler import RunningCompilers
from tests.models.scenes import pendulum_scene

EXAMPLES = Path(eomgen.__file__).parents[1] / "examples"
TERMS = ["mass", "inverse_dynamics", "forward_dynamics", "partials", "poses"]


@pytest.fixture
def model(monkeypatch: pytest.MonkeyPatch) -> Iterator[Model]:
    """Return a model whose companions are forgotten afterwards."""
    built = eomgen.build(pendulum_scene(), TERMS, profile="fast")
    monkeypatch.setattr(functions, "LEAST", 1)
    built.library.kept.pop("lanes", None)
    yield built
    built.library.kept.pop("lanes", None)


def blocks_of(model: Model, count: int, rng: np.random.Generator) -> dict[str, Array]:
    """Return inputs of all functions near the initial state, one row for each sample."""
    sizes = {key: value for key, value in model.functions.sizes.items() if isinstance(value, int)}
    blocks = {name: 0.3 * rng.normal(size=(count, max(1, size))) for name, size in sizes.items()}
    for name in ("v", "a", "s", "j"):
        blocks[name] = 0.3 * rng.normal(size=(count, sizes["v"]))
    blocks["q"] = np.array(model.initial_q) + 1e-3 * rng.normal(size=(count, sizes["q"]))
    blocks["p"] = model.parameter_array() * (1.0 + 0.01 * rng.normal(size=(count, 1)))
    blocks["t"] = rng.uniform(0.0, 1.0, count)
    return blocks


def called(model: Model, name: str, blocks: dict[str, Array]) -> tuple[Array, ...]:
    layout = next(item for item in model.library.layout["functions"] if item["name"] == name)
    for block, size in zip(layout["inputs"], layout["input_sizes"], strict=True):
        if block != "t" and blocks.get(block, np.empty(0)).shape[-1] != size:
            blocks[block] = np.full((len(blocks["t"]), size), 0.1)
    return Functions(model.library)(name, blocks)


def hold_lanes(model: Model, name: str, blocks: dict[str, Array]) -> None:
    """Hold results of lanes to those of the scalar library."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EOMGEN_LANES", "off")
        expected = called(model, name, blocks)
        patch.setenv("EOMGEN_LANES", "now")
        same(expected, called(model, name, blocks))


def in_lanes(model: Model, name: str) -> bool:
    companion = LaneCompanions.of(model.library)._found.get(name)
    return companion is not None and companion.judged and not companion.refused


def same(one: tuple[Array, ...], other: tuple[Array, ...]) -> None:
    for first, second in zip(one, other, strict=True):
        np.testing.assert_array_equal(first.view(np.int64), second.view(np.int64))


@pytest.mark.slow
@pytest.mark.long_cases("active_vehicle/scene.toml", "elastic_slider_crank/scene.toml")
@pytest.mark.parametrize(
    "scene",
    [
        "active_vehicle/scene.toml",  # a free body, tyres, an exponential
        "elastic_slider_crank/scene.toml",  # a closed loop, an elastic body
        "half_car_on_measured_road/scene.toml",  # a table
    ],
)
def test_every_function_of_a_scene_has_the_same_bits(scene: str, rng: np.random.Generator) -> None:
    model = eomgen.build(EXAMPLES / scene, profile="fast")
    model.library.kept.pop("lanes", None)
    blocks = blocks_of(model, 43, rng)
    for name in model.functions.names:
        hold_lanes(model, name, blocks)
        assert in_lanes(model, name), name


@pytest.mark.slow
def test_batches_of_any_size_and_of_broadcast_operands_have_the_same_bits(
    model: Model, rng: np.random.Generator
) -> None:
    whole = blocks_of(model, 17, rng)
    for name in TERMS:
        fixed = {**whole, "p": whole["p"][0], "q": whole["q"][3]}
        for count in range(2, 18):
            for blocks in (whole, fixed):
                part = {
                    key: value if value.ndim == 1 and key != "t" else value[:count] for key, value in blocks.items()
                }
                hold_lanes(model, name, part)
        assert in_lanes(model, name)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1e300])
def test_a_sample_that_is_no_number_leaves_the_others_alone(
    model: Model, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator, wrong: float
) -> None:
    monkeypatch.setenv("EOMGEN_LANES", "now")
    blocks = blocks_of(model, 11, rng)
    for name in TERMS[1:]:  # the mass is the same in all states
        sound = called(model, name, blocks)
        for place in (0, 5, 10):
            q = blocks["q"].copy()
            q[place] = wrong
            found = called(model, name, {**blocks, "q": q})
            for one, other in zip(sound, found, strict=True):
                np.testing.assert_array_equal(np.delete(one, place, axis=0), np.delete(other, place, axis=0))
            assert np.isnan(found[0][place]).any()
        assert in_lanes(model, name)


@pytest.mark.parametrize("workers", ["1", "2"])
def test_threads_share_lanes_to_the_same_bits(
    model: Model, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator, workers: str
) -> None:
    monkeypatch.setattr(functions, "_SHARE", 2000)
    monkeypatch.setenv("EOMGEN_THREADS", workers)
    hold_lanes(model, "partials", blocks_of(model, 1003, rng))
    assert in_lanes(model, "partials")


def test_a_companion_is_compiled_in_the_background_once_it_pays(
    model: Model, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, functions.__name__)
    monkeypatch.delenv("EOMGEN_LANES", raising=False)
    make, begun, allowed, threads = model.library.companion, threading.Event(), threading.Event(), []
    assert make is not None

    def waited(name: str, running: object = None) -> object:
        threads.append(threading.current_thread().name)
        if running is None:
            return None  # as with an empty cache
        begun.set()
        assert allowed.wait(600)
        return make(name, running)

    monkeypatch.setattr(model.library, "companion", waited)
    blocks = blocks_of(model, 50, rng)
    expected = called(model, "poses", blocks)
    assert not threads and not caplog.messages  # too little work even to look
    companion = LaneCompanions.of(model.library)._found["poses"]
    companion.seconds = companion.compiling
    same(expected, called(model, "poses", blocks))
    assert begun.wait(600)  # a thread of low priority may begin late
    assert threads[-1] == "eomgen-lanes" and threads[:-1] == [threading.current_thread().name]
    assert caplog.messages == ["compiles the lanes of poses in the background"]
    same(expected, called(model, "poses", blocks))  # while it compiles
    assert not in_lanes(model, "poses") and len(threads) == 2
    allowed.set()
    for thread in threading.enumerate():
        if thread.name == "eomgen-lanes":
            thread.join(600)
    assert companion.library is not None
    monkeypatch.setenv("EOMGEN_LANES", "now")  # so that no measured time decides
    same(expected, called(model, "poses", blocks))
    assert in_lanes(model, "poses")


@pytest.mark.slow
def test_companions_of_models_with_other_numbers_are_one_compilation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    libraries = []
    for mass in (1.7, 1.9):
        bodies = {"rod": {"mass": mass, "center_of_mass": [0.31, 0.02, -0.5], "inertia": [0.2, 0.21, 0.013]}}
        joints = {"swing": {"type": "revolute", "parent": "base", "child": "rod", "axis": [0, 1, 0]}}
        scene = eomgen.load({"format": 1, "name": "rod", "bodies": bodies, "joints": joints})
        library = build_in(tmp_path, scene, profile="reproducible").library
        assert library.companion is not None
        libraries.append((library, library.companion(library.layout["functions"][0]["name"], RunningCompilers())))
        monkeypatch.setattr(builder, "Compilation", None)  # for the second mass
    arrays = [rng.random((50, size)) for size in libraries[0][0].layout["functions"][0]["input_sizes"]]
    results = []
    for library, companion in libraries:
        outputs = [np.zeros(50), np.zeros(50)]
        assert companion is not None
        for made, output in zip((library, companion), outputs, strict=True):
            made.call(0, arrays, [output])
        assert outputs[0].tobytes() == outputs[1].tobytes()
        results.append(outputs[0])
    assert np.all(results[0] != results[1])


def test_a_companion_of_other_bits_is_left_out(
    model: Model, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, functions.__name__)
    make = model.library.companion
    assert make is not None

    def altered(name: str, running: object = None) -> object:
        library = make(name, running)

        def bind(*arguments: object) -> object:
            call, outputs = library.bind(*arguments), arguments[-1]

            def changed() -> None:
                call()
                outputs[0][20] = np.nextafter(outputs[0][20], np.inf)  # type: ignore[index]

            return changed

        return SimpleNamespace(bind=bind, call=None)

    monkeypatch.setattr(model.library, "companion", altered)
    hold_lanes(model, "poses", blocks_of(model, 200, rng))
    assert not in_lanes(model, "poses")
    assert caplog.messages == ["lanes of poses are left out: their library differs in bits"]


def test_a_compiler_that_fails_changes_nothing(
    model: Model, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, functions.__name__)

    def broken(name: str, running: object = None) -> object:
        raise ToolchainError("it broke", "another one")

    monkeypatch.setattr(model.library, "companion", broken)
    hold_lanes(model, "poses", blocks_of(model, 20, rng))
    assert caplog.messages == ["lanes of poses are left out: toolchain error: it broke; try: another one"]


def test_a_choice_of_lanes_that_is_none(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EOMGEN_LANES", "always")
    what = "environment variable EOMGEN_LANES: 'always' is not a choice of lanes; try: auto, off or now"
    with pytest.raises(UsageError, match=what):
        model.mass(np.zeros((40, 1)))
