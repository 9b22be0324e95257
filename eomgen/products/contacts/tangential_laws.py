"""Tangential laws: forces and moments of a contact as named formulas of slip, load and camber, read from a table.

A law is a table in ``tangential_laws.toml`` with one formula for each name. Formulas are evaluated name by name, so a
value that others mention is computed once.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.data import dataclass, replace
from eomgen.formula.evaluate import evaluate_batch, symbols
from eomgen.formula.nodes import Formula, Operation, Symbol
from eomgen.formula.recording import record
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import PARAMETERS, SceneNames
from eomgen.scene.reading.requirements import Bound, Outside, Row, above_zero, not_below_zero
from eomgen.symbolic.scalar import Algebra, Scalar

#: Bounds of coefficients, by key of the table ``bounds``.
_BOUNDS: Mapping[str, Callable[[str], Bound]] = {
    "above_zero": above_zero,
    "not_below_zero": not_below_zero,
    "not_above_zero": lambda quantity: (Outside(-math.inf, 0.0), f"{quantity} is {{0}}", "0 or less"),
}
#: Keys of a table that are not formulas.
_KEYS = frozenset({"required", "quantities", "zeros", "ones", "versions", "options"})


@dataclass(frozen=True, eq=False)
class TangentialLaw:
    """Named formulas of a tangential law.

    Attributes
    ----------
    formulas : mapping of str to Formula
        Symbols are parameters, with the names of other formulas, of coefficients or of quantities.
    quantities : frozenset of str
        Names of the quantities of a pair, such as ``load`` and ``slip_x``.
    """

    formulas: Mapping[str, Formula]
    quantities: frozenset[str]

    def order(self, results: Sequence[str], known: Mapping[str, object]) -> list[str]:
        """Return the names of the formulas that results need, each after the names in its formula; ``known`` names need
        no formula."""
        mentioned: dict[str, list[str]] = {}
        waiting = list(results)
        while waiting:
            name = waiting.pop()
            if name in self.formulas and name not in known and name not in mentioned:
                mentioned[name] = sorted(symbol.name for symbol in symbols(self.formulas[name]))
                waiting += mentioned[name]
        return [name for name in TopologicalSorter(mentioned).static_order() if name in mentioned]

    def coefficients(self, results: Sequence[str], known: Mapping[str, object]) -> list[str]:
        """Return the coefficients that results need, ``known`` or not."""
        order = self.order(results, known)
        used = {symbol.name for name in order for symbol in symbols(self.formulas[name])}
        return sorted(used - set(order) - self.quantities)

    def in_place_of(self, name: str, results: Sequence[str], known: Mapping[str, object]) -> str:
        """Return a coefficient without which the coefficient ``name`` is needed for results, else ``name`` itself."""
        others = (item for item in self.formulas if item.isupper())
        return next((item for item in others if name not in self.coefficients(results, {**known, item: 0.0})), name)

    def values(
        self, results: Sequence[str], coefficients: Mapping[str, ArrayLike], **quantities: ArrayLike
    ) -> dict[str, NDArray[np.float64]]:
        """Return results by name for batches of states, NaN without a finite value.

        Parameters
        ----------
        results : names of formulas
        coefficients : numbers, or arrays that vary with the states
        quantities : numbers or arrays by name, of shapes that broadcast

        Examples
        --------
        >>> from eomgen.products.contacts.tangential_laws import tangential_law
        >>> law = tangential_law("linear")
        >>> coefficients = {"STIFFNESS_X": 20.0, "STIFFNESS_Y": 15.0, "FRICTION": 1.0}
        >>> float(law.values(["force_y"], coefficients, load=4000.0, slip_x=0.0, slip_y=0.1)["force_y"].round(3))
        -3328.201
        """
        known: dict[str, Any] = {**coefficients, **quantities}
        for name in self.order(results, known):
            known[name] = evaluate_batch(self.formulas[name], lambda symbol: known[symbol.name])
        return {name: known[name] for name in results}

    def record(self, algebra: Algebra, results: Sequence[str], known: Mapping[str, Scalar]) -> dict[str, Scalar]:
        """Return results by name, recorded on the tape of ``algebra``; ``known`` are the scalars of all quantities and
        coefficients in use."""
        scalars = dict(known)
        for name in self.order(results, known):
            scalars[name] = record(algebra, self.formulas[name], lambda symbol: scalars[symbol.name])
        return {name: scalars[name] for name in results}


@cache
def tangential_law(name: str, version: str = "", option: str = "") -> TangentialLaw:
    """Return the law of a table.

    Parameters
    ----------
    name : ``linear``, ``brush``, ``tmeasy`` or ``magic_formula``
    version, option : tables of the law whose formulas replace formulas with the same names; of ``magic_formula``
        ``5.2``, ``6.1`` or ``6.2``, and ``tangents``; option ``motion`` of all laws, alone or before another one: slips
        from the motion of a pair
    """
    words, table = option.split(), _tables()[name]
    motion = _tables()["motion"] if "motion" in words else {}
    own = table.get("options", {})
    replaced = [*([table["versions"][version]] if version else []), *(own[word] for word in words if word in own)]
    texts = {key: text for part in (motion, table, *replaced) for key, text in part.items() if key not in _KEYS}
    numbers = {name: text for key, text in (("zeros", "0"), ("ones", "1")) for name in table.get(key, "").split()}
    quantities = f"{table['quantities']} {motion.get('quantities', '')}".split()
    return read_formulas({**numbers, **texts}, quantities, table["required"].split())


def read_formulas(texts: Mapping[str, str], quantities: Sequence[str], coefficients: Sequence[str]) -> TangentialLaw:
    """Return a law from texts of formulas by name; ``quantities`` and ``coefficients`` are further names. Raises
    FormulaError for an unknown name."""
    names = SceneNames(parameters=dict.fromkeys((*texts, *quantities, *coefficients), True))
    formulas = {name: read_formula(text, names, PARAMETERS) for name, text in texts.items()}
    labelled = {name: replace(item, label=name) for name, item in formulas.items() if isinstance(item, Operation)}
    return TangentialLaw({**formulas, **labelled}, frozenset(quantities))


@cache
def rules() -> tuple[tuple[Formula, Row], ...]:
    """Return formulas of coefficients of all laws, with rules for their values in scenes and in files."""
    tables, result = _tables(), list[tuple[Formula, Row]]()
    for kind, names in tables["bounds"].items():
        for name in names.split():
            result.append(
                (Symbol("parameter", name), Row((), *_BOUNDS[kind](f"the coefficient {name} [E2442]"), stage=0))
            )
    names = " ".join(tables["relations"]).split()
    for words, formula in read_formulas(tables["relations"], [], names).formulas.items():
        fault = f"the coefficients do not satisfy {words} [E2462]"
        result.append((formula, Row((), above_zero("")[0], fault, "values that do")))
    return tuple(result)


@cache
def _tables() -> dict[str, Any]:
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
