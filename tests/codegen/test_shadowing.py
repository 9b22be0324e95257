"""Arguments, locals and counters of a C function have names of one space: nothing shadows."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

import eomgen
from eomgen.codegen.targets.c.naming import INNER, output_name
from eomgen.errors import EomgenError
from eomgen.system.system import INPUT_BLOCKS
from eomgen.system.terms import TERMS

RATES = ("rates", "force_rates", "joint_brackets_rates", "link_brackets_rates", "coriolis_rates")
FLAGS = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wshadow", "-Werror", "-fsyntax-only")


def check(scene: Any, terms: Any, folder: Path) -> None:
    """Fail with the compiler's words unless the generated C of some terms passes without a warning."""
    eomgen.generate(scene, folder, terms=terms)
    for source in sorted(folder.glob("*.c")):
        done = subprocess.run(["gcc", *FLAGS, f"-I{folder}", str(source)], capture_output=True, text=True, check=False)
        assert not done.returncode, f"{source.name}: {done.stderr[:2000]}"


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
    check(scene, RATES, tmp_path / "c")


@pytest.mark.long
@pytest.mark.parametrize("path", sorted(Path("examples").glob("*/scene.toml")), ids=lambda path: path.parent.name)
def test_every_term_of_every_example(path: Path, tmp_path: Path) -> None:
    left = list(TERMS)
    while left:
        try:
            return check(path, left, tmp_path / "c")
        except EomgenError as error:
            named = [term for term in left if re.search(rf"(?<!\w){term}(?!\w)", str(error).split("try:")[0])]
            assert named, error
            left = [term for term in left if term not in named]
