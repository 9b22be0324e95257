"""The contract of a section of a scene file, and the state of reading one scene.

A row of the register ``sections`` says all that the package knows of a section: schema, names for formulas, reader,
checks, notes, its fields of the Scene, and its method of the SceneBuilder. File schema, builder, reference page and
assembly are loops over the rows. Other distributions add rows by entry points of the group ``eomgen.sections``.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar, cast

from eomgen.base.data import dataclass, field, field_names
from eomgen.base.messages import NAME_LENGTH
from eomgen.base.products import import_target
from eomgen.formula.nodes import Formula, Vector
from eomgen.scene.formula.scope import ElementQuantity, SceneNames
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.requirements import Bound, Row
from eomgen.scene.reading.values import Values
from eomgen.system.signals import Parameter, variables_of

if TYPE_CHECKING:
    from eomgen.scene.reading.key_metadata import Table

Kept = TypeVar("Kept")
#: From the key, body and position of a place to the equivalent body and the position in this body.
AttachByKey = Callable[[str, str, Vector], tuple[str, Vector]]
#: From the key, the kind and the entry of an output of a beam's section to the three components.
SectionFormulas = Callable[[str, str, Any], tuple[Formula, ...]]
_NAMES = frozenset(field_names(SceneNames))


class Entries(Protocol):
    """Protocol of a scene file as data whose entries have passed their schemas: settings as attributes, and sections by
    key."""

    @property
    def coordinates(self) -> str: ...
    @property
    def gravity(self) -> tuple[float | str, ...]: ...
    @property
    def simulation(self) -> Any: ...

    def section(self, key: str) -> Mapping[str, Any]:
        """Return the entries of a section by name."""
        ...

    def table(self, key: str) -> Any:
        """Return a section that is one table; None if the file has none."""
        ...


class UnusedEntries(NamedTuple):
    """Entries of a section without an effect, with the nouns of one and of several."""

    singular: str
    plural: str
    names: Sequence[str]


@dataclass(frozen=True, eq=False)  # rows are compared by identity
class Section:
    """A section of a scene file: a row of the register.

    Attributes
    ----------
    key : of the section in a file
    entry : schema of an entry, or ``module:name`` of a schema that is imported only for scenes with the section
    singular : noun of an entry on the reference page; by default the key without the last letter
    method : name of the builder's method; by default ``singular``
    positional : keys of an entry that the builder's method takes by position, after the name
    documentation : of the builder's method; by default derived from the documentation of ``entry``
    bare : noun of an entry, ``a parameter``, if formulas refer to entries by name alone
    single : whether the section is one table in place of entries by name
    after : sections that are read before this section; the order of reading is the order of messages and requirements,
        too
    before : sections, unknown to a product, that are read after this section
    last : whether the section observes a motion, and is read after all sections that do not
    attached : whether entries have places on bodies, which are nodes on geometrically exact beams
    scene_field : field of the Scene that holds the items; empty if ``fields`` says more
    drawn : whether entries are for pictures alone
    unlike : sections that may not have an entry of the same name: the nouns of both entries, and a remedy
    item : from name, entry and state of reading to the item of the Scene; by default the entry itself
    bounds : bound of each single value, by key within the entry; None for any number
    """

    key: str
    entry: type[Table] | str
    singular: str = ""
    method: str = ""
    positional: tuple[str, ...] = ()
    documentation: str = ""
    bare: str = ""
    single: bool = False
    after: tuple[str, ...] = ()
    before: tuple[str, ...] = ()
    last: bool = False
    attached: bool = False
    scene_field: str = ""
    drawn: bool = False
    unlike: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    item: Callable[[str, Any, Reading], Any] | None = None
    bounds: Mapping[str, Bound | None] = field(default_factory=dict)

    @property
    def schema(self) -> type[Table]:
        """Schema of an entry, imported if need be."""
        return cast("type[Table]", import_target(self.entry)) if isinstance(self.entry, str) else self.entry

    @property
    def title(self) -> str:
        """Noun of an entry: ``torsion spring``."""
        return self.singular or self.key.removesuffix("s").replace("_", " ")

    @property
    def method_name(self) -> str:
        """Name of the builder's method."""
        return self.method or self.title.replace(" ", "_")

    @property
    def method_documentation(self) -> str:
        """First lines of the documentation of the builder's method."""
        return self.documentation or f"Add an entry of the section ``{self.key}``: {self.schema.__doc__}"

    def names(self, reading: Reading) -> Mapping[str, Any]:
        """Return the names that formulas may mention, by field of ``SceneNames``: tuples and dictionaries, to be joined
        over all sections; dictionaries may be filled while sections are read.

        Parameters
        ----------
        reading : Reading
            State of reading.

        Returns
        -------
        mapping
            Names by field of ``SceneNames``.
        """
        return {self.key: reading.names_in(self.key)} if self.key in _NAMES else {}

    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        """Return the fault of a legal name of an entry, and a hint; two empty texts if there is none.

        By default the only fault is an entry of this name in a section of ``unlike``.

        Parameters
        ----------
        name : str
            Name of an entry, also of an entry that its schema refused, which is not in ``document``.
        document : Entries
            The entries of the document that have passed their schemas.
        rows : sequence of Section
            The sections that the document needs, in the order of the register, ``curves`` last.

        Returns
        -------
        fault : str
            Empty without a fault.
        hint : str
            Remedy; may be empty.
        """
        for key, (nouns, hint) in self.unlike.items():
            if name in document.section(key):
                return f"the name {name} is both {nouns} [E1461]", hint
        return "", ""

    def made_names(self, entries: Mapping[str, Any]) -> Mapping[str, str]:
        """Return names that entries add for formulas, with descriptions for messages.

        Parameters
        ----------
        entries : mapping
            Entries of the section by name, as written.

        Returns
        -------
        mapping
            Descriptions by added name.
        """
        return {}

    def parameters(self, entries: Mapping[str, Any]) -> Sequence[Parameter]:
        """Return the parameters that entries are, or make.

        Parameters
        ----------
        entries : mapping
            Entries of the section by name, as written.

        Returns
        -------
        sequence of Parameter
            Of all entries.
        """
        return ()

    def prepare(self, reading: Reading) -> None:
        """Read the entries that readers of other sections need, before these readers are called.

        Parameters
        ----------
        reading : Reading
            State of reading.
        """

    def read(self, reading: Reading) -> Mapping[str, Any]:
        """Return the items of the Scene that entries become, by name; problems go to the report of ``reading``.

        Parameters
        ----------
        reading : Reading
            State of reading; its ``items`` are not changed by default.

        Returns
        -------
        mapping
            Items by name, in the order of the document, without entries that their schema refused.
        """
        entries = reading.document.section(self.key).items()
        return {name: self.read_entry(name, entry, reading) for name, entry in entries}

    def read_entry(self, name: str, entry: Any, reading: Reading) -> Any:
        """Return the item of an entry.

        Parameters
        ----------
        name : str
            Name of the entry.
        entry : Table
            The entry, checked by its schema.
        reading : Reading
            State of reading.

        Returns
        -------
        object
            The item of the Scene.
        """
        return entry if self.item is None else self.item(name, entry, reading)

    def check(self, reading: Reading) -> None:
        """Report faults between entries, after all entries are read.

        Parameters
        ----------
        reading : Reading
            State of reading, to whose report faults go.
        """

    def notes(self, reading: Reading) -> Iterable[str]:
        """Return notes on doubtful entries of a scene without problems.

        Parameters
        ----------
        reading : Reading
            State of reading, with all items.

        Returns
        -------
        iterable of str
            One sentence for each.
        """
        return ()

    def unused(self, reading: Reading) -> UnusedEntries:
        """Return the entries that no formula mentions although such entries only serve formulas.

        Parameters
        ----------
        reading : Reading
            State of reading, with all items.

        Returns
        -------
        UnusedEntries
            Names of the entries, with the noun for the note.
        """
        return UnusedEntries("", "", ())

    def plain_angles(self, entries: Mapping[str, Any]) -> Iterable[tuple[str, float]]:
        """Return subject and value, rad, of each angle that is a plain number in the entries as written.

        Parameters
        ----------
        entries : mapping
            Entries of the section by name, as written.

        Returns
        -------
        iterable of tuple of str and float
            Subject for messages, and the angle in rad.
        """
        return ()

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        """Return the fields of the Scene that follow from the section; tuples and mappings of several sections are
        joined in the order of the register.

        Parameters
        ----------
        reading : Reading
            State of reading, with the items of this section.

        Returns
        -------
        mapping
            Values by field of the Scene.
        """
        return {self.scene_field: tuple(reading.items[self.key].values())} if self.scene_field else {}


@dataclass(eq=False)
class Reading:
    """The state of reading one scene: items read so far, for the readers of further sections.

    Parameters
    ----------
    document : Entries
        All entries of the document, checked by their schemas.
    refused : mapping
        Names of refused entries by section: these entries exist, but the data are unknown.
    data : mapping
        The nested data of the document.
    rows : sequence of Section
        In the order of the register.
    report : Report
        Collects problems and notes.
    folder : Path
        The folder from which paths of the scene start.
    judged : collection of str
        Keys whose values an importer has judged, which have no requirements.
    bounds : mapping
        Bounds of single values, by key.
    units : mapping
        Units of the values of formulas, by key.
    offered : mapping
        Quantities of force elements for formulas, with their kinds in scopes, by section.

    Attributes
    ----------
    names : names that formulas may mention; the mappings of ``tables`` are filled while sections are read
    values : the reader of values
    parameters : of the scene so far
    items : results of the sections that are read, by section and name
    attach : moves places on geometrically exact beams to nodes
    section_formulas : gives outputs of beams' sections
    bodies : names of all bodies and beams
    broken : names of refused bodies and beams
    """

    document: Entries
    refused: Mapping[str, set[str]]
    data: Mapping[str, Any]
    rows: Sequence[Section]
    report: Report
    folder: Path
    judged: Collection[str]
    bounds: Mapping[str, Row]
    units: Mapping[str, str]
    offered: Mapping[str, Mapping[str, str]]

    def __post_init__(self) -> None:
        """Collect parameters, names and unit labels from all sections, make the reader of values, and call ``prepare``
        of each row, in the order of ``rows``."""
        document, rows = self.document, self.rows
        self.items: dict[str, Mapping[str, Any]] = {}
        self.attach: AttachByKey = _as_written
        self.section_formulas: SectionFormulas = lambda key, kind, output: ()
        self.broken = sorted(self.refused["bodies"] | self.refused["beams"])
        self.bodies = dict.fromkeys([*document.section("bodies"), *document.section("beams"), *self.broken])
        self._kept: dict[type, Any] = {}
        self.parameters = [item for row in rows if not row.single for item in row.parameters(document.section(row.key))]
        tunable = {item.name: item.tunable for item in self.parameters}
        named = [item for row in rows if row.bare for item in document.section(row.key).items()]
        labels = {name: getattr(entry, "unit", "") for name, entry in named}
        self.tables: dict[str, Any] = {
            "parameters": tunable | dict.fromkeys(sorted(self.refused["parameters"]), False),
            "labels": labels | {item.name: item.unit for item in self.parameters},
            "offered": {
                kind: ElementQuantity(key, scope, self.names_in(key))
                for key, scopes in self.offered.items()
                for kind, scope in scopes.items()
            },
        }
        for row in rows:
            join(self.tables, row.names(self))
        self.names = SceneNames(**self.tables)
        self.values = self.reader()
        for row in rows:
            row.prepare(self)

    def names_in(self, key: str) -> tuple[str, ...]:
        """Return the names of all entries of a section, refused entries last.

        Parameters
        ----------
        key : str
            Key of the section.

        Returns
        -------
        tuple of str
            In the order of the document.
        """
        return (*self.document.section(key), *sorted(self.refused[key]))

    def reader(self, report: Report | None = None) -> Values:
        """Return a new reader of values, which reports to the scene's report or to another report.

        Its requirements, notes and mentioned names are separate from the reader ``values``.

        Parameters
        ----------
        report : Report, optional
            Report for problems; the scene's by default.

        Returns
        -------
        Values
            A reader of values, with the defaults of all parameters that are known by now.
        """
        defaults = {parameter.name: parameter.value for parameter in self.parameters}
        refused = frozenset().union(*self.refused.values())
        return Values(self.names, defaults, report or self.report, refused, self.judged, self.bounds, self.units)

    def aside(self, attach: AttachByKey = lambda key, body, position: (body, position)) -> Reading:
        """Return a copy of this state with a separate report and a separate reader of values, to read entries in
        advance.

        Parameters
        ----------
        attach : callable, optional
            Function of the key, the body and the position of a place that returns body and position, as ``attach`` of
            the state; by default body and position stay.

        Returns
        -------
        Reading
            Items and kept objects read before are in the copy; later ones, problems and requirements of the copy do not
            enter this state. Parameters and names are shared.
        """
        there = copy.copy(self)
        there.report = Report(self.report.file, self.report.lines)
        there.values = self.reader(there.report)
        there.items, there._kept, there.attach = dict(self.items), dict(self._kept), attach
        return there

    def add_parameters(self, parameters: Sequence[Parameter]) -> None:
        """Add tunable parameters, which formulas that ``values`` reads from now on may mention.

        Parameters
        ----------
        parameters : sequence of Parameter
            Further parameters, each taken as tunable, which also enter ``parameters`` of this state; not checked.
        """
        self.parameters += parameters
        self.tables["parameters"] |= {item.name: True for item in parameters}
        self.tables["labels"] |= {item.name: item.unit for item in parameters}
        self.values.parameters = {**self.values.parameters, **{item.name: item.value for item in parameters}}

    def keep(self, thing: object) -> None:
        """Keep an object for the readers of other sections, which get the object by class.

        Parameters
        ----------
        thing : object
            Kept under its class.
        """
        self._kept[type(thing)] = thing

    def kept(self, kind: type[Kept]) -> Kept:
        """Return the object of a class that the reader of an earlier section kept.

        Parameters
        ----------
        kind : type
            Class of the object; a class derived from it is another class.

        Returns
        -------
        object
            Of that class, the last one kept.

        Raises
        ------
        KeyError
            No object of this class was kept.
        """
        kept: Kept = self._kept[kind]
        return kept


def join(whole: dict[str, Any], part: Mapping[str, Any]) -> None:
    """Add the values of the mapping ``part`` to the dictionary ``whole`` in place: tuples of an equal key are
    concatenated, dictionaries are updated in place, and other values are overwritten."""
    for key, value in part.items():
        if isinstance(value, tuple):
            whole[key] = (*whole.get(key, ()), *value)
        elif isinstance(value, dict) and key in whole:
            whole[key] |= value
        else:
            whole[key] = value


def in_reading_order(rows: Sequence[Section]) -> list[Section]:
    """Return the sections in the order of reading: each one after the sections in its field ``after``, and after
    sections that have its key in their field ``before``; otherwise in the order of ``rows``. Sections with ``last``
    come at the end, and keys of absent sections are ignored."""
    by_key = {row.key: row for row in rows}
    order: dict[str, Section] = {}

    def put(row: Section) -> None:
        if row.key in order:
            return
        for key in row.after:
            if key in by_key:  # a product may be absent
                put(by_key[key])
        for later_row in rows:
            if row.key in later_row.before:
                put(later_row)
        order[row.key] = row

    for row in sorted(rows, key=lambda row: row.last):
        put(row)
    return list(order.values())


def fault_of_variables(
    owner: str, name: str, count: int, document: Entries, rows: Sequence[Section]
) -> tuple[str, str]:
    """Return a fault and a remedy for the names of the parameters of ``count`` standard normal variables that an entry
    adds; two empty texts without a fault. Faults are a name that is too long, and a name that an entry of another
    section with bare names has in ``document``. ``owner`` is the noun of the entry, "random process" or "sea", and
    ``name`` the entry's name."""
    last = variables_of(name, count)[-1]
    if len(last) > NAME_LENGTH:
        return f"the {owner} {name} has parameters such as {last}, whose names are too long [E1452]", "a shorter name"
    every = set(variables_of(name, count))
    for row in rows:
        for taken in every.intersection(document.section(row.key)) if row.bare else ():
            fault = f"the {owner} {name} has the parameter {taken}, and there is {row.bare} of that name [E1457]"
            return fault, "another name for one of them"
    return "", ""


def _as_written(key: str, body: str, position: Vector) -> tuple[str, Vector]:
    return body, position
