"""SDF: each part of the format's grammar is read, counted, noted or refused with its line, in every version."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from eomgen.errors import DescriptionError
from eomgen.products.robots.leftovers import NOTED, READ, REFUSED
from eomgen.products.robots.sdf.conversion import sdf_data
from eomgen.products.robots.sdf.values import STATUSES
from tests.robots.sdf_grammar import COMMAND, FIRST, INNER, NEWEST, PAGE, Part, grammar, key_of, page


def test_every_part_of_the_grammar_has_a_status() -> None:
    parts = [(key, part.name) for key, own in grammar().items() for part in own]
    assert len(parts) > 170
    assert sorted(parts) == sorted((key, name) for key, names in STATUSES.items() for name in names)


def test_the_page_is_the_table() -> None:
    assert page() == PAGE.read_text(encoding="utf-8"), f"docs/sdf.md is not the table; run: {COMMAND}"


#: A file with every element that has a row in the table, on joints of all types, and a file that it includes.
BASE, PART = (Path(__file__).with_name(name).read_text(encoding="utf-8") for name in ("every_element.sdf", "part.sdf"))
#: Values of texts that are no numbers, by part; the first that differs from the one in the file.
TEXTS = {
    "parent": ("e", "h"),
    "child": ("h", "e"),
    "gearbox_reference_body": ("e",),
    "uri": ("other.sdf",),
    "name": ("another",),
    "@name": ("another",),
    "@type": ("revolute", "prismatic"),
    "@version": ("2.0",),
    "@relative_to": ("mount",),
    "@frame": ("mount",),
    "@attached_to": ("b",),
    "@expressed_in": ("mount",),
    "@canonical_link": ("a",),
    "@placement_frame": ("b",),
    "placement_frame": ("piece",),
    "@rotation_format": ("quat_xyzw",),
    "@joint": ("revolute",),
    "@axis": ("axis2",),
}
NUMBERS = {"bool": "true", "vector3": "0.3 0.2 -0.4", "pose": "0.1 0.2 0.3 0.3 0.2 0.1"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "part.sdf").write_text(PART, encoding="utf-8")
    return tmp_path


#: Elements that are not read, and whose parts are tried.
BY_PARTS = ("velocity_decay", "fluid_added_mass")


@dataclass(frozen=True)
class Mutant:
    """A file in which one part has another value; ``owner`` is the path of names of its element."""

    text: str
    key: str
    part: Part
    owner: str

    @property
    def label(self) -> str:
        return f"{self.owner} {self.key} {self.part.name}"


def base(minor: int) -> ElementTree.Element:
    """Return the file in a version, without the elements that this version does not have."""
    root = ElementTree.fromstring(BASE)
    root.set("version", f"1.{minor}")

    def prune(element: ElementTree.Element, key: str) -> None:
        known = {part.name for part in grammar().get(key, ()) if part.first <= minor <= part.last}
        for child in list(element):
            if child.tag not in known:
                element.remove(child)
            else:
                prune(child, key_of(child.tag, element.tag))

    prune(root, "sdf")
    return root


def elements(root: ElementTree.Element) -> Iterator[tuple[str, str, ElementTree.Element]]:
    """Yield key, path of names and element, for all elements with a row."""
    waiting = [("sdf", "", root)]
    while waiting:
        key, owner, element = waiting.pop()
        if key in STATUSES:
            yield key, owner, element
        for child in element:
            named = f"{owner}/{child.get('name')}" if child.get("name") else f"{owner}/{child.tag}"
            waiting.append((key_of(child.tag, element.tag), named, child))


def mutants(key: str, minor: int, most: int) -> Iterator[Mutant]:
    """Yield the mutants of ``most`` elements with a key in one version, first of the revolute joint."""
    root = base(minor)
    every = [found for found in elements(root) if found[0] == key]
    every.sort(key=lambda found: "/revolute" not in found[1].replace("revolute2", ""))
    for _, owner, element in every[:most]:
        for part in grammar()[key]:
            if not part.first <= minor <= part.last:
                continue
            if part.type == INNER and (STATUSES[key][part.name] == READ or part.name in BY_PARTS):
                continue
            before = deepcopy(element)
            if change(element, part):
                yield Mutant(ElementTree.tostring(root, encoding="unicode"), key, part, owner)
            element[:] = before[:]
            element.text = before.text
            element.attrib = dict(before.attrib)


def change(element: ElementTree.Element, part: Part) -> bool:
    """Give a part of an element another value."""
    tag = part.name.removeprefix("@")
    present = element.find(tag)
    old = element.get(tag, "") if part.name != tag else "" if present is None else present.text or ""
    if part.name in TEXTS:
        new = next(text for text in TEXTS[part.name] if text != old)
    elif part.type == "bool":
        new = "false" if old == "true" or tag == "gravity" else "true"
    else:
        new = NUMBERS.get(part.type, f"{float(old or 0) + 0.3:.6g}" if part.type in ("double", "int") else "")
    if part.name != tag:
        element.set(tag, new)
        if new == "quat_xyzw":
            element.text = "0.1 0.2 0.3 0.5 0.5 0.5 0.5"
        # angles of zero are alike
        return tag != "degrees" or len(set((element.text or "0").split()[3:])) > 1
    if present is None:
        present = ElementTree.SubElement(element, tag)
        present.attrib = {"name": "new", "type": "new"} if part.type == INNER else {}
    present.text = new
    return True


def outcome(text: str, folder: Path, *, strict: bool = False) -> tuple[dict[str, Any], tuple[str, ...]]:
    found = sdf_data(
        text, file="model.sdf", strict=strict, path=folder / "model.sdf", limits=True, friction=True, actuated=True
    )
    return found.data, tuple(found.notes)


#: Values that are felt nowhere, by a part of the mutant's label: a note of the base file stands for some.
UNFELT = (
    (r"^/place/physics", "1 physics"),
    (r"^/place/machine/ground", "merged into the bod"),
    (r"^/place/machine/fixed/axis", "1 axis of fixed joints"),
    (r"^/place/machine/fixed", "merged into the bod"),
    (
        r"^/place/machine/ball/axis .*(xyz|use_parent_model_frame)|^/place/machine/ball/axis/xyz",
        "1 direction of ball joints",
    ),
    (r"^/place/machine/continuous/axis/limit", "1 limits of continuous joints"),
    (r"must_be_loop_joint", ""),  # of a joint without which its link would be free
    (r"/(gearbox|ball)/axis2?/dynamics dynamics spring_reference", ""),  # without a spring
    (r"/(gearbox|ball)/axis2?/limit limit (stiffness|dissipation)", ""),  # without a range
    (r"use_parent_model_frame", ""),  # the frame of the joint is parallel
    (r"/gearbox joint pose", ""),
)


def tried(keys: Collection[str], minor: int, folder: Path, most: int) -> tuple[set[tuple[str, str]], list[str]]:
    """Return the parts that were felt or noted for one of their elements, and the labels of mutants that are silent, or
    have another status than the table says; ``most`` of the elements with a key are tried."""
    data, notes = outcome(ElementTree.tostring(base(minor), encoding="unicode"), folder)
    met: set[tuple[str, str]] = set()
    wrong = []
    for mutant in [mutant for key in keys for mutant in mutants(key, minor, most)]:
        status = STATUSES[mutant.key][mutant.part.name]
        met_now, said = False, ""
        try:
            new, new_notes = outcome(mutant.text, folder)
        except DescriptionError as error:
            said = str(error)
            met_now = status in (READ, REFUSED) and re.search(r"(model|part)\.sdf:\d+", said) is not None
        else:
            noted, changed = new_notes != notes, new != data
            met_now = (changed or noted) if status == READ else noted and not changed and status != REFUSED
            if status == NOTED and met_now:
                with pytest.raises(DescriptionError, match=r"model\.sdf:[0-9]+.*no --strict"):
                    outcome(mutant.text, folder, strict=True)
        reason = None if met_now else next((note for label, note in UNFELT if re.search(label, mutant.label)), None)
        if met_now or reason:
            met.add((mutant.key, mutant.part.name))
        if not met_now and (reason is None or not any(reason in note for note in notes)):
            wrong.append(f"{mutant.label} ({status}) {said}")
    return met, wrong


def parts(keys: Collection[str], minor: int) -> set[tuple[str, str]]:
    """Return the parts that a version has, without elements whose own parts are tried."""
    own = [(key, part) for key in keys for part in grammar()[key] if part.first <= minor <= part.last]
    inner = {(key, part.name) for key, part in own if part.type == INNER}
    return {(key, part.name) for key, part in own} - {
        (key, name) for key, name in inner if STATUSES[key][name] == READ or name in BY_PARTS
    }


QUICK = ("include", "frame", "velocity_decay", "inertial/pose")


def test_no_part_of_some_elements_is_silent(folder: Path) -> None:
    met, wrong = tried(QUICK, NEWEST, folder, 1)
    assert wrong == []
    assert parts(QUICK, NEWEST) - met == set()


@pytest.mark.long
@pytest.mark.parametrize(("minor", "most"), [(FIRST, 1), ((FIRST + NEWEST) // 2, 1), (NEWEST, 3)])
def test_no_part_of_any_element_is_silent_in_a_version(minor: int, most: int, folder: Path) -> None:
    met, wrong = tried(STATUSES, minor, folder, most)
    assert wrong == []
    assert parts(STATUSES, minor) - met == set()
