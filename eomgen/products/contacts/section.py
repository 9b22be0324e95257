"""Contacts in scene files, keys, bounds and data: a shape of a body on a plane, on a surface or in a housing, with laws
of the normal and the tangential force."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

from eomgen.base.data import dataclass, replace
from eomgen.base.messages import key_of
from eomgen.formula.nodes import ZERO, ZERO_VECTOR, Formula, Symbol
from eomgen.formula.substitution import map_symbols
from eomgen.products.contacts import friction_laws, normal_laws
from eomgen.products.contacts.laws import (
    LOCAL_NAMES,
    AppliedLaw,
    ContactLaw,
    bounds_of,
    rate_name,
    read_law,
    state_name,
    table_of,
)
from eomgen.products.contacts.slip_laws import KEYS, OF_FILE, SlipLaw, read_coefficients
from eomgen.products.contacts.surfaces import FOLLOWER, HEIGHT, surface_fields
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.joint_types import Need
from eomgen.scene.joints.constraint_schema import FrameEntry
from eomgen.scene.joints.frames import Site, read_frame
from eomgen.scene.joints.model import Frame
from eomgen.scene.reading.key_metadata import Table, key, of_parameters, optional
from eomgen.scene.reading.kinds import Triple, Value
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.requirements import Row, above_zero
from eomgen.scene.section import Entries, Reading, Section
from eomgen.system.signals import State

if TYPE_CHECKING:

    class NormalEntry(Table):
        type: str

    class TangentialEntry(NormalEntry):
        file: str | None
else:
    NormalEntry = table_of("NormalEntry", "A law of the normal force.", normal_laws.LAWS)
    TangentialEntry = table_of("TangentialEntry", "A law of the tangential force.", friction_laws.LAWS, **KEYS)

#: Keys of each shape, with examples, and the axes of the second frame that it needs, z of wheels, which slip along and
#: across it; functions of the same names are in ``mechanics/forces/contact_pairs.py``.
SHAPES: Mapping[str, tuple[str, Need]] = {
    "point": ("", "nothing"),
    "sphere": ("radius=0.1", "nothing"),
    "disc": ("radius=0.3", "z"),
    "torus": ("radius=0.3 tube_radius=0.05", "z"),
    "ellipsoid": ("semi_axes=[0.2,0.03,0.02]", "any"),
    FOLLOWER: ("radius=0.3", "z"),
}


class ContactEntry(Table):
    """A contact: a body of a simple shape on a plane or a surface, or in a housing."""

    first: FrameEntry = key("frame of the surface: the plane of its x and y, z out of the ground", kind="frame")
    second: FrameEntry = key("frame in the centre of the shape", kind="frame")
    shape: str = key("`point`, `sphere`, `disc`, `torus`, `ellipsoid`, as of [rolling](constraints.md), or `follower`")
    radius: Value | None = of_parameters("radius of a sphere or a disc, or of the centre line of a torus", unit="m")
    tube_radius: Value | None = of_parameters("tube radius of a torus", unit="m")
    semi_axes: Triple | None = of_parameters("semi-axes of an ellipsoid along x, y, z of `second`", unit="m")
    surface: Value | None = optional(
        "height of the surface over the plane", unit="m", names=HEIGHT, shown_default="the plane"
    )
    surface_rate: Value | None = optional(
        "its rate from time and inputs; needed if an input moves it", unit="m/s", names=HEIGHT
    )
    housing: Literal["sphere", "cylinder"] | None = optional(
        "a hollow about the origin, or about the z axis of `first`, in place of the plane, for a sphere or a point"
    )
    clearance: Value | None = of_parameters("radius of the housing less the radius of the sphere", unit="m")
    normal: NormalEntry | None = optional("law of the normal force", shown_default="linear, by the tyre's file")
    tangential: TangentialEntry | None = optional("law of the tangential force", shown_default="without friction")


@dataclass(frozen=True)
class Contact(ForceElement):
    """A contact between a shape of the second frame's body and a surface of the first frame's body.

    Attributes
    ----------
    housing : ``sphere`` or ``cylinder`` with a ``clearance``; empty for a plane or a surface
    tangential : None without friction
    axis_key : key of a wheel's axis below the element
    surface_rate : rate of the height due to time and inputs; None if it follows from the formula
    moving_surface : whether time or inputs move the surface
    elastic : whether only the part of the normal force with a potential acts
    """

    section: ClassVar[str] = "contacts"
    law: ClassVar[str] = "eomgen.products.contacts.law:LAW"
    axis_key: ClassVar[str] = "second.axis"

    first: Frame
    second: Frame
    shape: str
    normal: AppliedLaw
    tangential: AppliedLaw | None = None
    radius: Formula = ZERO
    tube_radius: Formula = ZERO
    semi_axes: tuple[Formula, Formula, Formula] = ZERO_VECTOR
    surface: Formula | None = None
    surface_rate: Formula | None = None
    moving_surface: bool = False
    housing: str = ""
    clearance: Formula = ZERO
    elastic: bool = False

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        laws = (self.normal, self.tangential)
        yield from ((formula, 0) for law in laws if law is not None for formula in law.values.values())
        yield from self.heights()

    def heights(self) -> Iterator[tuple[Formula, int]]:
        """Yield height and rate of the surface, by quantities of scenes, with the number of time derivatives needed."""
        for height, derivatives in ((self.surface, 1), (self.surface_rate, 0)):
            if height is not None:
                yield map_symbols(height, self._place), derivatives

    def _place(self, symbol: Symbol) -> Symbol:
        """Return a symbol, with the quantity of scenes in place of x or y."""
        return Symbol(f"contact_{'xy'[symbol.index]}", self.name) if symbol.kind == "local" else symbol

    def passive(self) -> Self:
        return replace(self, tangential=None, elastic=True)

    @property
    def touches(self) -> bool:
        return not self.housing

    def lengths(self) -> tuple[Formula, ...]:
        return (self.radius,)

    def frames(self) -> tuple[Frame, Frame] | None:
        return self.first, self.second


#: Deflection at whose load the relaxation length counts, m.
_USUAL_DEFLECTION = 0.02
#: Law in place of a law that the tyre's file gives.
_OF_FILE = AppliedLaw("linear", {})


def read_contact(name: str, entry: ContactEntry, site: Site) -> Contact:
    """Return the contact of an entry of [contacts]; faults are reported."""
    key, values, report = key_of("contacts", name), site.values, site.values.report
    need: Need = "nothing"
    if check_reference(f"{key}.shape", entry.shape, SHAPES, "shape", report):
        of_file = ("radius",) if entry.tangential is not None and entry.tangential.file else ()
        words = {shape: [word.split("=", 1) for word in keys.split()] for shape, (keys, _) in SHAPES.items()}
        kinds = {shape: " ".join(w[0] if w[0] in of_file else "=".join(w) for w in of) for shape, of in words.items()}
        values.check_kind(key, entry, "shape", kinds)
        need = SHAPES[entry.shape][1]
    if entry.housing is not None:
        if need != "nothing" or entry.surface is not None:
            fault = "a housing holds a sphere or a point, and has no surface [E2412]"
            report.add(f"{key}.housing", fault, 'shape = "sphere"')
        if entry.clearance is None:
            report.add(key, "a housing needs a clearance [E2413]", "clearance = 1e-4")
    elif entry.clearance is not None:
        report.add(f"{key}.clearance", "a clearance needs a housing [E2414]", 'housing = "cylinder"')
    friction = entry.tangential
    return Contact(
        name,
        read_frame(f"{key}.first", "contact", entry.first, "z", site),
        read_frame(f"{key}.second", f"contact of the shape {entry.shape}", entry.second, need, site),
        entry.shape,
        _OF_FILE if entry.normal is None else read_law(f"{key}.normal", name, entry.normal, normal_laws.LAWS, values),
        None if friction is None else read_law(f"{key}.tangential", name, friction, friction_laws.LAWS, values),
        **surface_fields(key, "surface", entry, values, "contact"),
        housing=entry.housing or "",
        **values.keys(key, entry, "radius", "tube_radius", "semi_axes", "clearance"),
    )


class PairSection(ElementSection):
    """A section of pairs, which a description keeps for checks of runs."""

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        items = tuple(reading.items[self.key].values())
        return {**super().fields(reading), "parts": {self.key: items} if items else {}}


def _laws_of(entries: Mapping[str, Any]) -> dict[str, ContactLaw]:
    """Return the tangential laws of entries that have one."""
    tables = {name: entry.tangential for name, entry in entries.items() if entry.tangential is not None}
    return {name: friction_laws.LAWS[table.type] for name, table in tables.items()}


def _gives(law: ContactLaw | None, kind: str) -> bool:
    """Return whether a tangential law has a result, a state or the rate of a state."""
    return law is not None and kind in (*law.results, *law.states, *map(rate_name, law.states))


class _Contacts(PairSection):
    def read_entry(self, name: str, entry: ContactEntry, reading: Reading) -> Contact:
        item, key = super().read_entry(name, entry, reading), key_of("contacts", name)
        assert isinstance(item, Contact)
        table = entry.tangential
        if table is not None and isinstance(row := friction_laws.LAWS[table.type], SlipLaw):
            if entry.shape in SHAPES and SHAPES[entry.shape][1] != "z":
                fault = f"{row.name} is a law of wheels, and a {entry.shape} has no spin axis [E2460]"
                reading.report.add(f"{key}.tangential.type", fault, '"bristles" or "coulomb", or shape = "torus"')
            coefficients = read_coefficients(name, row, table, reading.folder, reading.values)
            if table.file is None and entry.normal is not None and entry.normal.type == "linear":
                coefficients = {"LOAD": _USUAL_DEFLECTION * item.normal.values["stiffness"], **coefficients}
            item = replace(item, tangential=AppliedLaw(row.name, coefficients))
            if entry.radius is None and "UNLOADED_RADIUS" in coefficients:
                item = replace(item, radius=coefficients["UNLOADED_RADIUS"] - item.tube_radius)
                reading.values.require(f"{key}.radius", Row((), *_LENGTH), [item.radius])
        if entry.normal is not None:
            return item
        known = {} if item.tangential is None else item.tangential.values
        if "FITTYP" not in known:
            hint = 'normal = { type = "linear", stiffness = "200 kN/m" }'
            fault = "no law of the normal force, and no tyre's file with a stiffness [E2438]"
            reading.report.add(key, fault, hint, follows=(f"{key}.tangential.file",))
        return replace(item, normal=AppliedLaw(OF_FILE.name, known))

    def names(self, reading: Reading) -> Mapping[str, Any]:
        entries, names = reading.document.section("contacts"), super().names(reading)
        laws, offered = _laws_of(entries), dict(names["offered"])
        for kind in OF_SOME_LAWS if offered else ():
            having = [name for name in offered[kind].names if name not in entries or _gives(laws.get(name), kind)]
            types = " or ".join(law.name for law in friction_laws.LAWS.values() if _gives(law, kind))
            offered[kind] = replace(offered[kind], names=tuple(having), remedy=f"{types} as the type of tangential")
        return {**names, "offered": offered, "states": tuple(self.made_names(entries))}

    def made_names(self, entries: Mapping[str, Any]) -> Mapping[str, str]:
        return {
            state_name(name, state): f"a state of the contact {name}"
            for name, law in _laws_of(entries).items()
            for state in law.states
        }

    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        entries = document.section("contacts")
        for made in self.made_names({name: entries[name]} if name in entries else {}):
            for row in rows:
                if row.bare and made in document.section(row.key):
                    fault = f"the contact makes the state {made}, and there is {row.bare} of that name [E1457]"
                    return fault, "another name for one of them"
        return "", ""

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        contacts = [item for item in reading.items["contacts"].values() if item.tangential is not None]
        laws = [(item.name, friction_laws.LAWS[item.tangential.name]) for item in contacts]
        states = tuple(
            State(
                state_name(name, state), Symbol(rate_name(state), name), 0.0, law.unit, f"{state} of the contact {name}"
            )
            for name, law in laws
            for state in law.states
        )
        return {**super().fields(reading), "states": states}


#: Results of tangential laws that scenes offer under the same name.
OF_LAWS = ("moment_x", "moment_y", "moment_z", "slip_x", "slip_y")
#: Internal states and their rates, as quantities of scenes.
STATES = tuple(
    name for law in friction_laws.LAWS.values() for state in law.states for name in (state, rate_name(state))
)
#: Quantities that only contacts with a law of them have; forces and moments of other contacts are 0.
OF_SOME_LAWS = ("slip_x", "slip_y", *STATES)
_LENGTH = above_zero("the size of a shape [E2415]")
SECTION = _Contacts(
    key="contacts",
    entry=ContactEntry,
    model=Contact,
    reader=read_contact,
    bounds={
        **dict.fromkeys(("radius", "tube_radius", "semi_axes"), _LENGTH),
        **dict.fromkeys(("first.position", "second.position")),
        "clearance": above_zero("the clearance of a housing [E2441]"),
        **bounds_of(normal_laws.LAWS, "normal"),
        **bounds_of(friction_laws.LAWS, "tangential"),
    },
    offers={
        **dict.fromkeys((*LOCAL_NAMES.values(), "contact_x", "contact_y", "contact_z", *STATES), "element"),
        **dict.fromkeys(("normal_force", "friction_force_x", "friction_force_y", *OF_LAWS), "tension"),
    },
    positional=("first", "second"),
    documentation="""
    Add a contact of a body's shape with a plane, a surface or a housing, by laws of the normal and the tangential
    force.""",
)
