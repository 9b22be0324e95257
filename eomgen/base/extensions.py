"""Register entries of other distributions: entry points, loaded when eomgen has no entry of that name itself, and
digests of their code for the key of the cache."""

from __future__ import annotations

import hashlib
import inspect
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


def loaded(entry: EntryPoint, kind: type[Row]) -> Row:
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


def broken(entry: EntryPoint, fault: str) -> UsageError:
    """Return the error for an entry point that cannot be taken."""
    who = distribution(entry)
    where = f"the entry point {shown(entry.name)} ({entry.value}) in {entry.group} of the distribution {who}"
    return UsageError(Problem(entry.group, f"{where} {fault}", f"another version of {who}, or uninstall it"))


def code_stamp(kind: Callable[..., object]) -> str:
    """Return a digest of the file or package of another distribution's class or function; empty for eomgen's own, and
    for functions in C, which have no file."""
    if kind.__module__.partition(".")[0] == __name__.partition(".")[0] or inspect.isbuiltin(kind):
        return ""
    file = Path(inspect.getfile(kind))
    in_package = "." in kind.__module__ or file.name == "__init__.py"
    files = (
        sorted(path for path in file.parent.rglob("*") if path.suffix in (".py", ".jinja")) if in_package else [file]
    )
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in files)).hexdigest()
