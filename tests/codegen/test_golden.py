"""The committed C of four scenes is, byte by byte, what eomgen writes today; a difference is shown, and how to accept
it."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.golden import ACCEPT, GENERATED, ROOT, SCENES, committed_files, difference, generated_files, strangers


@pytest.mark.parametrize("name", SCENES)
def test_generated_code_is_the_committed_code(name: str) -> None:
    diff = difference(name, committed_files(name), generated_files(name))
    assert not diff, f"\n{diff[:20_000]}\n{ACCEPT}"


def test_every_folder_belongs_to_a_scene() -> None:
    assert strangers() == []


@pytest.mark.slow
def test_hash_seeds_do_not_change_a_byte() -> None:
    text = "from tests.golden import generated_files; import hashlib, json; "
    text += (
        "print(hashlib.sha256(json.dumps(generated_files('spherical_pendulum'), sort_keys=True).encode()).hexdigest())"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "20261120", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", text]
    result = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=300)
    files = json.dumps(generated_files("spherical_pendulum"), sort_keys=True)
    assert result.stdout.strip() == hashlib.sha256(files.encode()).hexdigest()


@pytest.mark.parametrize("name", SCENES)
def test_committed_code_compiles_without_a_warning(name: str, tmp_path: Path) -> None:
    compiler = shutil.which("cc")
    assert compiler, "these tests need a C compiler called cc"
    sources = sorted(str(path) for path in (GENERATED / name).glob("*.c"))
    flags = ["-std=c99", "-O0", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    command = [compiler, *flags, *sources, "-o", str(tmp_path / "model"), "-lm"]
    result = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert result.returncode == 0, result.stderr


def test_difference_sees_line_endings_and_empty_files() -> None:
    assert difference("top", {"a.c": "x\n"}, {"a.c": "x\r\n"})
    assert "+++ generated/top/empty.h" in difference("top", {}, {"empty.h": ""})
