"""``help`` of a model's runs, of ``build`` and of ``load`` names every option that is accepted."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from contextlib import suppress
from typing import Any, get_type_hints

import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.integrators.families.family import Sizes
from eomgen.integrators.families.register import row_of
from eomgen.integrators.methods import METHOD_NAMES, method_named
from eomgen.scene.sources.register import BUILT_IN
from eomgen.simulation import option_types, resume, simulate, start

RUNS = {
    "simulate": (simulate.simulate, option_types.RunOptions, {"t_end", "step"}),
    "start": (start.start, option_types.MethodOptions, {"initial", "parameters", "method", "step", "motions"}),
    "resume": (resume.resume, option_types.ResumeOptions, {"path", "t_end"}),
}
#: Of a scene with and without constraints and internal states.
SIZES = (Sizes(3, 3, 0, 0, 0, 0, 0), Sizes(3, 3, 1, 1, 1, 3, 3))


def words(function: Callable[..., Any]) -> set[str]:
    return set(re.findall(r"\w+", inspect.getdoc(function) or ""))


@pytest.mark.parametrize("name", RUNS)
def test_options_of_runs(name: str) -> None:
    function, typed, own = RUNS[name]
    public = getattr(eomgen.Model, name)
    accepted = set(inspect.signature(function).parameters) - {"model"}
    assert accepted <= words(public), accepted - words(public)
    assert set(inspect.signature(public).parameters) == {"self", *own, "options"}
    hints = get_type_hints(typed)
    assert accepted == own | set(hints)
    for option, kind in get_type_hints(function).items():
        assert option not in hints or kind == hints[option], option


@pytest.mark.parametrize("method", METHOD_NAMES)
def test_methods_with_their_parameters_and_settings(method: str) -> None:
    described = words(eomgen.Model.simulate)
    assert method in described
    needed = set(row_of(method)[1].parameters)
    with suppress(UsageError):  # undamped methods of index 3 are refused
        needed |= {item.name for sizes in SIZES for item in method_named(method).settings(sizes)}
    coefficients = {"alpha_m", "alpha_f"}  # what rho_inf and alpha stand for
    assert needed - coefficients <= described


def test_options_of_build_and_load() -> None:
    for function in (eomgen.build, eomgen.load):
        assert set(inspect.signature(function).parameters) <= words(function)
    for source in BUILT_IN:
        for option in source.options:
            assert {option.name, *option.choices} <= words(eomgen.load), option.name
    assert {"fast", "reproducible", "quick", "double", "float"} <= words(eomgen.build)
