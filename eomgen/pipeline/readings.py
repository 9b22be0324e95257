"""Scenes that were read before: a file of unchanged text, includes and options is taken from the cache, checked.

A record holds digests of all files that were read, and scene and description as JSON. Only numbers, texts, arrays,
dataclasses and functions of eomgen are in it, so a record runs no code when it is opened; a scene with other objects
has no record. Functions are stored by name.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property, partial
from importlib import import_module
from inspect import getattr_static
from operator import attrgetter
from pathlib import Path
from types import BuiltinFunctionType, FunctionType, MethodType
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.data import dataclass, field_names, is_dataclass, replace, without_garbage_collection
from eomgen.base.files import ABSENT, digest_of_file, make_private_folder, temporary_file
from eomgen.base.limits import CALLED
from eomgen.base.version import __version__, checkout_stamp
from eomgen.errors import FileError, Message, ModelError, Problem
from eomgen.pipeline.front_end import FrontEnd, is_scene
from eomgen.toolchain.cache import READINGS, default_folder, postpone, writable_by_others, write_postponed

if TYPE_CHECKING:
    from eomgen.scene.scene import Scene
    from eomgen.system.description import Description, Shape

#: Endings of further files that eomgen itself reads; other distributions read further files, and may change.
_OWN = (".csv", ".txt", ".dat", ".tsv", ".c", ".stl", ".obj", ".dae", ".glb")
#: Bytes of a scene in a record at most: larger scenes take about as long to read from a record.
_LARGEST = 4_000_000
#: Bytes of a body with its joint, of a point and of a force element at least: the text of a scene that is too large is
#: not made in the first place.
_LEAST = {"bodies": 400, "points": 60, "elements": 80}
#: Types of the functions in requirements: eomgen's own and comparisons of Python, whose module is ``_operator``.
_FUNCTIONS = (FunctionType, BuiltinFunctionType)
_COMPARISONS = tuple(f"_operator:{name}" for name in ("lt", "le", "eq", "ne", "ge", "gt"))
#: Number of records kept; the oldest go first.
_MOST = 512


class NoRecordError(Exception):
    """A scene with objects that a record cannot hold, or a record that this process cannot read."""


@dataclass(frozen=True)
class StoredScene:
    """Scene of a record, made on the first request: a compiled model in the cache needs the description alone.

    Attributes
    ----------
    content : bytes
        Digest of the scene, for keys of caches.
    description : Description
    plain : bool
        Whether a compiled model of the scene asks for the scene itself only to derive equations: the bodies have
        coordinates of their own joints, and no calibration finds parameters.
    text, elements : str
        The scene without its force elements, and the force elements, as JSON.
    """

    content: bytes
    description: Description
    plain: bool
    text: str
    elements: str

    @property
    def lean(self) -> StoredScene | Scene:
        """The record if the scene is plain, else the scene."""
        return self if self.plain else self.scene

    @cached_property
    def scene(self) -> Scene:
        """The scene itself, which knows its record and its digest."""
        scene: Scene = from_text(self.text)
        # force elements are made on the first request: their classes come with their schemas
        vars(scene).update(_record=self, digest=self.content, _elements=partial(from_text, self.elements))
        del vars(scene)["elements"]
        return scene


def record_of(scene: object) -> StoredScene | None:
    """Return the record that a scene was made from; None for any other scene, such as a changed copy."""
    record = getattr(scene, "__dict__", {}).get("_record")
    return record if isinstance(record, StoredScene) else None


def stored_scene(path: object, options: Mapping[str, Any]) -> StoredScene | None:
    """Return the scene of a file that was read before with these options, from the cache of readings. None if there is
    no record, if a file has changed since, or for anything but a path. Postponed records are written first."""
    if not isinstance(path, str | os.PathLike):
        return None
    write_postponed()
    try:
        data = _place(path, options).read_bytes()
        if hashlib.sha256(data[64:]).hexdigest().encode() != data[:64]:
            return None
        files, *record = json.loads(data[64:])
        for file, digest in files.items():
            if digest == ABSENT and not os.path.lexists(file):
                continue
            if digest_of_file(Path(file).read_bytes()) != digest:
                return None
        return from_record(record)
    except (NoRecordError, OSError, ValueError, TypeError, AttributeError):
        return None


def store(
    path: str | os.PathLike[str],
    options: Mapping[str, Any],
    scene: Scene,
    description: Description,
    files: Mapping[str, str],
) -> None:
    """Keep a scene, read from these files, for later processes, if a record can hold it; written when the process
    waits.

    Parameters
    ----------
    files : mapping
        Digest of each file by absolute path, ``ABSENT`` for a missing file, empty for a file that changed meanwhile.
    """
    from eomgen.scene.sources.register import recorded_endings  # noqa: PLC0415  # a stored scene needs no reader

    endings = (*recorded_endings(), *_OWN)
    if not all(files.values()) or not all(file.lower().endswith(endings) for file in files):
        return
    if sum(len(getattr(scene, part)) * size for part, size in _LEAST.items()) > _LARGEST:
        return
    with contextlib.suppress(NoRecordError, OSError):
        record_path = _place(path, options)
        make_private_folder(record_path.parent)  # not at the end: the folder may be removed until then
        postpone(partial(_store, record_path, scene, description, files))


def _store(record_path: Path, scene: Scene, description: Description, files: Mapping[str, str]) -> None:
    try:
        with without_garbage_collection():
            record = to_record(scene, description)
        if sum(map(len, record[3:])) > _LARGEST:
            return
        data = json.dumps([files, *record]).encode()
        with temporary_file(record_path) as stream:
            stream.write(hashlib.sha256(data).hexdigest().encode() + data)
        Path(stream.name).replace(record_path)
        _remove_oldest(record_path.parent)
    except (NoRecordError, OSError, ValueError, TypeError):  # the next process reads the file again
        return


#: Data of a record as JSON types: digest of the scene, description, whether the scene is plain, scene without force
#: elements, force elements.
Record = tuple[str, str, bool, str, str]


def to_record(scene: Scene, description: Description) -> Record:
    """Return the data of a record as JSON types. Raises NoRecordError for a scene with parts that a record cannot hold.
    These are joint types of other distributions, and objects other than data."""
    for joint in scene.joints:
        if joint.has_extension_type:  # the type may change
            raise NoRecordError(f"the type of the joint {joint.name}")
    text, elements = to_text(replace(scene, elements=())), to_text(scene.elements)
    plain = scene.coordinates == "joint" and not any(item.calibration for item in scene.feedback)
    return scene.digest.hex(), to_text(description), plain, text, elements


def record_of_document(document: Any, front_end: FrontEnd) -> Record:
    """Return the data of a scene and the description for a file of a model, with the meshes of shapes read in. Raises
    ModelError for a document that is not a scene, or parts that a file cannot hold."""
    described = front_end.describe(document)
    hint = "eomgen.build(scene) on the other machine"
    if isinstance(document, StoredScene):
        document = document.scene
    elif not is_scene(document):
        raise ModelError(Problem("save", f"{described.name} was not made from a scene [E0557]", hint))
    try:
        drawing = replace(described.drawing, shapes=_read(described.drawing.shapes))
        return to_record(replace(document, shapes=_read(document.shapes)), replace(described, drawing=drawing))
    except NoRecordError as error:
        fault = f"{described.name} has parts of another distribution, which a file cannot hold: {error} [E0558]"
        raise ModelError(Problem("save", fault, hint)) from None


def _read(shapes: Iterable[Shape]) -> tuple[Shape, ...]:
    """Return shapes with their meshes read, for machines without the files; an unreadable mesh keeps the file."""
    result = []
    for shape in shapes:
        result.append(shape)
        with contextlib.suppress(FileError):
            result[-1] = shape.whole()
    return tuple(result)


def from_record(record: Record) -> StoredScene:
    """Return the scene of a record. Raises NoRecordError, ValueError or TypeError if this version has no such data."""
    content, description, plain, text, elements = record
    return StoredScene(bytes.fromhex(content), from_text(description), plain, text, elements)


def _place(path: str | os.PathLike[str], options: Mapping[str, Any]) -> Path:
    """Return the path of the record of a file read with these options, in the cache. Raises NoRecordError if the cache
    has no folder, or one that other users can write to."""
    try:
        folder = default_folder()
    except FileError as error:
        raise NoRecordError from error
    if writable_by_others(folder):
        raise NoRecordError
    file = os.path.abspath(Path(os.fspath(path)).expanduser())  # noqa: PTH100  # links are followed again
    made_by = [__version__, checkout_stamp(), *sys.version_info[:2]]
    key = json.dumps([made_by, file, sorted(options.items()), CALLED.get()[:2]])
    return folder / READINGS / hashlib.sha256(key.encode()).hexdigest()


def _remove_oldest(folder: Path) -> None:
    records = list(folder.iterdir())
    if len(records) > _MOST:
        for record in sorted(records, key=lambda file: file.stat().st_mtime_ns)[: -_MOST // 2]:
            with contextlib.suppress(OSError):
                record.unlink()


def to_text(value: Any) -> str:
    """Return data of dataclasses, numbers, texts, arrays and eomgen's functions as JSON text, each shared object once.
    Raises NoRecordError for any other data."""
    kinds: dict[type, tuple[int, list[str]]] = {}
    known: dict[int, int] = {}

    def convert(item: Any) -> Any:
        """Return an object of a scene as JSON, repeated objects by number. Raises NoRecordError for an object without a
        record."""
        kind = type(item)
        if item is None or kind in (str, int, float, bool):
            return item
        if kind in _WRITE:
            return _WRITE[kind](item, convert)
        if kind not in kinds:
            if kind.__module__ == "fractions":
                return {"fraction": str(item)}
            if kind is np.ndarray and item.dtype.kind in "fiubc":
                return {"array": [item.dtype.str, item.shape, item.tobytes().hex(), bool(item.flags.writeable)]}
            if kind in _FUNCTIONS and "<" not in item.__qualname__ and _object(_name(item)) is item:
                return {"function": _name(item)}
            if not is_dataclass(kind) or _object(_name(kind)) is not kind:
                raise NoRecordError(_name(kind))
            kinds[kind] = len(kinds), list(field_names(kind))
        if id(item) in known:
            return {"same": known[id(item)]}
        number, names = kinds[kind]
        if not all(isinstance(getattr_static(kind, name), cached_property) for name in vars(item).keys() - names):
            raise NoRecordError(_name(kind))
        data = {"of": [number, *[convert(getattr(item, name)) for name in names]]}
        known[id(item)] = len(known)
        return data

    data = convert(value)
    return json.dumps([[[_name(kind), names] for kind, (_, names) in kinds.items()], data], separators=(",", ":"))


def from_text(text: str) -> Any:
    """Return the data that ``to_text`` has written, without running constructors. Raises NoRecordError, ValueError or
    TypeError if this version has no such classes, or the text is none of ``to_text``."""
    table, data = json.loads(text)
    kinds: list[tuple[type, list[str]]] = [(_object(name), names) for name, names in table]
    if not all(isinstance(kind, type) and is_dataclass(kind) for kind, _ in kinds):
        raise NoRecordError
    instances: list[Any] = []

    def read(item: Any) -> Any:
        if type(item) is list:
            return tuple([read(part) for part in item])
        if type(item) is not dict:
            return item
        ((kind, value),) = item.items()
        if kind != "of":
            return instances[value] if kind == "same" else _READ[kind](value, read)
        object_class, names = kinds[value[0]]
        instance = object.__new__(object_class)
        vars(instance).update(zip(names, [read(part) for part in value[1:]], strict=True))
        instances.append(instance)
        return instance

    return read(data)


def _array(value: Any) -> Any:
    dtype, shape, data, writable = value
    array = np.frombuffer(bytearray.fromhex(data), dtype).reshape(shape)
    array.flags.writeable = writable
    return array


def _fraction(text: str) -> Any:
    from fractions import Fraction  # noqa: PLC0415  # few scenes have any

    return Fraction(text)


def _function(name: str) -> Any:
    value = _object(name)
    if type(value) not in _FUNCTIONS:
        raise NoRecordError(name)
    return value


def _method(value: Any, read: Callable[[Any], Any]) -> Any:
    bound = getattr(read(value[0]), value[1])
    if type(bound) is not MethodType:
        raise NoRecordError(value[1])
    return bound


#: Functions that convert the values of types, and a function for their parts.
_WRITE: Mapping[type, Callable[[Any, Callable[[Any], Any]], Any]] = {
    tuple: lambda value, convert: [convert(part) for part in value],
    dict: lambda value, convert: {"map": [[convert(key), convert(part)] for key, part in value.items()]},
    bytes: lambda value, _: {"bytes": value.hex()},
    Message: lambda value, _: {"message": [value.line, value.doubt]},
    MethodType: lambda value, convert: {"method": [convert(value.__self__), value.__name__]},
}
_READ: Mapping[str, Callable[[Any, Callable[[Any], Any]], Any]] = {
    "map": lambda value, read: {read(key): read(part) for key, part in value},
    "message": lambda value, _: Message(*value),
    "bytes": lambda value, _: bytes.fromhex(value),
    "fraction": lambda value, _: _fraction(value),
    "array": lambda value, _: _array(value),
    "function": lambda value, _: _function(value),
    "method": _method,
}


def _name(value: Any) -> str:
    return f"{value.__module__}:{value.__qualname__}"


def _object(name: str) -> Any:
    """Return a class or function of eomgen by ``module:name``, or a comparison of Python. Raises NoRecordError."""
    module, _, attribute = name.partition(":")
    if not (module.startswith("eomgen.") or name in _COMPARISONS):
        raise NoRecordError(name)
    try:
        value = attrgetter(attribute)(import_module(module))
        is_defined_there = _name(value) == name  # no import of the module, such as ``os.system``
    except AttributeError:
        is_defined_there = False
    if not is_defined_there:
        raise NoRecordError(name)
    return value
