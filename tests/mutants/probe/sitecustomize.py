"""Marks the blocks of functions of the package that Python processes run, and mutates one file of the package.

On the PYTHONPATH of a process and its children Python imports it at their start. A block is a run of statements without
a branch; each block gets a first statement that stores one byte in memory that the processes share: some 40 ns, and no
change of line numbers.
"""

from __future__ import annotations

import ast
import builtins
import importlib.abc
import importlib.machinery
import json
import marshal
import mmap
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import CodeType, ModuleType

#: A folder with the numbers of blocks (``plan.json``), the bytes of blocks (``marks``), and beside it compiled modules.
FOLDER, PACKAGE = os.environ.get("EOMGEN_PROBE_FOLDER", ""), os.environ.get("EOMGEN_PROBE_PACKAGE", "")
#: Name of a file in the folder: ``{"file": path, "source": text}``. Read by child processes of a trial.
MUTANT = "EOMGEN_PROBE_MUTANT"
#: Number of the first block of each file.
PLAN: dict[str, int] = {}
COMPOUND = (ast.If, ast.For, ast.While, ast.With, ast.Try, ast.Match)


def blocks(tree: ast.Module) -> Iterator[tuple[str, list[ast.stmt], int]]:
    """Return the function, the list of statements and the place in the list of the first statement of each block."""

    def of_statements(
        statements: list[ast.stmt], names: tuple[str, ...], at: int
    ) -> Iterator[tuple[str, list[ast.stmt], int]]:
        fresh = True
        for place, statement in enumerate(statements):
            if fresh and place >= at:
                yield ".".join(names), statements, place
            fresh = isinstance(statement, COMPOUND) or (fresh and place < at)
            if isinstance(statement, COMPOUND):
                for inner in _inner(statement):
                    yield from of_statements(inner, names, 0)
            else:
                yield from of_definitions([statement], names)

    def of_definitions(statements: list[ast.stmt], names: tuple[str, ...]) -> Iterator[tuple[str, list[ast.stmt], int]]:
        for node in statements:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                begins = 1 if ast.get_docstring(node, clean=False) is not None and len(node.body) > 1 else 0
                yield from of_statements(node.body, (*names, node.name), begins)
            elif isinstance(node, ast.ClassDef):
                yield from of_definitions(node.body, (*names, node.name))
            elif isinstance(node, COMPOUND):
                for inner in _inner(node):
                    yield from of_definitions(inner, names)

    return of_definitions(tree.body, ())


def _inner(statement: ast.stmt) -> Iterator[list[ast.stmt]]:
    """Return the lists of statements inside a compound statement."""
    for name in ("body", "orelse", "finalbody"):
        if inner := getattr(statement, name, None):
            yield inner
    for branch in (*getattr(statement, "handlers", ()), *getattr(statement, "cases", ())):
        yield branch.body


def _marked(tree: ast.Module, base: int) -> ast.Module:
    """Return the module with a mark at the start of each block."""
    added = []
    for number, (_, statements, place) in enumerate(blocks(tree)):
        mark = ast.parse(f"__eomgen_marks__[{base + number}] = 1").body[0]
        for part in ast.walk(mark):
            ast.copy_location(part, statements[place])
        added.append((statements, statements[place], mark))
    for statements, before, mark in added:
        statements.insert(next(place for place, one in enumerate(statements) if one is before), mark)
    return tree


class _Loader(importlib.machinery.SourceFileLoader):
    def get_code(self, fullname: str) -> CodeType:
        path = Path(self.path)
        file = path.relative_to(Path(PACKAGE).parent).as_posix()
        if os.environ.get(MUTANT):
            mutant = json.loads(Path(os.environ[MUTANT]).read_text(encoding="utf-8"))
            if mutant["file"] == file:
                return compile(mutant["source"], self.path, "exec", dont_inherit=True)
        base = PLAN[file]
        kept = Path(FOLDER).parent / "code" / f"{fullname}-{base}-{path.stat().st_mtime_ns}"
        if not kept.is_file():
            code = compile(_marked(ast.parse(path.read_bytes()), base), self.path, "exec", dont_inherit=True)
            kept.parent.mkdir(exist_ok=True)
            beside = kept.with_name(f"{kept.name}-{os.getpid()}")
            beside.write_bytes(marshal.dumps(code))
            beside.replace(kept)
        made: CodeType = marshal.loads(kept.read_bytes())
        return made


class _Finder(importlib.abc.MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname.partition(".")[0] != Path(PACKAGE).name:
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path)
        if (
            spec is not None
            and spec.origin
            and Path(spec.origin).is_relative_to(PACKAGE)
            and spec.origin.endswith("py")
        ):
            spec.loader = _Loader(fullname, spec.origin)
        return spec


def install(folder: str, package: str) -> mmap.mmap:
    """Import the package with marks from now on, and return the memory of the marks."""
    global FOLDER, PACKAGE
    FOLDER, PACKAGE = folder, package
    PLAN.update(json.loads(Path(folder, "plan.json").read_text(encoding="utf-8")))
    with Path(folder, "marks").open("r+b") as opened:
        marks = mmap.mmap(opened.fileno(), 0)
    builtins.__eomgen_marks__ = marks  # type: ignore[attr-defined]
    sys.meta_path.insert(0, _Finder())
    return marks


if FOLDER and PACKAGE and not hasattr(builtins, "__eomgen_marks__"):
    install(FOLDER, PACKAGE)
