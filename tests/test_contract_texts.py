"""Docstrings of the public contract: sections of numpydoc, and examples that run."""

from __future__ import annotations

import doctest
import inspect
import re
from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest

import eomgen
from docs.site.reference import INTERNAL
from eomgen.base.products import products, public_names
from eomgen.simulation.simulator import Simulator
from tests.docstrings import LEFT_OUT, findings_of, names, undocumented
from tests.product_parts import facts_of

FACTS = [facts_of(product) for product in products()]
CLASSES = (
    *(eomgen.Model, eomgen.Solution, eomgen.System, Simulator, eomgen.SceneBuilder),
    *(
        getattr(import_module(facts["results"][name]), name)
        for facts in FACTS
        for name in facts.get("contract", ())
        if name in facts.get("results", {})
    ),
)
FUNCTIONS = (
    *("build", "derive", "generate", "load"),
    *(name for facts in FACTS for name in facts.get("contract", ()) if name in public_names()),
)

#: Functions whose example would be long, need a large scene or a file of another program; none is added.
WITHOUT_EXAMPLE = {"Model.section_loads", *(name for facts in FACTS for name in facts.get("without_example", ()))}


def contract() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield name and function of each method with arguments, and of each function, of the contract."""
    for kind in CLASSES:
        for name in (name for name in dir(kind) if not name.startswith("_")):
            member = getattr(kind, name)
            if callable(member) and arguments(member):
                yield f"{kind.__name__}.{name}", member
    yield from ((name, getattr(eomgen, name)) for name in FUNCTIONS)


def arguments(function: Callable[..., Any]) -> list[str]:
    """Return the names of the arguments, the object itself aside."""
    names = [*inspect.signature(function).parameters]
    return [name for name in names if name not in ("self", "model")]


CONTRACT = dict(contract())


@cache
def built(*args: Any) -> eomgen.Model:
    """Return the model of an example, compiled fast and once."""
    path, terms = args
    return eomgen.build(path, profile="quick", terms=terms)


@pytest.mark.parametrize("name", CONTRACT)
def test_arguments_and_results_have_their_sections(name: str) -> None:
    text = inspect.getdoc(CONTRACT[name]) or ""
    assert "Parameters\n----------\n" in text or name in INTERNAL
    result = str(inspect.signature(CONTRACT[name]).return_annotation)
    assert result == "None" or "Returns\n-------\n" in text or name in INTERNAL


def test_no_further_function_lacks_an_example() -> None:
    without = {name for name, function in CONTRACT.items() if ">>>" not in (inspect.getdoc(function) or "")}
    assert without - INTERNAL == WITHOUT_EXAMPLE


#: Functions of the contract with an example, and all other public names with one.
EXAMPLES = {name: function for name, function in CONTRACT.items() if ">>>" in (function.__doc__ or "")} | {
    name: value
    for name, value in names()
    if inspect.isfunction(value) and ">>>" in (value.__doc__ or "") and value not in CONTRACT.values()
}
#: Examples that compile for more than a second.
SLOW = {name for facts in FACTS for name in facts.get("slow_examples", ())}


@pytest.mark.slow_cases(
    "eomgen.fmu", "Model.sensitivities", "Ensemble.deviation", "eomgen.Solution.to_pandas", "eomgen.Solution.to_xarray",
    "eomgen.studies.check", "Solution.linearize", "with_controller", "eomgen.from_sympy",
)  # fmt: skip  # a list of examples that import or compile much
@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in EXAMPLES])
def test_examples_run_as_they_stand(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    matplotlib.use("Agg")
    (tmp_path / "examples").symlink_to(Path(__file__).parents[1] / "examples")
    monkeypatch.chdir(tmp_path)
    quick = SimpleNamespace(**{other: getattr(eomgen, other) for other in eomgen.__all__})
    quick.build = lambda scene, terms=None: (
        built(scene, terms if terms is None else tuple(terms))
        if isinstance(scene, str)
        else eomgen.build(scene, profile="quick")
    )
    finder, runner = doctest.DocTestFinder(recurse=False), doctest.DocTestRunner(verbose=False)
    names = {"eomgen": quick, "np": np}
    arm = name.startswith("SceneBuilder.") and name != "SceneBuilder.build"
    if arm:
        exec("\n".join(re.findall(r">>> (arm = .*)", inspect.getdoc(eomgen.SceneBuilder) or "")), names)
    function = EXAMPLES[name]
    function = function if ">>>" in (function.__doc__ or "") else inspect.unwrap(function)
    (example,) = finder.find(function, name, globs=names)
    report: list[str] = []
    runner.run(example, out=report.append, clear_globs=False)
    assert runner.tries and not runner.failures, "".join(report)
    if arm:
        assert example.globs["arm"].build().name == "arm"


def unclear(first: float, second: float) -> float:
    """Adds two numbers

    Parameters
    ----------
    first : float
        One of them.
    third : float
        Another one.
    """
    return first + second


def test_numpydoc_finds_what_is_wrong_with_a_docstring() -> None:
    codes = {item.code for item in findings_of(f"{__name__}.unclear", unclear)}
    assert {"SS03", "SS05", "PR01", "PR02", "RT01"} <= codes and not codes & LEFT_OUT.keys()
    assert findings_of("eomgen.build", eomgen.build) == []


class Constructed:
    """A class with a section for one of its two arguments.

    Parameters
    ----------
    first : float
        One of them.

    Attributes
    ----------
    third : float
    """


def test_fields_of_classes_stand_in_one_of_two_sections() -> None:
    message = "Parameters {'first', 'second', 'third'} not documented"
    assert undocumented(message, Constructed) == {"first", "second"}
    assert undocumented(message, unclear) == {"first", "second", "third"}
    assert undocumented("Parameters {'model'} not documented", eomgen.Model.mass) == set()
    assert undocumented(message, eomgen.Model) == set()  # made by build
