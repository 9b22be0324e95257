"""Writes the stubs of the methods that the register of verbs gives to ``Model`` and ``Solution``, of the public names
of products, and of public modules whose files are elsewhere, so that type checkers and editors read signatures and
docstrings at the functions: ``python -m tests.model_stub``."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import eomgen
from eomgen.base.products import OF_THE_CORE, public_modules, public_names
from eomgen.base.verbs import methods_of, own

COMMAND = "python -m tests.model_stub"
_HEAD = f'''"""Methods of {{}}, for type checkers and editors: from the register of verbs, by
``{COMMAND}``."""

'''
_PACKAGE = Path(eomgen.__file__).parent
#: Stub by the class with the methods.
STUBS = {owner: _PACKAGE / "products" / f"{owner.lower()}_methods.pyi" for owner in ("Model", "Solution")}
EXPORTED = _PACKAGE / "products" / "exported.pyi"
_EXPORTED = f'''"""Public names of products, for type checkers, by ``{COMMAND}``."""

'''


def stub(owner: str) -> str:
    """Return the text of a stub: the class with the functions of the register as methods."""
    found = sorted((target.partition(":")[0], name) for name, _, target in methods_of(own(), owner))
    imports = [f"from {module} import {name} as _{name}\n" for module, name in found]
    methods = [f"    {name} = _{name}\n" for _, name in found]
    return "".join([_HEAD.format(owner), *sorted(imports), f"\nclass {owner}Methods:\n", *methods])


def module_stubs() -> dict[Path, str]:
    """Return the texts of the stubs of public modules by file."""
    modules = OF_THE_CORE | public_modules()
    head = f'"""{{}}, for type checkers and editors: by ``{COMMAND}``."""\n\n{{}}'
    return {_PACKAGE / f"{name}.pyi": head.format(module, _imports(module)) for name, module in modules.items()}


def _imports(module: str) -> str:
    """Return the statements by which a stub offers the names of a module."""
    places = getattr(import_module(module), "PLACES", None)
    if places is None:
        return f"from {module} import *\n"
    own = {name: name if name == attribute else f"_{name}" for name, (_, attribute) in places.items()}
    lines = [f"from eomgen.{home} import {attribute} as {own[name]}\n" for name, (home, attribute) in places.items()]
    renamed = [f"\n{name} = {own[name]}\n" for name in sorted(places) if name != own[name]]  # "as" offers no other name
    return "".join([*sorted(lines), *renamed])


def exported() -> str:
    """Return the text of the stub of the public names of products."""
    homes = [(*target.split(":"), name) for name, target in public_names().items()]
    homes += [(*target.rsplit(".", 1), name) for name, target in public_modules().items()]
    imports: dict[str, list[str]] = {}
    for module, there, name in sorted(homes):
        imports.setdefault(module, []).append(name if there == name else f"{there} as {name}")
    lines = []
    for module, names in imports.items():
        plain = [name for name in names if " as " not in name]
        lines += [f"from {module} import {name}\n" for name in names if " as " in name]
        lines += [f"from {module} import {', '.join(sorted(plain))}\n"] if plain else []
    listed = "".join(f'    "{name}",\n' for name in sorted(name for _, _, name in homes))
    return f"{_EXPORTED}{''.join(lines)}\n__all__ = [\n{listed}]\n"


if __name__ == "__main__":
    EXPORTED.write_text(exported(), encoding="utf-8")
    for file, text in module_stubs().items():
        file.write_text(text, encoding="utf-8")
    for class_name, path in STUBS.items():
        path.write_text(stub(class_name), encoding="utf-8")
