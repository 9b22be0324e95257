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

#: Each has a function f(work) that changes work->x (6 numbers) and work->n (4 whole numbers).
HEAD = """
typedef struct work { real x[6]; long n[4]; struct { real high, low; } pair; } work;
"""
CASES = {
    "a loop whose condition stands behind it": """
static void f(work *w)
{
    int turns = 0, last = 0;
    do {
        ++turns;
        if (w->x[1] > K(2.0))
            break;
        w->x[1] = w->x[1] + fabs(w->x[2]) + K(0.1);
        if (turns == w->n[1])
            continue;
        w->x[2] = floor(w->x[2] * K(3.0)) / K(2.0) - K(0.25);
        last = turns >= w->n[0];
    } while (!last && w->x[0] > (real)turns - K(3.0));
    w->n[2] = turns;
    do {
        w->x[3] = w->x[3] + K(0.5);
        --turns;
    } while (0);
}
""",
    "entries of a log, each lane at a place of its own": """
typedef struct entry { long number; real at, state[2]; } entry;
static const char *const names[2] = { "one", "two" };
static const real *rows(const real *u, real *part) { (void)part; return u; }
static long note(work *w, entry *log, long *used)
{
    long place = -1;
    int i;
    if (w->x[0] > K(0.2) && *used < 3) {
        place = (*used)++;
        log[place].number = w->n[0];
        log[place].at = w->x[1];
        for (i = 0; i < 2; ++i)
            log[place].state[i] = w->x[2 + i];
    }
    return place;
}
static void f(work *w)
{
    entry log[3];
    long used = w->n[1] > 2, place = -1;
    int turn, i;
    const real *u = rows(NULL, w->x);
    memset(log, 0, sizeof log);
    for (turn = 0; turn < 3; ++turn) {
        place = note(w, log, &used);
        w->x[0] = w->x[0] - K(0.5);
        w->x[1] = w->x[1] + (u == NULL ? K(1.5) : u[turn]);
        if (place >= 0)
            log[place].at = log[place].at * K(2.0) + log[place].state[1];
    }
    for (turn = 0; turn < 3; ++turn)
        for (i = 0; i < 2; ++i)
            w->x[2 + i] = w->x[2 + i] + (real)(turn + 1) * log[turn].state[i] + log[turn].at;
    w->n[2] = used;
    w->n[3] = place < 0 ? log[0].number : log[place].number + 10 * place;
}
""",
    "a pointer that may be null": """
static void g(work *w, const real *u)
{
    int i;
    for (i = 0; i < 2; ++i) {
        const int held = u != NULL && u[i] == u[i];
        w->x[i] = held ? u[i] : K(0.5);
        if (w->n[i] > 1 || (held && u[i + 1] > w->x[2]))
            w->n[i] = 7;
    }
}
static void f(work *w)
{
    g(w, w->x + 3);
    g(w, NULL);
}
""",
    "sine and cosine into memory of the caller": """
static void f(work *w)
{
    if (w->x[0] > K(0.0))
        EG_SINCOS(w->x[1], &w->x[2], w->x + 3);
    if (w->x[4] > K(0.0))
        EG_SINCOS(w->x[5], &w->pair.high, &w->pair.low);
}
""",
    "choices": """
static void f(work *w)
{
    if (w->x[0] > K(0.0)) {
        w->x[1] = w->x[1] + K(1.0);
        if (w->x[2] < w->x[1])
            w->n[0] += 3;
        else
            w->n[1] = -w->n[1];
    } else if (w->x[3] > K(0.5) && w->x[4] > K(0.0)) {
        w->x[5] = w->x[2] > w->x[3] || w->n[2] > 0 ? K(2.0) * w->x[4] : -w->x[4];
    } else {
        w->x[0] = K(7.0);
    }
    w->n[3] = (w->x[0] > K(1.0)) + 2 * !(w->n[0] > 1);
}
""",
    "a choice by a common number, whose cases run on, into memory of the caller": """
static void sums(int k, const real *x, real *out)
{
    real sum = K(0.5);
    switch (k) {
    case 4: sum = sum + x[3];
    case 3: sum = sum + x[2] * K(2.0);
    case 2: sum = sum * x[1];
    default: ;
    }
    out[0] = sum + x[0];
}
static void f(work *w)
{
    int k;
    for (k = 1; k < 6; ++k) {
        real part[2];
        sums(k, w->x, part);
        w->x[5] = w->x[5] + part[0];
    }
    if (w->x[1] > K(0.5)) {
        real part[1];
        sums(3, w->x, part);
        w->x[4] = part[0];
    }
}
""",
    "memory of the caller in which lanes that are not there have numbers": """
static void change(const real *x, real *out)
{
    out[0] = out[0] + x[1];
    if (x[3] > K(0.0))
        out[1] = x[2];
}
static void filled(const real *x, real *out) { change(x, out); }
static void f(work *w)
{
    real kept[2];
    kept[0] = w->x[0];
    kept[1] = w->x[1];
    filled(w->x, kept);
    if (w->x[2] > K(0.1))
        filled(w->x + 2, kept);
    w->x[3] = kept[0];
    w->x[4] = kept[1];
}
""",
    "loops": """
static int steps(real start, real end, work *w)
{
    int count;
    for (count = 0; start < end; ++count) {
        if (w->n[0] == count)
            continue;
        start = start + K(0.25);
        if (count > 5)
            break;
        w->x[count % 3] = w->x[count % 3] + start;
    }
    return count;
}
static void f(work *w)
{
    int i, j;
    real sum = K(0.0);
    w->n[1] = steps(w->x[3], w->x[4], w);
    for (i = 0; i < 4 && sum < K(2.0); ++i)
        for (j = 0; j <= i; ++j) {
            if (w->x[j] > K(1.5))
                break;
            sum = sum + w->x[i] * w->x[j];
        }
    w->x[5] = sum;
    while (w->n[2] > 1 && w->x[0] < K(3.0)) {
        w->n[2] = w->n[2] / 2;
        w->x[0] = w->x[0] + K(0.5);
    }
}
""",
    "returns": """
static int root(real x, real *y)
{
    if (!(x >= K(0.0)))
        return 2;
    *y = EG_SQRT(x);
    if (*y > K(1.0))
        return 1;
    *y = K(1.0) - *y;
    return 0;
}
static real larger(real x, real y) { return x > y ? x : y; }
static void f(work *w)
{
    const int status = root(w->x[0], &w->x[1]);
    int i;
    w->n[0] = status;
    if (status == 2)
        return;
    for (i = 0; i < 3; ++i) {
        if (w->x[2 + i] < K(-1.0))
            return;
        w->x[2 + i] = larger(w->x[2 + i], w->x[1]);
        if (root(w->x[2 + i], &w->pair.high) == 0 && root(w->pair.high, &w->pair.low) != 1)
            w->n[1] = w->n[1] + 1;
    }
    w->n[2] = 100;
}
""",
    "places": """
static const int order[4] = { 2, 0, 3, 1 };
static const real share[3] = { K(0.25), -K(0.5), 1.0 };
static void f(work *w)
{
    int i, best = 0, count = 0, found[4];
    real y[6];
    for (i = 1; i < 6; ++i)
        if (EG_ABS(w->x[i]) > EG_ABS(w->x[best]))
            best = i;
    for (i = 0; i < 4; ++i) {
        found[i] = 0;
        if (w->x[order[i]] > K(0.0))
            found[count++] = order[i];
    }
    memcpy(y, w->x, sizeof y);
    w->x[best] = w->x[0];
    w->x[0] = y[best] * K(share[1]);
    w->n[3] = count;
    w->n[0] = found[count > 0 ? count - 1 : 0];
    if (best > 2)
        memcpy(w->x + 1, y + 2, 2 * sizeof *y);
    w->x[5] = w->x[found[0]] + share[best % 3];
}
""",
    "copies": """
static void fill(work *w, const real *from, int much)
{
    if (much)
        memset(w->x + 3, 0, 2 * sizeof *w->x);
    memcpy(w->x, from, 2 * sizeof *from);
}
static void f(work *w)
{
    work before = *w, next = *w;
    const real *origin = NULL;
    if (w->x[0] > K(0.0)) {
        const real half = next.x[4] = next.x[4] * K(0.5);
        next.x[1] = half + K(3.0);
        fill(&next, next.x + 2, next.n[0] > 0);
        *w = next;
    } else if (w->x[1] > K(0.0)) {
        w->pair = before.pair;
        w->pair.low = w->pair.high = K(4.0);
    }
    w->n[2] = memcmp(before.x, w->x, sizeof before.x) == 0;
    if (origin != NULL)
        w->x[0] = origin[0];
    w->n[3] = (long)(w->x[5] * K(10.0));
    w->x[4] = (real)w->n[3] - K(0.5);
}
""",
}
MAIN = """
int count(void) { return (int)(sizeof(work) / sizeof(real)); }
void run(double *flat, int samples)
{
    int s, i;
    for (s = 0; s < samples; ++s) {
        work w;
        for (i = 0; i < 6; ++i)
            w.x[i] = flat[s * 12 + i];
        for (i = 0; i < 4; ++i)
            w.n[i] = (long)flat[s * 12 + 6 + i];
        w.pair.high = flat[s * 12 + 10];
        w.pair.low = flat[s * 12 + 11];
        f(&w);
        for (i = 0; i < 6; ++i)
            flat[s * 12 + i] = w.x[i];
        for (i = 0; i < 4; ++i)
            flat[s * 12 + 6 + i] = (double)w.n[i];
        flat[s * 12 + 10] = w.pair.high;
        flat[s * 12 + 11] = w.pair.low;
    }
}
"""
MAIN_OF_LANES = """
void run(double *flat, int samples)
{
    int s, i, lane;
    for (s = 0; s < samples; s += EG_LANES) {
        work w;
        eg_wholes here = EG_WHOLES(0);
        for (lane = 0; lane < EG_LANES; ++lane) {
            const double *row = flat + (s + lane) * 12;
            here[lane] = (s + lane) % 7 == 3 ? 0 : -1;
            for (i = 0; i < 6; ++i)
                w.x[i][lane] = row[i];
            for (i = 0; i < 4; ++i)
                w.n[i][lane] = (long)row[6 + i];
            w.pair.high[lane] = row[10];
            w.pair.low[lane] = row[11];
        }
        f(here, &w);
        for (lane = 0; lane < EG_LANES; ++lane) {
            double *row = flat + (s + lane) * 12;
            for (i = 0; i < 6; ++i)
                row[i] = w.x[i][lane];
            for (i = 0; i < 4; ++i)
                row[6 + i] = (double)w.n[i][lane];
            row[10] = w.pair.high[lane];
            row[11] = w.pair.low[lane];
        }
    }
}
"""
NUMBERS = "typedef double eomgen_real;\n#ifdef EOMGEN_SHORT_NAMES\ntypedef double real;\n#endif\n"


def compiled(folder: Path, name: str, text: str, *flags: str) -> ctypes.CDLL:
    real = environment().get_template("c/model/eomgen_real.h.jinja").render()
    (folder / "eomgen_real.h").write_text(real, encoding="utf-8")
    (folder / "eomgen_lanes.h").write_text(
        environment().get_template("ensembles/lanes.h.jinja").render(), encoding="utf-8"
    )
    source = folder / f"{name}.c"
    source.write_text(text, encoding="utf-8")
    command = [
        *find_compiler().command,
        "-std=c99",
        "-O1",
        "-ffp-contract=off",
        "-fPIC",
        "-shared",
        "-Wno-psabi",
        *flags,
    ]
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


@pytest.mark.long_cases("loops", "copies", "places")
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
