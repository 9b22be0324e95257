"""Products are removed by the files of their lists: copies of the sources, each without one product."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from eomgen.base.products import products
from tests.product_parts import RENEWALS, ROOT, dependents, paths_of, strays
from tests.syntax import PACKAGE, facts, record_of

#: Tests of the core that hold without a product.
HELD = (
    "tests/test_doors.py",
    "tests/test_budgets.py",
    "tests/test_public_names.py",
    "tests/test_public_modules.py",
    "tests/test_verbs.py",
    "tests/test_products.py",
    "tests/scene/test_scene_builder.py",
)
#: Copies of the sources, each of which lacks a share of the products; one takes 20 s. Each keeps a product with methods
#: of models, and one with methods of solutions: the stub of a class without any is no Python.
COPIES = 5


@pytest.mark.parametrize("product", products())
def test_every_path_of_a_product_is_there(product: str) -> None:
    missing = [path for path in paths_of(product) if not (ROOT / path).exists()]
    assert not missing


@pytest.mark.parametrize("product", products())
def test_tests_elsewhere_import_nothing_of_a_product(product: str) -> None:
    assert not [*strays(product)]


@pytest.mark.long
@pytest.mark.parametrize("number", range(COPIES))
def test_products_are_removed_by_their_paths(number: int, tmp_path: Path) -> None:
    """Each product is gone from one of the copies, with the products that need it."""
    removed = {one for product in [*products()][number::COPIES] for one in dependents(product)}
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    compiled = (file.relative_to(ROOT).as_posix() for file in (ROOT / "eomgen").rglob("*.pyc"))
    for name in (*listed.splitlines(), *compiled):
        target = tmp_path / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_file():
            shutil.copy2(ROOT / name, target)  # with its time, by which Python takes the compiled module
    facts()
    shutil.copy(record_of(PACKAGE), record_of(tmp_path / "eomgen"))
    for path in (path for product in removed for path in paths_of(product)):
        shutil.rmtree(tmp_path / path) if (tmp_path / path).is_dir() else (tmp_path / path).unlink(missing_ok=True)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "EOMGEN_CACHE": str(tmp_path / "cache")}

    def run(*words: str) -> None:
        done = subprocess.run(
            [sys.executable, *words], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout[-4000:]}{done.stderr[-4000:]}"

    for command in RENEWALS:
        run(*command.split()[1:])
    texts = {
        file: file.read_text(encoding="utf-8") for file in tmp_path.rglob("*.py*") if file.suffix in (".py", ".pyi")
    }
    assert not [file for file, text in texts.items() for name in removed if f"eomgen.products.{name}" in text]
    # a door that removed products alone used stays open, for other distributions as well
    shut = "tests/test_doors.py::test_rooms_name_only_what_others_import"
    words = f"-m pytest --deselect {shut} -q -n 0 -p no:cacheprovider -m".split()
    run(*words, "not slow and not long", *HELD)
