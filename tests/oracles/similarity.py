"""Similarity as an oracle: a scene with tunable units of length, mass and time makes the same motion in all of them.

Where the units are powers of two, every operation of the equations is exact in them, so the motions have the same bits,
unless something is compared with a number that has a unit of its own. No reference solution is needed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.formula.units.conversion import measure
from eomgen.formula.units.parser import read_unit
from eomgen.integrators.stepper_layout import row_layout
from eomgen.pipeline.model import Model
from eomgen.scene.document.schema import every_document
from eomgen.scene.reading.key_metadata import ANY_UNIT, Inner, Table, Units, fields_of
from eomgen.simulation.stepping.settings import chosen_method, stepper_settings
from eomgen.simulation.stepping.stepper import Stepper

DOCUMENT = every_document()

Array = NDArray[np.float64]
Data = Mapping[str, Any]

_BASES = {"[length]": "unit_length", "[mass]": "unit_mass", "[time]": "unit_time"}
#: What a scene of formulas in the states of joints says itself, by naming the units.
_SAID = re.compile(r"unit_(length|mass|time)")
_TIME = re.compile(r"(?<![\w.])t(?![\w.])")


@dataclass(frozen=True)
class UnitsOf:
    """What one unit of length, mass and time of a scene is, in m, kg and s."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    def size(self, unit: str) -> float:
        """Return by what a number with a unit string grows; a power of two of powers of two, exactly."""
        powers = measure(read_unit(unit))[1] if unit not in ("", "1") else {}
        bases = (("[length]", self.length), ("[mass]", self.mass), ("[time]", self.time))
        return float(np.prod([base ** powers.get(name, 0) for name, base in bases]))


#: Powers of two near 1e-6 .. 1e6 for lengths, 1e-9 .. 1e9 for masses, 1e-6 .. 1e8 for times.
BINARY = (
    UnitsOf(length=2.0**-20),
    UnitsOf(length=2.0**20),
    UnitsOf(mass=2.0**-30),
    UnitsOf(mass=2.0**30),
    UnitsOf(time=2.0**-20),
    UnitsOf(time=2.0**27),
    UnitsOf(2.0**-20, 2.0**-30, 2.0**-20),
    UnitsOf(2.0**20, 2.0**30, 2.0**27),
)
#: The same in powers of ten, which rounding tells apart.
DECIMAL = (
    UnitsOf(length=1e-6),
    UnitsOf(length=1e6),
    UnitsOf(mass=1e-9),
    UnitsOf(mass=1e9),
    UnitsOf(time=1e-6),
    UnitsOf(time=1e8),
    UnitsOf(1e-6, 1e-9, 1e-6),
    UnitsOf(1e6, 1e9, 1e8),
)


# -- scenes in other units ---------------------------------------------------------------------------------------------


def in_units(document: Data) -> dict[str, Any]:
    """Return a scene with the tunable parameters ``unit_length``, ``unit_mass`` and ``unit_time``, all 1.

    Every number whose key has a unit is multiplied as the unit says; t in formulas is taken in ``unit_time``. A formula
    that names one of the units is taken as it is, and initial states, which take no tunable parameters, stay what they
    are. Defaults with a unit (gravity, onsets) have to be written.
    """
    result = _table(DOCUMENT, document, None, document.get("joints", {}))
    units = {name: {"value": 1.0, "tunable": True} for name in _BASES.values()}
    return result | {"parameters": {**document.get("parameters", {}), **units}}


def _table(model: type[Table], data: Data, kind: object, joints: Data) -> dict[str, Any]:
    kind = data.get("type", kind or joints.get(data.get("joint"), {}).get("type"))
    result = dict(data)
    for name, (meaning, inner) in fields_of(model).items():
        if name not in data or name in ("parameters", "initial", "simulation"):
            continue
        if inner is not None:
            result[name] = _inner(inner, data[name], kind, joints)
            continue
        unit: Units = meaning.unit if not isinstance(meaning.unit, Mapping) else meaning.unit.get(str(kind), "")
        if unit == ANY_UNIT:
            unit = data.get("unit", "")
        elif isinstance(unit, tuple) and isinstance(data.get("index"), int):
            unit = unit[data["index"]]
        if unit or meaning.names is not None:
            result[name] = _value(unit, data[name])
    return result


def _inner(inner: Inner, value: Any, kind: object, joints: Data) -> Any:
    if inner.shape == "entries":
        return {name: _table(inner.model, entry, kind, joints) for name, entry in value.items()}
    if inner.shape == "list" and isinstance(value, list | tuple):
        return [_table(inner.model, entry, kind, joints) for entry in value]
    return _table(inner.model, value, kind, joints) if isinstance(value, Mapping) else value


def _value(unit: Units, value: Any) -> Any:
    if isinstance(value, list | tuple):
        units = (unit,) * len(value) if isinstance(unit, str) else unit
        return [_value(one, entry) for one, entry in zip(units, value, strict=True)]
    if isinstance(value, Mapping):
        return {name: _value(unit, entry) for name, entry in value.items()}
    if isinstance(value, str):
        if _SAID.search(value):
            return value
        value = _TIME.sub("(t / unit_time)", value)
    elif not isinstance(value, int | float) or not value:
        return value
    factor = _factor(unit) if isinstance(unit, str) and unit else ""
    return f"({factor}) * ({value})" if factor else value


def _factor(unit: str) -> str:
    """Return the formula by which a number with a unit is multiplied, empty for plain numbers and angles."""
    powers = [(_BASES[name], power) for name, power in measure(read_unit(unit))[1].items() if name in _BASES]
    above = [f"{name}**{power}" if power > 1 else name for name, power in powers if power > 0]
    below = [f"{name}**{-power}" if power < -1 else name for name, power in powers if power < 0]
    return " * ".join(above or ["1"]) + "".join(f" / {part}" for part in below) if above or below else ""


# -- motions in other units, brought back ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Motion:
    """What a stepper gave, in the units in which the scene is written.

    Attributes
    ----------
    status : of the stepper, 0 when all is well
    rows : ``t, q, v, vdot``, and ``lam`` and ``z`` where there are any, (rows, size) each; the first row is the start
    statistics : what the stepper counted
    """

    status: int
    rows: dict[str, Array]
    statistics: dict[str, float]

    def has_the_bits_of(self, other: Motion) -> bool:
        """Return whether all rows are equal; numbers that only the smallest doubles could hold in other units count as
        zero."""
        blocks = [(self.rows[name], other.rows[name]) for name in other.rows]
        return self.status == other.status == 0 and all(
            one.shape == two.shape and bool(np.all((one == two) | (np.abs(one - two) < 1e-280))) for one, two in blocks
        )

    def difference(self, other: Motion, names: Sequence[str] = ("q", "v")) -> float:
        """Return the largest difference of some blocks, in units of the largest number of each block in the other
        motion."""
        if self.status or other.status or len(self.rows["t"]) != len(other.rows["t"]):
            return float("inf")
        sizes = [max(np.abs(other.rows[name]).max(initial=0.0), 1e-300) for name in names]
        return max(
            np.abs(self.rows[name] - other.rows[name]).max(initial=0.0) / size
            for name, size in zip(names, sizes, strict=True)
        )


class Similar:
    """A model of a scene made by ``in_units``, whose motions are brought back from any units.

    Parameters
    ----------
    model : Model
    q, v, z : arrays, optional
        Where motions start, in the units of the scene, on the constraints to rounding; the scene's initial state by
        default.
    """

    def __init__(self, model: Model, q: Array | None = None, v: Array | None = None, z: Array | None = None) -> None:
        self.model = model
        start = (model.initial_q, model.initial_v, model.initial_z)
        self.q, self.v, self.z = (
            own if given is None else np.array(given) for given, own in zip((q, v, z), start, strict=True)
        )
        if model.multipliers and q is None:
            consistent = model.consistent(self.q, self.v)
            self.q, self.v = consistent.q, consistent.v
        self.multiplier_powers = self._multiplier_powers() if model.multipliers else np.zeros((0, 3))

    def parameters(self, units: UnitsOf, others: Mapping[str, float] | None = None) -> Array:
        """Return the array of tunable parameters."""
        given = {"unit_length": units.length, "unit_mass": units.mass, "unit_time": units.time, **(others or {})}
        return self.model.parameter_array(given)

    def sizes(self, units: UnitsOf) -> dict[str, Array]:
        """Return by what the components of t, q, v, vdot, lam and z grow."""
        v = np.array([units.size(unit) for unit in self.model.v_units])
        bases = np.array([units.length, units.mass, units.time])
        return {
            "t": np.array([units.time]),
            "q": np.array([units.size(unit) for unit in self.model.q_units]),
            "v": v,
            "vdot": v / units.time,
            "lam": np.prod(bases**self.multiplier_powers, axis=1),
            "z": np.array([units.size(unit) for unit in self.model.z_units]),
        }

    def motion(
        self,
        units: UnitsOf,
        method: str,
        step: float,
        steps: int,
        *,
        every: int = 1,
        settings: Mapping[str, float] | None = None,
        others: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Motion:
        """Step in other units.

        Parameters
        ----------
        step : of the scene, in ``unit_time``
        settings : of the stepper
        others : values of the scene's own tunable parameters
        parameters : of the method, as ``simulate`` takes them
        """
        given = dict.fromkeys(("rho_inf", "alpha", "beta", "gamma", "order", "tolerance")) | parameters
        library = self.model.stepper(method)
        chosen = chosen_method(method, given, self.model.library.layout["defaults"], bool(self.model.multipliers))
        chosen_settings = stepper_settings(library.layout["method"], step * units.time, chosen, settings or {})
        stepper = Stepper(library, chosen_settings, self.parameters(units, others))
        sizes = self.sizes(units)
        status = stepper.initialize(0.0, self.q * sizes["q"], self.v * sizes["v"], None, self.z * sizes["z"])
        rows = np.empty((steps // every + 1, stepper.sizes["row"]))
        rows[0], recorded = stepper.row, 0
        if not status:
            status, recorded = stepper.run(steps, every, None, rows[1:])
        layout = row_layout(library.layout["method"])
        return Motion(
            status,
            {name: rows[: recorded + 1, part] / sizes[name] for name, part in layout.items()},
            dict(stepper.statistics),
        )

    def _multiplier_powers(self) -> Array:
        """Return the exponents of length, mass and time of each multiplier, from what it grows by when a unit is
        doubled.

        At random velocities, which leave none of them zero.
        """
        v = np.random.default_rng(1).normal(size=self.model.nv)
        doubled = (UnitsOf(length=2.0), UnitsOf(mass=2.0), UnitsOf(time=2.0))
        grown = np.array([self._multipliers(units, v) for units in doubled]) / self._multipliers(UnitsOf(), v)
        return np.asarray(np.round(np.log2(grown)).T)

    def _multipliers(self, units: UnitsOf, v: Array) -> Array:
        q_sizes, v_sizes = ([units.size(unit) for unit in names] for names in (self.model.q_units, self.model.v_units))
        found = self.model.constrained_dynamics(self.q * q_sizes, v * v_sizes, parameters=self.parameters(units))
        return np.asarray(found[1], dtype=float)
