"""Entry points of other distributions, loaded if eomgen has no entry with that name; and digests of their code for the
cache's key."""

from __future__ import annotations

import hashlib
import inspect
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from eomgen.base.messages import shown
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

Row = TypeVar("Row")


def extensions(group: str) -> Iterator[EntryPoint]:
    """Yield the entry points of a group in an order that does not depend on the order of installation."""
    from importlib.metadata import entry_points  # noqa: PLC0415  # most processes ask for none

    yield from sorted(entry_points(group=group), key=lambda entry: (entry.name, entry.value))


def load_row(entry: EntryPoint, kind: type[Row]) -> Row:
    """Return the object that an entry point names. Raises UsageError naming the distribution if the import fails or the
    type is wrong."""
    try:
        row = entry.load()
    except Exception as error:  # a module of another distribution may raise any error at import
        raise broken(entry, f"does not load: {type(error).__name__}: {error}") from error
    if not isinstance(row, kind):
        raise broken(entry, f"is not an {kind.__module__}.{kind.__qualname__}")
    return row


def distribution(entry: EntryPoint) -> str:
    """Return the name of the distribution of an entry point."""
    return entry.dist.name if entry.dist is not None else entry.value.partition(":")[0]


def distribution_of(module: str) -> str:
    """Return the name of the distribution that a module belongs to, if that extends eomgen by entry points; empty for
    other modules."""
    from importlib.metadata import distributions  # noqa: PLC0415  # for errors only

    package = module.partition(".")[0]
    for extension in distributions():
        entries = [entry for entry in extension.entry_points if entry.group.startswith("eomgen.")]
        if not entries:
            continue
        packages = {entry.module.partition(".")[0] for entry in entries}
        packages.update((extension.read_text("top_level.txt") or "").split())
        if package in packages or any(file.parts[0] == package for file in extension.files or ()):
            return extension.name
    return ""


def broken(entry: EntryPoint, fault: str) -> UsageError:
    """Return the error for an entry point that cannot be taken."""
    who = distribution(entry)
    where = f"the entry point {shown(entry.name)} ({entry.value}) in {entry.group} of the distribution {who}"
    return UsageError(Problem(entry.group, f"{where} {fault} [E0124]", f"another version of {who}, or uninstall it"))


#: Digests of code by file, with the state of the import of its module then: a module that is loaded runs the text that
#: it was loaded from, even if its file changes later.
_STAMPS: dict[Path, tuple[object, str]] = {}


def code_stamp(kind: Callable[..., object], *targets: str) -> str:
    """Return a digest of the code of another distribution's class or function, and of targets ``module:name`` on which
    it depends; empty for eomgen's own, and for functions in C, which have no file."""
    modules = dict.fromkeys([kind.__module__, *(target.partition(":")[0] for target in targets if target)])
    of_others = [name for name in modules if name.partition(".")[0] != __name__.partition(".")[0]]
    if not of_others or inspect.isbuiltin(kind):
        return ""
    files = {kind.__module__: Path(inspect.getfile(kind))} if kind.__module__ in of_others else {}
    for name in of_others:
        if name not in files and (file := _file_of(name)) is not None:
            files[name] = file
    return hashlib.sha256("".join(_stamp(name, file) for name, file in files.items()).encode()).hexdigest()


def _file_of(module: str) -> Path | None:
    """Return the file of a module, which need not be loaded; None without one."""
    from importlib.util import find_spec  # noqa: PLC0415  # for other distributions only

    try:
        spec = find_spec(module)
    except (ImportError, ValueError):  # whoever loads it says why
        return None
    return None if spec is None or not spec.has_location or spec.origin is None else Path(spec.origin)


def _stamp(module: str, file: Path) -> str:
    """Return a digest of the files with the code of a module; for a loaded module, of the text that was imported, as
    far as known."""
    loaded_from = getattr(sys.modules.get(module), "__spec__", None)
    known = _STAMPS.get(file)
    if known is None or loaded_from is None or known[0] not in (None, loaded_from):
        digest = hashlib.sha256(b"\0".join(path.read_bytes() for path in _sources(module, file))).hexdigest()
        known = loaded_from, digest
    _STAMPS[file] = loaded_from, known[1]
    return known[1]


def _sources(module: str, file: Path) -> list[Path]:
    """Return the files of Python and Jinja in a module's package, from the topmost folder that is a package; for a
    single module the file and the neighbours that are imported, directly or not."""
    depth = module.count(".") + (file.name == "__init__.py")
    if depth:
        root = file.parents[depth - 1]
        while (
            not (root / "__init__.py").is_file() and root != file.parent
        ):  # a package that several distributions share
            root = root / file.relative_to(root).parts[0]
        return sorted(path for path in root.rglob("*") if path.suffix in (".py", ".jinja"))
    found, left = set[Path](), [file]
    while left:
        found.add(path := left.pop())
        names = re.findall(rb"^\s*(?:from|import)\s+(\w+)", path.read_bytes(), re.MULTILINE)
        neighbours = {path.with_name(f"{name.decode()}.py") for name in names}
        left += sorted(neighbour for neighbour in neighbours - found if neighbour.is_file())
    return sorted(found)
