"""Reading of SDF files, with included files."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from eomgen.base.data import replace
from eomgen.base.messages import listed, nearest, shown
from eomgen.errors import DescriptionError, FileError
from eomgen.products.robots.draft import (
    MODEL_FRAME,
    WORLD_FRAME,
    Axis,
    Draft,
    DraftFrame,
    DraftJoint,
    DraftLink,
    DraftMimic,
    DraftModel,
    Gear,
    WrittenPose,
)
from eomgen.products.robots.leftovers import Leftovers
from eomgen.products.robots.sdf.values import STATUSES, Minor, SdfValues
from eomgen.products.robots.sdf.visuals import visuals_of_link
from eomgen.products.robots.uris import is_remote, is_there, locate
from eomgen.products.robots.visuals import LEFT_OUT
from eomgen.scene.inertia import Inertia, tensor
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import Element, read_xml
from eomgen.scene.sources.source import read_text, shown_file

#: Types of joints: their types in scenes, empty for the one that has none, and their number of axes.
TYPES: Mapping[str, tuple[str, int]] = {
    "revolute": ("revolute", 1),
    "continuous": ("revolute", 1),
    "prismatic": ("prismatic", 1),
    "screw": ("helical", 1),
    "universal": ("universal", 2),
    "revolute2": ("universal", 2),
    "ball": ("spherical", 0),
    "fixed": ("fixed", 0),
    "gearbox": ("", 2),
}
_VERSION = re.compile(r"1\.([0-9]{1,4})")
_RESERVED = re.compile(f"{WORLD_FRAME}|__.*__")
#: Numbers of elements with their defaults.
_MOMENTS = {"ixx": 1.0, "iyy": 1.0, "izz": 1.0, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
_MIMIC = {"multiplier": 1.0, "offset": 0.0, "reference": 0.0}
_DYNAMICS = dict.fromkeys(("damping", "friction", "spring_stiffness", "spring_reference"), 0.0)
#: Gravity of a world that gives none, m/s^2.
WORLD_GRAVITY = (0.0, 0.0, -9.8)
_Item = DraftLink | DraftJoint | DraftFrame | DraftModel


class SdfReader:
    """Reads an SDF file and the files that it includes.

    Parameters
    ----------
    report : Report
        Takes the faults of all files.
    packages : mapping
        Folders of packages and models by name.
    home : Path
        Folder of the file.
    """

    def __init__(self, report: Report, packages: Mapping[str, Path], home: Path) -> None:
        self.report, self.packages = report, packages
        self.leftovers = Leftovers(STATUSES)
        self.home = home
        self.undrawn: dict[tuple[str, str], list[str]] = {}
        self.defaulted: list[str] = []
        self.liberties: list[str] = []

    def draft(self, root: Element, file: str, folder: Path) -> Draft:
        """Return the draft of a file from the root element; models outside of a world are put into an empty one. `file`
        is the name in messages, `folder` the folder of the file. Raises DescriptionError for all faults together."""
        reading = _FileReader(self, file, folder, ())
        self.liberties += root.liberties
        if not reading.read_version(root):
            self.report.raise_problems()
        worlds = list(root.children_with_tag("world"))
        result = DraftModel(WORLD_FRAME, reading.place(root), WrittenPose(reading.place(root)))
        gravity, name = None, ""
        for element in worlds[:1]:
            result.place = reading.place(element)
            gravity = reading.gravity(element)
            name = element.get("name").replace("default", "")
            reading.contents(element, "world", result)
        for element in worlds[1:]:
            reading.refuse(element, "a file with several worlds is not read [E1947]", "a file for each")
        for element in root.children_with_tag("model"):
            reading.add(result, "models", reading.model(element), element)
        self.leftovers.keep(root, "sdf", file, "")
        if not result.models and not result.joints:
            reading.refuse(root, "the file has no <model> [E1948]", '<model name="..."> with links')
        self.report.raise_problems()
        notes = [*self.liberties]
        if gravity is None:
            notes.append("the file has no <world>, which would give gravity: the scene has its own, 9.81 m/s^2 [W0166]")
        if self.defaulted:
            note = f"links without <inertial> have 1 kg and 1 kg m^2, as SDF says: {listed(self.defaulted)} [W0168]"
            notes.append(note)
        only = next(iter(result.models)) if len(result.models) == 1 else ""
        name = only or name or Path(file).stem or "model"
        return Draft(name, result, self.leftovers, gravity, self.undrawn, notes)


class _FileReader(SdfValues):
    """Reads the elements of one file; ``chain`` has the paths of the files that include this file, from the
    outermost."""

    def __init__(self, reader: SdfReader, file: str, folder: Path, chain: Sequence[Path]) -> None:
        super().__init__(file, reader.report, reader.leftovers)
        self.reader, self.folder, self.chain = reader, folder, chain

    def read_version(self, root: Element) -> bool:
        """Keep k of the file's version 1.k; return whether it is read. Another root element or version is
        reported."""
        if root.tag != "sdf":
            self.refuse(root, f"the outermost element is {shown(root.tag)}, not 'sdf' [E1949]", "an SDF file")
            return False
        written = root.get("version")
        match = _VERSION.fullmatch(written)
        if match is None or not Minor.FIRST <= int(match[1]) <= Minor.NEWEST:
            fault = f"version {shown(written)} of SDF is not read [E1950]"
            self.refuse(root, fault, f'version="1.{Minor.FIRST}" to version="1.{Minor.NEWEST}"')
            return False
        self.minor = int(match[1])
        return True

    def gravity(self, world: Element) -> tuple[float, ...]:
        """Return the gravity (3 numbers) of a world, m/s^2; files before version 1.6 have gravity in ``<physics>``,
        which is otherwise not read there."""
        result = self.vector(world, "gravity", WORLD_GRAVITY)
        for settings in world.children_with_tag("physics"):
            if settings.first("gravity") is not None:
                if self.minor < Minor.WORLD_GRAVITY:
                    result = self.vector(settings, "gravity", WORLD_GRAVITY)
                else:
                    location = (self.place(settings), "")
                    self.leftovers.unread.setdefault("elements <gravity> of <physics>", []).append(location)
            settings.read_whole()
            self.leftovers.count("physics")
        return result

    def add(self, model: DraftModel, kind: str, item: _Item, element: Element) -> None:
        """Add a link, joint, frame or model to ``model`` by name; ``kind`` is the attribute of the model with such
        items. A name that is empty, reserved or already there is reported, and the item not added."""
        name = item.name
        if not name:
            self.refuse(element, f"the {element.tag} has no name [E1701]", f'<{element.tag} name="...">')
        elif _RESERVED.fullmatch(name) or ("::" in name and self.minor >= Minor.FRAMES):
            self.refuse(element, f"the name {shown(name)} is reserved in SDF [E1952]", "another name")
        elif model.has(name):
            fault = f"the name {shown(name)} is there twice: links, joints, frames and models share their names [E1954]"
            self.refuse(element, fault, "another name")
        else:
            getattr(model, kind)[name] = item

    def contents(self, element: Element, key: str, result: DraftModel) -> None:
        """Read frames, links, joints, models and includes of a model or a world into ``result``; ``key`` is ``model``
        or ``world``."""
        readers: Mapping[str, Callable[[Element], _Item]] = {
            **({"link": self.link} if key == "model" else {}),
            **{"frame": self.frame, "joint": self.joint, "model": self.model},
        }
        for tag, read in readers.items():
            for child in element.children_with_tag(tag):
                self.add(result, f"{tag}s", read(child), child)
        for child in element.children_with_tag("include"):
            self.include(child, result)
        self.keep(element, key, result.name)

    def model(self, element: Element) -> DraftModel:
        """Return the model of an element with all content; a model without links that is not static is reported."""
        name = element.get("name")
        result = DraftModel(
            name,
            self.place(element),
            self.pose(element, name),
            self.flag(element, "static", default=False),
            element.get("canonical_link"),
            element.get("placement_frame"),
        )
        self.note_wind(element, name)
        before = len(self.reader.defaulted)
        self.contents(element, "model", result)
        if result.static:  # inertias of static links are not used
            del self.reader.defaulted[before:]
        if not result.links and not result.models and not result.static:
            fault = f"the model {shown(name)} has no link [E1955]"
            self.refuse(element, fault, "one link, or <static>true</static>")
        return result

    def note_wind(self, element: Element, name: str) -> None:
        """Note wind that acts on a model or on a link."""
        wind = element.first("enable_wind")
        if wind is not None and self.flag(element, "enable_wind", default=False):
            self.leftovers.noted.setdefault("enable_wind", []).append((self.place(wind), name))

    def frame(self, element: Element) -> DraftFrame:
        name = element.get("name")
        result = DraftFrame(name, self.place(element), self.pose(element, name), element.get("attached_to"))
        self.keep(element, "frame", name)
        return result

    def link(self, element: Element) -> DraftLink:
        """Return a link; without mass properties in the file 1 kg and 1 kg m^2, as the format says."""
        name = element.get("name")
        inertia = self.inertia(element, name)
        if self.flag(element, "kinematic", default=False):
            fault = f"the link {shown(name)} is kinematic: Gazebo moves it without forces [E1956]"
            self.refuse(element, fault, "a prescribed motion (drive) in a scene that includes the file")
        self.note_wind(element, name)
        decay = element.first("velocity_decay")
        if decay is not None:
            if any(self.number(decay, part, 0.0) for part in ("linear", "angular")):
                self.leftovers.noted.setdefault("velocity_decay", []).append((self.place(decay), name))
            self.keep(decay, "velocity_decay", name)
        pulled = self.flag(element, "gravity", default=True)
        pose = self.pose(element, name)
        visuals, reasons = visuals_of_link(element, self, self.path)
        for reason in reasons:
            self.reader.undrawn.setdefault((LEFT_OUT, reason), []).append(name)
        self.keep(element, "link", name)
        return DraftLink(name, self.place(element), inertia, pose, pulled, visuals)

    def path(self, address: str) -> str:
        """Return the path of a mesh from the folder of the file that is converted."""
        if "://" not in address and self.folder == self.reader.home:
            return address
        return os.path.relpath(locate(address, self.folder, self.reader.packages), self.reader.home)

    def inertia(self, link: Element, name: str) -> Inertia:
        """Return the inertia of a link element in the link's frame: as in SDF, 1 kg and unit moments if missing.
        Negative masses, ``auto`` and added mass of a fluid are reported; ``name`` is the link."""
        element = link.first("inertial")
        if element is None:
            self.reader.defaulted.append(name)
            return Inertia(1.0, np.zeros(3), np.eye(3))
        if self.flag_of(element, "auto"):
            fault = f"inertial: auto lets Gazebo compute the inertia of {shown(name)} from its collision"
            fault += " geometry [E1957]"
            self.refuse(element, fault, "<mass> and <inertia> in numbers")
        mass = self.number(element, "mass", 1.0)
        if mass < 0.0:
            self.refuse(element, f"the mass {mass:.6g} is negative [E1709]", "a positive number of kg")
        entries = self.row(element, "inertia", name, _MOMENTS)
        added = element.first("fluid_added_mass")
        if added is not None:
            sizes = [self.number(added, child.tag, 0.0) for child in list(added.children())]
            self.keep(added, "fluid_added_mass", name)
            if any(sizes):
                self.refuse(added, "fluid_added_mass is not supported [E1958]", "an inertia without the fluid")
        pose = self.pose(element, name, framed=False)
        self.keep(element, "inertial", name)
        return Inertia(mass, np.zeros(3), tensor(entries)).transform(pose.orientation, pose.position)

    def joint(self, element: Element) -> DraftJoint:
        """Return the joint of an element, with axes, dynamics and limits; faults such as an unknown type or missing
        axes are reported."""
        name, kind = element.get("name"), element.get("type")
        if kind not in TYPES:
            self.refuse(element, f"the joint type {shown(kind)} is not known [E1712]", nearest(kind, TYPES))
        parent, child = (self.text(element, tag) for tag in ("parent", "child"))
        for tag, text in (("parent", parent), ("child", child)):
            if not text:
                self.refuse(element, f"the joint {shown(name)} has no <{tag}> [E1959]", f"<{tag}>link</{tag}>")
        if child == WORLD_FRAME:
            self.refuse(element, f"the child of the joint {shown(name)} is the world [E1960]", "the world as parent")
        axes = tuple(axis for tag in ("axis", "axis2") if (axis := self.axis(element, tag)) is not None)
        scene_type, count = TYPES.get(kind, ("", 0))
        if kind in TYPES and len(axes) < count:
            fault = f"the {kind} joint {shown(name)} has {len(axes)} of {count} axes [E1961]"
            self.refuse(element, fault, "<axis><xyz>0 0 1</xyz></axis>" if not axes else "<axis2> as well")
        gear = None
        if kind == "gearbox":
            gear = Gear(self.number(element, "gearbox_ratio", 1.0), self.text(element, "gearbox_reference_body"))
        result = DraftJoint(
            name,
            self.place(element),
            self.pose(element, name),
            scene_type,
            kind,
            parent,
            child,
            axes[:count],
            self.pitch(element) if kind == "screw" else 0.0,
            gear,
            self.is_cut(element, name),
            axes[0] if kind == "ball" and axes else None,
        )
        self.without_effect(element, kind, len(axes) > count)
        self.keep(element, "joint", name)
        return result

    def without_effect(self, element: Element, kind: str, surplus: bool) -> None:  # of one caller
        """Count, for a note, the elements of a joint that have an effect on joints of other types alone. `kind` is the
        joint's type in SDF; ``surplus`` whether the joint has more axes than the type."""
        tags = ["axis" if kind == "fixed" else "axis2"] if surplus else []
        if kind == "ball" and surplus:
            self.leftovers.count("direction of ball joints")
        tags += ["gearbox_ratio", "gearbox_reference_body"] if kind != "gearbox" else []
        tags += ["thread_pitch", "screw_thread_pitch"] if kind != "screw" else []
        for tag in tags:
            child = element.first(tag)
            if child is not None:
                child.read_whole()
                self.leftovers.count(f"{tag} of {kind} joints")

    def pitch(self, element: Element) -> float:
        """Return the travel of a screw joint, m/rad; a pitch of 0 is reported. ``screw_thread_pitch`` is in m per turn;
        ``thread_pitch``, before version 1.10, in radians per m of a left-handed thread."""
        if element.first("screw_thread_pitch") is not None:
            travel = self.number(element, "screw_thread_pitch", 1.0) / (2.0 * math.pi)
            old = element.first("thread_pitch")
            if old is not None:
                old.read_whole()
        elif element.first("thread_pitch") is not None:
            turns = self.number(element, "thread_pitch", 1.0)
            travel = -1.0 / turns if turns else 0.0
        else:
            travel = 1.0 / (2.0 * math.pi)
        if travel == 0.0:
            fault = "the thread pitch of a screw joint is not 0 [E1962]"
            self.refuse(element, fault, "a revolute or a prismatic joint")
        return travel

    def is_cut(self, element: Element, owner: str) -> bool:
        """Return whether the file says that a joint closes a loop (``must_be_loop_joint`` of Simbody); ``owner`` is the
        name."""
        physics = element.first("physics")
        if physics is None:
            return False
        simbody = physics.first("simbody")
        result = False
        if simbody is not None:
            result = self.flag(simbody, "must_be_loop_joint", default=False)
            self.keep(simbody, "simbody", owner)
        self.keep(physics, "joint/physics", owner)
        return result

    def axis(self, joint: Element, tag: str) -> Axis | None:
        """Return the axis ``tag`` (``axis`` or ``axis2``) of a joint with dynamics, limits and mimic; None if the joint
        has none."""
        element, name = joint.first(tag), joint.get("name")
        if element is None:
            return None
        vector = self.vector(element, "xyz", (0.0, 0.0, 1.0))
        written = element.first("xyz")
        frame = "" if written is None else written.get("expressed_in")
        if written is not None:
            self.keep(written, "xyz", name)
        if not any(vector):
            self.refuse(element, f"the {tag} of the joint {shown(name)} has no direction [E1963]", "<xyz>0 0 1</xyz>")
            vector = (0.0, 0.0, 1.0)
        if self.minor < Minor.FRAMES:
            of_model = self.flag(element, "use_parent_model_frame", default=self.minor < Minor.JOINT_AXES)
            frame = frame or (MODEL_FRAME if of_model else "")
        damping, friction, stiffness, rest = self.row(element, "dynamics", name, _DYNAMICS)
        result = Axis(self.place(element), vector, frame, damping, friction, stiffness, rest)
        if (limit := element.first("limit")) is not None:
            result = self.limits(limit, result, joint)
        if (mimic := element.first("mimic")) is not None:
            location, leader, of_axis = self.place(mimic), mimic.get("joint"), mimic.get("axis", "axis")
            multiplier, offset, reference = self.row(element, "mimic", name, _MIMIC)
            result = replace(result, mimic=DraftMimic(location, leader, multiplier, offset, of_axis, reference))
        self.keep(element, "axis", name)
        return result

    def limits(self, element: Element, axis: Axis, joint: Element) -> Axis:
        """Return a copy of the axis with the limits, effort and stops of the element ``<limit>``; a negative effort or
        velocity means no limit."""
        defaults = {"lower": -math.inf, "upper": math.inf, "effort": math.inf, "velocity": math.inf}
        lower, upper, effort, speed = (self.number(element, tag, defaults[tag], infinite=True) for tag in defaults)
        ends = {"position": min(-lower, upper)}
        ends |= {word: end if end >= 0.0 else math.inf for word, end in (("velocity", speed), ("effort", effort))}
        if joint.get("type") == "continuous" and math.isfinite(ends.pop("position")):
            self.leftovers.count("limits of continuous joints")
        written = any(element.first(tag) is not None for tag in ("stiffness", "dissipation"))
        stop = (self.number(element, "stiffness", 1e8), self.number(element, "dissipation", 1.0))
        self.keep(element, "limit", joint.get("name"))
        return replace(
            axis,
            lower=lower,
            upper=upper,
            effort=effort if effort >= 0.0 else math.inf,
            limited=tuple(word for word, end in ends.items() if math.isfinite(end)),
            stop=stop if written else None,
        )

    def include(self, element: Element, into: DraftModel) -> None:
        """Read the model of another file into the model or world ``into``, with the name, pose and ``static`` that the
        include gives. With ``merge`` the names of links, joints and frames count as names in ``into``; names that are
        there twice are reported."""
        address = self.text(element, "uri")
        name, merge = self.text(element, "name"), self.flag_of(element, "merge")
        static = element.first("static") is not None
        held = self.flag(element, "static", default=False)
        pose, placement = self.pose(element, name or address), self.text(element, "placement_frame")
        moved = element.first("pose") is not None
        self.keep(element, "include", name or address)
        inner = self.read_include(element, address)
        if inner is None:
            return
        inner.name = name or inner.name
        inner.pose = pose if moved else replace(inner.pose, relative_to="")
        inner.placement = placement or ("" if moved and not inner.placement else inner.placement)
        inner.static = held if static else inner.static
        if not merge:
            self.add(into, "models", inner, element)
            return
        twice = [twin for twin in inner.names if twin in into.names]
        if twice:
            fault = f"the included file has the name {shown(twice[0])}, which is there already [E1964]"
            self.refuse(element, fault, "the include without merge, or another name")
            return
        inner.name = f"_merged__{inner.name}__"
        while inner.name in into.models:
            inner.name += "_"
        inner.static = into.static
        into.models[inner.name] = inner
        into.merged |= dict.fromkeys(inner.names, inner.name)

    def read_include(self, element: Element, address: str) -> DraftModel | None:
        """Return the only model of the file at an address (a path, or model://, package:// or file://); None after a
        reported fault: no, a remote or a faulty file, a circle of includes, or several models."""
        if not address:
            self.refuse(element, "the include has no <uri> [E1965]", "<uri>model.sdf</uri>")
            return None
        if is_remote(address):
            fault = f"{shown(address)} lies in a network, and only local files are read [E1966]"
            self.refuse(element, fault, "a local path")
            return None
        path = locate(address, self.folder, self.reader.packages)
        path = _file_of_model(path) if is_there(path) and path.is_dir() else path
        if path.resolve() in self.chain or len(self.chain) >= 20:
            self.refuse(element, f"files include one another in a circle: {shown(address)} [E1590]", "another file")
            return None
        try:
            file = shown_file(path)
            root = read_xml(read_text(path), file)
        except FileError as error:
            hint = 'packages=["NAME=FOLDER"]' if "://" in address else f"a path from the folder of {self.file}"
            self.refuse(element, f"{shown(address)} {error.problems[0].what} [E1594]", hint)
            return None
        except DescriptionError as error:
            self.report.noted += [(element.line, problem) for problem in error.problems]
            return None
        reading = _FileReader(self.reader, file, path.parent, [*self.chain, path.resolve()])
        self.reader.liberties += root.liberties
        if not reading.read_version(root):
            return None
        models = list(root.children_with_tag("model"))
        self.leftovers.keep(root, "sdf", file, "")
        if len(models) != 1:
            fault = f"an included file has one model, and this one has {len(models)} [E1967]"
            reading.refuse(root, fault, "one model")
            return None
        return reading.model(models[0])


def _file_of_model(folder: Path) -> Path:
    """Return the newest readable file that a folder of a model names in its ``model.config``; ``model.sdf`` if that
    file is unreadable or names none."""
    try:
        root = read_xml(read_text(folder / "model.config"), "model.config")
    except (FileError, DescriptionError):
        return folder / "model.sdf"
    versions = {}
    for element in root.children_with_tag("sdf"):
        match = _VERSION.fullmatch(element.get("version"))
        versions[int(match[1]) if match else 0] = element.text()
    readable = [minor for minor in versions if minor <= Minor.NEWEST]
    return folder / (versions[max(readable)] if readable else "model.sdf")
