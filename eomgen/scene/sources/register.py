"""The register of sources, eomgen's own and sources of other distributions."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from eomgen.base.extensions import broken, extensions, load_row
from eomgen.base.files import open_file
from eomgen.base.messages import nearest, shown
from eomgen.base.products import rows_of
from eomgen.errors import Problem, UsageError
from eomgen.scene.sources.source import LARGEST_FILE, ConvertedScene, Option, Source

#: The group of entry points for sources of other distributions: objects of the class ``Source``.
GROUP = "eomgen.sources"


def _read_toml(text: str, **options: Any) -> ConvertedScene:
    from eomgen.scene.sources.renamed_keys import read_toml  # noqa: PLC0415  # a scene of a record is not read

    return read_toml(text, **options)


TOML = Source("TOML", (".toml",), "a .toml scene", _read_toml, scenes=True, recorded=True)


@cache
def own_sources() -> tuple[Source, ...]:
    """Return eomgen's own sources: scene files, and the sources of products."""
    return (TOML, *rows_of(GROUP, Source))


@cache
def sources() -> tuple[Source, ...]:
    """Return all sources, eomgen's own first. Raises UsageError with the name of a distribution whose source cannot be
    taken, or reads an ending of another source."""
    result = list(own_sources())
    for entry in extensions(GROUP):
        source = load_row(entry, Source)
        taken = [ending for ending in source.endings if any(ending in known.endings for known in result)]
        if taken:
            raise broken(entry, f"reads {taken[0]} files, which another source does")
        result.append(source)
    return tuple(result)


def source_of(path: Path) -> Source | None:
    """Return the source that reads a file, by the ending of the file's name, and by the outermost element of XML if
    several of eomgen's own sources share the ending; None without a source."""
    ending = path.suffix.lower()
    core = [source for source in own_sources() if ending in source.endings]
    if len(core) > 1:
        root = _root_of(path)
        return next((source for source in core if source.root and root.startswith(source.root)), core[0])
    return (core[0] if core else None) or next((source for source in sources() if ending in source.endings), None)


def own_endings() -> tuple[str, ...]:
    """Return the endings of eomgen's own sources."""
    return tuple(ending for source in own_sources() for ending in source.endings)


def endings_like(path: Path) -> set[str]:
    """Return the endings of eomgen's own sources, and the ending of a file."""
    return {path.suffix.lower(), *own_endings()}


def recorded_endings() -> tuple[str, ...]:
    """Return the endings of files of which a reading can be kept."""
    others = {ending for source in own_sources() if not source.recorded for ending in source.endings}
    return tuple(ending for ending in own_endings() if ending not in others)


def one_of_each() -> str:
    """Return a file of each of eomgen's own sources, for hints."""
    *others, last = [source.article for source in own_sources()]
    return f"{', '.join(others)} or {last}" if others else last


def readable(path: Path) -> str:
    """Return a hint for a file that no source reads: scenes in a folder of that name, the name with an ending, or the
    kinds of files that can be read."""
    ending = path.suffix.lower()
    if ending == ".npz":
        return f"eomgen.Solution.load({shown(path.name)}), if it is a solution; eomgen plot draws it, too"
    with contextlib.suppress(OSError, ValueError):  # of names that are none, such as the empty one
        files = sorted(path.iterdir()) if path.name and path.is_dir() else []
        if scenes := [str(file) for file in files if file.is_file() and source_of(file) is not None][:3]:
            return " or ".join(scenes)
        longer = [path.with_name(path.name + end) for source in sources() for end in source.endings]
        if not ending and (present := [str(file) for file in longer if file.is_file()]):
            return " or ".join(present)
    hints = (source.elsewhere[ending] for source in sources() if ending in source.elsewhere)
    *others, last = [source.article for source in sources()]
    return next(hints, f"{', '.join(others)} or {last}")


def all_options() -> dict[str, tuple[Source, Option]]:
    """Return the options of eomgen's own sources by name; of one that several have, the first source's."""
    result: dict[str, tuple[Source, Option]] = {}
    for source in own_sources():
        for option in source.options:
            result.setdefault(option.name, (source, option))
    return result


def takes(path: Path, option: str) -> bool:
    """Return whether the format of a file has an option of this name."""
    return any(item.name == option for item in getattr(source_of(path), "options", ()))


def formats_with(source: Source, option: Option) -> str:
    """Return the names of the formats that have an option of a source, for texts about the option."""
    shared = [origin.name for origin in own_sources() if source in own_sources() and option in origin.options]
    return ", ".join(shared or [source.name])


def checked_options(source: Source | None, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values, by name, of the ``options`` that a source has; options of other sources with default
    values are left out. ``source`` is None for nested data or a Scene. Raises UsageError for unknown options, options
    of other kinds of file, or invalid values."""
    rows = all_options()
    if not options.keys() <= rows.keys():
        rows = {option.name: (origin, option) for origin in sources() for option in origin.options}
    if unknown := [name for name in options if name not in rows]:
        names = ["path", "strict", "coordinates", "task_frames", *rows]
        meant = {word: hint for source in own_sources() for word, hint in source.words.items()}
        hint = nearest(unknown[0], names, meant)
        raise UsageError(Problem("load", f"there is no argument {shown(unknown[0])} [E0105]", hint))
    of = {option.name: option for option in source.options} if source is not None else {}
    specified = [
        name
        for name, value in options.items()
        if name not in of and (value or rows[name][1].default != ()) and value != rows[name][1].default
    ]
    if specified:
        raise _other_source_error(source, specified, *rows[specified[0]])
    for name in of.keys() & options.keys():
        _check_value(of[name], options[name])
    return {name: value for name, value in options.items() if name in of}


def _other_source_error(source: Source | None, specified: Sequence[str], owner: Source, option: Option) -> UsageError:
    """Return, without raising, the error for the options ``specified`` of another source than the file's, ``owner``;
    ``option`` is the first of them."""
    if source is None:
        fault = f"{', '.join(specified)}: for {owner.name} files only [E1934]"
        return UsageError(Problem("load", fault, f"the path of {owner.article}, or none of them"))
    *first, last = (item.name for item in owner.options)
    every = f"{', '.join(first)} and {last}" if first else last
    fault = f"{every} are for {owner.name} only [E1935]"
    return UsageError(fault, option.elsewhere or "keys of the joint in the scene file")


def _check_value(option: Option, value: object) -> None:
    """Raise UsageError for a value that is not among the choices of an option, or is not a truth value for a flag."""
    if option.choices and value not in option.choices:
        raise UsageError(f"{option.name} is {shown(value)} [E1936]", " or ".join(option.choices))
    if isinstance(option.default, bool) and not isinstance(value, bool):
        fault = f"True or False is needed, not {type(value).__name__} [E1937]"
        hint = f"{option.name}=True, for all joints" if value else f"{option.name}=False"
        raise UsageError(Problem(option.name, fault, hint))


def _root_of(path: Path) -> str:
    """Return the tag of the outermost element in an XML file; empty if the file cannot be read or has none."""
    from eomgen.scene.reading.xml import root_tag  # noqa: PLC0415  # for endings that several formats share

    try:
        with open_file(path) as stream:
            return root_tag(stream.read(LARGEST_FILE).decode("utf-8", "replace"))
    except (OSError, ValueError):
        return ""
