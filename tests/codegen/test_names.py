"""Names from outside stay distinct, legal and harmless."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from eomgen.base.files import template_folder
from eomgen.codegen.targets.c.naming import comment, free_prefix, mangle, output_name
from eomgen.errors import ModelError
from eomgen.system.terms import TERMS

names = st.text(alphabet=st.sampled_from('aZ5fe_ .é*/\\"\n0_Z'), max_size=8)


@given(names, names)
@settings(max_examples=400, deadline=None)
def test_mangling_is_injective_and_legal(first: str, second: str) -> None:
    assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", mangle(first))
    assert (mangle(first) == mangle(second)) == (first == second)


@pytest.mark.slow
@given(st.text(max_size=60))
@settings(max_examples=300, deadline=None)
def test_comments_cannot_end_or_continue(text: str) -> None:
    clean = comment(text)
    assert not re.search(r"\*|//|\?\?|\\|\n|[^\x20-\x7e]", clean)


def test_outputs_avoid_inputs_locals_and_words() -> None:
    assert [output_name(name, ("q", "p")) for name in ("M", "q", "x12", "w", "double", "K")] == [
        "M",
        "q_out",
        "x12_out",
        "w_out",
        "double_out",
        "K",
    ]


@pytest.mark.parametrize("name", ["", "1arm", "arm-2", "a b", "é", 'x";system("'])
def test_prefixes_that_cannot_be_are_refused(name: str) -> None:
    with pytest.raises(ModelError, match="is not a C identifier"):
        free_prefix(name)


@pytest.mark.parametrize("name", ["main", "EG", "eomgen_real", "int", "Math"])
def test_prefixes_that_are_taken_are_longer(name: str) -> None:
    assert free_prefix(name) == f"{name}_model"


def test_no_function_of_a_stepper_has_the_name_of_a_term() -> None:
    """Both carry the scene's prefix, and a model may have any term beside any stepper."""
    folder = template_folder() / "c" / "integrators"
    text = "".join(path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*.jinja")))
    own = set(re.findall(r"^static [^(\n]*\{\{ P \}\}_([a-z_]+)\(", text, re.MULTILINE))
    assert {"solve_accelerations", "rates_of_motion"} <= own
    assert not own & set(TERMS)
