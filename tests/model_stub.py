"""Writes the stub of ``Model``, which names the functions of the register of verbs, so that type checkers and editors
read signatures and docstrings at these: ``python -m tests.model_stub eomgen/pipeline/model.pyi``."""

from __future__ import annotations

import sys
from pathlib import Path

from eomgen.base.verbs import methods_of, own

COMMAND = "python -m tests.model_stub eomgen/pipeline/model.pyi"
_HEAD = f'''"""Methods of Model, for type checkers and editors: from the register of verbs, by
``{COMMAND}``."""

'''


def stub() -> str:
    """Return the text of the stub: the class with the functions of the register as methods."""
    found = sorted((target.partition(":")[0], name) for name, _, target in methods_of(own()))
    imports = [f"from {module} import {name} as _{name}\n" for module, name in found]
    imports.append("from eomgen.compiled.model import CompiledModel\n")
    methods = [f"    {name} = _{name}\n" for _, name in found]
    return "".join([_HEAD, *sorted(imports), "\nclass Model(CompiledModel):\n", *methods])


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(stub(), encoding="utf-8")
