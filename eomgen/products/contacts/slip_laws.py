"""Laws of slip as rows of the register: formulas are tables in ``tangential_laws.toml``, coefficients come from a
tyre's file and from the table ``coefficients`` in a scene."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from eomgen.base.data import dataclass
from eomgen.base.messages import key_of, listed, nearest, shown
from eomgen.errors import EomgenError
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Number
from eomgen.formula.substitution import map_symbols
from eomgen.products.contacts.laws import BY_PLACE, ContactLaw, bind_to_contact, rate_name
from eomgen.products.contacts.tangential_laws import TangentialLaw, rules, tangential_law
from eomgen.products.contacts.tyre_files import TyreFile, read_tyre_file, version_of
from eomgen.scene.reading.key_metadata import optional
from eomgen.scene.reading.kinds import Value
from eomgen.scene.reading.values import Values
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar

#: Keys without use that a note names at most.
_MOST_NAMES = 12
#: Keys of a file at which slips, slip angle, camber and load end.
_ENDS = ("KPUMIN", "KPUMAX", "ALPMIN", "ALPMAX", "CAMMIN", "CAMMAX", "FZMAX")
#: Numbers that choose formulas: the version, the side (-1: mirrored), the book's slips.
_CHOICES = ("FITTYP", "SIDE", "TANGENTS")
#: Quantities and results that change their sign in a mirror.
_MIRRORED = (
    *("deflection_y", "slip_velocity_y", "slip_y", "rate_y", "force_y", "part_y"),
    *("turn_x", "camber", "moment_x", "moment_z", "road_moment_x"),
)
_ROAD = ("road_moment_x", "road_moment_y")
_RESULTS = {n: n for n in ("force_x", "force_y", "moment_x", "moment_y", "moment_z", "slip_x", "slip_y", *_ROAD)}
_STATES = {f"deflection_{axis}": f"rate_{axis}" for axis in "xy"}
_NAMES = (*_RESULTS.values(), *_STATES.values())
#: Results of the normal force of a file.
_NORMAL = ("normal_force", "elastic", "energy")
#: Keys of laws of slip whose values are a path and a table.
KEYS: Mapping[str, tuple[Any, Any]] = {
    "file": (
        Annotated[str, Field(min_length=1, max_length=1000)] | None,
        optional(
            "`magic_formula`: path of a `.tir` file, from the scene's folder", path=True, example='file = "car.tir"'
        ),
    ),
    "side": (
        Literal["left", "right"] | None,
        optional("`magic_formula`: side of the vehicle; mirrored if it is not the side of the file (`TYRESIDE`)"),
    ),
    "tangents": (
        bool | None,
        optional("`magic_formula`: the book's tangent of the slip angle and sine of the camber", shown_default="false"),
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

    def table(self, version: str, option: str = "") -> TangentialLaw:
        """Return the formulas of a version, from the motion of a pair on."""
        return tangential_law(self.name, version, f"motion {option}".strip() if self.states else "")

    def values(self, algebra: Algebra, results: Sequence[str], known: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Return results by name, of the side and by the options that the coefficients choose."""
        fitted, side, tangents = (known[name].constant or 0.0 if name in known else 0.0 for name in _CHOICES)
        law = self.table(version_of(fitted), "tangents" if tangents else "")
        given = {name: scalar for name, scalar in known.items() if name in law.quantities or name.isupper()}

        def mirror(scalars: Mapping[str, Scalar]) -> dict[str, Scalar]:
            flipped = _MIRRORED if side < 0.0 else ()
            return {name: -scalar if name in flipped else scalar for name, scalar in scalars.items()}

        return mirror(law.record(algebra, results, mirror(given)))

    def record(self, algebra: Algebra, known: Mapping[str, Scalar]) -> dict[str, Scalar]:
        texts = {**self.results, **{rate_name(state): text for state, text in self.states.items()}}
        recorded = self.values(algebra, [*texts.values()], known)
        return {name: recorded[text] for name, text in texts.items()}


class NormalLaw(ContactLaw):
    """The normal force of a tyre's file. It depends on tangential forces, whose parts by the load are of the load
    without them."""

    def record(self, algebra: Algebra, known: Mapping[str, Scalar]) -> dict[str, Scalar]:
        law, parts = BY_NAME["magic_formula"], dict.fromkeys(("part_x", "part_y"), algebra.zero)
        if any(known[name].constant != 0.0 for name in ("Q_FCX", "Q_FCY") if name in known):
            (load,) = law.values(algebra, ["carried"], {**known, **parts}).values()
            load = algebra.call(Op.MAX, load, algebra.scalar(1e-3))
            forces = law.values(algebra, ["force_x", "force_y"], {**known, "load": load})
            parts = {f"part_{axis}": forces[f"force_{axis}"] / load for axis in "xy"}
        force, elastic, energy = law.values(algebra, _NORMAL, {**known, **parts}).values()
        return {"force": force, "elastic": elastic, "energy": energy}


def read_coefficients(contact: str, row: SlipLaw, entry: Any, folder: Path, values: Values) -> dict[str, Formula]:
    """Return the coefficients of the law of a contact, numbers from the file or formulas from the scene; faults are
    reported, and keys of the file without use, or with limits, are noted."""
    key = f"{key_of('contacts', contact)}.tangential"
    report, numbers, law, results = values.report, dict[str, float](), row.table(""), _NAMES
    file = None
    if entry.file is not None and not report.concerns(f"{key}.file"):
        try:
            file = read_tyre_file(folder / entry.file)
            file.check_turn_slip()
            law, results = row.table(file.version, "tangents" if entry.tangents else ""), (*_NAMES, *_NORMAL)
        except EomgenError as error:
            report.add_file_error(f"{key}.file", error)
            return {}
        side = 1.0 if entry.side in (None, file.side) else -1.0
        numbers = {**file.numbers, "SIDE": side, "TANGENTS": float(bool(entry.tangents))}
    given = {
        name: values.formula(f"{key}.coefficients.{name}", value, BY_PLACE)
        for name, value in (entry.coefficients or {}).items()
    }
    for name in given:
        if not name.isupper() or name not in law.coefficients(results, {name: 0.0}):
            fault = f"{shown(name)} is not a coefficient of {row.name} [E2439]"
            names = law.coefficients(results, dict.fromkeys(filter(str.isupper, law.formulas), 0.0))
            report.add(f"{key}.coefficients.{name}", fault, nearest(name, names))
    known = {**{name: Number(value) for name, value in numbers.items()}, **bind_to_contact(given, contact)}
    used = law.coefficients(results, known)
    _check_numbers({name: known[name] for name in used if name in known}, given, file, key, values)
    if file is not None:
        _note_numbers(file, used, given, f"{key}.file", values)
        _note_side(file, entry.side, f"{key}.side", values)
    if missing := [name for name in used if name not in known]:
        hint = f"coefficients = {{ {law.in_place_of(missing[0], results, known)} = ... }}"
        report.add(key, f"coefficients are missing: {listed(missing)} [E2440]", hint, follows=(key,))
    return {name: known[name] for name in (*used, *_CHOICES) if name in known}


def _check_numbers(
    known: Mapping[str, Formula], given: Collection[str], file: TyreFile | None, key: str, values: Values
) -> None:
    """Report coefficients in use that are out of their bounds, ``given`` ones of the scene and other ones of a file."""
    for formula, rule in rules():
        names = sorted({symbol.name for symbol in symbols(formula)})
        if not {*names} <= {*known}:
            continue
        value = map_symbols(formula, lambda symbol: known[symbol.name])
        if file is not None and {*names}.isdisjoint(given):
            if rule.broken(at := [values.value(value)]):
                values.report.add_file_error(f"{key}.file", file.fault(names[0], *rule.fault(at)))
        elif all(symbol.kind == "parameter" for symbol in symbols(value)):
            values.require(f"{key}.coefficients.{names[0]}", rule, [value])


def _note_side(file: TyreFile, side: str | None, key: str, values: Values) -> None:
    if side and (written := file.texts.get("TYRESIDE", "left")).lower() not in ("left", "right"):
        values.note([f"{key}: TYRESIDE = {shown(written)} of {file.name} is taken as 'left' [W0321]"])


def _note_numbers(file: TyreFile, used: Collection[str], given: Collection[str], key: str, values: Values) -> None:
    """Note keys of a file without use, and limits that are kept."""
    if unused := file.unused_keys({*used, *given}):
        more = f" and {len(unused) - _MOST_NAMES} others" if len(unused) > _MOST_NAMES else ""
        names = f"{', '.join(unused[:_MOST_NAMES])}{more}"
        values.note([f"{file.name}: keys that the law does not use: {names} [W0310]"])
    if ends := [f"{name} = {file.numbers[name]:g}" for name in _ENDS if name in {*file.numbers} - {*given}]:
        values.note([f"{file.name}: slips, camber and load end at the ranges of the file: {', '.join(ends)} [W0320]"])


_OF_TWO = "coefficients={STIFFNESS_X=20,STIFFNESS_Y=15,FRICTION=1}"
ROWS = tuple(
    SlipLaw(name, {}, results, states=states, more=more)
    for name, results, states, more in (
        ("linear", _RESULTS, _STATES, _OF_TWO),
        ("steady_slip", {name: name for name in ("force_x", "force_y")}, {}, _OF_TWO),
        ("brush", _RESULTS, _STATES, "coefficients={STIFFNESS=15,FRICTION=1}"),
        ("tmeasy", _RESULTS, _STATES, "coefficients={LOAD=3000,DFX1=...}"),
        ("magic_formula", _RESULTS, _STATES, 'file="car.tir" coefficients side tangents'),
    )
)
BY_NAME: Mapping[str, SlipLaw] = {row.name: row for row in ROWS}
#: In place of a row of normal laws, with the coefficients of the file as values.
OF_FILE = NormalLaw("tyre_file", {}, {})
