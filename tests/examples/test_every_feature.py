"""Every feature on the covering examples: a result that agrees with another way to the same number, or one message."""

from __future__ import annotations

import functools
import re
import subprocess
import sys
import tomllib
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.system.terms import TERMS
from tests.examples.covering import covering

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
#: Steps of a run.
STEPS = 20
#: Options of the compiler for all generated C.
WARNINGS = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wshadow", "-Werror", "-fsyntax-only")
#: Messages that name a fault of eomgen in place of the user's.
BROKEN = re.compile("internal error|report this|Traceback|JaxRuntimeError|ValueError|IndexError|KeyError|TypeError")
Array = np.ndarray


def mechanical_scenes() -> Iterator[str]:
    """Yield the scene files of mechanisms, relative to the folder of examples."""
    for path in sorted(EXAMPLES.rglob("*.toml")):
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        if data.get("format") == 1 and {"joints", "include", "nets"} & data.keys():
            yield path.relative_to(EXAMPLES).as_posix()


class Example:
    """The model of an example, a state of it, and a short run."""

    def __init__(self, name: str) -> None:
        self.path = EXAMPLES / name
        self.rng = np.random.default_rng(zlib.crc32(name.encode()))

    @functools.cached_property
    def model(self) -> eomgen.Model:
        return eomgen.build(self.path, profile="quick")

    @functools.cached_property
    def step(self) -> float:
        data = tomllib.loads(self.path.read_text(encoding="utf-8"))
        step = data.get("simulation", {}).get("step", 1e-3)
        return step if isinstance(step, float) else 1e-3

    @property
    def end(self) -> float:
        return STEPS * self.step

    def simulate(self, model: eomgen.Model, **options: Any) -> eomgen.Solution:
        return model.simulate(self.end, self.step, error_estimate=False, **options)

    @functools.cached_property
    def run(self) -> eomgen.Solution:
        return self.simulate(self.model)

    @functools.cached_property
    def state(self) -> dict[str, Any]:
        """Arguments of functions of a state near the initial one."""
        model, rng = self.model, self.rng
        q = model.integrate(model.initial_q, 0.1 * rng.normal(size=model.nv))
        given = {"q": q, "v": 0.3 * rng.normal(size=model.nv), "t": 0.2}
        given |= {"u": np.full(model.nu, 0.3)} if model.nu else {}
        return given | ({"z": np.array(model.initial_z)} if model.nz else {})

    def parameter(self) -> tuple[str, float]:
        """Return the first tunable parameter with its value."""
        for name, value in self.model.parameters.items():
            return name, float(value)
        pytest.skip("no tunable parameter")


@functools.lru_cache(maxsize=1)
def example(name: str) -> Example:
    """Return an example; its cases follow one another."""
    return Example(name)


def assert_close(first: object, second: object, tolerance: float = 1e-9) -> None:
    one, other = (np.ravel(np.asarray(values, float)) for values in (first, second))
    assert one.shape == other.shape and np.isfinite(one).all()
    assert np.linalg.norm(one - other) <= tolerance * (1e-9 + np.linalg.norm(other))


def all_terms_without_warnings(case: Example, folder: Path) -> None:
    wanted = list(TERMS)
    while wanted:
        try:
            eomgen.generate(case.path, folder / "terms", terms=wanted)
            break
        except eomgen.ModelError as error:  # names terms that the scene does not have
            reason = str(error).partition("; try: ")[0]
            named = {term for term in wanted if re.search(rf"(?<!\w){term}(?!\w)", reason)}
            if not named:
                raise
            wanted = [term for term in wanted if term not in named]
    eomgen.generate(case.path, folder / "run")
    files = sorted(folder.glob("*/*.c"))
    assert wanted and len(files) > 2
    for file in files:
        done = subprocess.run(
            ["cc", *WARNINGS, file.name], cwd=file.parent, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr[:2000]


def casadi(case: Example, _: Path) -> None:
    model, given = case.model, case.state
    functions = eomgen.casadi(model, profile="quick")
    acceleration = case.rng.normal(size=model.nv)
    values = {
        **given,
        "a": acceleration,
        "p": model.parameter_array(),
        "z": given.get("z", []),
        "u": given.get("u", []),
    }
    for name, expected in (
        ("forward_dynamics", lambda: model.forward_dynamics(**given)),
        ("inverse_dynamics", lambda: model.inverse_dynamics(a=acceleration, **given)),
    ):
        if name in functions.keys():  # noqa: SIM118  # results by name, no mapping
            function = functions[name]
            assert_close(function(*[values[word] for word in function.name_in()]), expected(), 1e-8)


def jax(case: Example, _: Path) -> None:
    import jax as library

    library.config.update("jax_enable_x64", True)
    functions, given = eomgen.jax(case.model), case.state

    def accelerations(q: Any) -> Any:
        return functions.forward_dynamics(**{**given, "q": q})

    assert_close(accelerations(given["q"]), case.model.forward_dynamics(**given), 1e-8)
    assert np.isfinite(np.asarray(library.jacfwd(accelerations)(given["q"]))).all()


def derivatives_of_a_run(case: Example, _: Path) -> None:
    name, value = case.parameter()
    found = case.model.sensitivities(case.end, case.step, by=[name])
    change = 1e-6 * (abs(value) or 1.0)
    above, below = (case.simulate(case.model, parameters={name: value + by}) for by in (change, -change))
    last = np.concatenate([np.ravel(np.asarray(found.derivatives[key])[-1]) for key in above.outputs] or [np.zeros(0)])
    differences = [(above.outputs[key][-1] - below.outputs[key][-1]) / (2.0 * change) for key in above.outputs]
    expected = np.concatenate([np.ravel(one) for one in differences] or [np.zeros(0)])
    size = max((np.abs(np.asarray(values)).max(initial=0.0) for values in above.outputs.values()), default=0.0)
    assert np.abs(last - expected).max(initial=0.0) <= 1e-4 * np.abs(expected).max(initial=0.0) + 1e-9 * size / change


def samples(case: Example, _: Path) -> None:
    name, value = case.parameter()
    table = {name: [0.99 * value, value, 1.01 * value] if value else [-0.01, 0.0, 0.01]}
    ensemble = case.model.simulate_many(case.end, case.step, table=table, error_estimate=False, points=3)
    assert ensemble.done == 3


def saved_model(case: Example, folder: Path) -> None:
    again = case.simulate(eomgen.load_model(case.model.save(folder / "model.eom")))
    assert np.array_equal(again.q, case.run.q) and np.array_equal(again.v, case.run.v)


def tape_engine(case: Example, _: Path) -> None:
    other = case.simulate(eomgen.build(case.path, profile="instant"))
    assert_close(other.q[-1], case.run.q[-1], 1e-6)


def functional_mock_up_unit(case: Example, folder: Path) -> None:
    import fmpy

    file = eomgen.fmu(case.path, folder / "model.fmu", version=3, types="cs", profile="quick")
    result = fmpy.simulate_fmu(str(file), stop_time=case.end, output_interval=case.step)
    assert all(np.isfinite(result[name]).all() for name in result.dtype.names if result[name].dtype.kind == "f")


def verb(name: str) -> Callable[[Example, Path], None]:
    """Return the feature of a command: results in JSON, or one message."""

    def command(case: Example, _: Path) -> None:
        done = subprocess.run(
            [sys.executable, "-m", "eomgen", name, str(case.path), "--json"],
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        allowed = (0,) if name == "info" else (0, 3, 4, 6)
        assert done.returncode in allowed, done.stderr[-2000:]
        assert not BROKEN.search(done.stderr), done.stderr[-2000:]

    return command


FEATURES: Mapping[str, Callable[[Example, Path], None]] = {
    feature.__name__: feature
    for feature in (
        all_terms_without_warnings, casadi, jax, derivatives_of_a_run, samples, saved_model, tape_engine,
        functional_mock_up_unit,
    )
} | {name: verb(name) for name in ("equilibrium", "info", "linearize")}  # fmt: skip  # a table
COVERING = covering(mechanical_scenes())
#: A seventh of the pairs, so that each feature meets a seventh of the covering examples and each of them two features;
#: closed forms are those of test_check_of_examples, runs those of the READMEs.
PAIRS = [
    (name, feature)
    for row, name in enumerate(mechanical_scenes())
    for column, feature in enumerate(FEATURES)
    if name in COVERING and (row + column) % 7 == 0
]


@pytest.mark.long
@pytest.mark.parametrize(("name", "feature"), PAIRS)
def test_a_feature_of_an_example_is_a_result_or_one_message(name: str, feature: str, tmp_path: Path) -> None:
    try:
        FEATURES[feature](example(name), tmp_path)
    except eomgen.ToolchainError:
        raise
    except eomgen.EomgenError as error:
        assert error.code and not BROKEN.search(str(error))
