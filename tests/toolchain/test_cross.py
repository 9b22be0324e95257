"""Files for other machines: the same digits under emulators, sizes of code, stacks; and refusals."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import struct
import subprocess
from pathlib import Path

import pytest

import eomgen
from eomgen.cli import main
from eomgen.toolchain import cross
from eomgen.toolchain.compiler import Compiler, find_compiler, zig_program
from eomgen.toolchain.cross import TARGETS, CrossBuild, code_bytes, cross_build, cross_target
from tests.models.library import scene_file

ROOT = Path(__file__).parents[2]
GENERATED = ROOT / "generated" / "spherical_pendulum"
needs_zig = pytest.mark.skipif(zig_program() is None, reason="the package ziglang is not installed")
#: Starts of files by machine: ELF with class and processor, MZ, Mach-O of 64 bits for arm64, WebAssembly 1.
STARTS = {
    "x86_64-linux": {0: b"\x7fELF\x02", 18: b"\x3e"},
    "aarch64-linux": {0: b"\x7fELF\x02", 18: b"\xb7"},
    "riscv64-linux": {0: b"\x7fELF\x02", 18: b"\xf3"},
    "x86_64-windows": {0: b"MZ"},
    "arm64-macos": {0: b"\xcf\xfa\xed\xfe\x0c\x00\x00\x01"},
    "wasm32": {0: b"\0asm\x01"},
    "cortex-m4": {0: b"\x7fELF\x01", 16: b"\x01\x00\x28"},
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(GENERATED, tmp_path / "c"))


def native(folder: Path) -> str:
    """Return the output of the program that the first compiler makes of a folder, by the command of its manifest."""
    command = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["compile"].split()
    subprocess.run([*find_compiler().command, *command[1:]], cwd=folder, check=True)
    return subprocess.run([folder / "spherical_pendulum"], check=True, capture_output=True, text=True).stdout


def test_an_unknown_machine_is_named_with_the_known_ones() -> None:
    with pytest.raises(
        eomgen.UsageError, match=r"--for: no machine is called 'aarch64'; try: .*known are x86_64-linux"
    ):
        cross_target("aarch64")


def test_without_zig_the_remedy_is_one_command(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.setattr(cross, "zig_program", lambda: None)
    with pytest.raises(eomgen.ToolchainError) as caught:
        cross_build(folder, "wasm32")
    assert "made by the package ziglang, which is not installed; try: " in str(caught.value)
    assert str(caught.value).endswith('try: pip install "eomgen[compiler]"')


def test_the_command_refuses_before_it_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = str(ROOT / "examples" / "four_bar" / "scene.toml")
    assert main(["generate", scene, "--out", str(tmp_path / "c"), "--for", "pdp11"]) == 2
    assert "no machine is called 'pdp11'" in capsys.readouterr().err
    assert main(["generate", scene, "--out", str(tmp_path / "c"), "--for", "wasm32", "--target", "casadi"]) == 2
    assert "--for: programs are made of C, not of casadi; try: --target c" in capsys.readouterr().err
    assert not (tmp_path / "c").exists()


@pytest.mark.skipif(shutil.which("size") is None, reason="binutils are not installed")
def test_code_is_counted_as_binutils_count_it(folder: Path) -> None:
    subprocess.run([*find_compiler().command, "-O2", "-c", "spherical_pendulum_step.c"], cwd=folder, check=True)
    data = (folder / "spherical_pendulum_step.o").read_bytes()
    listing = subprocess.run(
        ["size", "-A", "spherical_pendulum_step.o"], cwd=folder, check=True, capture_output=True, text=True
    ).stdout
    lines = [line.split() for line in listing.splitlines() if line.startswith(".text")]
    assert code_bytes(data) == sum(int(words[1]) for words in lines) > 1000
    with pytest.raises(ValueError, match="unknown format"):
        code_bytes(b"no object")


def object_file(kind: str, sections: list[tuple[int, int]]) -> bytes:
    """Return headers of an object file by its specification: sections by flags and size."""
    if kind.startswith("elf"):
        wide = kind == "elf64"
        header = bytearray(64 if wide else 52)
        header[:6] = b"\x7fELF" + bytes((1 + wide, 1))
        size, place = (64, 64) if wide else (40, 52)
        struct.pack_into("<Q" if wide else "<I", header, 40 if wide else 32, place)  # e_shoff
        struct.pack_into("<HH", header, 58 if wide else 46, size, len(sections))  # e_shentsize, e_shnum
        rows = [
            struct.pack("<IIQQQQIIQQ" if wide else "<IIIIIIIIII", 7, 1, flags, 0, 0, length, 0, 0, 0, 0)
            for flags, length in sections
        ]
        return bytes(header) + b"".join(rows)
    if kind == "coff":
        rows = [struct.pack("<8sIIIIIIHHI", b".text", 0, 0, length, 0, 0, 0, 0, 0, flags) for flags, length in sections]
        return struct.pack("<HHIIIHH", 0x8664, len(sections), 0, 0, 0, 0, 0) + b"".join(rows)
    rows = [
        struct.pack("<16s16sQQIIIIIIII", b"__text", b"__TEXT", 0, length, 0, 0, 0, 0, flags, 0, 0, 0)
        for flags, length in sections
    ]
    segment = struct.pack("<II16sQQQQIIII", 0x19, 72 + 80 * len(rows), b"", 0, 0, 0, 0, 7, 7, len(rows), 0)
    symbols = struct.pack("<IIIIII", 2, 24, 0, 0, 0, 0)
    commands = symbols + segment + b"".join(rows) + symbols
    return struct.pack("<IIIIIIII", 0xFEEDFACF, 0x0100000C, 0, 1, 3, len(commands), 0, 0) + commands


@pytest.mark.parametrize(
    ("kind", "code", "data"),
    [("elf64", 0x6, 0x3), ("elf32", 0x4, 0x10), ("coff", 0x60000020, 0xC0000040), ("mach-o", 0x80000400, 0x2)],
)
def test_code_of_each_format_is_counted(kind: str, code: int, data: int) -> None:
    assert code_bytes(object_file(kind, [(data, 7), (code, 1000), (code, 234), (data, 5000)])) == 1234
    assert code_bytes(object_file(kind, [(data, 9)])) == 0


def test_code_of_webassembly_is_counted() -> None:
    """Sizes are numbers of 7 bits a byte, the lowest first."""
    section = bytes((10, 0xB0, 0x09)) + bytes(0x30 + 128 * 9)
    other = bytes((1, 5)) + bytes(5)
    assert code_bytes(b"\0asm\1\0\0\0" + other + section + other + bytes((10, 3)) + bytes(3)) == 0x30 + 128 * 9 + 3


def test_the_deepest_chain_of_calls_and_the_sizes_of_all_objects(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    listing = (Path(__file__).parent / "calls.ll").read_text(encoding="utf-8")
    frames = {"step": 100, "mass": 40, "force": 500, "alone": 600, "main": 9000}
    commands: list[list[str]] = []

    def compiled(words: list[str], output: Path, location: str) -> str:
        commands.append(words)
        assert location == f"zig for wasm32, sources in {folder}"
        if "-emit-llvm" in words:
            output.write_text(listing, encoding="utf-8")
            return ""
        output.write_bytes(object_file("elf64", [(6, 1000)]) if "-c" in words else b"program")
        return "\n".join(
            f"x.c:1:6: warning: stack frame size ({size}) exceeds limit (0) in '{name}' [-Wframe-larger-than]"
            for name, size in frames.items()
        )

    monkeypatch.setattr(cross, "zig", lambda: Compiler(("zig", "cc"), Path("zig")))
    monkeypatch.setattr(cross, "run_compiler", compiled)
    made = cross_build(folder, "wasm32")
    assert (made.target, made.size, made.code, made.stack) == ("wasm32", len(b"program"), 2000, 640)
    assert made.file == folder.resolve() / "spherical_pendulum-wasm32.wasm"
    assert all(words[:4] == ["zig", "cc", "-target", "wasm32-wasi"] for words in commands)
    sources = [Path(word).name for words in commands[:-1] for word in words if word.endswith(".c")]
    assert sources == ["spherical_pendulum.c"] * 2 + ["spherical_pendulum_step.c"] * 2
    assert [Path(word).name for word in commands[-1] if word.endswith((".c", ".o"))] == [
        "main.c", "spherical_pendulum.o", "spherical_pendulum_step.o",
    ]  # fmt: skip  # a list
    assert commands[-1][-4:-2] == ["-s", "-lm"] and shlex.split(made.command) == commands[-1]
    assert {"-std=c99", "-O2", "-ffp-contract=off"} <= set(commands[0]) and "-Wframe-larger-than=0" in commands[0]


def test_other_folders_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cross, "zig", lambda: Compiler(("zig", "cc"), Path("zig")))
    for text in (None, "{}", "[]", "no JSON"):
        if text is not None:
            (tmp_path / "manifest.json").write_text(text, encoding="utf-8")
        with pytest.raises(eomgen.FileError, match="this is not a folder of eomgen's"):
            cross_build(tmp_path, "cortex-m4")


@needs_zig
@pytest.mark.slow
@pytest.mark.long_except("arm64-macos", "wasm32", "cortex-m4")  # zig makes a C library for each of the others
@pytest.mark.parametrize("name", TARGETS)
def test_a_file_is_for_its_machine_and_prints_the_same_digits(name: str, folder: Path) -> None:
    made = cross_build(folder, name)
    data = made.file.read_bytes()
    assert made.file.parent == folder.resolve() and made.size == len(data)
    assert all(data[place : place + len(text)] == text for place, text in STARTS[name].items())
    assert 5_000 < made.code < 60_000 and 200 < made.stack < 10_000
    target = cross_target(name)
    runner = [*target.runner] if target.runner and shutil.which(target.runner[0]) else []
    if name == "wasm32" and not runner and shutil.which("node"):
        from tests.toolchain.compilers import NODE  # of one target

        runner = [*NODE]
    if runner:
        done = subprocess.run([*runner, str(made.file)], capture_output=True, text=True, check=True)
        assert done.stdout.replace("\r\n", "\n") == native(folder)


def test_the_command_reports_code_stack_and_the_work_of_a_step(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cross, "zig", lambda: None)
    monkeypatch.setattr(cross, "cross_build", lambda folder, name: CrossBuild(name, folder / name, 9, 8, 7, "zig cc"))
    scene = scene_file(tmp_path, "oscillator", simulation__method="rosenbrock")
    words = ["generate", str(scene), "--out", str(tmp_path / "c"), "--for", "cortex-m4", "--for", "wasm32"]
    assert main([*words, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [list(item.values())[:4] for item in data["machines"]] == [
        [name, str(tmp_path / "c" / name), 9, 8] for name in ("cortex-m4", "wasm32")
    ]
    assert main(words) == 0
    total = data["step"]["total"]
    each = ", ".join(f"{total[key]} {key}" for key in ("additions", "multiplications", "divisions"))
    assert f"a step of rosenbrock: {each}" in capsys.readouterr().err and total["multiplications"] > 5
    assert main([*words, "--method", "rk4"]) == 0
    told = capsys.readouterr()
    assert re.search(r"\nwasm32 +wasm32 +9 +8 +7 ", told.out) and "deepest stack" in told.out
    assert "operations of each function that steps of rk4 call: forward_dynamics 1\n" in told.err
    assert main([*words, "--target", "python"]) == 2 and "programs are made of C" in capsys.readouterr().err
