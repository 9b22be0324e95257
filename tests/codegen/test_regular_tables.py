"""Long tables of indices that are regular become loops and counting: the same entries, by running what is written."""

from __future__ import annotations

import random
import subprocess
from pathlib import Path
from typing import Any

import pytest

from eomgen.codegen.program import Statement
from eomgen.codegen.scheduling.matrix_loops import added_products
from eomgen.codegen.scheduling.stretches import ranges, repeat_statements, stretches
from eomgen.codegen.targets.c.printer import Printer
from eomgen.codegen.targets.c.tables import Lookup, RowLookup, collapse, nonzeros, places_of_fronts
from eomgen.codegen.targets.c.templates import environment

#: Places of six entries in each of 40 elements, where the ends of the chain differ.
CHAIN = [3, 1, 4, *[10 * k + place for k in range(1, 40) for place in (0, 7, 2, 3, 5, 9)], 900, 17]
#: Places that follow no rule.
WILD = random.Random(2).sample(range(10_000), 240)
COPY = (Statement("out", (0, 0, ("in", "read", 0))),)


def written(loops: list[tuple[Any, ...]], size: int, folder: Path) -> list[float]:
    """Return what loops that copy s, whose entries are their places, to d leave there; -0.5 is nothing."""
    lines = Printer({"s": "s[{}]"}, ["d"]).lines([Statement("repeat", data) for data in loops])
    head = "#include <stdio.h>\ntypedef double real;\n#define K(x) (x)\nint main(void)\n{\n"
    head += f"    static real s[20000], d[{size}];\n    int n;\n    for (n = 0; n < 20000; ++n) s[n] = n;\n"
    head += f"    for (n = 0; n < {size}; ++n) d[n] = -0.5;\n"
    return printed(head + "\n".join(lines) + f'\n    for (n = 0; n < {size}; ++n) printf("%.17g\\n", d[n]);', folder)


def printed(text: str, folder: Path) -> list[float]:
    """Return the numbers that a program prints, which is given without its end."""
    (folder / "program.c").write_text(f"{text}\n    return 0;\n}}\n", encoding="utf-8")
    command = ["cc", "-std=c99", "-Werror", "-o", str(folder / "program"), str(folder / "program.c")]
    subprocess.run(command, check=True)
    found = subprocess.run([str(folder / "program")], check=True, capture_output=True, text=True).stdout
    return [float(line) for line in found.split()]


@pytest.mark.parametrize(
    "places", [CHAIN, WILD, list(range(5, 300, 3)), [7] * 100], ids=["chain", "wild", "even", "one"]
)
@pytest.mark.parametrize("minus", [False, True])
def test_loops_copy_from_the_same_places(places: list[int], minus: bool, tmp_path: Path) -> None:
    row: Any = ("row", "s", tuple(places))
    loops = repeat_statements(len(places), COPY, (("neg", row) if minus else row,), (("row", 0, 3, 2),))
    found = written(loops, 3 + 2 * len(places), tmp_path)
    assert found[3::2] == [-place if minus else place for place in places]
    assert set(found[:3] + found[4::2]) == {-0.5}


def test_constants_of_elements_are_equal_ones_or_a_table(tmp_path: Path) -> None:
    values = [0.5, 0.5, *[number for _ in range(30) for number in (1.0, 1.0, 0.25)], 0.5]
    loops = repeat_statements(len(values), COPY, (("numbers", tuple(values)),), (("row", 0, 0, 1),))
    assert written(loops, len(values), tmp_path) == values
    assert len(loops) == 3


def test_long_loops_choose_between_ranges(tmp_path: Path) -> None:
    statements = [Statement("let", (k + 1, ("in", "read", 0))) for k in range(9)]
    whole = (*statements, Statement("out", (0, 0, 9)))
    places = [40, 11, *range(50, 90, 2), 3]
    values = [0.5, *[1.0] * 21, 0.5]
    read = (("row", "s", tuple(places)), ("numbers", tuple(values)))
    (loop,) = repeat_statements(len(places), whole, read, (("row", 0, 0, 1),))
    assert [expression[0] for expression in loop[2]] == ["choice", "choice"]
    text = "\n".join(Printer({"s": "s[{}]"}, ["d"]).lines([Statement("repeat", loop)]))
    assert "r0 = s[k < 2 ? 40 - 29 * k : k < 22 ? 46 + 2 * k : 3];" in text
    assert "r1 = (k < 1 ? K(0.5) : k < 22 ? K(1.0) : K(0.5));" in text


#: What each of 40 elements takes from the results of two loops, three of ten of one and two of three of the other.
OF_TWO_LOOPS = [start + step * k for k in range(40) for start, step in ((7, 10), (900, 3), (4, 10), (901, 3), (5, 10))]


def test_what_two_loops_left_is_copied_loop_by_loop(tmp_path: Path) -> None:
    count = len(OF_TWO_LOOPS)
    loops = repeat_statements(count, COPY, (("row", "s", tuple(OF_TWO_LOOPS)),), (("row", 0, 0, 1),))
    assert written(loops, count, tmp_path) == OF_TWO_LOOPS
    assert len(loops) == 2


def test_iterations_that_wait_for_others_keep_their_order() -> None:
    read = ("row", "w", tuple(OF_TWO_LOOPS))
    (loop,) = repeat_statements(len(OF_TWO_LOOPS), COPY, (read,), (("row", "w", 100, 1),))
    assert loop[2] == (read,)
    assert len(repeat_statements(len(OF_TWO_LOOPS), COPY, (read,), (("row", "w", 2000, 1),))) == 2


@pytest.mark.parametrize("gain", ["", "gain"])
def test_products_are_added_in_loops(gain: str, tmp_path: Path) -> None:
    terms = [(3 * k + i, 9 * k + 3 * i + j, 3 * k + j) for k in range(30) for i in range(3) for j in range(3)]
    terms[0] = (5, 400, 80)
    loops = added_products(terms, gain)
    inputs = {"right": "right[{}]", "numbers": "w[{}]", "vector": "x[{}]", "gain": ["2.0"]}
    text = "#include <stdio.h>\ntypedef double real;\nint main(void)\n{\n    static real right[90], w[500], x[90];\n"
    text += "    int n;\n    for (n = 0; n < 90; ++n) { right[n] = n; x[n] = 90 - n; }\n"
    text += "    for (n = 0; n < 500; ++n) w[n] = n % 7;\n" + "\n".join(Printer(inputs, ["right"]).lines(loops))
    found = printed(text + '\n    for (n = 0; n < 90; ++n) printf("%.17g\\n", right[n]);', tmp_path)
    wanted = [float(row) for row in range(90)]
    for row, number, column in terms:
        wanted[row] += (-2.0 if gain else 1.0) * (number % 7) * (90 - column)
    assert found == wanted
    assert len(loops) <= 3
    assert added_products([(row, row, WILD[row]) for row in range(200)]) == ()


def test_what_is_not_regular_keeps_its_table() -> None:
    row = ("row", "s", tuple(WILD))
    assert repeat_statements(len(WILD), COPY, (row,), (("row", 0, 0, 1),)) == [
        (len(WILD), COPY, (row,), (("row", 0, 0, 1),))
    ]


def test_stretches_cover_all_rows_once() -> None:
    found = stretches([CHAIN], [True])
    assert [stretch.start for stretch in found] == [0, *(stretch.stop for stretch in found[:-1])]
    assert found[-1].stop == len(CHAIN)
    assert (6, 39) in [(stretch.period, stretch.count) for stretch in found]


def test_ranges_are_the_fewest_from_the_left() -> None:
    assert ranges([4, 6, 8, 8, 8, 1]) == [(3, 4, 2), (5, 8, 0), (6, 1, 0)]


BY_RESIDUE = [place for k in range(40) for place in (-1, -1, -1, 7 * k + 4, 7 * k + 5, 7 * k + 6)]


@pytest.mark.parametrize(
    "values", [CHAIN, WILD, BY_RESIDUE, [1, 1, 1, 0, 0, 0] * 40, list(range(90)), [3] * 80, [1, 2]]
)
def test_lookups_give_the_entries_of_the_table(values: list[int], tmp_path: Path) -> None:
    found = Lookup("entry", values)
    text = f"#include <stdio.h>\nint main(void)\n{{\n{found.declaration()}    int i;\n"
    text += f"    for (i = 0; i < {len(values)}; ++i)\n"
    assert printed(text + f'        printf("%d\\n", {found.at()});', tmp_path) == values
    assert found.at("1") in ("entry[1]", str(values[1]))
    entries = sum(len(entries) for _, entries in found.tables)
    assert entries == len(values) if values in (WILD, [1, 2]) else entries <= 20


@pytest.mark.parametrize(("rows", "columns", "tables"), [(2, 12, 48), (2, 11, 88), (1, 30, 60), (3, 2, 12)], ids=str)
def test_nonzeros_are_visited_in_order(rows: int, columns: int, tables: int, tmp_path: Path) -> None:
    """Of elements with so many rows of so many neighbouring columns, the second half of which is the next one's."""
    places = [(rows * k + i, columns * k // 2 + j) for k in range(40) for i in range(rows) for j in range(columns)]
    macro = environment().get_template("c/integrators/newton/nonzeros.jinja").module.each_nonzero
    body = '        printf("%d %d %d\\n", {}, {}, {});\n'.format
    text = "#include <stdio.h>\nint main(void)\n{\n" + macro(places, caller=body)
    found = printed(text, tmp_path)
    assert found == [number for k, place in enumerate(places) for number in (k, *place)]
    assert sum(len(entries) for part in nonzeros(places) for entries in part["tables"].values()) == tables
    assert macro([(k, place) for k, place in enumerate(WILD)], caller=body).count("for (") == 1


def test_equal_items_at_equally_spaced_places_are_one() -> None:
    runs = [{"group": "SE3", "q": 7 * k, "v": 6 * k} for k in range(12)]
    runs[5] = {**runs[5], "group": "SO3"}
    found = collapse([*runs, *({**run, "q": run["q"] + 90} for run in runs[6:])], ["group"], ["q", "v"])
    assert [(run["group"], run["count"], run["q"]) for run in found] == [
        *(("SE3", 1, 7 * k) for k in range(5)),
        ("SO3", 1, 35),
        *(("SE3", 1, 7 * k) for k in range(6, 12)),
        *(("SE3", 1, 90 + 7 * k) for k in range(6, 12)),
    ]
    (one,) = collapse([{"q": 4 + 7 * k, "v": 6 * k} for k in range(20)], [], ["q", "v"])
    assert (one["count"], one["q"], one["v"]) == (20, "4 + 7 * k", "6 * k")


def test_kinds_that_take_turns_are_one_after_the_other() -> None:
    """Positions and rotations of free bodies take turns; fewer than a loop is worth stay as they are."""
    pairs = [({"group": "R", "q": 7 * k + 4}, {"group": "SO3", "q": 7 * k}) for k in range(9)]
    found = collapse([*(run for pair in pairs for run in pair), {"group": "R", "q": 90}], ["group"], ["q"])
    assert [(run["group"], run["count"], run["q"]) for run in found] == [
        ("R", 9, "4 + 7 * k"),
        ("R", 1, 90),
        ("SO3", 9, "7 * k"),
    ]
    few = [run for pair in pairs[:7] for run in pair]
    assert [run["group"] for run in collapse(few, ["group"], ["q"])] == ["R", "SO3"] * 7


def test_rows_of_fronts_count_where_they_are_regular() -> None:
    fronts = [[0, 0, 0], *([1, 10 * k, 6 * k] for k in range(1, 50)), [2, 700, 0]]
    assert places_of_fronts(fronts) == ["i < 2 ? i : i < 50 ? 1 : 2", "i < 50 ? 10 * i : 700", "i < 50 ? 6 * i : 0"]
    assert places_of_fronts([[k, place] for k, place in enumerate(WILD)]) == []
    assert places_of_fronts([[0, k] for k in range(9)]) == []


def test_rows_of_places_are_stored_for_one_period(tmp_path: Path) -> None:
    """A head, 30 periods of three rows moved by 10, and an end, against each of the given rows; others keep theirs."""
    periods = [(10 * k + a, 10 * k + b) for k in range(30) for a, b in ((5, 8), (1, 4), (9, 2))]
    rows = [(7, 3), (2, 2), *periods, (900, 17)]
    made = RowLookup(rows)
    assert len(made.rows) <= 8
    stored = ", ".join(f"{{ {one}, {other} }}" for one, other in made.rows)
    head = "#include <stdio.h>\nint main(void)\n{\n    int element;\n"
    text = f"{head}    static const int places[{len(made.rows)}][2] = {{ {stored} }};\n"
    text += f"    for (element = 0; element < {len(rows)}; ++element) {{\n"
    text += f"        const int *const at = places[{made.row}], by = {made.moved};\n"
    text += '        printf("%d %d\\n", at[0] + by, at[1] + by);\n    }'
    assert printed(text, tmp_path) == [float(place) for row in rows for place in row]
    uneven = [(k, 2 * k) for k in range(100)]
    assert (RowLookup(uneven).rows, RowLookup(uneven).row) == (uneven, "")


def test_ranges_are_integers_of_c() -> None:
    """Fronts of 7000 hinges: the last place would be on a line that begins far outside of the integers."""
    places = [*(35 + 57 * k for k in range(6998)), 398_888, 0]
    assert places[6998] != 35 + 57 * 6998
    made = ranges(places)
    assert [end for end, _, _ in made] == [6998, 6999, 7000]
    begin = 0
    for end, start, step in made:
        assert [start + step * k for k in range(begin, end)] == places[begin:end]
        assert max(abs(start), abs(step * (end - 1))) < 2**31
        begin = end
