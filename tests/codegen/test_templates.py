"""Templates stay readable: short files, short lines; so does the C that comes out of them."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest

from eomgen.base.files import template_folder
from eomgen.codegen.targets.c import printer
from eomgen.codegen.targets.c.printer import WIDTH, wrap_text
from tests.golden import GENERATED

#: Lines in a template.
LONGEST = 300

TEMPLATES = sorted(template_folder().rglob("*.jinja"))


@pytest.mark.parametrize("path", TEMPLATES, ids=lambda path: path.relative_to(template_folder()).as_posix())
def test_templates_are_short_and_have_short_lines(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= LONGEST
    assert [f"{number}: {line}" for number, line in enumerate(lines, 1) if len(line) > WIDTH] == []


def test_generated_lines_are_short_unless_a_text_makes_them_long_and_end_without_blanks() -> None:
    lines = [line for file in GENERATED.rglob("*.[ch]") for line in file.read_text().split("\n")]
    assert lines and [line for line in lines if len(line) > WIDTH and '"' not in line] == []
    assert [line for line in lines if line != line.rstrip()] == []


def test_generated_code_is_folded_and_decided() -> None:
    """Folding twice changes nothing; sums with zero and differences of numbers are evaluated before printing."""
    for file in sorted(GENERATED.rglob("*.[ch]")):
        text = file.read_text()
        assert wrap_text(text) == text, file
        code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        undecided = re.findall(r"[\[(]0 \+ \w|\w \+ 0[\],;)]|= \d+ - \d+;", code)
        assert file.name == "eomgen_real.h" or undecided == [], file


def test_long_tables_are_folded_page_by_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a page ends does not matter, not even within a text; and what a line costs does not grow with it."""
    numbers = ", ".join(f"{0.1 * k:.17g}" for k in range(300))
    texts = ", ".join(f'{k}, "{"a, b " * 18}"' for k in range(9))
    line = f'    static const real c[] = {{{numbers}, f("a, b"), /* c, d */ {numbers}, {texts}, {numbers}}};'
    whole = wrap_text(line)
    assert "".join(whole.split()) == "".join(line.split()) and whole.count("a, b " * 18) == 9
    for page in (1, 50, 121, 122, 123, 1000):
        monkeypatch.setattr(printer, "_WINDOW", page)
        assert wrap_text(line) == whole
    monkeypatch.undo()

    def cost(count: int) -> float:
        table = f"    static const real c[] = {{{'1.2345678901234567, ' * count}0}};"
        times = []
        for _ in range(3):
            began = time.process_time()
            wrap_text(table)
            times.append(time.process_time() - began)
        return min(times)

    assert cost(32_000) < 16.0 * cost(4_000)


def test_texts_and_directives_stay_whole() -> None:
    for line in (f'    return "{"a, b " * 40}";', f"#define A_NAME {'(x) + ' * 30}0"):
        assert wrap_text(line) == line


def test_a_product_that_begins_with_a_star_is_no_comment() -> None:
    name = "a_name_of_a_scene_that_is_rather_long"
    line = f"        * {name}_larger({name}_extent(work->q, work), work->largest_size_so_far) / step_of_the_run;"
    folds = wrap_text(f"/* A comment\n * of two lines. */\n    x = K(2.0)\n{line}")
    assert "/\n        * " not in folds
    assert re.sub(r"\s+", "", folds).endswith(re.sub(r"\s+", "", line))
