"""Each number of the first page is measured here, or stands in the page of measured data that its line links."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

import eomgen
from tests.anchors import measured_runs
from tests.anchors.runs import runs
from tests.benchmarks.test_error_estimates import COUNTED

ROOT = Path(__file__).parents[2]
LINES = dict(re.findall(r"^- \*\*([^*]+)\*\*:? (.*)$", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE))


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def test_the_site_has_the_same_lines() -> None:
    site, *words = (re.sub(r"\]\([^)]*\)", "]", text) for text in (page("index.md"), *LINES.values()))
    assert len(words) == 7 and [line for line in words if line not in site] == []


def test_the_same_bits_by_three_compilers_in_all_examples() -> None:
    rows = re.findall(r"^\| \w+/[\w/]+ \| (\w+) \| (\w+) \| (\w+) \|", page("compilers.md"), re.MULTILINE)
    equal = sum(set(row) == {"equal"} for row in rows)
    assert f"[{equal} of {len(rows)} examples](docs/compilers.md#digits)" in LINES["Same bits"]


@pytest.mark.slow
def test_the_four_bar_is_closed_after_many_steps() -> None:
    run = eomgen.build(ROOT / "examples/four_bar/scene.toml").simulate(100.0, 1e-3, error_estimate=False)
    assert run.stats["steps"] == 100_000
    assert f"{run.stats['max_constraint']:.1e} m after [100 000 steps]" in LINES["Closed loops are closed"]


@pytest.mark.parametrize(
    ("line", "work", "by", "number"),
    [
        ("A new robot", "Panda, 7 joints: from its URDF to a loaded library", "eomgen", "834 ms"),
        ("Fast in double", "Panda, 7 joints: inverse dynamics at 100 000 states", "eomgen", "30.6 ns"),
        ("Fast in double", "Panda, 7 joints: inverse dynamics, scalar C; a call", "eomgen", "90.7 ns"),
        ("Fast in double", "Panda, 7 joints: inverse dynamics, scalar C; a call", "Pinocchio > CasADi > C", "163 ns"),
    ],
)
def test_times_are_those_of_the_benchmarks(line: str, work: str, by: str, number: str) -> None:
    rows = page("benchmarks.md").rpartition(f"\n| {work}")[2]
    measured = re.search(rf"\| {re.escape(by)} \| ([\d.]+ \w+) ±", rows)
    assert measured and measured[1] == number and number in LINES[line]


def test_generated_c_has_fixed_buffers(tmp_path: Path) -> None:
    folder, source = ROOT / "generated" / "active_vehicle", tmp_path / "size.c"
    texts = [file.read_text(encoding="utf-8") for file in (ROOT / "generated").glob("*/*.[ch]")]
    assert len(texts) > 20 and not [
        text for text in texts if re.search(r"\b(?:malloc|calloc|realloc|alloca|free)\(", text)
    ]
    source.write_text(
        "#include <stdio.h>\n#include <active_vehicle.h>\n"
        'int main(void) { return printf("%zu", sizeof(active_vehicle_simulator)) < 0; }\n'
    )
    words = [shutil.which("cc") or "gcc", f"-I{folder}", str(source), "-o", str(tmp_path / "size")]
    subprocess.run(words, check=True)
    size = subprocess.run([str(tmp_path / "size")], check=True, capture_output=True, text=True).stdout
    assert f"[{int(size):,} bytes]".replace(",", " ") in LINES["No allocation"]


def test_stated_errors_of_random_scenes() -> None:
    right = sum(difference[0] <= 1e-4 for difference in measured_runs().values())
    assert f"[{right} of {len(runs())}](docs/verification.md)" in LINES["Stated errors"]
    all_runs = sum(COUNTED.values())
    assert f"[{all_runs} of {all_runs}](tests/benchmarks/test_error_estimates.py)" in LINES["Stated errors"]


def test_gradients_are_measured_by_a_benchmark() -> None:
    assert "3.7 runs](benchmarks/sensitivities.py)" in LINES["Gradients"]
    assert "3.7 times the run for a seven-axis arm with 24 parameters" in page("python/derivatives_of_a_run.md")
