"""Scenes from files, TOML and URDF, and from data of the same form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from eomgen.errors import Problem, UsageError
from eomgen.scene.reading.part import Part
from eomgen.scene.reading.report import Report
from eomgen.scene.scene import Scene
from eomgen.scene.sources.text import read_text, shown_file
from eomgen.scene.sources.toml import toml_data
from eomgen.text import shown


def load(
    path: str | Path,
    *,
    strict: bool = False,
    root: str = "fixed",
    lock: Sequence[str] = (),
    limits: bool = False,
    friction: bool = False,
    coordinates: Literal["joint", "absolute"] | None = None,
) -> Scene:
    """Read a scene from a ``.toml`` or ``.urdf`` file.

    Parameters
    ----------
    path : str or Path
        The file.
    strict : bool
        Refuse what an importer would leave out with a note.
    root : str
        For URDF: whether the root link is ``fixed`` to the base or ``free``.
    lock : sequence of str
        For URDF: moving joints to be fixed at zero.
    limits : bool
        For URDF: turn limits of position into compliant stops, as hard as the joints' largest efforts ask for.
    friction : bool
        For URDF: take the dry friction of joints, regularised at 0.01 rad/s and 1 mm/s.
    coordinates : str, optional
        ``joint`` or ``absolute``, in place of what the file says (a URDF says joint).

    Raises
    ------
    FileError
        If the file cannot be read or is larger than 10 MB.
    DescriptionError
        With everything that is wrong with its content.
    UsageError
        If the kind of file is not known, or an option does not fit it.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (".toml", ".urdf", ".xml"):
        hint = "xacro first, to make a .urdf of it" if kind == ".xacro" else "a .toml scene or a .urdf file"
        raise UsageError(f"{str(path)!a} is not a kind of file that can be read", hint)
    if kind == ".toml" and (root != "fixed" or lock or limits or friction):
        raise UsageError("root, lock, limits and friction are for URDF only", "keys of the joint in the scene file")
    if coordinates not in (None, "joint", "absolute"):
        raise UsageError(f"coordinates are {shown(coordinates)}", "joint or absolute")
    text, file = read_text(path), shown_file(path)
    if kind == ".toml":
        return load_toml(text, file=file, coordinates=coordinates, folder=path.parent)
    asked: dict[str, Any] = {"lock": lock, "limits": limits, "friction": friction}
    return load_urdf(text, file=file, strict=strict, root=root, coordinates=coordinates, **asked)


def load_toml(
    text: str,
    *,
    file: str = "scene.toml",
    coordinates: Literal["joint", "absolute"] | None = None,
    folder: Path | None = None,
) -> Scene:
    """Read a scene from the text of a TOML file.

    ``file`` is the name for messages, ``coordinates`` as in ``load``, ``folder`` where the paths of tables start.

    Raises
    ------
    DescriptionError
    """
    data, lines = toml_data(text, file)
    return from_data(data, file=file, lines=lines, coordinates=coordinates, folder=folder)


def load_urdf(
    text: str,
    *,
    file: str = "robot.urdf",
    strict: bool = False,
    root: str = "fixed",
    lock: Sequence[str] = (),
    limits: bool = False,
    friction: bool = False,
    coordinates: Literal["joint", "absolute"] | None = None,
) -> Scene:
    """Read a scene from the text of a URDF file; see ``load``.

    Raises
    ------
    DescriptionError, UsageError
    """
    from eomgen.scene.sources.urdf.conversion import urdf_data  # noqa: PLC0415  # pydantic is slow to import

    if root not in ("fixed", "free"):
        raise UsageError(f"root is {shown(root)}", "fixed or free")
    data, lines, notes = urdf_data(text, file=file, strict=strict, root=root, lock=lock, limits=limits, friction=friction)
    return from_data(data, file=file, lines=lines, notes=notes, inertias_checked=True, coordinates=coordinates)


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
        Where the data came from, for messages: the line of each dotted key, or ``file:line``.
    problems : sequence of Problem
        Found before, to be reported together with what is found here.
    notes, metadata
        Handed on to the scene.
    inertias_checked : bool
        True where whoever made the data has judged the inertias already.
    coordinates : str, optional
        ``joint`` or ``absolute``, in place of what the data say.
    folder : Path, optional
        Where the paths of tables start; the current folder by default.

    Raises
    ------
    DescriptionError
        With every problem that could be found.
    """
    from eomgen.scene.document.assemble import assemble  # noqa: PLC0415  # pydantic is slow to import

    report = Report(file, lines or {})
    report.found += [(0, problem) for problem in problems]
    if not data and not report.found:
        report.add("", "the scene is empty", 'format = 1, name = "...", and [bodies] and [joints]')
        report.raise_problems()
    part = Part(dict(data), {})
    if "include" in data:
        from eomgen.scene.sources.include import with_included  # noqa: PLC0415  # most scenes have none

        part = with_included(data, report, folder or Path())
        report.lines = part.lines
    return assemble(
        part, report, notes=notes, metadata=metadata or {}, inertias_checked=inertias_checked, coordinates=coordinates,
        folder=folder or Path(),
    )  # fmt: skip
