"""Passes of the compiler that generated C does without: the same bits as of -O2, in less time."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.errors import ToolchainError
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build_in
from eomgen.toolchain import profiles
from eomgen.toolchain.cache import Cache
from eomgen.toolchain.compiler import find_compiler
from eomgen.toolchain.profiles import (
    OF_ELIMINATION,
    OF_STRAIGHT,
    PROFILES,
    passes_for,
    without_slow_passes,
)
from tests.toolchain.test_builder import FILES, build

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    ("version", "changed"),
    [
        ("cc (Debian 12.2.0-14+deb12u1) 12.2.0", True),
        ("x86_64-linux-gnu-gcc-14 (Ubuntu 14.2.0-4ubuntu2) 14.2.0", True),
        ("gcc (Ubuntu 11.4.0-1ubuntu1~22.04) 11.4.0", False),  # -O2 without vectors of loops
        ("Apple clang version 15.0.0 (clang-1500.3.9.4)", False),
        ("unknown version", False),
    ],
)
def test_only_compilers_with_these_passes_are_called_without_them(version: str, changed: bool) -> None:
    for profile in PROFILES.values():
        flags = without_slow_passes(profile.flags, version)
        assert ("-O2" not in flags and "-O1" in flags) == (changed and "-O2" in profile.flags)
        assert [flag for flag in flags if flag in profile.flags] == [f for f in profile.flags if f in flags]
        assert set(profile.flags) - set(flags) <= {"-O2"}


@pytest.mark.parametrize(
    ("version", "machine", "changed"),
    [
        ("cc (Debian 12.2.0-14+deb12u1) 12.2.0", "x86_64", True),
        ("cc (Debian 12.2.0-14+deb12u1) 12.2.0", "aarch64", False),
        ("gcc (GCC) 15.1.1 20250425", "x86_64", False),  # may name the pass otherwise
        ("gcc (Ubuntu 11.4.0-1ubuntu1~22.04) 11.4.0", "x86_64", False),
    ],
)
def test_passes_with_names_of_some_versions_are_left_out_by_these_alone(
    version: str, machine: str, changed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(profiles.platform, "machine", lambda: machine)
    flags = PROFILES["fast"].flags
    plain, fewer = without_slow_passes(flags, version), without_slow_passes(flags, version, OF_STRAIGHT)
    assert set(fewer) - set(plain) == (set(OF_STRAIGHT) if changed else set())


def test_short_sources_are_compiled_with_all_passes() -> None:
    flags, version = PROFILES["fast"].flags, "cc (Debian 12.2.0-14+deb12u1) 12.2.0"
    assert passes_for("x" * 130_000, flags, version) == flags
    assert passes_for("x" * 130_001, flags, version) == without_slow_passes(flags, version) != flags
    assert passes_for("x" * 60_000, flags, version, loops=True) == flags
    assert passes_for("x" * 60_001, flags, version, loops=True) == without_slow_passes(flags, version)


def _bits(model: Model) -> tuple[dict[str, bytes], Array]:
    """Return the bytes of some functions at a random state, and the states of some steps."""
    random = np.random.default_rng(1)
    q, v, a = model.initial_q + 0.0, random.normal(size=model.nv), random.normal(size=model.nv)
    held = {"multipliers": random.normal(size=len(model.multipliers))} if model.multipliers else {}
    bits = {}
    for name in ("residual", "partials", "iteration", "equations", "mass"):
        if name in model.functions:
            values = model.evaluate(name, q, v=v, a=a, t=0.3, **held)
            bits[name] = b"".join(np.asarray(value).tobytes() for value in values.values())
    solution = model.simulate(50 * model.description.simulation.step, error_estimate=False)
    return bits, np.hstack([solution.q, solution.v])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "profile"), [("quarter_car", "fast"), ("four_bar", "reproducible"), ("elastic_slider_crank", "fast")]
)
def test_the_bits_are_as_of_all_passes(
    example: str, profile: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = EXAMPLES / example / "scene.toml"
    monkeypatch.setattr(profiles, "_LONG", 0)  # as if these sources were long
    monkeypatch.setattr(profiles, "_WITHOUT_SLOW_PASSES", (*profiles._WITHOUT_SLOW_PASSES, *OF_ELIMINATION))
    few, run = _bits(build_in(tmp_path / "few", scene, method="generalized_alpha", profile=profile))
    monkeypatch.setattr(profiles, "_WITHOUT_SLOW_PASSES", ("-O2",))
    every, run_of_every = _bits(build_in(tmp_path / "every", scene, method="generalized_alpha", profile=profile))
    assert few == every
    assert "residual" in few
    # in steppers other products may be fused with sums
    assert np.abs(run - run_of_every).max() <= 1e-13 * np.abs(run_of_every).max() > 0.0


@pytest.mark.slow
def test_the_fault_of_one_of_several_files_is_reported_with_its_command_and_place(tmp_path: Path) -> None:
    """The other compilers run at the same time, and one of them is ended."""
    slow = "\n".join(f"double f{k}(double x) {{ return x * {k}.0; }}" for k in range(400))
    files = FILES | {"model_2.c": slow, "model_3.c": "int broken(void) { return missing; }\n"}
    with pytest.raises(ToolchainError) as caught:
        build(tmp_path, files=files)
    [problem] = caught.value.problems
    key = next((Cache(tmp_path).folder / "failed").iterdir()).name
    assert problem.where == f"C compiler, sources kept in {Cache(tmp_path).failed_folder(key)}"
    assert str(find_compiler().path) in problem.what
    assert "model_3.c -o" in problem.what
    assert "ended with status 1 and said:" in problem.what
    assert "model_3.c:1:" in problem.what
    assert "'missing' undeclared" in problem.what
    assert "model_2.c" not in problem.what
    assert problem.hint.startswith("eomgen doctor")


@pytest.mark.parametrize("flag", ["-O1", "-O2"])
def test_no_compiler_leaves_out_the_call_of_a_part_that_stores_by_a_loop(flag: str, tmp_path: Path) -> None:
    source, header = Path(__file__).with_name("lost_part.c"), Path(__file__).parents[2] / "generated" / "bouncing_ball"
    results = []
    for optimised in ("-O0", flag):
        library = tmp_path / f"part{optimised}.so"
        options = ("-ffp-contract=off", "-shared", "-fPIC", f"-I{header}")
        command = [*find_compiler().command, optimised, *options, str(source)]
        subprocess.run([*command, "-o", str(library), "-lm"], check=True)
        workspace = np.random.default_rng(1).normal(size=4000)
        ctypes.CDLL(str(library)).whole(workspace.ctypes.data_as(ctypes.POINTER(ctypes.c_double)))
        results.append(workspace)
    changed = results[0] != np.random.default_rng(1).normal(size=4000)
    assert np.count_nonzero(changed) == 18
    assert results[0].tobytes() == results[1].tobytes()
