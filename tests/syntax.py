"""Facts of the package's files that tests compare, by one syntax tree of each file for all processes.

To parse and walk all files takes seconds for each test. Facts are kept in the folder for temporary files, each under
the digest of its file and of the modules that gather the facts: after a change the changed files alone are parsed.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "eomgen"


class Facts(NamedTuple):
    """Facts of a file; its tree would fill the memory."""

    #: Imported modules, names that they are asked for, and the name of the ``Kind`` of each import.
    imports: Sequence[Sequence[str]]
    identifiers: Sequence[str]
    #: Lines that execute a text, and the functions by which they do so.
    evaluations: Sequence[str]
    #: Lines that use private names of other files.
    foreign: Sequence[str]
    #: Comments, docstrings and literals of three words or more.
    texts: Sequence[str]
    #: Each occurrence of a variable, an argument, an attribute or a function name.
    names: Sequence[str]
    #: Numbers of lines by kind, as ``budgets.line_counts``.
    lines: dict[str, float]
    constants: int
    #: Name of each function, and of each short function with its number of uses.
    functions: Sequence[str]
    short: Sequence[tuple[str, int]]
    #: Complexity of each function above ``READABLE``.
    complexities: Sequence[tuple[str, int]]
    #: Messages without a code: line and text.
    unmarked: Sequence[str]


def nodes_of(tree: ast.AST) -> list[ast.AST]:
    """Return the nodes of a tree in the order of ``ast.walk``, which takes twice as long."""
    nodes = [tree]
    for node in nodes:
        for name in node._fields:
            value = getattr(node, name, None)
            if isinstance(value, list):
                nodes += [part for part in value if isinstance(part, ast.AST)]
            elif isinstance(value, ast.AST) and not isinstance(value, ast.expr_context):
                nodes.append(value)
    return nodes


def _facts(path: Path) -> Facts:
    from tests import budgets, language, test_doors
    from tests.messages import sentences

    source = path.read_text(encoding="utf-8")
    tree = ast.parse(source)
    nodes = nodes_of(tree)
    texts, names = language.of_nodes(source, nodes)
    return Facts(
        [(module, name, kind.name) for module, name, kind in test_doors.imports_of(path, tree)],
        sorted(test_doors.identifiers(nodes)),
        list(test_doors.evaluations(nodes)),
        list(test_doors.foreign(nodes)),
        texts,
        names,
        budgets.line_counts(source, nodes),
        budgets.constants(tree),
        [function.name for _, function in budgets.functions(tree)],
        budgets.short_functions(source, tree),
        list(budgets.complex_functions(source, budgets.READABLE, tree)),
        list(sentences.unmarked(source, nodes)),
    )


def record_of(package: Path) -> Path:
    """Return the file of the facts of a package."""
    folder = Path(tempfile.gettempdir()) / f"eomgen-syntax-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
    return folder / f"{hashlib.sha256(str(package).encode()).hexdigest()}.json"


@cache
def facts() -> dict[Path, Facts]:
    """Return the facts of each ``.py`` and ``.pyi`` file of the package, sorted by path."""
    gathering = hashlib.sha256()
    for name in ("syntax", "budgets", "language", "test_doors", "messages/sentences"):
        gathering.update((ROOT / "tests" / f"{name}.py").read_bytes() + b"\0")

    def key(file: Path) -> str:
        digest = gathering.copy()
        digest.update(f"{file.relative_to(PACKAGE)}\0".encode() + file.read_bytes())
        return digest.hexdigest()

    keys = {file: key(file) for file in sorted([*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.pyi")])}
    record = record_of(PACKAGE)
    known = json.loads(record.read_text(encoding="utf-8")) if record.is_file() else {}
    made = {file: Facts(*known[key]) if key in known else _facts(file) for file, key in keys.items()}
    if keys.values() - known.keys():
        record.parent.mkdir(exist_ok=True)
        part = record.with_suffix(f".{os.getpid()}")
        part.write_text(json.dumps({key: made[file] for file, key in keys.items()}), encoding="utf-8")
        part.replace(record)
    return made
