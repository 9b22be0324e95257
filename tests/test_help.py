"""``help`` of a model's runs, of ``build`` and of ``load`` names every option that is accepted."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from contextlib import suppress
from typing import Any, cast, get_type_hints

import pytest

import eomgen
from eomgen.base.products import import_target, products
from eomgen.errors import UsageError
from eomgen.integrators.families.family import Sizes
from eomgen.integrators.families.register import method_named, method_names, row_of
from eomgen.scene.sources.register import own_sources
from eomgen.simulation import option_types
from eomgen.verbs import OWNERS, methods
from tests.product_parts import facts_of

#: Functions of products that hand options on: their types, and the function that takes the options in the end.
HANDED_ON = [row for product in products() for row in facts_of(product).get("handed_on", ())]
#: Of a scene with and without constraints and internal states.
SIZES = (Sizes(3, 3, 0, 0, 0, 0, 0), Sizes(3, 3, 1, 1, 1, 3, 3))


def words(function: Callable[..., Any]) -> set[str]:
    return set(re.findall(r"\w+", inspect.getdoc(function) or ""))


@pytest.mark.parametrize(("owner", "name"), [(owner, name) for owner in OWNERS for name in sorted(methods(owner))])
def test_methods_show_and_document_every_argument(owner: str, name: str) -> None:
    method = getattr(getattr(eomgen, owner), name)
    shown = set(inspect.signature(method).parameters) - {owner.lower()}
    assert not {"options", "kwargs", "args"} & shown
    assert shown <= words(method), shown - words(method)


@pytest.mark.parametrize("row", HANDED_ON, ids=lambda row: row["function"])
def test_options_that_are_handed_on_are_shown(row: dict[str, str]) -> None:
    typed = getattr(option_types, row["options"])
    function, taker = (cast("Callable[..., Any]", import_target(row[key])) for key in ("function", "taken_by"))
    given, taken = inspect.signature(function).parameters, inspect.signature(taker).parameters
    assert set(typed.__annotations__) <= set(given)
    kinds = get_type_hints(taker)
    for option, kind in get_type_hints(typed).items():
        assert kind == kinds[option], option
        assert given[option].default == taken[option].default, option


@pytest.mark.parametrize("method", method_names())
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
    for source in own_sources():
        for option in source.options:
            assert {option.name, *option.choices} <= words(eomgen.load), option.name
    assert {"fast", "reproducible", "quick", "double", "float"} <= words(eomgen.build)
