"""Mutants are single changes that compile, never of texts, types or layouts of drawings."""

from __future__ import annotations

import pytest

from tests.mutants.__main__ import sampled
from tests.mutants.operators import mutants_of


@pytest.mark.parametrize(
    ("line", "changes"),
    [
        ("a < b", {"a >= b", "a <= b"}),
        ("a not in b", {"a in b"}),
        ("a is None", {"a is not None"}),
        ("(a) + (b)", {"(a) - (b)"}),
        ("a ** 2", {"a * 2", "a ** 3"}),
        ("-a", {"+a"}),
        ("a and b", {"a or b"}),
        ("not a", {"bool(a)"}),
        ("0.5", {"0.75"}),
        ("0.0", {"1.0"}),
        ("1e-12", {"1e-09"}),
        ("True", {"False"}),
        ("f(a, b)", {"f(b, a)"}),
        ("f(a, a)", set()),
        ("f(*a, b)", set()),
        ("isinstance(a, b)", set()),
        ("np.maximum(a, b)", set()),
        ("plot(a, linewidth=2)", set()),
        ("'text' + a", set()),
        ("'text'", set()),
        ("f'{a + 1}'", set()),
        ("Problem(a + 1, b)", set()),
        ("lambda a: a", set()),
    ],
)
def test_expressions_change_by_their_operators(line: str, changes: set[str]) -> None:
    source = f"x = {line}\n".encode()
    assert {mutant.applied(source).decode()[4:-1] for mutant in mutants_of(source, "m.py")} == changes


@pytest.mark.parametrize(
    ("statement", "changes"),
    [
        ("call(a)", {"pass"}),
        ("a.b = c", {"pass"}),
        ("a = c", set()),
        ("a += c", {"pass", "a -= c"}),
        ("raise ValueError(a + 1)", {"pass"}),
        ("return a", {"return None"}),
        ("return None", set()),
        ('"""A docstring with 1 + 1."""', set()),
        ("b: Literal[1] = c", set()),
        ("print(a)", set()),
        ("assert a > 0", set()),
    ],
)
def test_statements_are_removed_and_values_not_returned(statement: str, changes: set[str]) -> None:
    source = f"def f(a: int | float = 0) -> Any:\n    {statement}\n".encode()
    found = [mutant for mutant in mutants_of(source, "m.py") if mutant.line == 2]
    assert {mutant.applied(source).decode().split("\n")[1].strip() for mutant in found} == changes
    assert {mutant.function for mutant in found} <= {"f"}


def test_answers_of_yes_or_no_are_turned_round_and_texts_are_left_alone() -> None:
    source = (
        b"def f(a) -> bool:\n    return a\n\ndef g(a) -> str:\n    return a\n\ndef __repr__(a):\n    return a + 1\n"
    )
    assert [mutant.new for mutant in mutants_of(source, "m.py")] == ["not (a)"]


def test_lines_stay_on_their_numbers() -> None:
    source = b"def f(a):\n    a.call(\n        1,\n        2,\n    )\n    return a\n"
    for mutant in mutants_of(source, "m.py"):
        assert mutant.applied(source).count(b"\n") == source.count(b"\n")


def test_a_sample_is_drawn_by_its_seed_and_begins_with_smaller_ones() -> None:
    under = "eomgen/products/linear/modes.py"
    assert sampled(20, 3, [under])[:5] == sampled(5, 3, [under]) != sampled(5, 4, [under])
    assert {mutant.file for mutant in sampled(20, 3, [under])} == {under}
