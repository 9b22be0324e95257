"""Known units of symbols in formulas: time, coordinates with their rates, and motions of points."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.formula.nodes import Formula, Operation, Quantity, Symbol
from eomgen.scene.joint_types import JOINTS

_OF_KINDS = {"time": "s", "position": "m", "velocity": "m/s", "acceleration": "m/s^2"}
_PER_TIME = {"q": "", "v": "/s", "a": "/s^2"}
#: Operations whose results have the unit of their arguments.
_KEEPING = frozenset({"add", "sub", "neg", "abs", "min", "max"})


def unit_of(formula: Formula, joints: Mapping[str, str]) -> str:
    """Return the unit in SI of a formula that is a known quantity, shifted, turned in sign or limited; empty for
    others.

    Parameters
    ----------
    joints : mapping
        Types of joints by name.
    """
    if isinstance(formula, Symbol):
        return unit_of_symbol(formula, joints)
    if isinstance(formula, Quantity):
        return formula.word.unit
    if isinstance(formula, Operation) and formula.name in _KEEPING:
        result = {unit for part in formula.arguments if (unit := unit_of(part, joints))}
        return result.pop() if len(result) == 1 else ""
    return ""


def unit_of_symbol(symbol: Symbol, joints: Mapping[str, str]) -> str:
    """Return the unit of a symbol; empty if unknown. ``joints`` are types by name."""
    if symbol.kind in _OF_KINDS:
        return _OF_KINDS[symbol.kind]
    kind = JOINTS.get(joints.get(symbol.name, ""))
    if symbol.kind not in _PER_TIME or kind is None:
        return ""
    units = kind.units if kind.q_size == kind.v_size == len(kind.units) else ()
    return f"{units[symbol.index]}{_PER_TIME[symbol.kind]}" if symbol.index < len(units) else ""
