"""MJCF compiled by MuJoCo, and the lines at which its elements stand, also in included files."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.base.messages import nearest, shown
from eomgen.base.products import optional_package
from eomgen.errors import DescriptionError, Problem, UsageError
from eomgen.products.robots.leftovers import ElementPlace
from eomgen.scene.reading.xml import Element, read_xml
from eomgen.scene.sources.source import read_text, shown_file

#: Sections of a file whose children are elements of one kind, by the name of the kind.
_SECTIONS = {"actuator": "actuator", "equality": "equality", "tendon": "tendon", "sensor": "sensor", "keyframe": "key"}
#: Elements below bodies, by the name of the kind.
_OF_BODIES = {"body": "body", "joint": "joint", "freejoint": "joint", "site": "site", "geom": "geom"}
#: Depth at which MuJoCo's own reader of XML ends.
_DEEPEST = 500
#: Remedies for parts of MuJoCo's messages.
_REMEDIES = {
    "Error opening file": "a path from the folder of the file, or assetdir, meshdir and texturedir of <compiler>",
    "already included": "one <include> of each file, and none of a file that includes it",
    "unrecognized element": "the file as the MuJoCo that it is for saves it (mj_saveLastXML), or without the element",
    "unrecognized": "pip install -U mujoco, if the file is for a newer MuJoCo",
    "repeated name": "another name for one of them",
    "mjMINVAL": "a geom with mass in the body, or <inertial>",
    "engthrange": "lengthrange of the actuator, or limits of the joints that it moves",
}
_LINE = re.compile(r"\bline (\d+)")
_UNKNOWN = re.compile(r"(?:unknown element|unrecognized name) '([^']+)'|'([^']+)' (?:is )?not found")


@dataclass
class MjcfElements:
    """The elements of a file and of the included files, with their lines.

    Attributes
    ----------
    every : path of tags, element and file of each element
    named : place by kind and name
    ordered : places by kind, in the order of the compiled model
    includes : place of the last ``<include>`` of each file
    files : that are read
    liberties : notes on faults of their XML
    """

    every: list[tuple[str, Element, str]] = field(default_factory=list)
    named: dict[tuple[str, str], ElementPlace] = field(default_factory=dict)
    ordered: dict[str, list[ElementPlace]] = field(default_factory=dict)
    includes: dict[str, ElementPlace] = field(default_factory=dict)
    files: set[Path] = field(default_factory=set)
    liberties: list[str] = field(default_factory=list)

    def place(self, kind: str, name: str, number: int, count: int, file: str) -> ElementPlace:
        """Return the place of an element of a kind by name, or by number if there are ``count`` such elements. The
        first line of ``file`` if neither is known."""
        if name and (kind, name) in self.named:
            return self.named[kind, name]
        places = self.ordered.get(kind, [])
        return places[number] if len(places) == count else ElementPlace(file, 1)

    def first(self, tag: str, file: str) -> ElementPlace:
        """Return the place of the first element whose tag begins with ``tag``; the start of ``file`` without one."""
        places = (ElementPlace(name, element.line) for _, element, name in self.every if element.tag.startswith(tag))
        return next(places, ElementPlace(file, 1))

    def mentioning(self, word: str) -> ElementPlace | None:
        """Return the place of the last include of the file ``word``, or of the only element with this attribute name or
        value. None without such an element, or for several."""
        if word in self.includes:
            return self.includes[word]
        places = {
            ElementPlace(file, element.line)
            for _, element, file in self.every
            for name, value in element.attributes
            if word in (name, value) or (name == "file" and word.endswith(value))
        }
        return places.pop() if len(places) == 1 else None


def elements_of(text: str, file: str, path: Path | None) -> MjcfElements:
    """Return the elements of an MJCF text and of the included files, found from the folder of ``path``; without a path
    none are included. Raises DescriptionError for a text that is not MJCF."""
    result = MjcfElements()
    root = read_xml(text, file, _DEEPEST)
    if root.tag != "mujoco":
        fault = f"the outermost element is {shown(root.tag)}, not 'mujoco' [E1921]"
        raise DescriptionError(Problem(f"{file}:{root.line}", fault, "the file that includes this one"))
    result.liberties += root.liberties
    if path is not None:
        result.files.add(path.absolute())
    _walk(result, root, "", file, None if path is None else path.parent)
    return result


def _walk(result: MjcfElements, element: Element, path: str, file: str, folder: Path | None) -> None:
    """Record the children of an element in ``result``, with the elements of included files in their places. ``path``
    has the tags from the root, ``file`` is the name in messages, ``folder`` the folder of the root file. Child bodies
    come last, as in the compiled model, which numbers all geoms, joints and sites of a body before."""
    for child in sorted(element.children(), key=lambda child: child.tag == "body"):
        if child.tag == "include":
            result.includes[child.get("file")] = ElementPlace(file, child.line)
            for included, name in _included_roots(result, child, folder):
                _walk(result, included, path, name, folder)
            continue
        inner = f"{path}/{child.tag}" if path else child.tag
        result.every.append((inner, child, file))
        kind, location = _kind(path, child.tag), ElementPlace(file, child.line)
        if inner == "worldbody":
            result.ordered.setdefault("body", [location])  # the body 0, of all such sections together
        elif kind:
            result.ordered.setdefault(kind, []).append(location)
            if child.get("name"):
                result.named.setdefault((kind, child.get("name")), location)
        _walk(result, child, inner, file, folder)


def _kind(path: str, tag: str) -> str:
    if path in _SECTIONS:
        return _SECTIONS[path]
    return _OF_BODIES.get(tag, "") if path.startswith("worldbody") else ""


def _included_roots(result: MjcfElements, element: Element, folder: Path | None) -> Iterator[tuple[Element, str]]:
    """Yield the root of an included file with its name; none of a file that is missing or that is read already: MuJoCo
    refuses these. Raises DescriptionError for a file that is not XML."""
    path = None if folder is None else (folder / element.get("file")).absolute()
    if path is None or path in result.files or not path.exists():
        return
    result.files.add(path)
    root = read_xml(read_text(path), shown_file(path), _DEEPEST)
    result.liberties += root.liberties
    yield root, shown_file(path)


def mujoco_module() -> Any:
    """Return the package ``mujoco``. Raises UsageError if it is missing."""
    fault = "MJCF is compiled by MuJoCo, and the package mujoco is not installed [E1923]"
    mujoco = optional_package("mujoco", Problem("load", fault, "pip install 'eomgen[mujoco]'"))
    if not hasattr(mujoco.MjModel, "actuator_outadr"):
        fault = f"mujoco {mujoco.__version__} is older than 4.0, whose models are read [E1922]"
        raise UsageError(Problem("load", fault, "pip install -U 'eomgen[mujoco]'"))
    return mujoco


@contextmanager
def _caught(mujoco: Any) -> Iterator[list[str]]:
    """Collect the texts of MuJoCo's warnings within the block, in the resulting list: MuJoCo would print them, and
    write them to a file in the current folder. Warnings of Python are added at the end of the block."""
    texts: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(texts.append)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield texts
            texts += [str(warning.message) for warning in caught]
    finally:
        mujoco.set_mju_user_warning(before)


def compile_model(text: str, file: str, path: Path | None, elements: MjcfElements) -> tuple[Any, list[str]]:
    """Return the ``mujoco.MjModel`` of a file, static bodies kept, and texts of MuJoCo's warnings.

    The file at ``path`` is compiled, without a path the text.

    Raises
    ------
    DescriptionError
        With MuJoCo's message, at the place of the element if known.
    """
    mujoco = mujoco_module()
    try:
        with _caught(mujoco) as texts:
            spec = mujoco.MjSpec.from_string(text) if path is None else mujoco.MjSpec.from_file(str(path))
            _check_assets(spec, path)
            spec.compiler.fusestatic = False
            model = spec.compile()
        return model, [f"MuJoCo: {' '.join(text.split())}" for text in texts]
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise DescriptionError(_problem(str(error), file, elements)) from None


def _check_assets(spec: Any, path: Path | None) -> None:
    """Raise FileError for a file of a mesh, texture or height field that is not regular: MuJoCo would read a named
    pipe for ever. MuJoCo names missing files itself."""
    if path is None:
        return
    assets = ((spec.meshdir, (*spec.meshes, *spec.skins, *spec.hfields)), (spec.texturedir, spec.textures))
    files = {path.parent / folder / item.file for folder, items in assets for item in items if item.file}
    for file in sorted(files):
        if file.exists() and not file.is_file():
            read_text(file)


def _problem(message: str, file: str, elements: MjcfElements) -> Problem:
    """Return MuJoCo's message as a problem in one line, with the place of the element, or the file, and a remedy."""
    element = re.search(r"Element name '([^']*)', id \d+", message)
    words = re.sub(r"\s*(?:Element '[^']*', )?line \d+(?:, column \d+)?\s*", " ", message)
    words = re.sub(r"\s*Element name '[^']*', id \d+,?", "", words)
    words = " ".join(re.sub(r"^(?:(?:XML )?Error:\s*)+", "", words).split()).removeprefix("Schema violation: ")
    tag = re.search(r"Element '([^']*)', line", message)
    if tag and words.endswith("unrecognized element"):
        words += f" <{tag[1][:64]}>"
    if element and element[1] and f"'{element[1]}'" not in words:
        words += f" ({shown(element[1])})"
    location = _place_of(message, file, elements)
    if not location and _LINE.search(message):
        words += " (in an included file)"
    return Problem(location or file, f"MuJoCo refuses the file: {words} [E1924]", _remedy(words, elements))


def _place_of(message: str, file: str, elements: MjcfElements) -> str:
    """Return the place of MuJoCo's message as text, by the line there, which is 0 in included files, or by the element
    that the message names; empty for an unknown place."""
    line = _LINE.search(message)
    if line and int(line[1]):
        return f"{file}:{line[1]}"
    for word in re.findall(r"'([^']+)'", message):
        if location := elements.mentioning(word):
            return str(location)
    counted = re.search(r"\b(actuator|equality|key|sensor|tendon) (\d+)", message)
    ordered = elements.ordered.get(counted[1], []) if counted else []
    return str(ordered[int(counted[2])]) if counted and int(counted[2]) < len(ordered) else ""


def _remedy(words: str, elements: MjcfElements) -> str:
    """Return the names nearest to an unknown one, or the remedy for the fault; empty without one."""
    unknown = _UNKNOWN.search(words)
    known = [name for _, name in elements.named]
    if unknown and known:
        return nearest(unknown[1] or unknown[2], known)
    return next((remedy for part, remedy in _REMEDIES.items() if part in words), "")
