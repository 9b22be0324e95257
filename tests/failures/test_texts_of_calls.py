"""Texts of refused calls from Python, at the border of what is taken, and calls on the other side of it; a product's
calls are in its folder of tests, in ``refused_calls.py``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.base import journal
from eomgen.base.csv_tables import _cells
from eomgen.cli import options
from eomgen.codegen import folder
from eomgen.codegen.targets.c.naming import check_identifier
from eomgen.compiled import base_parameters
from eomgen.compiled.bodies import operational_inertia
from eomgen.errors import EomgenError
from eomgen.integrators.stepper_layout import checked_setting
from eomgen.results import dense_output
from eomgen.results.events import Events
from eomgen.simulation import resume, run_model
from eomgen.simulation.stepping import controllers
from tests.failures.failure import tables_of_products

SETTINGS = {
    "family": "rk4",
    "parameters": {},
    "settings": [
        {"name": "reuse", "default": 1, "whole": [0, 1]},
        {"name": "max_halvings", "default": 10, "whole": [0, 30]},
        {"name": "rtol", "default": 1e-6, "whole": None},
        {"name": "tolerance", "default": 1e-5, "whole": None},
    ],
    "bounds": [{"left": "tolerance", "relation": ">", "right": 0.0}],
}


#: Calls, and the texts that they are refused with.
REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "combinations": (
        lambda: base_parameters._check(np.array([[1.0, 1.0 + 2e-6]]) * 1e3, (0,), np.array([[1.0, 1.0]])),
        "base_parameters: combinations that hold at some random motions do not hold at others; try: another seed",
    ),
    "csv": (
        lambda: _cells("a.csv:3", '1,"2"3', ","),
        "a.csv:3: this is not a CSV file: ',' expected after '\"'; try: plain cells between delimiters",
    ),
    "two values": (
        lambda: options.assignments("--set", ["a=1,b=2"]),
        "--set a=1,b=2: this option takes one name and one value; try: --set a=1 --set b=2",
    ),
    "identifier": (lambda: check_identifier("2x", "function"), "function '2x' is not an identifier"),
    "rows of a twist": (
        lambda: operational_inertia(cast(Any, None), "arm", [0.0], rows=[3, 6]),
        "rows: '[3, 6]' are not rows of a twist; try: rows=[3, 4, 5]",
    ),
    "negative setting": (lambda: checked_setting(SETTINGS, "rtol", -1e-9), "settings.rtol: rtol is negative: -1e-09"),
    "whole setting": (
        lambda: checked_setting(SETTINGS, "max_halvings", 30.5),
        "settings.max_halvings: max_halvings must be a whole number from 0 to 30, not 30.5; try: 10",
    ),
    "setting of zero": (
        lambda: checked_setting(SETTINGS, "tolerance", 0.0),
        "settings.tolerance: tolerance is 0, and has to be above it; try: 1e-05, which it is by default",
    ),
    "solution made by hand": (
        lambda: dense_output.factors_of({}),
        "at: this solution does not say which groups its coordinates are of: it was made by hand or by an older eomgen;"
        " try: a solution of simulate",
    ),
    "event that is none": (
        lambda: Events.__getitem__(cast(Any, SimpleNamespace(counts={"stop": 1}, names=("stop",))), "stpo"),
        "events: there is no event 'stpo'; try: stop",
    ),
    "parameters of a run that goes on": (
        lambda: resume._same_parameters(cast(Any, PAIR), np.array([1.0, 2.0]), {"k": 2.5}),
        "parameter k: the run has 2, not 2.5; try: a run of its own for other parameters",
    ),
    "function of a run": (
        lambda: run_model._inputs({"force": "function", "lift": 2.0}, {"lift": 3.0}),
        "2 problems\n  1. input force: the run had a function here, which a solution does not hold; try: the same"
        " again: inputs={'force': ...}\n  2. input lift: the run had 2 here; try: leave it out",
    ),
    "controller of nothing": (
        lambda: controllers._values(ROW, None, 0.5),
        "controller servo: the function gives nothing at t = 0.5 s, and has to give 2 numbers: force, lift; try:"
        " return force, lift",
    ),
    "controller of three numbers": (
        lambda: controllers._values(ROW, [1.0, 2.0, 3.0], 0.5),
        "controller servo: the function gives an array of shape (3,) at t = 0.5 s, and has to give 2 numbers: force,"
        " lift; try: return force, lift",
    ),
    "controller of words": (
        lambda: controllers._values({**ROW, "outputs": ["force"]}, "one", 0.5),
        "controller servo: the function gives str, which is not an array of numbers at t = 0.5 s, and has to give one"
        " number, force; try: return value, the number that force holds",
    ),
}
PAIR = SimpleNamespace(parameters=("m", "k"), parameter_array=lambda whole: np.array([whole["m"], whole["k"]]))
ROW = {"name": "servo", "outputs": ["force", "lift"]}


for table in tables_of_products("REFUSED"):
    REFUSED |= table


@pytest.mark.slow_cases("a path over an input of a list")
@pytest.mark.parametrize("name", REFUSED)
def test_calls_beyond_the_border_are_refused_in_these_words(name: str) -> None:
    call, text = REFUSED[name]
    with pytest.raises(EomgenError) as caught:
        call()
    assert str(caught.value).partition("error: ")[2] == text


ACCEPTED: Sequence[Callable[[], object]] = (
    lambda: base_parameters._check(np.array([[1.0, 1.0]]) * 1e3, (0,), np.array([[1.0, 1.0]])),
    lambda: checked_setting(SETTINGS, "reuse", 0.0) == 0.0,
    lambda: checked_setting(SETTINGS, "max_halvings", 30.0),
    lambda: checked_setting(SETTINGS, "rtol", 0.0),
)


@pytest.mark.parametrize("call", [*ACCEPTED, *chain.from_iterable(tables_of_products("ACCEPTED"))])
def test_calls_at_the_border_are_taken(call: Callable[[], object]) -> None:
    call()


def test_folders_of_others_are_not_written_into(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(EomgenError, match=f"{tmp_path / 'file'} is a file, not a folder; try: another folder"):
        folder._earlier_files(tmp_path / "file")
    assert folder._earlier_files(tmp_path / "none") == set()


def test_studies_of_other_things_are_not_gone_on_with(tmp_path: Path) -> None:
    def opened(identity: str, *, resume: bool) -> journal.Journal[int]:
        of: dict[str, Any] = {"identity": identity, "others": "another scene", "row_of": lambda line: line["row"]}
        return journal.Journal(tmp_path, "cells.jsonl", "cells of a study", resume=resume, **of)

    opened("a", resume=False).append({"row": 3})
    assert opened("a", resume=True).rows == [3]
    text = "holds the cells of a study, cells.jsonl; try: --resume, which goes on with it, or another folder"
    with pytest.raises(EomgenError) as caught:
        opened("a", resume=False)
    assert str(caught.value).endswith(f"{tmp_path}: {text}")
    with pytest.raises(EomgenError) as caught:
        opened("b", resume=True)
    assert str(caught.value).endswith(f"{tmp_path}: holds the cells of a study of another scene; try: another folder")
