"""Conversion of model directives to a scene that includes the models: a weld places the base of a model, so that all
names and formulas of a model are renamed as in any included file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.data import dataclass, field
from eomgen.base.files import read_bytes
from eomgen.base.messages import legal_name, nearest, shown
from eomgen.errors import DescriptionError, FileError
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import root_tag
from eomgen.scene.rotations import quaternion_of_matrix, roll_pitch_yaw, snapped_rotation
from eomgen.scene.sources.directives.values import Pose, Values
from eomgen.scene.sources.draft import LinkPlace
from eomgen.scene.sources.mjcf.source import MJCF
from eomgen.scene.sources.sdf.source import SDF
from eomgen.scene.sources.source import LARGEST_FILE, ConvertedScene, OptionError, Source, read_text, shown_file
from eomgen.scene.sources.urdf.conversion import turns_of
from eomgen.scene.sources.urdf.source import URDF
from eomgen.scene.sources.uris import is_remote, is_there, located, package_folders
from eomgen.system.description import BASE

WORLD_FRAME = "world"
#: Directives with their keys.
_KEYS: Mapping[str, tuple[str, ...]] = {
    "add_model": ("file", "name", "default_joint_positions", "default_free_body_pose"),
    "add_frame": ("name", "X_PF"),
    "add_weld": ("parent", "child", "X_PC"),
    "add_directives": ("file", "model_namespace"),
    "add_model_instance": ("name",),
}
#: Directives without a part in the equations.
_IDLE = ("add_collision_filter_group",)
_BY_ROOT = {"robot": URDF, "mujoco": MJCF, "sdf": SDF}
_DEEPEST, _MOST_MODELS = 20, 1000
#: Joints whose coordinates have another order or other ones in Drake: x, y and angle of a planar joint, and roll, pitch
#: and yaw of a ball joint.
_PLANAR, _SPHERICAL = "planar", "spherical"


@dataclass
class _File:
    """A file of directives: its values, folder, and the namespace of its models."""

    values: Values
    folder: Path
    space: str = ""

    def full(self, name: str) -> str:
        """Return the whole name of a model or frame."""
        return name if not self.space or name == WORLD_FRAME else f"{self.space}::{name}"


@dataclass
class _Weld:
    node: Any
    file: _File
    parent: str
    pose: Pose
    child: str = ""
    frame: str = ""


@dataclass
class _Model:
    """A model with its weld, the place of its base in the scene once it is known, and its content as a scene."""

    name: str
    node: Any
    file: _File
    path: Path
    source: Source
    positions: list[tuple[str, Any]] = field(default_factory=list)
    free: list[tuple[str, Any]] = field(default_factory=list)
    weld: _Weld | None = None
    data: Mapping[str, Any] = field(default_factory=dict)
    base: LinkPlace | None = None

    @property
    def key(self) -> str:
        """Name of the include in the scene."""
        return legal_name(self.name.replace("::", "__"), ())


@dataclass
class _Frame:
    node: Any
    file: _File
    holder: str
    pose: Pose


def directives_data(
    text: str, *, file: str, strict: bool, path: Path | None, options: Mapping[str, Any]
) -> ConvertedScene:
    """Return a file of model directives in the form of a scene file; the options as in ``DIRECTIVES``.

    Raises
    ------
    DescriptionError, OptionError, UsageError
    """
    home = Path() if path is None else path.parent
    report = Report(file, {})
    reader = _Reader(report, package_folders(options["packages"]), home)
    reader.read(Values(text, file, report), home, "", (path.resolve(),) if path is not None else ())
    report.raise_problems()
    converter = _Converter(reader, report, {**options}, home, file, strict=strict)
    return converter.scene()


class _Reader:
    """Reads files of directives: models, frames and welds by whole names.

    Attributes
    ----------
    omitted : places and words of parts that are not read
    idle : how many directives have no effect, by name
    """

    def __init__(self, report: Report, packages: Mapping[str, Path], home: Path) -> None:
        self.report, self.packages, self.home = report, packages, home
        self.models: dict[str, _Model] = {}
        self.frames: dict[str, _Frame] = {}
        self.welds: list[_Weld] = []
        self.omitted: list[tuple[str, int, str]] = []
        self.idle: dict[str, int] = {}

    def read(self, values: Values, folder: Path, space: str, chain: Sequence[Path]) -> None:
        """Read a file into the lists."""
        file = _File(values, folder, space)
        top = values.known(values.root, "the file", ("directives",))
        for entry in values.items(top.get("directives", values.root), "directives"):
            for name, node in values.entries(entry, "a directive").items():
                if name in _IDLE:
                    self.idle[name] = self.idle.get(name, 0) + 1
                elif name not in _KEYS:
                    values.refuse(entry, f"the directive {shown(name)} is not known", nearest(name, [*_KEYS, *_IDLE]))
                elif name != "add_model_instance":
                    getattr(self, name)(node, values.known(node, name, _KEYS[name]), file, chain)
        self.omitted += [(values.file, *note) for note in values.unread]

    def named(self, node: Any, entries: Mapping[str, Any], key: str, file: _File) -> str:
        """Return a name that a directive gives or uses; empty for a fault."""
        if key not in entries:
            file.values.refuse(node, f"there is no {key}", f"{key}: ...")
            return ""
        return file.values.text(entries[key], key)

    def opened(self, node: Any, entries: Mapping[str, Any], file: _File) -> Path | None:
        """Return the path of a file that a directive names; None for a fault."""
        address = self.named(node, entries, "file", file)
        if not address:
            return None
        if is_remote(address):
            file.values.refuse(
                node, f"{shown(address)} lies in a network, and only local files are read", "a local path"
            )
            return None
        path = located(address, file.folder, self.packages)
        if not is_there(path) or not path.is_file():
            hint = 'packages=["NAME=FOLDER"]' if "://" in address else f"a path from the folder of {file.values.file}"
            file.values.refuse(entries["file"], f"there is no file {shown(address)}", hint)
            return None
        return path

    def add_model(self, node: Any, entries: Mapping[str, Any], file: _File, _chain: Sequence[Path]) -> None:
        name, path = file.full(self.named(node, entries, "name", file)), self.opened(node, entries, file)
        if path is None:
            return
        source = _source_of(path)
        if source is None:
            fault = f"{shown(path.name)} is not a model that can be read"
            file.values.refuse(entries["file"], fault, "a .urdf, .sdf or .xml file of MuJoCo")
            return
        if name in self.models or len(self.models) >= _MOST_MODELS:
            fault = f"the model {shown(name)} is there twice" if name in self.models else "there are too many models"
            file.values.refuse(node, fault, "another name" if name in self.models else f"at most {_MOST_MODELS}")
            return
        values = file.values
        model = _Model(name, node, file, path, source)
        starts = {"default_joint_positions": model.positions, "default_free_body_pose": model.free}
        for key, pairs in starts.items():
            if key in entries:
                pairs.extend(values.entries(entries[key], key).items())
        self.models[name] = model

    def add_frame(self, node: Any, entries: Mapping[str, Any], file: _File, _chain: Sequence[Path]) -> None:
        name = file.full(self.named(node, entries, "name", file))
        pose, holder = file.values.pose(entries.get("X_PF"), "X_PF")
        if "::" not in name.removeprefix(f"{file.space}::") and not holder:
            file.values.refuse(node, "X_PF has no base_frame", "base_frame: world")
            return
        if not holder:  # the frame of the model that the name leads into
            holder = f"{name.removeprefix(f'{file.space}::').rpartition('::')[0]}::__model__"
        if name in self.frames:
            file.values.refuse(node, f"the frame {shown(name)} is there twice", "another name")
        self.frames[name] = _Frame(node, file, holder, pose)

    def add_weld(self, node: Any, entries: Mapping[str, Any], file: _File, _chain: Sequence[Path]) -> None:
        parent, child = (self.named(node, entries, key, file) for key in ("parent", "child"))
        pose, frame = file.values.pose(entries.get("X_PC"), "X_PC")
        if frame:
            file.values.refuse(
                node, "X_PC: the pose of a weld is in its parent, so it has no base_frame", "parent: ..."
            )
        self.welds.append(_Weld(node, file, parent, pose, child))

    def add_directives(self, node: Any, entries: Mapping[str, Any], file: _File, chain: Sequence[Path]) -> None:
        path = self.opened(node, entries, file)
        space = file.values.text(entries["model_namespace"], "model_namespace") if "model_namespace" in entries else ""
        if path is None:
            return
        if path.resolve() in chain or len(chain) >= _DEEPEST:
            fault = f"files of directives include one another in a circle: {shown(path.name)}"
            file.values.refuse(node, fault, "another file")
            return
        inner = Values(read_text(path), shown_file(path), self.report)
        whole = file.full(space) if space else file.space
        self.read(inner, path.parent, whole, [*chain, path.resolve()])


class _Converter:
    """Makes the scene: an include for each model, and a frame for each frame."""

    def __init__(
        self, reader: _Reader, report: Report, options: Mapping[str, Any], home: Path, file: str, *, strict: bool
    ) -> None:
        self.reader, self.report, self.options, self.home = reader, report, options, home
        self.file, self.strict = file, strict
        self.visiting: list[str] = []

    def scene(self) -> ConvertedScene:
        """Return the scene."""
        for weld in self.reader.welds:
            self.attach(weld)
        self.report.raise_problems()
        for file, line, note in self.reader.omitted if self.strict else ():
            self.report.add_place(file, line, "", note, "no --strict (strict=False), to go on without")
        for model in self.reader.models.values():
            self.convert(model)
        self.report.raise_problems()
        includes = {model.key: self.include(model) for model in self.reader.models.values()}
        frames: dict[str, Any] = {}
        lines: dict[str, int | str] = {}
        for name, frame in self.reader.frames.items():
            place = self.place(frame.holder, frame.file, frame.node)
            if place is not None:
                key = legal_name(name.replace("::", "__"), frames)
                frames[key] = _in(place, frame.pose).entry
                lines[f"frames.{key}"] = f"{frame.file.values.file}:{frame.file.values.line(frame.node)}"
        if not includes:
            self.report.add_place(self.file, 1, "", "the file adds no model", "- add_model: with name and file")
        self.report.raise_problems()
        for model in self.reader.models.values():
            lines[f"include.{model.key}"] = f"{model.file.values.file}:{model.file.values.line(model.node)}"
        name = legal_name(Path(self.file).name.partition(".")[0] or "models", ())
        data = {"format": 1, "name": name, "bodies": {}, "joints": {}, "frames": frames, "include": includes}
        counts = [f"{count} {directive}" for directive, count in self.reader.idle.items()]
        notes = [f"without a part in the equations of motion: {', '.join(counts)}"] if counts else []
        return ConvertedScene(data, lines, [*notes, *(note for _, _, note in self.reader.omitted)])

    def attach(self, weld: _Weld) -> None:
        """Give a weld to the model of its child."""
        model, frame = self.model_of(weld.child, weld.file, weld.node)
        if model is None:
            return
        if model.weld is not None:
            fault = f"the model {shown(model.name)} is welded twice"
            weld.file.values.refuse(weld.node, fault, "one weld for each model, which the others hang on")
            return
        model.weld, weld.frame = weld, frame

    def model_of(self, written: str, file: _File, node: Any) -> tuple[_Model | None, str]:
        """Return the model of a frame, and the frame's name in it; None for a fault. A name without a model is looked
        up among the names of models."""
        name = file.full(written)
        models = [one for one in self.reader.models if name.startswith(f"{one}::")]
        if models:
            longest = max(models, key=len)
            return self.reader.models[longest], name.removeprefix(f"{longest}::")
        if name in self.reader.models:
            return self.reader.models[name], name.rpartition("::")[2]
        fault = f"there is no model with the frame {shown(written)}"
        file.values.refuse(node, fault, nearest(written.partition("::")[0], self.reader.models) or "MODEL::FRAME")
        return None, ""

    def convert(self, model: _Model) -> None:
        """Read the content of a model."""
        try:
            result = model.source.convert(
                read_text(model.path), model.path, strict=self.strict, included=True, **self.options_of(model)
            )
        except OptionError as error:
            weld = model.weld
            node, file = (weld.node, weld.file) if weld and error.option == "weld" else (model.node, model.file)
            file.values.refuse(node, str(error.problems[0]), "")
        except FileError as error:
            model.file.values.refuse(model.node, str(error.problems[0]), "")
        except DescriptionError as error:
            self.report.noted += [(0, problem) for problem in error.problems]
        else:
            model.data = result.data

    def options_of(self, model: _Model) -> dict[str, Any]:
        """Return the options of a model's file."""
        known = {option.name for option in model.source.options}
        result = {name: value for name, value in self.options.items() if name in known and value}
        if model.source is URDF:
            result["root"] = "fixed" if model.weld else "free"
        elif model.source is SDF and model.weld:
            result["weld"] = [model.weld.frame]
        return result

    def include(self, model: _Model) -> dict[str, Any]:
        """Return the include of a model."""
        base = self.base_of(model)
        options = self.options_of(model)
        if "packages" in options:
            options["packages"] = list(options["packages"])
        turned = snapped_rotation(base.orientation)
        return {
            "file": os.path.relpath(model.path, self.home),
            "prefix": f"{model.key}__",
            "parent": base.body,
            "position": base.position.tolist(),
            "rotation": turns_of(turned),
            "initial": self.initial(model),
            **options,
        }

    def base_of(self, model: _Model) -> LinkPlace:
        """Return the place of a model's base in the scene."""
        if model.base is not None:
            return model.base
        world = LinkPlace(BASE, np.eye(3), np.zeros(3))
        if model.name in self.visiting:
            circle = ", ".join([*self.visiting, model.name])
            model.file.values.refuse(
                model.node, f"the welds of the models run in a circle: {circle}", "a weld to world"
            )
            return world
        model.base = world
        weld = model.weld
        if weld is None:
            return world
        model.base = None
        self.visiting.append(model.name)
        parent = self.place(weld.parent, weld.file, weld.node)
        self.visiting.pop()
        child = self.within(model, weld.frame, weld.file, weld.node)
        held = None if child is None else _held_by_base(model.data, child)
        if child is not None and held is None:
            fault = (
                f"the frame {shown(weld.frame)} of {shown(model.name)} moves against the link that carries the model"
            )
            weld.file.values.refuse(weld.node, fault, "a frame of the root link")
        model.base = world if parent is None or held is None else _in(parent, weld.pose.then(held.inverse))
        return model.base

    def place(self, written: str, file: _File, node: Any) -> LinkPlace | None:
        """Return the place of a frame in the scene; None for a fault."""
        if written == WORLD_FRAME:
            return LinkPlace(BASE, np.eye(3), np.zeros(3))
        name = self.frame_name(written, file)
        frame = self.reader.frames.get(name)
        if frame is not None:
            if name in self.visiting:
                file.values.refuse(node, f"the frames name one another in a circle: {written}", "another base_frame")
                return None
            self.visiting.append(name)
            holder = self.place(frame.holder, frame.file, frame.node)
            self.visiting.pop()
            return None if holder is None else _in(holder, frame.pose)
        model, inner = self.model_of(written, file, node)
        if model is None:
            return None
        within = self.within(model, inner, file, node)
        if within is None:
            return None
        base = self.base_of(model)
        if within.body != BASE:
            return LinkPlace(f"{model.key}__{within.body}", within.orientation, within.position)
        return _in(base, Pose(within.orientation, within.position))

    def frame_name(self, written: str, file: _File) -> str:
        """Return the whole name of a frame. One that was added without a model belongs to the model of the frame that
        holds it, too, and is known everywhere if no other has its name."""
        name, frames = file.full(written), self.reader.frames
        if name in frames:
            return name
        *outer, last = name.split("::")
        alike = [one for one in frames if one.split("::")[-1] == last]
        if "::" not in written:
            return alike[0] if len(alike) == 1 else name
        own = [one for one in alike if "::".join(outer) == self.holder_of(one)]
        return own[0] if own else name

    def holder_of(self, name: str) -> str:
        """Return the model of the frame that holds a frame of the file; empty without one."""
        for _ in self.reader.frames:
            frame = self.reader.frames.get(name)
            if frame is None:
                break
            name = frame.file.full(frame.holder)
        return max((one for one in self.reader.models if name.startswith(f"{one}::")), key=len, default="")

    def within(self, model: _Model, written: str, file: _File, node: Any) -> LinkPlace | None:
        """Return the place of a frame in the model's own scene; None for a fault."""
        frames, bodies = model.data.get("frames", {}), model.data.get("bodies", {})
        name = written.replace("::", "__")
        if written == "__model__":
            return LinkPlace(BASE, np.eye(3), np.zeros(3))
        for wanted in (name, f"{name}_link", f"{name}_body"):
            if wanted in frames:
                entry = frames[wanted]
                turned = np.array(entry.get("orientation", np.eye(3)))
                return LinkPlace(entry["body"], turned, np.array(entry.get("position", np.zeros(3))))
            if wanted in bodies:
                return LinkPlace(wanted, np.eye(3), np.zeros(3))
        hint = nearest(written, [*frames, *bodies])
        file.values.refuse(node, f"the model {shown(model.name)} has no frame {shown(written)}", hint)
        return None

    def initial(self, model: _Model) -> dict[str, Any]:
        """Return the initial states of a model's joints that the file gives."""
        result: dict[str, Any] = {}
        joints: Mapping[str, Mapping[str, Any]] = model.data.get("joints", {})
        values = model.file.values
        for name, node in model.positions:
            if name not in joints:
                fault = f"default_joint_positions: the model has no moving joint {shown(name)}"
                values.refuse(node, fault, nearest(name, joints))
                continue
            result[name] = {"position": self.position(joints[name]["type"], node, values)}
        free = {joint["child"]: name for name, joint in joints.items() if joint["type"] == "free"}
        for name, node in model.free:
            if name not in free:
                fault = f"default_free_body_pose: {shown(name)} is not a free link of the model"
                values.refuse(node, fault, nearest(name, free) or "an add_model without add_weld")
                continue
            pose, frame = values.pose(node, "default_free_body_pose")
            place = self.place(frame, model.file, node) if frame else LinkPlace(BASE, np.eye(3), np.zeros(3))
            if place is not None and place.body != BASE:
                values.refuse(node, f"base_frame: {shown(frame)} moves, and a start is given in the world", "world")
            elif place is not None:
                at = _in(place, pose)
                turned = list(quaternion_of_matrix(at.orientation.tolist()))
                result[free[name]] = {"position": at.position.tolist(), "orientation": turned}
        return result

    @staticmethod
    def position(kind: str, node: Any, values: Values) -> float | list[float]:
        """Return initial coordinates in the order and kind of a joint here."""
        given = values.numbers(node, "default_joint_positions", 3 if kind in (_PLANAR, _SPHERICAL) else None)
        if kind == _PLANAR:
            return [given[2], *given[:2]]
        if kind == _SPHERICAL:
            return list(quaternion_of_matrix(roll_pitch_yaw(*given).tolist()))
        return given[0] if len(given) == 1 else given


def _in(place: LinkPlace, inner: Pose) -> LinkPlace:
    """Return the place of a frame that is given in another one."""
    at = Pose(place.orientation, place.position).then(inner)
    return LinkPlace(place.body, snapped_rotation(at.orientation), at.position)


def _held_by_base(data: Mapping[str, Any], place: LinkPlace) -> Pose | None:
    """Return the pose in the base of a frame that fixed joints hold there; None if it moves."""
    pose, body = Pose(place.orientation, place.position), place.body
    while body != BASE:
        joint = next((one for one in data["joints"].values() if one["child"] == body), None)
        if joint is None or joint["type"] != "fixed":
            return None
        own = Pose(np.array(joint.get("orientation", np.eye(3))), np.array(joint.get("position", np.zeros(3))))
        pose, body = own.then(pose), joint["parent"]
    return pose


def _source_of(path: Path) -> Source | None:
    """Return the source of a model by its ending, and by its outermost element if the ending is of several formats."""
    ending = path.suffix.lower()
    if ending in (".urdf", ".sdf"):
        return URDF if ending == ".urdf" else SDF
    if ending not in (".xml", ".mjcf", ".world"):
        return None
    try:
        return _BY_ROOT.get(root_tag(read_bytes(path, LARGEST_FILE).decode("utf-8", "replace")))
    except OSError:
        return None
