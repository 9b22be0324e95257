"""Templates stay readable: short files, short lines; so does the C that comes out of them."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest

from eomgen.base.files import template_folder
from eomgen.codegen.targets.c import printer
from eomgen.codegen.targets.c.printer import WIDTH, folded
from tests.golden import GENERATED

#: Lines in a template.
LONGEST = 300

TEMPLATES = sorted(template_folder().rglob("*.jinja"))


@pytest.mark.parametrize("path", TEMPLATES, ids=lambda path: path.relative_to(template_folder()).as_posix())
def test_templates_are_short_and_have_short_lines(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= LONGEST
    assert [f"{number}: {line}" for number, line in enumerate(lines, 1) if len(line) > WIDTH] == []


def test_generated_lines_are_short_unless_a_text_makes_them_long() -> None:
    files = sorted(GENERATED.rglob("*.[ch]"))
    long = [(file.name, line) for file in files for line in file.read_text().splitlines() if len(line) > WIDTH]
    assert files and [line for _, line in long if '"' not in line] == []


def test_code_is_folded_where_the_fewest_brackets_are_open() -> None:
    terms = " + ".join(f"x{k} * (y{k} - z{k})" for k in range(9))
    lines = folded(f"    const real sum = {terms};").split("\n")
    assert len(lines) == 2 and all(len(line) <= WIDTH for line in lines)
    assert (
        lines[1].startswith("        + x") and " ".join(line.strip() for line in lines) == f"const real sum = {terms};"
    )


def test_calls_are_folded_behind_commas() -> None:
    arguments = ", ".join(f"const real *restrict argument_{k}" for k in range(5))
    assert folded(f"void a_function({arguments})").split("\n") == [
        (
            "void a_function(const real *restrict argument_0, const real *restrict argument_1, const real *restrict"
            " argument_2,"
        ),
        "    const real *restrict argument_3, const real *restrict argument_4)",
    ]


def test_comments_are_folded_between_words_and_those_behind_code_go_above() -> None:
    words = " ".join(["word"] * 26)
    assert folded(f"/* {words} */").split("\n") == [f"/* {' '.join(['word'] * 23)}", f" * {' '.join(['word'] * 3)} */"]
    assert folded(f"    int member; /* {' '.join(['word'] * 21)} */").split("\n") == [
        f"    /* {' '.join(['word'] * 21)} */",
        "    int member;",
    ]


def test_long_tables_are_folded_page_by_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a page ends does not matter, not even within a text; and what a line costs does not grow with it."""
    numbers = ", ".join(f"{0.1 * k:.17g}" for k in range(300))
    texts = ", ".join(f'{k}, "{"a, b " * 18}"' for k in range(9))
    line = f'    static const real c[] = {{{numbers}, f("a, b"), /* c, d */ {numbers}, {texts}, {numbers}}};'
    whole = folded(line)
    assert "".join(whole.split()) == "".join(line.split()) and whole.count("a, b " * 18) == 9
    for page in (1, 50, 121, 122, 123, 1000):
        monkeypatch.setattr(printer, "_WINDOW", page)
        assert folded(line) == whole
    monkeypatch.undo()

    def cost(count: int) -> float:
        table = f"    static const real c[] = {{{'1.2345678901234567, ' * count}0}};"
        times = []
        for _ in range(3):
            began = time.process_time()
            folded(table)
            times.append(time.process_time() - began)
        return min(times)

    assert cost(32_000) < 16.0 * cost(4_000)


def test_texts_and_directives_stay_whole() -> None:
    for line in (f'    return "{"a, b " * 40}";', f"#define A_NAME {'(x) + ' * 30}0"):
        assert folded(line) == line


def test_a_product_that_begins_with_a_star_is_no_comment() -> None:
    name = "a_name_of_a_scene_that_is_rather_long"
    line = f"        * {name}_larger({name}_extent(work->q, work), work->largest_size_so_far) / step_of_the_run;"
    folds = folded(f"/* A comment\n * of two lines. */\n    x = K(2.0)\n{line}")
    assert "/\n        * " not in folds
    assert re.sub(r"\s+", "", folds).endswith(re.sub(r"\s+", "", line))
