"""Models that were compiled before, or elsewhere, run on a machine without a compiler."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import eomgen
from tests.models.library import scene_text

ROOT = Path(__file__).parents[2]
SCENE = scene_text(
    "pendulum",
    parameters={"length": {"value": 0.7, "tunable": True}},
    bodies__rod__mass=1.5,
    bodies__rod__center_of_mass=[0, 0, "-length"],
    simulation={"duration": 0.5, "step": 1e-3, "method": "rk4"},
)
RUN = """
import json, sys
sys.modules["ziglang"] = None
import eomgen
{before}
try:
    model = eomgen.build({scene!r}, profile="reproducible")
    run = model.simulate(parameters={{"length": 0.9}}, **{options!r})
    slow = sorted({{"sympy", "jinja2"}} & set(sys.modules))
    print(json.dumps({{"q": run.q[-1].tolist(), "success": run.success, "message": run.message, "slow": slow}}))
except eomgen.EomgenError as error:
    print(json.dumps({{"kind": type(error).__name__, "error": str(error)}}))
"""


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene and a cache that holds its library."""
    folder = tmp_path_factory.mktemp("shipped")
    (folder / "scene.toml").write_text(SCENE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EOMGEN_CACHE", str(folder / "cache"))
        eomgen.build(folder / "scene.toml", profile="reproducible")
    return folder


def ran(folder: Path, before: str = "", **options: object) -> dict[str, object]:
    """Return what a process says in which no compiler is found."""
    empty = folder / "bin"
    empty.mkdir(exist_ok=True)
    environment = {name: text for name, text in os.environ.items() if name != "CC"}
    environment |= {"PATH": str(empty), "EOMGEN_CACHE": str(folder / "cache"), "PYTHONPATH": str(ROOT)}
    code = RUN.format(scene=str(folder / "scene.toml"), options=options, before=before)
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found: dict[str, object] = json.loads(done.stdout)
    return found


@pytest.mark.slow
def test_a_compiled_model_runs_to_the_same_bits_without_sympy(shipped: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EOMGEN_CACHE", str(shipped / "cache"))
        expected = eomgen.build(shipped / "scene.toml", profile="reproducible").simulate(parameters={"length": 0.9})
    found = ran(shipped)
    assert found == {"q": expected.q[-1].tolist(), "success": True, "message": expected.message, "slow": []}


@pytest.mark.slow
def test_pythons_headers_are_not_needed_either(shipped: Path) -> None:
    missing = "import eomgen.toolchain.builder as builder; builder.python_headers = lambda: None"
    assert ran(shipped, missing)["success"] is True


@pytest.mark.slow
@pytest.mark.parametrize("change", ["method", "scene", "damage"])
def test_what_has_to_be_compiled_says_so(change: str, shipped: Path, tmp_path: Path) -> None:
    folder = tmp_path / "other"
    shutil.copytree(shipped, folder)
    if change == "scene":
        (folder / "scene.toml").write_text(SCENE.replace("1.5", "1.6"))
    if change == "damage":
        (library,) = (folder / "cache").glob("*/model.*")
        library.write_bytes(library.read_bytes()[:-8])
    found = ran(folder, **({"method": "generalized_alpha"} if change == "method" else {}))
    assert found["kind"] == "ToolchainError"
    assert str(found["error"]).startswith(
        "toolchain error: no C compiler found: looked for cc, gcc, clang on the path, in CC, and for the package"
        f" ziglang, and the cache {folder / 'cache'} has no library of this model with these terms, this method and"
        " profile reproducible for this machine; try: "
    )
