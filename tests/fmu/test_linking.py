"""Sources of FMUs: two models in one program, many instances on threads, sanitizers, and other builders."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import fmpy
import fmpy.build
import numpy as np
import pytest

import eomgen
from eomgen.base.files import template_folder
from eomgen.products.fmu.binary import this_machine
from tests.fmu.importers import run, written

SCENES = Path(__file__).parents[2] / "examples" / "coupled_fmus" / "scenes"
#: Programs of both models, by the version of FMI.
MAINS = {3: Path(__file__).with_name("two_models.c"), 2: Path(__file__).with_name("two_models_fmi2.c")}
HEADERS = template_folder() / "fmu"


@cache
def file_of(name: str, version: int) -> Path:
    return written(SCENES / f"{name}.toml", version)


def unpacked(name: str, version: int, folder: Path) -> Path:
    """Return the folder of an FMU."""
    target = folder / f"{name}_{version}"
    with zipfile.ZipFile(file_of(name, version)) as archive:
        archive.extractall(target)
    return target


def compiled(words: Sequence[str | Path]) -> None:
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


def definitions(name: str, folder: Path) -> list[str]:
    """Return macros with the value references and the token of a model."""
    description = fmpy.read_model_description(str(folder))
    upper = name.upper()
    wanted = ("angle", "speed", "torque", "command")
    references = {item.name: item.valueReference for item in description.modelVariables if item.name in wanted}
    macros = [f"-D{upper}_{variable.upper()}={reference}" for variable, reference in references.items()]
    return [*macros, f'-D{upper}_TOKEN="{description.guid}"']


def program(folder: Path, flags: Sequence[str], version: int = 3) -> Path:
    """Return a program of both models."""
    flags = [*flags, "-DEOMGEN_FMU_STATIC"] if version == 2 else flags
    headers = HEADERS / f"fmi{version}"
    objects: list[Path] = []
    macros: list[str] = []
    for name in ("plant", "controller"):
        sources = unpacked(name, version, folder) / "sources"
        macros += definitions(name, sources.parent)
        for source in sorted(sources.glob("*.c")):
            objects.append(folder / f"{name}_{source.stem}.o")
            includes = ["-I", sources, "-I", headers]
            words = ["cc", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *flags, "-c"]
            compiled([*words, *includes, source, "-o", objects[-1]])
    words = ["cc", "-std=c99", "-D_POSIX_C_SOURCE=200809L", "-pthread", *flags, *macros, "-I", headers]
    target = folder / "both"
    compiled([*words, MAINS[version], *objects, "-o", target, "-lm"])
    return target


@pytest.mark.long
def test_two_models_link_into_one_program_whose_instances_run_on_threads(tmp_path: Path) -> None:
    angles = list[float]()
    for version in (3, 2):
        (tmp_path / str(version)).mkdir()
        both = program(tmp_path / str(version), ["-O1"], version)
        symbols = subprocess.run(["nm", "-g", both], capture_output=True, text=True, check=True).stdout
        named = {line.split()[-1] for line in symbols.splitlines() if " T " in line}
        assert {f"plant_fmi{version}DoStep", f"controller_fmi{version}DoStep"} <= named
        assert not [name for name in named if name.startswith("fmi")]
        done = subprocess.run([both], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")
        angles.append(float(done.stdout))
    assert angles[0] == angles[1] > 0.0


@pytest.mark.long
def test_sanitizers_and_valgrind_have_no_findings(tmp_path: Path) -> None:
    for version in (2, 3):
        (tmp_path / str(version)).mkdir()
        flags = ["-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
        checked = program(tmp_path / str(version), flags, version)
        done = subprocess.run([checked], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")
    if shutil.which("valgrind") is not None:
        (tmp_path / "plain").mkdir()
        plain = program(tmp_path / "plain", ["-O1", "-g"])
        words = ["valgrind", "--error-exitcode=9", "--leak-check=full", "-q", str(plain)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


def rebuilt_by_fmpy(folder: Path) -> None:
    fmpy.build.build_platform_binary(folder, configuration="Debug")


def rebuilt_by_bd2cmake(folder: Path) -> None:
    words = [sys.executable, "-m", "fmi_bd2cmake.cli", "-i", "sources/buildDescription.xml", "-o", "CMakeLists.txt"]
    subprocess.run(words, cwd=folder, check=True, capture_output=True)
    shutil.rmtree(folder / "binaries", ignore_errors=True)
    for command in (["-B", "build", f"-DFMI_HEADERS_DIR={HEADERS / 'fmi3'}", "."], ["--build", "build"]):
        done = subprocess.run(["cmake", *command], cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    made = next(folder.rglob("*.so"))
    target = folder / "binaries" / "x86_64-linux"
    target.mkdir(parents=True, exist_ok=True)
    if made.parent != target:
        shutil.copy(made, target / made.name)


@pytest.mark.long_except_every(2)
@pytest.mark.slow
@pytest.mark.parametrize(("version", "builder"), [(2, rebuilt_by_fmpy), (3, rebuilt_by_fmpy), (3, rebuilt_by_bd2cmake)])
def test_builders_make_libraries_with_the_same_bits(version: int, builder: object, tmp_path: Path) -> None:
    folder = unpacked("plant", version, tmp_path)
    shutil.rmtree(folder / "binaries")
    (folder / "binaries").mkdir()
    assert callable(builder)
    builder(folder)
    signals = np.array([(0.0, 0.2), (1.0, 0.2)], dtype=[("time", float), ("torque", float)])
    rows = [
        run(file, "CoSimulation", 0.05, 1e-3, input=signals, output=["angle", "speed"])
        for file in (folder, file_of("plant", version))
    ]
    assert np.array_equal(rows[0], rows[1]) and eomgen.load(SCENES / "plant.toml").name == "plant"


@pytest.mark.long
@pytest.mark.parametrize(
    ("machine", "begin"),
    [
        ("x86_64-windows", b"MZ"),
        ("aarch64-linux", b"\x7fELF\x02\x01\x01"),
        ("aarch64-darwin", b"\xcf\xfa\xed\xfe"),
    ],
)
def test_zig_makes_libraries_for_other_machines(machine: str, begin: bytes) -> None:
    pytest.importorskip("ziglang")
    file = written(SCENES / "plant.toml", 3, binary=False, machines=[machine])
    with zipfile.ZipFile(file) as archive:
        (name,) = [name for name in archive.namelist() if name.startswith("binaries/")]
        assert name.startswith(f"binaries/{machine}/plant.") and archive.read(name).startswith(begin)


def test_machines_are_named() -> None:
    with pytest.raises(eomgen.UsageError, match=r"no machine is called 'arm-windows'; try: one of x86_64-linux"):
        eomgen.fmu(SCENES / "plant.toml", "unwritten.fmu", machines=["arm-windows"])
    with pytest.raises(eomgen.UsageError, match=r"FMI 2\.0 names x86 machines alone"):
        eomgen.fmu(SCENES / "plant.toml", "unwritten.fmu", version=2, machines=["aarch64-linux"])


@pytest.mark.parametrize(
    ("system", "processor", "name"),
    [("linux", "aarch64", "aarch64-linux"), ("darwin", "arm64", "aarch64-darwin")],
)
def test_fmi2_has_no_folder_for_libraries_of_arm(
    system: str, processor: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("eomgen.products.fmu.binary.sys.platform", system)
    monkeypatch.setattr("eomgen.products.fmu.binary.platform.machine", lambda: processor)
    assert this_machine(3).name == name
    text = f"binary: FMI 2.0 names x86 machines alone, and this one is {name}; try: version=3; or binary=False"
    with pytest.raises(eomgen.UsageError, match=re.escape(text)):
        this_machine(2)
    monkeypatch.setattr("eomgen.products.fmu.binary.platform.machine", lambda: "x86_64")
    assert this_machine(2).folder == {"linux": "linux64", "darwin": "darwin64"}[system]
