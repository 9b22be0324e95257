"""Rows of the registers of laws: keys with units and bounds, and formulas over local names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal

from pydantic import create_model

from eomgen.base.data import dataclass, field
from eomgen.formula.nodes import Formula, Number, Symbol
from eomgen.formula.substitution import map_symbols
from eomgen.products.contacts.tangential_laws import read_formulas
from eomgen.scene.formula.scope import PARAMETERS, SPRING_FORCE, TIME, Scope
from eomgen.scene.reading.key_metadata import Table, key, optional
from eomgen.scene.reading.kinds import Value
from eomgen.scene.reading.requirements import Bound
from eomgen.scene.reading.values import Values
from eomgen.symbolic.scalar import Algebra, Scalar

#: Quantities of a pair that coefficients of laws of slip may depend on.
_PLACE = ("contact_x", "contact_y")
#: Quantities of a pair that formulas of laws name, with the quantity of scenes that each one stands for.
LOCAL_NAMES: Mapping[str, str] = {
    "gap": "gap",
    "rate": "gap_rate",
    "deflection": "contact_deflection",
    "load": "normal_force",
    **{name: name for name in ("slip_velocity_x", "slip_velocity_y", "velocity_x", "velocity_y")},
    **{name: name for name in ("turn_x", "turn_y", "spin", "wheel_speed", "camber", *_PLACE)},
}
#: Names that formulas of normal laws may have.
NORMAL_NAMES = ("gap", "rate", "deflection")
#: Kind of the local names in scopes.
_LOCAL = "contact"


def local_scope(description: str, names: Iterable[str], kinds: frozenset[str] = frozenset()) -> Scope:
    """Return a scope for formulas in a law, with ``names`` of the pair and quantities of the given ``kinds``."""
    local = {name: (_LOCAL, f"{name} of the contact", Symbol("local", name)) for name in names}
    return Scope(description, kinds | {_LOCAL}, names=local)


NORMAL, TANGENTIAL = (
    local_scope(f"{', '.join(names)}, {SPRING_FORCE.description}", names, SPRING_FORCE.kinds)
    for names in (NORMAL_NAMES, tuple(LOCAL_NAMES))
)
#: Of coefficients of laws of slip.
BY_PLACE = local_scope(f"{', '.join(_PLACE)}, {TIME.description}", _PLACE, TIME.kinds)


@dataclass(frozen=True)
class LawKey:
    """Key of a law in a scene file.

    Attributes
    ----------
    bound : of the value; None for any number
    default : None for a key that the law needs, for which ``example`` is shown
    names : of formulas in the key
    """

    description: str
    unit: str = ""
    bound: Bound | None = None
    default: float | None = None
    example: str = "1.0"
    names: Scope = PARAMETERS


@dataclass(frozen=True)
class ContactLaw:
    """A law of the force between two bodies: a row of a register.

    Attributes
    ----------
    name : ``type`` in a scene file
    keys : by name
    definitions : formulas by name, of local names, keys, states and other definitions
    results : formulas of the law's results by name: ``force``, and ``elastic`` with its ``energy``, of a normal law;
        ``force_x``, ``force_y``, ``moment_x``, ``moment_y`` and ``moment_z``, about the normal, of a tangential law
    states : formulas of the rates of internal states, by name
    unit : of the states
    more : further keys, as ``Values.check_kind`` takes them
    """

    name: str
    keys: Mapping[str, LawKey]
    results: Mapping[str, str]
    definitions: Mapping[str, str] = field(default_factory=dict)
    states: Mapping[str, str] = field(default_factory=dict)
    unit: str = "m"
    more: str = ""

    def record(self, algebra: Algebra, known: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Return the results by name, and ``NAME_rate`` of each state NAME, recorded on the tape of ``algebra``.
        ``known`` are the scalars of local names, keys and states."""
        results = {**self.results, **{rate_name(state): text for state, text in self.states.items()}}
        texts = {**self.definitions, **{name: text for name, text in results.items() if name != text}}
        return read_formulas(texts, [*known], []).record(algebra, [*results], known)


@dataclass(frozen=True)
class AppliedLaw:
    """A law of a contact: the name of its row, and the formulas of all its keys."""

    name: str
    values: Mapping[str, Formula]


def rate_name(state: str) -> str:
    """Return the name of the rate of an internal state."""
    return f"{state}_rate"


def state_name(contact: str, name: str) -> str:
    """Return the name in the scene of an internal state of a contact's law."""
    return f"{contact}_{name}"


def table_of(title: str, documentation: str, laws: Mapping[str, ContactLaw], **keys: Any) -> Any:
    """Return the schema of a law's table in a scene file: ``type``, the keys of all laws, and further
    ``keys``."""
    fields: dict[str, Any] = {"type": (Literal[tuple(laws)], key("the law, one of the table below", kind="see below"))}
    for name in dict.fromkeys(name for law in laws.values() for name in law.keys):
        rows = {law.name: law.keys[name] for law in laws.values() if name in law.keys}
        first, units = next(iter(rows.values())), {law: row.unit for law, row in rows.items() if row.unit}
        by_words: dict[str, list[str]] = {}
        for law, row in rows.items():
            by_words.setdefault(row.description, []).append(f"`{law}`")
        words = "; ".join(f"{', '.join(of)}: {text}" for text, of in by_words.items())
        defaults = ("required" if row.default is None else f"`{row.default:g}`" for row in rows.values())
        default = " or ".join(dict.fromkeys(defaults))
        kind = "" if first.names is PARAMETERS else f"value of the contact and of the state, {first.unit}"
        shown = f"{name} = {first.example if first.default is None else first.default}"
        meaning = optional(words, unit=units, names=first.names, kind=kind, shown_default=default, example=shown)
        fields[name] = (Value | None, meaning)
    return create_model(title, __base__=Table, __module__=__name__, __doc__=documentation, **fields, **keys)


def bounds_of(laws: Mapping[str, ContactLaw], table: str) -> dict[str, Bound | None]:
    """Return the bounds of the keys of all laws whose values are numbers, by place below a contact."""
    rows = [(name, item) for law in laws.values() for name, item in law.keys.items() if item.names is PARAMETERS]
    return {f"{table}.{name}": item.bound for name, item in rows}


def defaults_of(law: ContactLaw) -> dict[str, Formula]:
    """Return the default of each key of a law; 0 for a needed key."""
    return {name: Number(item.default or 0.0) for name, item in law.keys.items()}


def read_law(key: str, contact: str, entry: Any, laws: Mapping[str, ContactLaw], values: Values) -> AppliedLaw:
    """Return the law of the table at ``key`` of a contact; missing keys, and keys of other laws, are reported."""
    taken = {
        law.name: " ".join(
            [law.more, *(n if item.default is not None else f"{n}={item.example}" for n, item in law.keys.items())]
        )
        for law in laws.values()
    }
    values.check_kind(key, entry, "type", taken)
    keys = laws[entry.type].keys
    defaults = defaults_of(laws[entry.type])
    given = values.keys(key, entry, *keys) if keys else {}
    if keys and not given and all(item.default == 0.0 for item in keys.values()):
        name, first = next(iter(keys.items()))
        values.report.add(key, "the law has no force and no moment [E2461]", f"{name} = {first.example}")
    return AppliedLaw(entry.type, defaults | bind_to_contact(given, contact))


def bind_to_contact(formulas: Mapping[str, Formula], contact: str) -> dict[str, Formula]:
    """Return formulas by name, with the quantities of a contact in place of local names."""

    def own_symbol(symbol: Symbol) -> Formula:
        return Symbol(LOCAL_NAMES[symbol.name], contact) if symbol.kind == "local" else symbol

    return {name: map_symbols(formula, own_symbol) for name, formula in formulas.items()}
