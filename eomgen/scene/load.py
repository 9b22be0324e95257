"""Loading of Scenes from files of every source, and from nested data."""

from __future__ import annotations

import contextlib
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

from eomgen.base.data import without_garbage_collection
from eomgen.base.messages import shown
from eomgen.base.products import fault_of_absent
from eomgen.errors import Problem, UsageError
from eomgen.scene.formula.namespaces import FileData
from eomgen.scene.reading.report import Report
from eomgen.scene.scene import Scene
from eomgen.scene.sources.register import TOML, checked_options, endings_like, readable, source_of
from eomgen.scene.sources.source import ConvertedScene, fault_of_kind, read_text, shown_file

#: The module by which pydantic looks for plugins when it makes a validator.
_PLUGINS = "pydantic.plugin._loader"


def load(
    path: str | Path,
    *,
    strict: bool = False,
    coordinates: Literal["joint", "absolute"] | None = None,
    task_frames: Sequence[str] = (),
    **options: Any,
) -> Scene:
    """Read a scene from a file of any kind in the register of sources.

    Parameters
    ----------
    path : str or Path
        The file; the ending determines the kind.
    strict : bool
        Raise an error for elements that an importer would leave out with a note.
    coordinates : str, optional
        ``joint`` or ``absolute``, in place of the file's choice (joint for a URDF).
    task_frames : sequence of str
        Bodies and frames that the terms of frames give, in place of the file's choice (all for a URDF).
    options
        Of the source: for URDF ``root``, ``lock``, ``limits``, ``friction``,
        ``actuated``, ``transmissions`` and ``tunable``.

    Raises
    ------
    FileError
        If the file cannot be read or is larger than 10 MB.
    DescriptionError
        With all faults of the content.
    UsageError
        If the kind of file is unknown, or an option does not fit the kind.
    """
    path = _expand_user(path)
    if coordinates not in (None, "joint", "absolute"):
        raise UsageError(f"coordinates are {shown(coordinates)} [E1678]", "joint or absolute")
    read = _read(path, strict=strict, **options)
    return _from_read(read, shown_file(path), coordinates, path.parent, task_frames)


def data_of(path: str | Path, *, strict: bool = False, **options: Any) -> dict[str, Any]:
    """Return a scene's nested data, in the form of ``from_data``, from any kind of file in the register of sources.

    Raises FileError, DescriptionError or UsageError, as ``load``.
    """
    return dict(_read(_expand_user(path), strict=strict, **options).data)


def _expand_user(path: str | Path) -> Path:
    """Return a path with the home folder in place of ``~``. Raises UsageError for a text of several lines, which is the
    content of a file rather than a path."""
    if "\n" in str(path):
        fault = f"the path of a file is needed, and {shown(str(path))} is a text of several lines [E1679]"
        more = "" if str(path).lstrip().startswith("<") else ", or load(tomllib.loads(text))"
        raise UsageError(Problem("path", fault, f"the path of a file that holds the text{more}"))
    try:
        return Path(path).expanduser()
    except RuntimeError:  # no home folder: the path is used unchanged
        return Path(path)


def _read(path: Path, *, strict: bool, **options: Any) -> ConvertedScene:
    source = source_of(path)
    if source is None:
        if not path.suffix and not path.exists():
            raise UsageError(f"there is no file {str(path)!a} [E2145]", readable(path))
        if absent := fault_of_absent(path.suffix.lower()):
            raise UsageError(f"{str(path)!a} cannot be read: {absent[0]} [E0902]", absent[1])
        raise UsageError(f"{str(path)!a} is not a kind of file that can be read [E1680]", readable(path))
    specified = checked_options(source, options)
    return source.convert(read_text(path, endings_like(path)), path, strict=strict, included=False, **specified)


def load_toml(
    text: str,
    *,
    file: str = "scene.toml",
    coordinates: Literal["joint", "absolute"] | None = None,
    folder: Path | None = None,
) -> Scene:
    """Return the scene of the text of a TOML file. ``file`` is the name for messages, ``coordinates`` as in ``load``,
    ``folder`` is the base of relative paths. Raises DescriptionError."""
    return _from_read(TOML.read(text, file=file), file, coordinates, folder)


def _from_read(
    read: ConvertedScene,
    file: str,
    coordinates: Literal["joint", "absolute"] | None,
    folder: Path | None,
    task_frames: Sequence[str] = (),
) -> Scene:
    """Check the data that a source has read from ``file``, and return the Scene; arguments as of ``load``, which
    replace the file's own choices if given. ``folder`` is the folder of relative paths."""
    names = [task_frames] if isinstance(task_frames, str) else list(task_frames)
    return from_data(
        {**read.data, "task_frames": names} if names else read.data,
        file=file,
        lines=read.lines,
        notes=read.notes,
        metadata=read.metadata,
        inertias_checked=read.inertias_checked,
        coordinates=coordinates,
        folder=folder,
    )


@contextlib.contextmanager
def _without_plugins() -> Iterator[None]:
    """Make validators of tables without pydantic's search for plugins, whose imports take half as long as pydantic's
    own.

    The search stays while other threads run, which may make models of their own.
    """
    if _PLUGINS in sys.modules or threading.active_count() > 1:
        yield
        return
    substitute: Any = ModuleType(_PLUGINS)
    substitute.get_plugins = tuple
    sys.modules[_PLUGINS] = substitute
    try:
        yield
    finally:
        del sys.modules[_PLUGINS]


@without_garbage_collection()
def from_data(
    data: Mapping[str, Any],
    *,
    file: str = "scene",
    lines: Mapping[str, int | str] | None = None,
    problems: Sequence[Problem] = (),
    notes: Sequence[str] = (),
    metadata: Mapping[str, Any] | None = None,
    inertias_checked: bool = False,
    coordinates: Literal["joint", "absolute"] | None = None,
    folder: Path | None = None,
) -> Scene:
    """Check nested data, in the form of a scene file, and return the scene.

    Parameters
    ----------
    data : mapping
        As ``tomllib`` reads a scene file.
    file, lines : str, mapping
        Origin of the data, for messages: the line of each dotted key, or ``file:line``.
    problems : sequence of Problem
        Known problems, to be reported together with further problems.
    notes, metadata
        Handed on to the scene.
    inertias_checked : bool
        Whether the source has checked the inertias already.
    coordinates : str, optional
        ``joint`` or ``absolute``, in place of the data's choice.
    folder : Path, optional
        Folder of relative paths of tables; the current folder by default.

    Raises
    ------
    DescriptionError
        With every problem that could be found.
    """
    with _without_plugins():
        from eomgen.scene.document.assemble import assemble  # noqa: PLC0415  # pydantic is slow to import

    metadata = dict(metadata or {})
    report = Report(file, lines or {})
    report.noted += [(0, problem) for problem in problems]
    if not data and not report.noted:
        report.add("", "the scene is empty [E1681]", 'format = 1, name = "...", and [bodies] and [joints]')
        report.raise_problems()
    if "kind" in data and (fault := fault_of_kind(data["kind"])):
        report.add("kind", *fault)
        report.raise_problems()
    if "repeat" in data:
        from eomgen.scene.repeat import expand_repeats  # noqa: PLC0415  # most scenes have none

        data = expand_repeats(data, report, counts=metadata.setdefault("repeat", {}))
    part = FileData(dict(data), {})
    if "include" in data:
        from eomgen.scene.include import with_included  # noqa: PLC0415  # most scenes have none

        part = with_included(data, report, folder or Path())
        report.lines = part.lines
    with _without_plugins():
        return assemble(
            part,
            report,
            notes=notes,
            metadata=metadata,
            inertias_checked=inertias_checked,
            coordinates=coordinates,
            folder=folder or Path(),
        )
