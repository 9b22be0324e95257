"""MJCF compiled by MuJoCo, and the lines at which its elements stand, also in included files."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.base.messages import shown
from eomgen.errors import DescriptionError, EomgenError, Problem, UsageError
from eomgen.scene.reading.xml import Element, read_xml
from eomgen.scene.sources.draft import Place
from eomgen.scene.sources.source import read_text, shown_file

#: Sections of a file whose children are elements of one kind, by the name of the kind.
_SECTIONS = {"actuator": "actuator", "equality": "equality", "tendon": "tendon", "sensor": "sensor", "keyframe": "key"}
#: Elements below bodies, by the name of the kind.
_OF_BODIES = {"body": "body", "joint": "joint", "freejoint": "joint", "site": "site", "geom": "geom"}
_DEEPEST = 20
_COMMENT = re.compile(r"(?<=<!--).*?(?=-->)", re.DOTALL)
#: An attribute without a blank before the next attribute.
_TIGHT = re.compile(r"""(=\s*(?:"[^"<>]*"|'[^'<>]*'))(?=[A-Za-z_])""")


@dataclass
class Elements:
    """The elements of a file and of the files that it includes.

    Attributes
    ----------
    every : all elements with their files, sections of the top level with their paths
    named : place by kind and name
    ordered : places by kind, in the order of the file
    """

    every: list[tuple[str, Element, str]] = field(default_factory=list)
    named: dict[tuple[str, str], Place] = field(default_factory=dict)
    ordered: dict[str, list[Place]] = field(default_factory=dict)

    def place(self, kind: str, name: str, number: int, count: int, file: str) -> Place:
        """Return the place of an element by its name, of one without a name by its number among ``count``."""
        if name and (kind, name) in self.named:
            return self.named[kind, name]
        places = self.ordered.get(kind, [])
        return places[number] if len(places) == count else Place(file, 1)

    def first(self, tag: str, file: str) -> Place:
        """Return the place of the first element whose tag begins so; the start of the file without one."""
        places = (Place(name, element.line) for _, element, name in self.every if element.tag.startswith(tag))
        return next(places, Place(file, 1))


def elements_of(text: str, file: str, path: Path | None) -> Elements:
    """Return the elements of an MJCF text. Raises DescriptionError for a text that is not MJCF."""
    result = Elements()
    root = read_xml(_strict(text), file)
    if root.tag != "mujoco":
        problem = Problem(f"{file}:{root.line}", f"the outermost element is {shown(root.tag)}, not 'mujoco'", "")
        raise DescriptionError(problem)
    folder = None if path is None else path.parent
    _walk(result, root, "", file, folder, 0)
    return result


def _strict(text: str) -> str:
    """Return a text without two liberties that MuJoCo's reader allows and XML does not: hyphens within comments, and
    attributes without a blank between them. The lines are the same."""
    return _TIGHT.sub(r"\1 ", _COMMENT.sub(lambda comment: comment[0].replace("-", "="), text))


def _walk(result: Elements, element: Element, path: str, file: str, folder: Path | None, depth: int) -> None:
    """Record the children of an element, with the elements of included files in their places."""
    for child in element.children():
        if child.tag == "include":
            for included, name in _included(child, folder, depth):
                _walk(result, included, path, name, folder, depth + 1)
            continue
        own = f"{path}/{child.tag}" if path else child.tag
        result.every.append((own, child, file))
        kind = _kind(path, child.tag)
        if kind:
            place = Place(file, child.line)
            result.ordered.setdefault(kind, []).append(place)
            if child.get("name"):
                result.named.setdefault((kind, child.get("name")), place)
        _walk(result, child, own, file, folder, depth)


def _kind(path: str, tag: str) -> str:
    if path in _SECTIONS:
        return _SECTIONS[path]
    return _OF_BODIES.get(tag, "") if path.startswith("worldbody") else ""


def _included(element: Element, folder: Path | None, depth: int) -> Iterator[tuple[Element, str]]:
    """Yield the root of an included file with its name; none if it cannot be read here: MuJoCo says why."""
    if folder is None or depth >= _DEEPEST or not element.get("file"):
        return
    path = folder / element.get("file")
    try:
        yield read_xml(_strict(read_text(path)), shown_file(path)), shown_file(path)
    except EomgenError:
        return


def mujoco_module() -> Any:
    """Return the package ``mujoco``. Raises UsageError if it is missing."""
    try:
        import mujoco  # noqa: PLC0415  # an extra
    except ImportError:
        fault = "MJCF is compiled by MuJoCo, and the package mujoco is not installed"
        raise UsageError(Problem("load", fault, "pip install 'eomgen[mujoco]'")) from None
    if not hasattr(mujoco.MjModel, "dof_dampingpoly"):
        fault = f"mujoco {mujoco.__version__} is older than 3.7, whose models are read"
        raise UsageError(Problem("load", fault, "pip install -U 'eomgen[mujoco]'"))
    return mujoco


def compiled(text: str, file: str, path: Path | None) -> tuple[Any, list[str]]:
    """Return the ``mujoco.MjModel`` of a file, static bodies kept, and MuJoCo's warnings.

    Raises
    ------
    DescriptionError
        With MuJoCo's message.
    """
    mujoco = mujoco_module()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            spec = mujoco.MjSpec.from_string(text) if path is None else mujoco.MjSpec.from_file(str(path))
            spec.compiler.fusestatic = False
            return spec.compile(), [f"MuJoCo: {' '.join(str(warning.message).split())}" for warning in caught]
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise DescriptionError(_problem(str(error), file)) from None


def _problem(message: str, file: str) -> Problem:
    """Return MuJoCo's message as one line, with the line of the file that it names."""
    line = re.search(r"\bline (\d+)", message)
    words = re.sub(r"\s*(?:Element '[^']*', )?line \d+(?:, column \d+)?\s*", " ", message)
    words = " ".join(re.sub(r"^(?:XML )?Error:\s*", "", words).split())
    return Problem(f"{file}:{line[1]}" if line else file, f"MuJoCo refuses the file: {words}", "")
