"""The core works without any product: copies of the package, each with one product deleted."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

import eomgen
from eomgen.base.files import template_folder
from eomgen.base.products import products
from eomgen.products.offered import OFFERED
from tests.models.scenes import PENDULUM_TOML
from tests.product_names import COMMAND, text_of
from tests.product_parts import facts_of

PACKAGE = Path(eomgen.__file__).parent
#: Deleted in the first tier.
FIRST = "studies"
#: Facts of each product from its folder of tests: ``uses`` of the product, in Python with ``model`` and ``run`` of a
#: pendulum, and command lines, with place and name of each message; and ``scenes`` that need the product.
FACTS = {name: facts_of(name) for name in products()}


def uses_of(product: str) -> list[tuple[str, str]]:
    """Return the uses of a product, each with its message."""
    return [(use["call"], use["message"]) for use in FACTS[product].get("uses", ())]


def scenes_of(product: str) -> Iterator[tuple[str, str]]:
    """Yield the scenes that need a product, by name: the pendulum with more, or a whole file."""
    for name, scene in FACTS[product].get("scenes", {}).items():
        if "whole" in scene:
            yield name, scene["whole"]
        elif "in_place_of" in scene:
            yield name, PENDULUM_TOML.replace(scene["in_place_of"], scene["more"])
        else:
            yield name, f"{PENDULUM_TOML}\n{scene['more']}"


#: The contract of the core, in one process.
_CORE = """
import contextlib, io, json, sys
from pathlib import Path
import eomgen
from eomgen.cli import main
from eomgen.base.products import products
from eomgen.products.offered import OFFERED
from eomgen.base.files import template_folder

def cli(*words):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(words)
    if code:
        raise RuntimeError(err.getvalue())
    return out.getvalue()

model = eomgen.build(eomgen.load("pendulum.toml"), profile="quick")
run = model.simulate(0.1, 1e-3)
messages = []
for use in json.loads(sys.argv[1]):
    try:
        eval(use)
        messages.append("no message")
    except Exception as error:
        messages.append(str(error).strip())
print(json.dumps({
    "file": eomgen.__file__,
    "products": list(products()),
    "public": [name for name in eomgen.__all__ if getattr(eomgen, name) is None],
    "success": run.success,
    "notes": run.metadata["notes"],
    "checked": [finding.name for finding in model.simulate(10.0, 0.25, parameters={"shake": 0.0}).findings],
    "motion": run.q[-1].tolist(),
    "poses": list(run.poses),
    "stored": list(eomgen.Solution.load(run.save("run.npz")).poses),
    "rest": json.loads(cli("equilibrium", "pendulum.toml", "--json"))["stable"],
    "help": cli("--help"),
    "schema": sorted(json.loads(cli("schema"))["properties"]),
    "info": json.loads(cli("info", "pendulum.toml", "--json"))["degrees_of_freedom"],
    "shown": cli("info", "pendulum.toml"),
    "messages": messages,
}))
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of libraries that all copies share: they are of one version of the code."""
    return tmp_path_factory.mktemp("cache")


def without(deleted: Sequence[str], folder: Path) -> list[str]:
    """Copy the package as it is installed, without products, and return the deleted and the dependent products."""
    shutil.copytree(PACKAGE, folder / "eomgen")
    shutil.copytree(PACKAGE.parent / "templates", folder / "eomgen" / "_templates")
    for product in deleted:
        shutil.rmtree(folder / "eomgen" / "products" / product)
        shutil.rmtree(folder / "eomgen" / "_templates" / product, ignore_errors=True)
    gone = [*deleted]
    while more := [name for name, row in products().items() if name not in gone and set(row.needs) & set(gone)]:
        gone += more
    return gone


@pytest.mark.long_cases("studies")
@pytest.mark.parametrize(
    "deleted",
    [
        pytest.param([FIRST], id=FIRST),
        pytest.param([*FACTS], id="all", marks=pytest.mark.slow),
        *(pytest.param([*FACTS][number::3], id=f"share {number}", marks=pytest.mark.long) for number in range(3)),
    ],
)
def test_the_core_works_without_products(deleted: list[str], tmp_path: Path, cache: Path) -> None:
    gone = without(deleted, tmp_path)
    (tmp_path / "pendulum.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    for name, text in (scene for product in FACTS for scene in scenes_of(product)):
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    uses = [use for name in gone for use in uses_of(name)]
    run = subprocess.run(
        [sys.executable, "-c", _CORE, json.dumps([use for use, _ in uses])],
        capture_output=True, text=True, check=False, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path), "EOMGEN_CACHE": str(cache)},
    )  # fmt: skip  # a command line
    assert run.returncode == 0, run.stderr
    result = json.loads(run.stdout)
    assert Path(result["file"]).is_relative_to(tmp_path)
    assert set(result["products"]) == set(products()) - set(gone)
    assert result["success"] and result["info"] == 1 and "Configuration" in result["shown"]
    assert "  simulate " in result["help"] and "bodies" in result["schema"] and not result["public"]
    assert ("checks: not installed" in result["notes"]) == ("doubts" in gone)
    assert "discretisation_error" in result["checked"]
    assert result["poses"] == result["stored"] == ["link", "base"] and result["rest"]
    owners = [name for name in gone for _ in uses_of(name)]
    for message, (_, fault), owner in zip(result["messages"], uses, owners, strict=True):
        because = f"it is part of the product {owner} of eomgen, which is not installed"
        assert fault in message and because in message and "; try: all of eomgen" in message and "\n" not in message


def test_templates_are_of_the_core_or_of_one_product() -> None:
    folders = {folder.name for folder in template_folder().iterdir() if folder.is_dir()} - {"__pycache__"}
    assert "c" in folders and folders - {"c"} <= set(products())


def test_names_for_messages_are_up_to_date() -> None:
    text = (PACKAGE / "products" / "offered.py").read_text(encoding="utf-8")
    assert text == text_of(text), f"out of date: {COMMAND}"


def _texts(file: Path) -> Iterator[tuple[int, str]]:
    """Yield line and text of each string of a module that is no docstring."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    statements = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in statements:
            yield node.lineno, node.value


#: Texts of the core that name a method of a product as a remedy.
REMEDIES = {
    'at="initial", or solution.linearize(t) about the motion itself',  # about a state that drives do not let rest
    'model.steady_motion(), or coordinates = "joint"',  # likewise
}


def test_no_text_of_the_core_names_a_product() -> None:
    offered = sorted({name for names in OFFERED.values() for name in names})
    words = "|".join(re.escape(name) for name in offered if name.isidentifier()) or "(?!)"
    formats = "|".join(re.escape(name) for name in offered if name.startswith(".") or name.isupper()) or "(?!)"
    named = re.compile(
        rf"\b(?:eomgen\.|products[./])(?:{'|'.join(products())})\b"
        rf"|\b(?:eomgen |eomgen\.|(?:model|solution|run|Model|Solution)\.)(?:{words})\b"
        rf"|(?<![\w.])(?:{formats})\b"
    )
    found = {
        f"{file.relative_to(PACKAGE)}:{line}: {text}"
        for file in PACKAGE.rglob("*.py")
        if file.relative_to(PACKAGE).parts[0] != "products"
        for line, text in _texts(file)
        if named.search(text) and text not in REMEDIES
    }
    assert not found
