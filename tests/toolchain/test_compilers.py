"""The order of the search for a compiler, zig of the package ziglang, and the same digits by every compiler."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from eomgen.errors import ToolchainError
from eomgen.toolchain import compiler, doctor
from eomgen.toolchain.compiler import _variables, _zig_folder, find_compiler, zig_program
from tests.examples.covering import covering
from tests.toolchain.compilers import END, START, compilers, difference, examples, motions, rows_of, table
from tests.toolchain.fire import environment, script

ROOT = Path(__file__).parents[2]
OTHERS = [name for name in ("clang", "zig") if name in compilers()]


@pytest.fixture
def ziglang(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The program of a package ziglang, which is first on the path of modules."""
    package = tmp_path / "site" / "ziglang"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    monkeypatch.delitem(sys.modules, "ziglang", raising=False)
    return script(package / "zig", 'echo "clang version 99"')


def test_zig_is_the_last_of_all(ziglang: Path, tmp_path: Path) -> None:
    found = find_compiler({"PATH": ""})
    assert found.command == (str(ziglang), "cc", "-fno-sanitize=undefined") and found.path == ziglang and found.is_zig
    for name in ("clang", "gcc", "cc"):
        program = script(tmp_path / name, "exit 0")
        assert find_compiler({"PATH": str(tmp_path)}).path == program
        assert not find_compiler({"PATH": str(tmp_path)}).is_zig


def test_zig_by_cc_has_no_checks_of_wrapped_integers_either(ziglang: Path, tmp_path: Path) -> None:
    script(tmp_path / "python", "exit 0")
    found = find_compiler({"PATH": str(tmp_path), "CC": "python -m ziglang cc"})
    assert found.command == ("python", "-m", "ziglang", "cc", "-fno-sanitize=undefined")


def test_no_compiler_at_all_is_one_message_with_two_remedies(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ziglang", None)
    monkeypatch.setattr(compiler, "_system_command", lambda: "apt-get install -y gcc libc6-dev")
    with pytest.raises(ToolchainError) as caught:
        find_compiler({"PATH": ""})
    assert str(caught.value) == (
        "toolchain error: no C compiler found: looked for cc, gcc, clang on the path, in CC, and for the package"
        ' ziglang; try: apt-get install -y gcc libc6-dev, or pip install "eomgen[compiler]"'
    )


def test_the_doctor_says_which_compiler_why_and_how_long(ziglang: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", "")
    assert doctor._compiler().found == (
        f"zig, clang version 99 ({ziglang}), the first of cc, gcc, clang and the package ziglang"
    )
    times = iter([31.0, 0.31])
    monkeypatch.setattr(doctor, "_seconds_of_build", lambda: next(times))
    assert doctor._compiles().found == (
        "a small library builds and links in 0.31 s; zig took 31 s to make its C library for this machine, once"
    )


def test_zig_has_a_folder_without_one_of_the_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A service has no home folder, and zig would refuse to run; a home folder that is a file cannot be written."""
    command, name = ("/opt/zig", "cc"), "ZIG_GLOBAL_CACHE_DIR"
    (tmp_path / "file").touch()
    monkeypatch.delenv(name, raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "own"))
    monkeypatch.setenv("HOME", str(tmp_path))
    assert name not in _variables(command)
    for home in ("", str(tmp_path / "file")):
        monkeypatch.setenv("HOME", home)
        _zig_folder.cache_clear()
        assert _variables(command)[name] == str(tmp_path / "own" / "zig")
        assert name not in _variables(("gcc",))
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "file" / "cache"))
    _zig_folder.cache_clear()
    assert Path(_variables(command)[name]).is_dir()
    _zig_folder.cache_clear()
    monkeypatch.setenv(name, "/chosen")
    assert _variables(command)[name] == "/chosen"


@pytest.mark.slow
@pytest.mark.skipif(not OTHERS, reason="there is one compiler here")
@pytest.mark.parametrize("name", OTHERS)
def test_compilers_agree_on_a_loop_and_a_beam(name: str, tmp_path: Path) -> None:
    names, there = ["four_bar/scene.toml", "spin_up_beam/scene.toml"], compilers()
    first, other = (motions(names, there[kind], tmp_path) for kind in ("gcc", name))
    assert {example: difference(first[example], other[example]) for example in names} == dict.fromkeys(names, "")


@pytest.mark.long
@pytest.mark.skipif(not OTHERS, reason="there is one compiler here")
@pytest.mark.parametrize("name", OTHERS)
def test_compilers_agree_on_a_third_of_the_examples_that_have_every_feature(name: str, tmp_path: Path) -> None:
    """The page has all examples, which take five minutes."""
    there, names = compilers(), covering(examples())[::3]
    first, other = (motions(names, there[kind], tmp_path) for kind in ("gcc", name))
    assert {example: difference(first[example], other[example]) for example in names} == dict.fromkeys(names, "")


@pytest.mark.long
@pytest.mark.skipif(zig_program() is None, reason="the package ziglang is not installed")
def test_a_machine_with_zig_alone_builds_and_runs(tmp_path: Path) -> None:
    (tmp_path / "bin").mkdir()
    where = {name: text for name, text in environment(tmp_path, PATH=str(tmp_path / "bin")).items() if name != "CC"}
    run = [sys.executable, "-m", "eomgen", "simulate", str(ROOT / "examples" / "four_bar" / "scene.toml")]
    done = subprocess.run(
        [*run, "--t-end", "0.01", "--no-plots", "--profile", "quick", "--out", str(tmp_path / "out"), "-v"],
        env=where, cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip  # a command line
    assert done.returncode == 0, done.stderr
    assert "by clang version" in done.stderr


def test_rows_of_the_page_are_read_as_they_were_written() -> None:
    page = (ROOT / "docs" / "compilers.md").read_text(encoding="utf-8")
    lines = [line for line in page.partition(START)[2].partition(END)[0].splitlines() if line]
    rows = rows_of(lines)
    assert table(rows) == lines
    assert {cells[kind] for cells in rows.values() for kind in ("gcc", "clang", "zig")} == {"equal"}
    assert sorted(rows) == sorted(examples()), "python -m tests.toolchain.compilers docs/compilers.md EXAMPLE.toml"
