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
from eomgen.products.robots.sdf.coverage import STATUSES
from eomgen.products.robots.sdf.reading import FIRST
from eomgen.products.robots.sdf.values import NEWEST
from tests.robots.sdf_grammar import COMMAND, INNER, PAGE, Part, grammar, key_of, page


def test_every_part_of_the_grammar_has_a_status() -> None:
    parts = [(key, part.name) for key, own in grammar().items() for part in own]
    assert len(parts) > 170
    assert sorted(parts) == sorted((key, name) for key, names in STATUSES.items() for name in names)


def test_the_page_is_the_table() -> None:
    assert page() == PAGE.read_text(encoding="utf-8"), f"docs/sdf.md is not the table; run: {COMMAND}"


LINK = """<link name="{0}"><pose>{1}</pose><gravity>true</gravity><inertial><pose>0.1 0.02 0.03 0.1 0.2 0.3</pose>
<mass>{2}</mass><inertia><ixx>0.1</ixx><iyy>0.12</iyy><izz>0.15</izz><ixy>0.01</ixy><ixz>0.02</ixz><iyz>0.03</iyz>
</inertia><fluid_added_mass/></inertial><velocity_decay/></link>
"""
AXIS = """<{0}><xyz>{1}</xyz><dynamics><damping>0.1</damping><friction>0.2</friction>
<spring_stiffness>2</spring_stiffness><spring_reference>0.1</spring_reference></dynamics>
<limit><lower>-1</lower><upper>1</upper><effort>8</effort></limit></{0}>
"""
BARE = "<{0}><xyz>0 1 0.2</xyz><dynamics/><limit/></{0}>"
ONE, TWO = AXIS.format("axis", "0 1 0.2"), AXIS.format("axis", "0 1 0") + AXIS.format("axis2", "1 0 0")
MIMIC = ONE.replace("</axis>", '<mimic joint="continuous"><multiplier>2</multiplier></mimic></axis>')
JOINT = '<joint name="{0}" type="{0}"><parent>{1}</parent><child>{2}</child><pose>{3}</pose>{4}'
JOINT += "<physics><simbody/></physics></joint>\n"
#: A file with every element that has a row in the table, on joints of all types.
BASE = f"""<sdf version="1.12"><world name="place"><gravity>0 0.1 -9</gravity><physics type="ode"/>
<include><uri>part.sdf</uri><name>apart</name><pose>0 0 2 0 0 0</pose></include>
<model name="machine"><pose>0.1 0.2 0.3 0 0 0.4</pose><static>false</static>
<frame name="mount"><pose>0.2 0 0.1 0.3 0 0</pose></frame>
{LINK.format("ground", "0 0 0 0 0 0", 1)}{LINK.format("a", "0.1 0 0 0.1 0 0", 2)}{
    LINK.format("b", "0.3 0 0 0 0.1 0", 3)
}
{LINK.format("c", "0.4 0.2 0 0 0.1 0.3", 3)}{LINK.format("d", "0.5 0 0.3 0 0 0.2", 3)}{
    LINK.format("e", "0 1 0 0 0 0", 3)
}
{LINK.format("f", "0 1 1 0 0 0", 2)}{LINK.format("g", "0 2 0 0 0 0", 4)}{LINK.format("h", "0 3 0 0 0 0", 2)}
{LINK.format("i", "1 2 0 0 0 0", 2)}
{JOINT.format("fixed", "world", "ground", "0 0 0 0 0 0", ONE)}
{JOINT.format("revolute", "ground", "a", "0.1 0 0 0 0.1 0", ONE)}
{JOINT.format("prismatic", "a", "b", "0 0.1 0 0 0.1 0", ONE.replace("0.2</xyz>", "-0.3</xyz>"))}
{JOINT.format("universal", "b", "c", "0 0.1 0 0 0 0", TWO)}
{JOINT.format("revolute2", "c", "d", "0 0.1 0 0.1 0 0", TWO)}
{JOINT.format("ball", "ground", "e", "0 -1 0 0 0 0", BARE.format("axis"))}
{JOINT.format("loop", "a", "e", "0 0 0 0 0 0", "").replace('type="loop"', 'type="ball"')}
{JOINT.format("screw", "ground", "f", "0 0 0 0 0 0", "<thread_pitch>3</thread_pitch>" + MIMIC)}
{JOINT.format("continuous", "ground", "g", "0 0 0 0 0 0", ONE)}
{JOINT.format("wheel", "ground", "i", "0 0 0 0 0 0", ONE).replace('type="wheel"', 'type="revolute"')}
{
    JOINT.format(
        "gearbox",
        "g",
        "i",
        "0 0 0 0 0 0",
        "<gearbox_ratio>3</gearbox_ratio>"
        "<gearbox_reference_body>ground</gearbox_reference_body>" + BARE.format("axis") + BARE.format("axis2"),
    )
}
</model></world></sdf>"""
PIECE = LINK.format("piece", "0 0 1 0 0 0", 2).replace("<fluid_added_mass/>", "")
PART = f'<sdf version="1.4"><model name="part">{PIECE}</model></sdf>'
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


@pytest.mark.slow
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
