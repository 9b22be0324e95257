"""C for one trajectory translated into C for lanes: each lane does what the text itself does, compiled as it stands."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import numpy as np
import pytest

from eomgen.codegen.targets.c.templates import environment
from eomgen.products.ensembles.lane_code import UntranslatableConstruct, to_lanes
from eomgen.toolchain.compiler import find_compiler, preprocess

COUNT = 64

#: Each file of the folder has a function f(work) that changes work->x (6 numbers) and work->n (4 whole numbers).
HEAD = """
typedef struct work { real x[6]; long n[4]; struct { real high, low; } pair; } work;
"""
FOLDER = Path(__file__).parent / "translated"
CASES = {file.stem: file.read_text(encoding="utf-8") for file in sorted(FOLDER.glob("*.c"))}
MAIN, MAIN_OF_LANES = ((FOLDER / "around" / name).read_text("utf-8") for name in ("main.c", "main_of_lanes.c"))
NUMBERS = "typedef double eomgen_real;\n#ifdef EOMGEN_SHORT_NAMES\ntypedef double real;\n#endif\n"


def compiled(folder: Path, name: str, text: str, *flags: str) -> ctypes.CDLL:
    real = environment().get_template("c/model/eomgen_real.h.jinja").render()
    (folder / "eomgen_real.h").write_text(real, encoding="utf-8")
    (folder / "eomgen_lanes.h").write_text(
        environment().get_template("ensembles/lanes.h.jinja").render(), encoding="utf-8"
    )
    source = folder / f"{name}.c"
    source.write_text(text, encoding="utf-8")
    strict = ["-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-shared", "-Wno-psabi"]
    command = [*find_compiler().command, *strict, *flags]
    subprocess.run([*command, str(source), "-o", str(folder / f"{name}.so"), "-lm"], check=True)
    return ctypes.CDLL(str(folder / f"{name}.so"))


def in_lanes(text: str) -> str:
    source = (
        '#define EOMGEN_SHORT_NAMES\n#include "eomgen_real.h"\n'
        + HEAD.replace("struct { real high, low; } pair", "pair pair").replace(
            "typedef struct work", "typedef struct pair { real high, low; } pair;\ntypedef struct work"
        )
        + text
    )
    plain = preprocess(find_compiler(), {"eomgen_real.h": NUMBERS, "case.c": source}, "case.c")
    return to_lanes(plain, {"f": ()}, {})


def samples() -> np.ndarray:
    rng = np.random.default_rng(11)
    found = np.round(rng.normal(0.3, 1.4, (COUNT, 12)), 3)
    found[:, 6:10] = rng.integers(-2, 6, (COUNT, 4))
    found[5, 0] = found[9, 4] = np.nan
    return found


@pytest.mark.slow_cases("loops", "copies", "places", "logs", "do_loops", "null_pointers")
@pytest.mark.parametrize("case", CASES)
def test_each_lane_does_what_the_text_does(case: str, tmp_path: Path) -> None:
    head = '#define EOMGEN_SHORT_NAMES\n#include <string.h>\n#include "eomgen_real.h"\n'
    scalar = compiled(tmp_path, "scalar", head + HEAD + CASES[case] + MAIN)
    lanes = '#define EOMGEN_SHORT_NAMES\n#include "eomgen_real.h"\n#include "eomgen_lanes.h"\n'
    both = compiled(tmp_path, "lanes", lanes + in_lanes(CASES[case]) + MAIN_OF_LANES, "-DEOMGEN_REAL_LANES")
    expected, found, untouched = samples(), samples(), samples()
    for library, data in ((scalar, expected), (both, found)):
        library.run(data.ctypes.data_as(ctypes.c_void_p), COUNT)
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
    ],
)
def test_what_lanes_cannot_follow_is_named_with_its_line(text: str, what: str) -> None:
    with pytest.raises(UntranslatableConstruct, match=rf"{what}.*\(stepper:\d+:\d+\)"):
        in_lanes(text)
