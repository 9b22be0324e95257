"""What the doctor prescribes, taken: the command is run in a shell, and then the item is fine."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from eomgen.toolchain import doctor
from eomgen.toolchain.compiler import find_compiler
from eomgen.toolchain.doctor import ToolchainCheck, examine
from tests.toolchain.fire import environment, script

PYTHON = sys.executable


def told(shell: str, where: dict[str, str]) -> dict[str, ToolchainCheck]:
    """Return the checks of ``eomgen doctor --json`` after commands of a shell."""
    words = ["/bin/sh", "-c", f'{shell}\n"{PYTHON}" -m eomgen doctor --json']
    done = subprocess.run(words, env=where, capture_output=True, text=True, check=False, timeout=120)
    assert "Traceback" not in done.stderr
    return {item["name"]: ToolchainCheck(**item) for item in json.loads(done.stdout)}


def assert_mended(name: str, where: dict[str, str], what: str, remedy: str) -> None:
    """Assert what is found wrong with an item, what is prescribed, and that it helps."""
    ill = told("", where)[name]
    assert not ill.ok and re.search(what, ill.found), ill
    assert ill.remedy == remedy
    assert told(ill.remedy, where)[name].ok


def test_this_machine_is_sound() -> None:
    checks = examine()
    assert [check.name for check in checks][:7] == [
        "python", "temporary files", "compiler", "compiles", "Python.h", "cache", "room",
    ]  # fmt: skip  # names
    assert [check for check in checks if not check.ok] == []
    assert find_compiler().version in {check.name: check for check in checks}["compiler"].found


#: Item of the doctor, changes of the environment (None takes a variable away), what is found, and the remedy.
ILLS: list[tuple[str, dict[str, str | None], str, str]] = [
    ("compiler", {"CC": "gcc 'x"}, "cannot be read: No closing quotation", "unset CC"),
    ("compiles", {"CC": "{folder}/broken"}, "no luck", "unset CC"),
    (
        "cache",
        {"EOMGEN_CACHE": "{folder}/the cache"},
        "the cache cannot be written: Not a directory",
        "mv '{folder}/the cache' '{folder}/the cache'.old",
    ),
    (
        "cache",
        {"EOMGEN_CACHE": "{folder}/open"},
        "{folder}/open can be written by everyone, and its libraries are run",
        "chmod go-w {folder}/open",
    ),
    (
        "cache",
        {"EOMGEN_CACHE": None, "XDG_CACHE_HOME": "/proc/nowhere", "HOME": "{folder}"},
        "cannot be written",
        'export EOMGEN_CACHE="$HOME/eomgen-cache"',
    ),
    ("cache", {"EOMGEN_CACHE": "~no_such_user"}, "'~no_such_user' cannot be found", "unset EOMGEN_CACHE"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "variables", "what", "remedy"), ILLS)
def test_what_is_ill_is_mended_by_what_is_prescribed(
    name: str, variables: dict[str, str | None], what: str, remedy: str, tmp_path: Path
) -> None:
    script(tmp_path / "broken", "echo no luck >&2; exit 1")
    (tmp_path / "the cache").write_text("mine", encoding="utf-8")
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    where: dict[str, str] = environment(tmp_path / "cache")
    for variable, value in variables.items():
        where.pop(variable, None)
        if value is not None:
            where[variable] = value.replace("{folder}", str(tmp_path))
    assert_mended(name, where, what.replace("{folder}", str(tmp_path)), remedy.replace("{folder}", str(tmp_path)))
    assert any(file.is_file() and file.read_text(encoding="utf-8") == "mine" for file in tmp_path.glob("the cache*"))


def test_the_findings_have_their_remedies_in_this_process_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same ills as of ``ILLS``, without a shell for each."""
    script(tmp_path / "broken", "echo no luck >&2; exit 1")
    (tmp_path / "the cache").write_text("mine", encoding="utf-8")
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    checks = {"compiler": doctor._compiler, "compiles": doctor._compiles, "cache": doctor._cache}
    for name, variables, what, remedy in ILLS:
        with monkeypatch.context() as patch:
            for variable, value in variables.items():
                if value is None:
                    patch.delenv(variable, raising=False)
                else:
                    patch.setenv(variable, value.replace("{folder}", str(tmp_path)))
            ill = checks[name]()
        assert (ill.name, ill.ok, ill.needed) == (name, False, name != "cache" or "cannot be found" in what)
        assert what.replace("{folder}", str(tmp_path)) in ill.found
        assert ill.remedy == remedy.replace("{folder}", str(tmp_path))


@pytest.mark.parametrize("chosen", [True, False])
def test_full_disks_and_temporary_folders(chosen: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    for variable, value in (("EOMGEN_CACHE", str(tmp_path / "not" / "yet")), ("TMPDIR", str(tmp_path))):
        if chosen:
            monkeypatch.setenv(variable, value)
        else:
            monkeypatch.delenv(variable, raising=False)
    fine = doctor._room()
    monkeypatch.setattr(doctor.shutil, "disk_usage", lambda folder: shutil._ntuple_diskusage(9, 9, doctor.ROOM - 1))
    full = doctor._room()
    assert (fine.ok, fine.remedy, full.ok, full.needed) == (True, "", False, False)
    assert full.found == f"50 MB free for the cache in {tmp_path}"
    assert full.remedy == ("unset EOMGEN_CACHE" if chosen else "export EOMGEN_CACHE=/var/tmp/eomgen-cache")

    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    assert doctor._temporary().ok
    monkeypatch.setattr(doctor.tempfile, "TemporaryFile", refuse)
    ill = doctor._temporary()
    others = [name for name in ("TEMP", "TMP") if os.environ.get(name)]
    assert (ill.ok, ill.found) == (False, "No space left on device")
    folder = f"unset {others[0]}" if others else 'mkdir -p "$HOME/tmp" && export TMPDIR="$HOME/tmp"'
    assert ill.remedy == ("unset TMPDIR" if chosen else folder)
    assert doctor._run_check(refuse) == ToolchainCheck(
        "refuse", False, str(OSError(28, "No space left on device")), "see the message"
    )


@pytest.mark.slow
def test_no_compiler_at_all(tmp_path: Path) -> None:
    """On a path that holds the package manager only. Its command is run as a rehearsal: tests do not change
    machines."""
    tools = tmp_path / "bin"
    tools.mkdir()
    manager = shutil.which("apt-get")
    (tools / "apt-get").symlink_to(manager or "/bin/true")
    where = {name: text for name, text in environment(tmp_path, PATH=str(tools)).items() if name != "CC"}
    (tmp_path / "sitecustomize.py").write_text('import sys\nsys.modules["ziglang"] = None\n', encoding="utf-8")
    where["PYTHONPATH"] = f"{tmp_path}{os.pathsep}{where['PYTHONPATH']}"
    ill = told("", where)["compiler"]
    install = "apt-get install -y gcc libc6-dev"
    words = "no C compiler found: looked for cc, gcc, clang on the path, in CC, and for the package ziglang"
    assert ill.found == words
    assert ill.remedy == (install if os.geteuid() == 0 else f"sudo {install}")
    if manager is not None:
        rehearsal = subprocess.run([*install.split(), "--simulate"], capture_output=True, text=True, check=False)
        assert rehearsal.returncode == 0, rehearsal.stderr


def test_a_cache_that_its_owner_has_locked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "cache"
    folder.mkdir(mode=0o500)
    monkeypatch.setenv("EOMGEN_CACHE", str(folder))
    # root may
    monkeypatch.setattr(doctor, "refusal", lambda path: "" if path.stat().st_mode & 0o200 else "Permission denied")
    ill = doctor._cache()
    assert ill.remedy == f"chmod u+rwx {folder}"
    subprocess.run(["/bin/sh", "-c", ill.remedy], check=True)
    assert doctor._cache().ok


@pytest.mark.slow
def test_no_place_for_temporary_files(tmp_path: Path) -> None:
    blocked = (
        "import tempfile; tempfile._candidate_tempdir_list = lambda: ['/proc/nowhere'] if 'TMPDIR' in os.environ else"
        " ['.']"
    )
    (tmp_path / "sitecustomize.py").write_text(f"import os; {blocked}\n", encoding="utf-8")
    where = environment(tmp_path / "cache", TMPDIR="/proc/nowhere")
    where["PYTHONPATH"] = f"{tmp_path}{os.pathsep}{where['PYTHONPATH']}"
    assert_mended("temporary files", where, "No usable temporary directory", "unset TMPDIR")


def test_a_package_whose_files_are_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor.importlib.util, "find_spec", lambda name: None)
    ill = doctor._package("cffi")
    assert not ill.ok and ill.found.endswith("is recorded, but its files are gone")
    assert ill.remedy == f"{PYTHON} -m pip install --force-reinstall cffi"


def test_headers_that_are_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "python_headers", lambda: None)
    monkeypatch.setattr(doctor.sys, "base_prefix", "/usr")
    ill = doctor._headers()
    assert not ill.ok and not ill.needed and "ABI mode" in ill.found
    assert ill.remedy.endswith("apt-get install -y python3-dev") or not shutil.which("apt-get")
    monkeypatch.setattr(doctor.sys, "base_prefix", "/opt/python")
    assert doctor._headers().remedy == "the headers of this Python, from where it was installed"
    monkeypatch.setattr(doctor.sys, "platform", "win32")
    fine = doctor._headers()
    assert fine.ok and not fine.needed and fine.found == "not used on Windows, whose models are loaded in ABI mode"


def test_a_disk_with_little_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "not" / "yet"))
    monkeypatch.setattr(doctor.shutil, "disk_usage", lambda folder: SimpleNamespace(free=2_500_000))
    told = doctor._room()
    assert (told.found, told.remedy) == (f"2 MB free for the cache in {tmp_path}", "unset EOMGEN_CACHE") and not told.ok
    monkeypatch.setattr(doctor, "ROOM", 2_500_000)
    assert doctor._room().ok


def test_packages_that_are_not_installed_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    ill = doctor._package("no-such-distribution-of-eomgen")
    assert (ill.ok, ill.found) == (False, "not installed")
    assert ill.remedy == f"{PYTHON} -m pip install no-such-distribution-of-eomgen"
    monkeypatch.setattr(doctor, "version", lambda name: "1.2.3")
    assert doctor._package("sympy") == ToolchainCheck("sympy", True, "1.2.3")
