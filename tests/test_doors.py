"""The rooms of the package open downwards only, and SymPy stays out of the way from a cached build to a running model."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import eomgen

PACKAGE = Path(eomgen.__file__).parent

#: For each room: the other rooms that it may import, or the one module that is open. What is not here may use everything.
DOORS: dict[str, set[str]] = {
    "errors": set(),
    "calls": {"errors", "scene.names", "scene.term_names"},
    "scene": {"errors", "calls"},
    "symbolic": {"errors"},
    "lie": {"errors", "symbolic"},
    "system": {"errors", "calls", "scene.term_names", "symbolic"},
    "mechanics": {"errors", "symbolic", "lie", "scene", "system"},
    "integrators": {"errors", "lie", "symbolic.evaluate"},  # pivots are chosen by sample values of a System
    "linear": {"errors", "lie"},
    "motion_laws": {"errors", "mechanics.formulas", "scene", "symbolic"},
    "codegen": {"errors", "resources", "system", "symbolic", "lie", "integrators"},
    "build": {"errors"},
    "control": {"errors"},
    "resources": {"errors"},
    "runtime": {
        "errors", "calls", "resources", "build", "codegen.layout", "integrators", "lie", "linear", "motion_laws", "scene",
    },
}
SYMPY_ROOMS = {"symbolic", "mechanics", "lie"}
NO_PICKLE_NO_EVAL = {"pickle", "marshal", "shelve", "dill", "cloudpickle"}


def _modules() -> Iterator[tuple[str, Path]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


def _imports(path: Path) -> Iterator[tuple[str, bool]]:
    """Yield every imported module, and whether it is for type checkers only."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    typing_only = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, id(node) in typing_only
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide which door is used"
            module = node.module or ""
            submodules = [f"{module}.{alias.name}" for alias in node.names]
            yield from ((name if _is_module(name) else module, id(node) in typing_only) for name in submodules)


def _is_module(name: str) -> bool:
    path = PACKAGE.parent.joinpath(*name.split("."))
    return path.with_suffix(".py").is_file() or path.is_dir()


def _may(room: str, target: str) -> bool:
    return any(target == door or target.startswith(door + ".") for door in {room, *DOORS[room]})


@pytest.mark.parametrize("room", DOORS)
def test_doors_open_downwards_only(room: str) -> None:
    wrong = [
        f"{module} imports {name}"
        for module, path in _modules()
        if module.split(".")[0] == room
        for name, _ in _imports(path)
        if name.startswith("eomgen.") and not _may(room, name.removeprefix("eomgen."))
    ]
    assert wrong == []


def test_every_room_has_been_walked() -> None:
    found = {module.split(".")[0] for module, _ in _modules()}
    assert set(DOORS) <= found
    assert {"pipeline", "cli"} <= found


def test_sympy_is_imported_where_laws_are_derived_only() -> None:
    wrong = [
        module
        for module, path in _modules()
        if module.split(".")[0] not in SYMPY_ROOMS
        for name, typing_only in _imports(path)
        if name.split(".")[0] == "sympy" and not typing_only
    ]
    assert wrong == []


def test_nothing_is_evaluated_or_unpickled() -> None:
    wrong = []
    for module, path in _modules():
        wrong += [f"{module} imports {name}" for name, _ in _imports(path) if name.split(".")[0] in NO_PICKLE_NO_EVAL]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("eval", "exec", "compile"):
                wrong.append(f"{module}:{node.lineno} calls {node.func.id}")
            if isinstance(node, ast.Name | ast.Attribute):
                name = node.id if isinstance(node, ast.Name) else node.attr
                if name in ("sympify", "parse_expr"):
                    wrong.append(f"{module}:{node.lineno} uses {name}")
    assert wrong == []


def _run(code: str, **environment: str) -> str:
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(PACKAGE.parent), **environment},
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_the_package_imports_nothing_heavy() -> None:
    heavy = ("sympy", "numpy", "pydantic", "matplotlib", "cffi", "click", "jinja2", "scipy")
    assert _run(f"import sys, eomgen; print([name for name in {heavy!r} if name in sys.modules])").strip() == "[]"


def test_the_package_imports_without_a_compiler(tmp_path: Path) -> None:
    code = "import eomgen; s = eomgen.SceneBuilder('x'); print(eomgen.__version__, callable(eomgen.build))"
    assert _run(code, PATH=str(tmp_path), CC="nothing").strip() == f"{eomgen.__version__} True"


_CACHED = """
import sys, time
start = time.perf_counter()
import eomgen
model = eomgen.build({path!r}, profile="quick")
run = model.simulate(1e-3, 1e-3)
seconds = time.perf_counter() - start
print(run.success, [name for name in ("sympy", "jinja2", "scipy", "matplotlib", "setuptools") if name in sys.modules], seconds)
"""


def test_a_cached_model_runs_without_sympy(tmp_path: Path) -> None:
    from tests.models.scenes import PENDULUM_TOML

    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    cache = {"EOMGEN_CACHE": str(tmp_path / "cache")}
    first = _run(_CACHED.format(path=str(path)), **cache)
    later = [_run(_CACHED.format(path=str(path)), **cache) for _ in range(3)]  # an edit of the checkout in between builds anew
    second = next((text for text in later if text.startswith("True []")), later[-1])
    assert first.startswith("True ['sympy', 'jinja2'")
    assert second.startswith("True []")
    assert float(second.split()[-1]) < float(first.split()[-1])


def test_the_public_function_build_survives_the_import_of_the_folder_of_that_name() -> None:
    code = "import eomgen.toolchain.cache, eomgen; from eomgen.build import cache; print(eomgen.build.__name__, cache.Cache.__name__)"
    assert _run(code).split() == ["build", "Cache"]
