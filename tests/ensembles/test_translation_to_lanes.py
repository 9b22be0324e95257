"""C for one trajectory translated into C for lanes: each lane does what the text itself does, compiled as it stands."""

from __future__ import annotations

import ctypes
import re
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from eomgen.codegen.targets.c.templates import environment
from eomgen.products.ensembles.lane_code import UntranslatableConstruct, to_lanes
from eomgen.toolchain.compiler import find_compiler

COUNT = 64

#: Each file of the folder has a function f(work) that changes work->x (6 numbers) and work->n (4 whole numbers).
PAIR = "struct { real high, low; }"
HEAD = f"typedef struct work {{ real x[6]; long n[4]; {PAIR} pair; }} work;\n"
FOLDER = Path(__file__).parent / "translated"
CASES = {
    file.stem: file.read_text(encoding="utf-8").replace("void f(work", f"void f_{file.stem}(work")
    for file in sorted(FOLDER.glob("*.c"))
}
MAIN, MAIN_OF_LANES = ((FOLDER / "around" / name).read_text("utf-8") for name in ("main.c", "main_of_lanes.c"))
NAMES = """#define EOMGEN_SHORT_NAMES
#include <string.h>
#include "eomgen_real.h"
int law(double x, double *y) { y[0] += x; y[1] = 2.0 * y[0]; return x > 0.5 ? 7 : -7; }
"""


def runs(main: str) -> str:
    """Return a function ``run_NAME`` for each case."""
    return "\n".join(main.replace("void run(", f"void run_{name}(").replace(" f(", f" f_{name}(") for name in CASES)


def compiled(folder: Path, name: str, text: str, *flags: str) -> ctypes.CDLL:
    for header, template in (
        ("eomgen_real.h", "c/model/eomgen_real.h.jinja"),
        ("eomgen_lanes.h", "ensembles/lanes.h.jinja"),
    ):
        (folder / header).write_text(environment().get_template(template).render(), encoding="utf-8")
    source = folder / f"{name}.c"
    source.write_text(text, encoding="utf-8")
    strict = ["-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-shared", "-Wno-psabi"]
    command = [*find_compiler().command, *strict, *flags]
    subprocess.run([*command, str(source), "-o", str(folder / f"{name}.so"), "-lm"], check=True)
    return ctypes.CDLL(str(folder / f"{name}.so"))


@cache
def both() -> tuple[ctypes.CDLL, ctypes.CDLL]:
    """Return all cases for one trajectory, and for lanes."""
    text = "\n".join(CASES.values())
    with tempfile.TemporaryDirectory() as folder:
        scalar = compiled(Path(folder), "scalar", NAMES + HEAD + text + runs(MAIN))
        lanes = f'{NAMES}#include "eomgen_lanes.h"\n{in_lanes(text, *CASES)}{runs(MAIN_OF_LANES)}'
        return scalar, compiled(Path(folder), "lanes", lanes, "-DEOMGEN_REAL_LANES")


def in_lanes(text: str, *names: str) -> str:
    plain = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    head = HEAD.replace(PAIR, "pair")
    head = f"typedef double eomgen_real;\ntypedef double real;\ntypedef {PAIR} pair;\n{head}"
    return to_lanes(head + plain, {f"f_{name}" if name else "f": () for name in names}, {})


def samples() -> np.ndarray:
    rng = np.random.default_rng(11)
    found = np.round(rng.normal(0.3, 1.4, (COUNT, 12)), 3)
    found[:, 6:10] = rng.integers(-2, 6, (COUNT, 4))
    found[5, 0] = found[9, 4] = np.nan
    return found


@pytest.mark.parametrize("case", CASES)
def test_each_lane_does_what_the_text_does(case: str) -> None:
    expected, found, untouched = samples(), samples(), samples()
    for library, data in zip(both(), (expected, found), strict=True):
        getattr(library, f"run_{case}")(data.ctypes.data_as(ctypes.c_void_p), COUNT)
    absent = np.arange(COUNT) % 7 == 3
    expected[absent] = untouched[absent]  # lanes that are not there stay as they are
    np.testing.assert_array_equal(found, expected)
    assert not np.array_equal(expected, untouched, equal_nan=True)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("static void f(work *w) { const real *x = w->x[0] > K(0.0) ? w->x : w->x + 1; w->x[2] = x[0]; }", "address"),
        ("static void f(work *w) { int i = w->x[0] > K(1.0); const real *x = w->x + i; w->x[2] = x[0]; }", "address"),
        ("static void f(work *w) { switch (w->n[0]) { case 1: w->n[1] = 2; } }", "a choice of its own"),
        ("static void f(work *w) { int k = 1; switch (k) { case 1: w->n[1] = 2; break; } }", "a case that ends"),
        ("static void f(work *w) { w->x[0] = sin(w->x[0]); }", "a call of sin"),
        ("static void f(work *w) { const real *x = w->x; if (w->x[0] > K(0.0)) x = w->x + 1; }", "the pointer x, set"),
        ("static void f(work *w) { w->x[0] = -(w->x[1] > K(0.0)); }", "the operator - within an expression"),
        ("static void f(work *w) { real a = w->x[0] = K(1.0); }", "an expression Assignment"),
        ("static void f(work *w) { w->n[0] = (long)(w->x[0] > K(0.0)); }", "the cast "),
        ("static void f(work *w) { w->x[0] = unknown; }", "the name unknown"),
        ("static void f(work *w) { int live = 1; w->n[0] = live; }", "the name live, which masks have"),
        ("static void f(work *w) { goto end; end: w->n[0] = 1; }", "a statement Goto"),
        ("static real kept; static void f(work *w) { w->x[0] = kept; }", "the variable kept of the whole file"),
        (
            "static void f(work *w) { EG_SINCOS(w->x[1], &w->x[2], w->x + 3); }",
            "a result in memory with",
        ),
        ("int law(double *y); static void f(work *w) { w->n[0] = law(w->x + 1); }", "an array of unknown size: "),
        (
            "static pair g(work *w) { if (w->x[0] > K(0.0)) return w->pair; return w->pair; }"
            " static void f(work *w) { w->pair = g(w); }",
            "a structure, returned where lanes part company",
        ),
    ],
)
def test_what_lanes_cannot_follow_is_named_with_its_line(text: str, what: str) -> None:
    with pytest.raises(UntranslatableConstruct, match=rf"{what}.*\(stepper:\d+:\d+\)"):
        in_lanes(text, "")
