"""Laws of slip as rows of the register: formulas are tables in ``tangential_laws.toml``, coefficients come from a
tyre's file and from the table ``coefficients`` in a scene."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from eomgen.base.data import dataclass
from eomgen.base.messages import key_of, listed, shown
from eomgen.errors import EomgenError
from eomgen.formula.nodes import Formula, Number
from eomgen.products.contacts.laws import BY_PLACE, ContactLaw, bind_to_contact, rate_name
from eomgen.products.contacts.tangential_laws import TangentialLaw, tangential_law
from eomgen.products.contacts.tyre_files import read_tyre_file, version_of
from eomgen.scene.reading.key_metadata import optional
from eomgen.scene.reading.kinds import Value
from eomgen.scene.reading.values import Values
from eomgen.symbolic.scalar import Algebra, Scalar

#: Keys without use that a note names at most.
_MOST_NAMES = 12
#: Coefficients of the normal force.
_OF_NORMAL_LAW = ("VERTICAL_STIFFNESS", "VERTICAL_DAMPING")
_RESULTS = {
    **{name: name for name in ("force_x", "force_y", "moment_z", "slip_x", "slip_y")},
    **{f"moment_{axis}": f"road_moment_{axis}" for axis in "xy"},
}
_STATES = {f"lagged_slip_{axis}": f"rate_{axis}" for axis in "xy"}
_NAMES = (*_RESULTS.values(), *_STATES.values())


#: Keys of laws of slip whose values are a path and a table.
KEYS: Mapping[str, tuple[Any, Any]] = {
    "file": (
        Annotated[str, Field(min_length=1, max_length=1000)] | None,
        optional(
            "`magic_formula`: path of a tyre's file (`.tir`), from the folder of the scene file", path=True, kind="text"
        ),
    ),
    "coefficients": (
        Annotated[dict[str, Value], Field(max_length=500)] | None,
        optional(
            "laws of slip: coefficients by name, in place of numbers of the file",
            names=BY_PLACE,
            kind="table of formulas",
        ),
    ),
}


@dataclass(frozen=True)
class SlipLaw(ContactLaw):
    """A law whose formulas are a table, and whose values are all coefficients."""

    def table(self, version: str) -> TangentialLaw:
        """Return the formulas of a version, from the motion of a pair on."""
        return tangential_law(self.name, version, "motion")

    def record(self, algebra: Algebra, known: Mapping[str, Scalar]) -> dict[str, Scalar]:
        law = self.table(version_of(known["FITTYP"].constant or 0.0) if "FITTYP" in known else "")
        given = {name: scalar for name, scalar in known.items() if name in law.quantities or name.isupper()}
        recorded = law.record(algebra, _NAMES, given)
        texts = {**self.results, **{rate_name(state): text for state, text in self.states.items()}}
        return {name: recorded[text] for name, text in texts.items()}


def read_coefficients(contact: str, row: SlipLaw, entry: Any, folder: Path, values: Values) -> dict[str, Formula]:
    """Return the coefficients of the law of a contact, numbers from the file or formulas from the scene; faults are
    reported, and keys of the file without use are noted."""
    key = f"{key_of('contacts', contact)}.tangential"
    report, numbers, version = values.report, dict[str, Formula](), ""
    if entry.file is not None:
        try:
            file = read_tyre_file(folder / entry.file)
            version = file.version
            file.check_turn_slip()
        except EomgenError as error:
            report.add_error(f"{key}.file", error)
            return {}
        numbers = {name: Number(value) for name, value in file.numbers.items()}
        if unused := [name for name in file.unused_keys(_NAMES, "motion") if name not in _OF_NORMAL_LAW]:
            more = f" and {len(unused) - _MOST_NAMES} others" if len(unused) > _MOST_NAMES else ""
            fault = f"{file.name} has keys that the law does not use: {', '.join(unused[:_MOST_NAMES])}{more} [W0310]"
            values.note([f"{key}.file: {fault}"])
    law = row.table(version)
    given = {
        name: values.formula(f"{key}.coefficients.{name}", value, BY_PLACE)
        for name, value in (entry.coefficients or {}).items()
    }
    for name in given:
        if name not in law.coefficients(_NAMES, {name: 0.0}):
            fault = f"{shown(name)} is not a coefficient of {row.name} [E2439]"
            report.add(f"{key}.coefficients.{name}", fault, "a name from the formulas of the law")
    known = {**numbers, **bind_to_contact(given, contact)}
    used = law.coefficients(_NAMES, known)
    if missing := [name for name in used if name not in known]:
        hint = f"coefficients = {{ {missing[0]} = ... }}"
        report.add(key, f"coefficients are missing: {listed(missing)} [E2440]", hint)
    return {name: known[name] for name in (*used, "FITTYP", *_OF_NORMAL_LAW) if name in known}


ROWS = tuple(
    SlipLaw(name, {}, _RESULTS, states=_STATES, unit="", more=more)
    for name, more in (
        ("linear", "coefficients={STIFFNESS_X=20,STIFFNESS_Y=15,FRICTION=1}"),
        ("brush", "coefficients={STIFFNESS=15,FRICTION=1}"),
        ("tmeasy", "coefficients={LOAD=3000,DFX1=...}"),
        ("magic_formula", 'file="car.tir" coefficients'),
    )
)
