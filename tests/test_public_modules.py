"""Public modules whose files are elsewhere, and public names of products."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import eomgen
from eomgen.base.products import OF_THE_CORE, earlier_names, products, public_modules, public_names

MODULES = OF_THE_CORE | public_modules()
STUB = Path(eomgen.__file__).parent / "products" / "exported.pyi"
#: A module within each package; rows of absent products are left out.
WITHIN = {
    "control": "regulator",
    "fields": "sampling",
    "sampling": "problem",
    "spectra": "road",
    "studies": "tuning.tune",
    "waves": "sea",
}
WITHIN = {name: within for name, within in WITHIN.items() if name in MODULES}


def _run(program: str) -> str:
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.strip()


@pytest.mark.parametrize("name", MODULES)
def test_a_public_module_is_one_object_with_the_module_itself(name: str) -> None:
    assert import_module(f"eomgen.{name}") is import_module(MODULES[name]) is getattr(eomgen, name)


@pytest.mark.parametrize("name", WITHIN)
def test_modules_within_are_the_same_objects(name: str) -> None:
    within = WITHIN[name]
    assert import_module(f"eomgen.{name}.{within}") is import_module(f"{MODULES[name]}.{within}")


def test_modules_that_moved_are_imported_by_their_earlier_names() -> None:
    earlier = earlier_names()
    program = f"from importlib import import_module as f; print(*(f('eomgen.' + n).__name__ for n in {list(earlier)}))"
    assert dict(zip(earlier, _run(program).split(), strict=True)) == earlier
    of_a_core_room = "from eomgen.analysis.equilibrium import Equilibrium as it; print(it.__module__)"
    assert _run(of_a_core_room) == "eomgen.compiled.rest.equilibrium"


def test_every_public_package_has_a_witness() -> None:
    assert set(WITHIN) == {name for name in MODULES if hasattr(import_module(MODULES[name]), "__path__")}


def test_a_module_that_there_is_not_is_refused_as_python_does() -> None:
    for name in ("eomgen.oceans", *(f"eomgen.{name}.oceans" for name in WITHIN)):
        with pytest.raises(ModuleNotFoundError, match=f"No module named '{name}'"):
            import_module(name)


def test_rows_of_products_are_read_without_their_modules() -> None:
    program = (
        "import sys; from eomgen.base.products import products; names = list(products());"
        "print([name for name in sys.modules if name.startswith('eomgen.products.') and name.count('.') > 2],"
        " 'numpy' in sys.modules, *names)"
    )
    assert _run(program) == f"[] False {' '.join(products())}"


def test_public_names_are_the_objects_of_their_rows() -> None:
    for name, target in public_names().items():
        module, _, attribute = target.partition(":")
        assert getattr(eomgen, name) is getattr(import_module(module), attribute)
    assert {*public_names(), *public_modules()} <= set(eomgen.__all__)


def test_the_stub_of_public_names_holds_the_rows() -> None:
    tree = ast.parse(STUB.read_text(encoding="utf-8"))
    homes = {
        alias.asname or alias.name: import_module(f"{node.module}.{alias.name}")
        if f"{node.module}.{alias.name}" in public_modules().values()
        else getattr(import_module(str(node.module)), alias.name)
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert homes == {name: getattr(eomgen, name) for name in (*public_names(), *public_modules())}
    declared = next(node.value for node in tree.body if isinstance(node, ast.Assign))
    assert sorted(ast.literal_eval(declared)) == sorted(homes)
