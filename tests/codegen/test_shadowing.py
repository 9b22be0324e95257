"""Arguments, locals and counters of a C function have names of one space: nothing shadows."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

import eomgen
from eomgen.codegen.targets.c.naming import INNER, output_name
from eomgen.system.system import INPUT_BLOCKS
from eomgen.system.terms import TERMS

RATES = ("rates", "force_rates", "joint_brackets_rates", "link_brackets_rates", "coriolis_rates")
FLAGS = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wshadow", "-Werror", "-fsyntax-only")


def test_no_counter_is_an_argument() -> None:
    assert not {INNER, "i", "k", "w"} & {*INPUT_BLOCKS, *(block for term in TERMS.values() for block in term.inputs)}
    assert output_name(INNER, ()) == f"{INNER}_out"


@pytest.mark.long
def test_rates_of_equal_parts(tmp_path: Path) -> None:
    """Equal pendulums make loops within loops over the rates, where j is the rate of the acceleration."""
    size = 12
    scene = {
        "format": 1,
        "name": "row",
        "gravity": [0, 0, -9.81],
        "bodies": {
            f"b{k}": {"mass": 1.0, "inertia": [0.1, 0.2, 0.3], "center_of_mass": [0, 0, -0.2]} for k in range(size)
        },
        "joints": {
            f"j{k}": {"type": "spherical", "parent": f"b{k - 1}" if k else "base", "child": f"b{k}"}
            for k in range(size)
        },
        "points": {f"p{k}": {"body": f"b{k}", "position": [0.1, 0, -0.4]} for k in range(size)},
        "springs": {
            f"s{k}": {"first": f"p{k}", "second": f"p{(k + 3) % size}", "stiffness": 10.0, "length": 0.1}
            for k in range(size)
        },
    }
    eomgen.generate(scene, tmp_path / "c", terms=RATES)
    for source in sorted((tmp_path / "c").glob("*.c")):
        words = ["gcc", *FLAGS, f"-I{source.parent}", str(source)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert not done.returncode, f"{source.name}: {done.stderr[:2000]}"
