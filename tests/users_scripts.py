"""Checks the types of users' scripts: the examples of all docstrings and pages, as one module, by ``mypy --strict``.

``python -m tests.users_scripts`` prints the errors with their places and ends with 1 if there are any.
"""

from __future__ import annotations

import doctest
import os
import re
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: Errors of scripts that are no faults of signatures: beginning of the message by place.
EXPECTED: Mapping[str, tuple[str, ...]] = {
    "docs/hamiltonian.md": ('"Solution" has no', '"Model" has no'),  # products return models of their own from build
    "docs/how_to/force_element_plug_in.md": ('Name "Drag" already',),  # a file of the reader
    "docs/python/rotors.md": ("No overload variant",),  # a dict of dicts, which the reader does not annotate
    "docs/python/scenes_made_by_python.md": ("Unpacked dict",),
}
#: Names of earlier examples are unknown, functions have no annotations, and values are there that may be None.
CONFIGURATION = """[mypy]
strict = true
strict_optional = false
disallow_untyped_defs = false
disallow_incomplete_defs = false
disallow_untyped_calls = false
check_untyped_defs = true
allow_redefinition = true
follow_imports = silent
disable_error_code = name-defined, import-untyped
[mypy-drags.*,jax.*,torch.*,casadi.*,fmpy.*]
ignore_missing_imports = true
"""
_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_DOCSTRING = re.compile(r'"""(.*?)"""', re.DOTALL)
_ERROR = re.compile(r"users\.py:(\d+): error: (.*)")


def examples() -> Iterator[tuple[str, str]]:
    """Yield place and source of the examples of each docstring, and of the blocks of Python of each page."""
    parser = doctest.DocTestParser()
    for file in sorted((ROOT / "eomgen").rglob("*.py")):
        for text in _DOCSTRING.findall(file.read_text(encoding="utf-8")):
            if source := "".join(example.source for example in parser.get_examples(textwrap.dedent(text))):
                yield str(file.relative_to(ROOT)), source
    for page in sorted((ROOT / "docs").rglob("*.md")):
        if source := "".join(_BLOCK.findall(page.read_text(encoding="utf-8"))):
            yield str(page.relative_to(ROOT)), source


def errors() -> list[str]:
    """Return place, line and message of each error that is not expected."""
    lines, places = ["import eomgen", "import numpy as np", ""], [""] * 3
    for number, (place, source) in enumerate(examples()):
        body = [f"def example_{number}() -> None:", *textwrap.indent(source, "    ").splitlines(), ""]
        lines += body
        places += [place] * len(body)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "users.py").write_text("\n".join(lines), encoding="utf-8")
        (Path(folder) / "mypy.ini").write_text(CONFIGURATION, encoding="utf-8")
        command = [sys.executable, "-m", "mypy", "--config-file", "mypy.ini", "users.py"]
        environment = {**os.environ, "MYPYPATH": str(ROOT)}
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode > 1 or not done.stdout:
        raise RuntimeError(done.stdout + done.stderr)
    found = []
    for number, message in _ERROR.findall(done.stdout):
        place = places[int(number) - 1]
        if not message.startswith(EXPECTED.get(place, ()) or ("\0",)):
            found.append(f"{place}: {lines[int(number) - 1].strip()}\n    {message}")
    return found


if __name__ == "__main__":
    wrong = errors()
    print("\n".join(wrong) or "the types of all examples agree with the signatures")
    sys.exit(bool(wrong))
