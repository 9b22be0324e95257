"""Inclusion of files: their entries under a prefix, renamed key by key; their base on a body of the scene.

A part is read as data with its values in SI; then its names and references are renamed as the schema says of each key,
while its formulas keep their text and take their namespace along.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from eomgen.base.messages import NAME_RULE, is_legal, key_of, nearest, shown
from eomgen.errors import EomgenError, FileError
from eomgen.formula.units.labels import number_in_label
from eomgen.formula.units.parser import UnitError, is_quantity
from eomgen.scene.control.controllers import made_by_controller
from eomgen.scene.control.schema import ControllerEntry
from eomgen.scene.document.parts_schema import Include, include_of
from eomgen.scene.document.schema import document_for, section_keys
from eomgen.scene.document.units import in_si, start_in_si
from eomgen.scene.document.validation import explain, wrong_format
from eomgen.scene.formula.namespaces import FileData, IncludedText, Namespace
from eomgen.scene.formula.scope import REACTING
from eomgen.scene.reading.key_metadata import Inner, KeyMetadata, Table, fields_of
from eomgen.scene.reading.kinds import FaultyText, describe
from eomgen.scene.reading.report import Report
from eomgen.scene.repeat import expand_repeats
from eomgen.scene.sources.register import all_options, endings_like, readable, source_of
from eomgen.scene.sources.source import ConvertedScene, OptionError, Source, read_text, shown_file
from eomgen.system.description import BASE, WORLD


class Renamer:
    """Renames the entries of an included file, and all references to these entries, for the including scene.

    Parameters
    ----------
    space : Namespace
        New name of each entry of the included file, by section and old name.
    base : str
        Name in the including file for the file's base.
    file : Path
        The included file, from the folder of the including one.
    """

    def __init__(self, space: Namespace, base: str, file: Path) -> None:
        self.space = space
        self.base = base
        self.file = file

    def document(self, data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Return the sections of an included file's ``data`` by key, each entry under the new name with renamed
        references; entries without a new name, and keys that are not sections of named entries, are left out."""
        result = {}
        schema = document_for(data)
        sections = section_keys(data)
        for section, (_, inner) in fields_of(schema).items():
            if section in sections and inner is not None and isinstance(data.get(section), Mapping):
                names = self.space.names[section]
                entries = data[section].items()
                result[section] = {
                    names[name]: self.entry(inner.model, entry) for name, entry in entries if name in names
                }
        return result

    def entry(self, model: type[Table], entry: Any) -> Any:
        if isinstance(entry, str) and model.short:
            entry = {model.short: entry}
        if not isinstance(entry, Mapping):
            return entry
        known = fields_of(model)
        return {key: self.value(*known[key], value) if key in known else value for key, value in entry.items()}

    def value(self, meaning: KeyMetadata, inner: Inner | None, value: Any) -> Any:
        if inner is not None:
            if inner.shape == "list" and isinstance(value, list | tuple):
                return [self.entry(inner.model, entry) for entry in value]
            if inner.shape == "entries" and isinstance(value, Mapping):
                return {name: self.entry(inner.model, entry) for name, entry in value.items()}
            return self.entry(inner.model, value)
        if meaning.refers:
            return self.reference(meaning.refers, value)
        if meaning.sets and isinstance(value, Mapping):
            return {self.number(name): self.texts(entry) for name, entry in value.items()}
        if meaning.path and isinstance(value, str):
            return str(self.file.parent / value)
        return self.texts(value) if meaning.unit or meaning.names is not None else value

    def reference(self, section: str, name: Any) -> Any:
        """Return the new name of an entry of ``section`` that a key refers to; for an unknown entry, words that are not
        a legal name, which the checks report later. ``name`` may be a list of names, or a mapping with a value for each
        name; the result has the same form. Values that are not texts stay. In the section of bodies, "base" becomes the
        including scene's body and "world" stays."""
        if isinstance(name, list | tuple):
            return [self.reference(section, entry) for entry in name]
        if isinstance(name, Mapping):
            known = self.space.names[section]
            return {known.get(entry, entry): self.texts(value) for entry, value in name.items()}
        if section == "bodies" and name in (BASE, WORLD):
            return self.base if name == BASE else WORLD
        if not isinstance(name, str) or not name:
            return name
        if section == "reactions":
            section = self.space.section_with(name, REACTING)
        return self.space.names[section].get(name, f"{name} in {self.file.name}")

    def number(self, name: str) -> str:
        """Return the new name of a component of the state: ``q.joint``, ``v.beam[2]``, or an internal state; an unknown
        name stays."""
        names = self.space.names
        match = re.fullmatch(r"\s*([qv])\s*\.\s*(\w+)(.*)", name, re.DOTALL)
        if match is None:
            return names["states"].get(name.strip(), name)
        letter, joint, index = match.groups()
        return f"{letter}.{names['joints'].get(joint, names['beams'].get(joint, joint))}{index}"

    def texts(self, value: Any) -> Any:
        """Return a value with each text, also in lists and mappings, marked as a formula whose names belong to the
        included file's namespace (``IncludedText``); other values stay."""
        if isinstance(value, FaultyText):
            return value
        if isinstance(value, str):
            return IncludedText(value, self.space)
        if isinstance(value, list | tuple):
            return [self.texts(entry) for entry in value]
        return {name: self.texts(entry) for name, entry in value.items()} if isinstance(value, Mapping) else value


def overridden(key: str, entry: Include, data: dict[str, Any], names: frozenset[str], report: Report) -> dict[str, str]:
    """Put the values of an include into the parameters of the included file's ``data``, in place, and return the values
    that are formulas, as text by the parameter's name; parameters with formulas are removed from ``data``. ``key`` is
    the dotted key of the include and ``entry`` the entry; ``names`` are names of the including file, which no unit may
    have. Unknown parameters and units that do not fit are reported."""
    section = data.get("parameters", {})
    parameters = dict(section) if isinstance(section, Mapping) else {}
    formulas: dict[str, str] = {}
    for name, value in entry.parameters.items():
        parameter_key = f"{key}.parameters.{key_of(name)}"
        if name not in parameters:
            fault = f"{shown(entry.file)} has no parameter {shown(name)} [E1586]"
            report.add(parameter_key, fault, nearest(name, parameters) or "without parameters")
            continue
        if isinstance(value, str) and not is_quantity(value):
            formulas[name] = value
            del parameters[name]
            continue
        table = parameters[name] if isinstance(parameters[name], Mapping) else {}
        label = table.get("unit", "")
        try:
            if isinstance(value, str):
                number, unit = number_in_label(value, label if isinstance(label, str) else "", names)
                parameters[name] = {**table, "value": number, "unit": unit}
            else:
                parameters[name] = {**table, "value": value}
        except UnitError as error:
            report.add_error(parameter_key, error)
    data["parameters"] = parameters
    return formulas


_LINE_KEY = re.compile(r"([a-z_]+)\.([A-Za-z_][A-Za-z0-9_]*)(.*)", re.DOTALL)


def with_included(data: Mapping[str, Any], report: Report, folder: Path) -> FileData:
    """Return the data of a scene with the entries of all included files, under new names, and with the lines of all
    keys.

    Parameters
    ----------
    data : mapping
        As ``tomllib`` reads a scene file.
    report : Report
        Report of the scene; takes the faults of all files.
    folder : Path
        Folder to which the paths in the scene are relative.
    """
    part = FileData(dict(data), {key: report.place(key) for key in report.lines})
    return _Includer(report, folder).include_files(part, report, folder, [(folder / report.file).resolve()])


class _Includer:
    def __init__(self, report: Report, folder: Path) -> None:
        self.report = report  # of the scene: the problems of other files end here
        self.folder = folder  # of the scene
        self.files = 0
        self.scenes: dict[Path, ConvertedScene] = {}  # by path: one file may be included many times

    def shown_file(self, path: Path) -> str:
        """Return the shorter text of an included file's path, relative to the folder of the scene or unchanged, for
        messages; whole paths distinguish files of equal name."""
        try:
            shorter = min(os.path.relpath(path, self.folder), str(path), key=len)
        except ValueError:  # on another drive
            shorter = str(path)
        return shown_file(Path(shorter), whole=True)

    def include_files(self, part: FileData, report: Report, folder: Path, chain: Sequence[Path]) -> FileData:
        """Add the entries of all files in the section ``include`` of a file to ``part``, the data of this file, and
        return the changed part. ``report`` is the report of the file, ``folder`` the file's folder, and ``chain`` has
        the paths from the scene's file to the file, by which circles are found. Faulty includes are reported and left
        out."""
        written = part.data.pop("include", {})
        if not isinstance(written, Mapping):
            fault = f"a table is needed here, not {describe(written)} [E0716]"
            report.add("include", fault, '[include.left] and file = "left.toml"')
            return part
        opened: list[tuple[str, Include, FileData]] = []
        for name, raw in written.items():
            entry = _entry(name, raw, report)
            inner = None if entry is None else self.open(key_of("include", name), entry, report, folder, chain)
            if entry is not None and inner is not None:
                opened.append((name, entry, inner))
        bodies = [BASE, *_bodies(part.data)]
        bodies += [_prefix(name, entry) + body for name, entry, inner in opened for body in _bodies(inner.data)]
        for name, entry, inner in opened:
            if entry.parent not in bodies:
                key = f"{key_of('include', name)}.parent"
                report.add(key, f"there is no body {shown(entry.parent)} [E1587]", nearest(entry.parent, bodies))
                entry = entry.model_copy(update={"parent": BASE})  # noqa: PLW2901 - so that it is one problem, not many
            _merge(name, entry, inner, part, report)
        return part

    def open(self, key: str, entry: Include, report: Report, folder: Path, chain: Sequence[Path]) -> FileData | None:
        """Return the data of the file that an include names, with the files included there; None, after a report, if
        the file cannot be read, is already open in the chain, is of an unknown kind, or above the limits of number and
        depth. ``key`` is the dotted key of
        the include and ``entry`` the entry; other arguments as of ``include_files``."""
        path, field = folder / entry.file, f"{key}.file"
        self.files += 1
        try:
            resolved = path.resolve()
        except (OSError, ValueError, RuntimeError) as error:
            fault = f"{shown(entry.file)} is not a path: {error} [E1588]"
            report.add(field, fault, "a path from the folder of this file")
            return None
        if resolved in chain:
            names = ", ".join(self.shown_file(step) for step in [*chain[chain.index(resolved) :], resolved])
            fault = f"files include one another in a circle: {names} [E1590]"
            report.add(field, fault, "one of them without the include")
            return None
        if len(chain) > 20 or self.files > 1000:
            fault = "more than 1000 files, or more than 20 within one another, are included [E1591]"
            report.add(field, fault, "fewer of them")
            return None
        source = source_of(path)
        if source is None:
            named = Path(entry.file) if path.is_dir() else path  # its files may include this one
            fault = f"{shown(entry.file)} is not a kind of file that can be included [E1592]"
            report.add(field, fault, readable(named))
            return None
        try:
            options = all_options()
            of_others = (options.keys() & entry.model_fields_set) - {option.name for option in source.options}
            for name in sorted(of_others):
                fault = f"{name} is for {options[name][0].name} only [E1593]"
                report.add(f"{key}.{name}", fault, "the joint in the included file")
            if source.scenes:
                return self.scene(source, path, [*chain, resolved])
            file = self.shown_file(path)
            part = _convert(source, path, file, entry)
            if "include" not in part.data:
                return part
            inner = Report(file, part.lines)
            part = self.include_files(part, inner, path.parent, [*chain, resolved])
            self.report.noted += inner.all()
            return part
        except FileError as error:
            problem = error.problems[0]
            report.add(field, f"{shown(entry.file)} {problem.what} [E1594]", f"a path from the folder of {report.file}")
        except OptionError as error:
            report.add_error(f"{key}.{error.option}", error)
        except EomgenError as error:
            self.report.noted += [(0, problem) for problem in error.problems]
        return None

    def scene(self, source: Source, path: Path, chain: Sequence[Path]) -> FileData:
        """Return the data of an included scene file in SI units, with repeated entries and further included files.
        ``chain`` has the paths from the scene's file to ``path``. Faults go to the report of the scene; a note is added
        for the keys ``base``, ``doubts`` and ``gravity``, which have no effect in an included file."""
        file, same = self.shown_file(path), chain[-1]
        if same not in self.scenes:
            self.scenes[same] = source.read(read_text(path), file=file, included=True)
        read = self.scenes[same]
        report = Report(file, read.lines)
        data = dict(read.data)
        if "repeat" in data:
            data = expand_repeats(data, report)
        _check_top_level(data, report)
        part = FileData(data, {key: report.place(key) for key in report.lines})
        part = self.include_files(part, report, path.parent, chain)
        report.lines = part.lines
        part.data, *_ = in_si(part.data, report)
        self.report.noted += report.all()
        part.notes += [
            f"{file}: its key {left_out} is left out, the key of the including scene holds [W0130]"
            for left_out in ("base", "doubts", "gravity")
            if left_out in part.data
        ]
        return part


def _entry(name: str, raw: object, report: Report) -> Include | None:
    """Return the checked entry ``raw`` of the section ``include`` with the name ``name``; None, after a report, if a
    key is wrong or the prefix cannot begin a name."""
    file = raw.get("file") if isinstance(raw, Mapping) else None
    table = include_of(source_of(Path(file)) if isinstance(file, str) else None)
    try:
        entry = table.model_validate(raw)
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            location = ("include", name, *(part for part in detail["loc"] if isinstance(part, str | int)))
            fault, hint = explain(detail["type"], detail["msg"], location, detail.get("input"), table, depth=2)
            report.add(key_of(*location), fault, hint)
        return None
    prefix = _prefix(name, entry)
    if prefix and not is_legal(prefix):
        message = f"{shown(prefix)} cannot be the beginning of a name [E1595]"
        report.add(key_of("include", name), message, 'prefix = "left_"')
        return None
    return entry


def _convert(source: Source, path: Path, file: str, entry: Include) -> FileData:
    """Return the data of a file of another format, with the options of the entry; ``file`` is the name for messages."""
    options = {option.name: getattr(entry, option.name) for option in source.options}
    read = source.convert(read_text(path, endings_like(path)), path, included=True, **options)
    places = {key: line if isinstance(line, str) else f"{file}:{line}" for key, line in read.lines.items()}
    judged = set(read.data["bodies"]) if read.inertias_checked else set()
    return FileData(read.data, places, [f"{file}: {note}" for note in read.notes], judged)


def _check_top_level(data: dict[str, Any], report: Report) -> None:
    """Report problems in the top-level keys of an included file, which the including scene does not check, and delete
    sections that are not tables and entries with illegal names from ``data`` in place."""
    if data.get("format") != 1:
        missing = ("the key format is missing [E1596]", "format = 1")
        report.add("format", *(wrong_format(data["format"]) if "format" in data else missing))
    schema = document_for(data)
    sections = section_keys(data)
    for key in list(data):
        if key not in schema.model_fields:
            report.add(key_of(key), f"the key {shown(key)} is unknown here [E0722]", nearest(key, schema.known_keys()))
        elif key in sections and not isinstance(data[key], Mapping):
            report.add(key, f"a table is needed here, not {describe(data[key])} [E0716]")
            del data[key]
        elif key in sections:
            for name in [name for name in data[key] if not is_legal(name)]:
                report.add(key_of(key, name), f"the name {shown(name)} is not legal [E0715]", NAME_RULE)
            data[key] = {name: entry for name, entry in data[key].items() if is_legal(name)}


def _merge(name: str, entry: Include, inner: FileData, part: FileData, report: Report) -> None:
    """Put the entries of an included file ``inner`` into the data ``part`` of the including file in place, with new
    names. ``name`` and ``entry`` are name and entry of the include. Parameters and initial states of the entry replace
    the values of the file. Lines, notes, formulas and namespaces are added to ``part``; names that are taken are
    reported."""
    key, prefix = key_of("include", name), _prefix(name, entry)
    names_of_file = frozenset(_names(part.data, "parameters") + _names(part.data, "inputs"))
    values = overridden(key, entry, inner.data, names_of_file, report)
    _start(key, entry, inner.data, report)
    sections = section_keys(inner.data)
    names = {section: {local: prefix + local for local in _names(inner.data, section)} for section in sections}
    names["bodies"] |= names["beams"]
    names["points"] |= names["frames"]
    space = Namespace(names, values)
    base = _base(name, entry, part, report, taken=names["frames"].values())
    entries = Renamer(space, base, Path(entry.file)).document(inner.data)
    renamed_too = _controller_names(entries)
    for section, controllers in _controller_names(inner.data).items():
        names[section] |= dict(zip(controllers, renamed_too[section], strict=True))
    for section, renamed in entries.items():
        mine = part.data.setdefault(section, {})
        if not isinstance(mine, Mapping):
            continue  # said when the scene is read
        for twice in [entry_name for entry_name in renamed if entry_name in mine]:
            here = part.lines.get(key_of(section, twice), report.file)
            there = inner.lines.get(key_of(section, twice.removeprefix(prefix)), entry.file)
            fault = f"the name {twice} in {section} is given twice, at {here} and at {there} [E1597]"
            report.add(key, fault, f'another prefix than "{prefix}"')
        part.data[section] = {**mine, **renamed}
    for old, line in inner.lines.items():
        match = _LINE_KEY.fullmatch(old)
        if match and match[1] == "include":
            part.lines[f"{key}.{old}"] = line
        elif match and match[1] in sections:
            part.lines.setdefault(f"{match[1]}.{prefix}{match[2]}{match[3]}", line)
    part.lines |= _places_of_starts(f"{key}.initial.", prefix, part.lines)
    part.notes += [note for note in inner.notes if note not in part.notes]  # of a file that is included several times
    part.judged |= {prefix + body for body in inner.judged}
    part.bound |= {f"{key}.parameters.{parameter}": text for parameter, text in values.items()}
    part.bound |= {f"{key}.{bound}": IncludedText(text, space) for bound, text in inner.bound.items()}


def _start(key: str, entry: Include, data: dict[str, Any], report: Report) -> None:
    """Replace the initial states of joints in the included file's ``data``, in place, by the values that the include
    gives, converted to SI; an unknown joint is reported at the dotted ``key`` of the include."""
    joints = data.get("joints", {})
    for name, initial in entry.initial.items():
        joint_key = f"{key}.initial.{key_of(name)}"
        if name not in joints:
            report.add(joint_key, f"{shown(entry.file)} has no joint {shown(name)} [E2132]", nearest(name, joints))
        else:
            start = start_in_si(data, name, joint_key, initial, report)
            data["joints"] = joints = {**joints, name: {**joints[name], "initial": start}}


def _places_of_starts(key: str, prefix: str, places: Mapping[str, str]) -> dict[str, str]:
    """Return the lines of the initial states that an include gives, under the keys of the joints in the scene. ``key``
    is the beginning of the keys in the include, ``prefix`` the prefix of new names, ``places`` has the lines by key."""
    written = [(name.removeprefix(key).partition("."), line) for name, line in places.items() if name.startswith(key)]
    return {f"joints.{prefix}{joint}.initial{dot}{rest}": line for (joint, dot, rest), line in written}


def _base(name: str, entry: Include, part: FileData, report: Report, taken: Collection[str]) -> str:
    """Return the name of the body of ``part`` that takes the place of the included file's base: the parent itself, or a
    massless body fixed to the parent at the include's position and rotation, which is added to ``part`` in place.
    ``name`` and ``entry`` are name and entry of the include; ``taken`` are the new names of the file's frames, which no
    body may have."""
    if entry.position == (0.0, 0.0, 0.0) and not entry.rotation:
        return entry.parent
    body, key = f"{name}_base", key_of("include", name)
    if body in taken:
        body = f"{body}_body"
    rotation = [turn.model_dump() for turn in entry.rotation or ()]
    joint = {"type": "fixed", "parent": entry.parent, "child": body, "position": entry.position, "rotation": rotation}
    for section, data in (("bodies", {"mass": 0.0}), ("joints", joint)):
        mine = part.data.get(section, {})
        if not isinstance(mine, Mapping):
            continue
        if body in mine:
            fault = f"the name {body} in {section} is needed for the place of this include [E1598]"
            report.add(key, fault, "another name")
        part.data[section] = {**mine, body: data}
        for suffix in ("", ".position", ".rotation"):
            if key + suffix in part.lines:
                part.lines[key_of(section, body) + suffix] = part.lines[key + suffix]
    return body


def _controller_names(data: Mapping[str, Any]) -> dict[str, list[str]]:
    """Return the names that the controllers in a file's data make for formulas, by section: lists for states,
    parameters and controllers; invalid controllers are left out."""
    result: dict[str, list[str]] = {"states": [], "parameters": [], "controllers": []}
    for name in _names(data, "controllers"):
        try:
            entry = ControllerEntry.model_validate(data["controllers"][name])
        except ValidationError:
            continue
        for section, made in made_by_controller(name, entry).items():
            result[section] += made
    return result


def _prefix(name: str, entry: Include) -> str:
    return f"{name}_" if entry.prefix is None else entry.prefix


def _bodies(data: Mapping[str, Any]) -> list[str]:
    """Return the names of bodies and beams, which joints can carry."""
    return _names(data, "bodies") + _names(data, "beams")


def _names(data: Mapping[str, Any], section: str) -> list[str]:
    entries = data.get(section, {})
    return [str(name) for name in entries] if isinstance(entries, Mapping) else []
