"""Perturbation of structure: numbers beside 0, 1 and coordinate axes change the equations by as little.

No reference is needed: code that takes 1e-9 for 0 in one place and not in the other changes forces by their own size.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError
from eomgen.lie.product import update
from eomgen.pipeline import pipeline
from eomgen.products.studies.ladders.runs import REACHED, REFUSED, Ended
from eomgen.products.studies.ladders.subject import OWN, Subject
from eomgen.symbolic.evaluate import evaluate
from eomgen.system.system import System

#: Keys whose numbers are geometry: directions, and places.
_AXES, _PLACES = ("axis", "second_axis", "x_axis", "z_axis"), ("position", "center_of_mass")
_TERMS = ("mass", "coupling", "force", "inverse_dynamics", "constraint", "constraint_jacobian", "poses")
#: Tolerated ratio of the change of the equations to the change of the numbers, relative to changes far from structure.
_SAFETY, _ROUNDING, _NEARBY, _STEP = 100.0, 1e-13, 1e-3, 1e-6


class Structure:
    """The equations of a scene at one state, and of scenes whose numbers are moved by a little."""

    def __init__(self, subject: Subject) -> None:
        self.subject = subject
        self.values = self._computed(0.0)
        self.condition = {name: max(_largest(block), 0.01) for name, block in self.values.items()}
        try:
            far, further = self._computed(_NEARBY), self._computed(_NEARBY + _STEP)
        except EomgenError:  # loops that close with these numbers alone
            return
        for name, least in self.condition.items():
            if name in far and name in further and far[name].shape == further[name].shape:
                self.condition[name] = max(_largest(further[name] - far[name]) / _STEP, least)

    def moved(self, amount: float) -> tuple[Ended, float]:
        """Return the verdict of the equations of a scene moved by an amount, and the ratio of their change to its
        limit: above 1 they are other equations."""
        try:
            values = self._computed(amount)
        except EomgenError as error:
            return Ended(REFUSED, str(error)), 0.0
        worst, name = 0.0, ""
        for block, condition in self.condition.items():
            if block not in values or values[block].shape != self.values[block].shape:
                continue
            change = _largest(values[block] - self.values[block])
            excess = change / (_SAFETY * (amount + _ROUNDING) * condition)
            worst, name = max((worst, name), (excess, block))
        return Ended(REACHED, f"{name} changes most" if worst > 1.0 else ""), worst

    def _computed(self, amount: float) -> dict[str, Array]:
        assert self.subject.data is not None  # for mypy: scenes without data are told apart before
        data = copy.deepcopy(dict(self.subject.data))
        rng = np.random.default_rng(3)
        for holder, key, kind in list(_numbers(data)):
            sign = float(rng.choice([-1.0, 1.0]))
            holder[key] = holder[key] + sign * amount * (1.0 if kind in _AXES else max(abs(holder[key]), 0.1))
        system = pipeline.derive(self.subject.read(data), terms=_TERMS)
        return _evaluated(system, self.subject)


def _evaluated(system: System, subject: Subject) -> dict[str, Array]:
    model, rng = subject.model(OWN), np.random.default_rng(5)
    q = update(model.factors, np.array(model.initial_q), 0.3 * rng.normal(size=model.nv) * _reach(model.v_units))
    blocks: dict[str, Any] = {
        "q": q,
        "v": rng.normal(size=model.nv),
        "a": rng.normal(size=model.nv),
        "t": np.array([0.3]),
        "z": np.array(model.initial_z),
        "u": rng.normal(size=model.nu),
        "p": np.array(list(model.parameters.values())),
        "lam": rng.normal(size=len(model.multipliers)),
        "base": rng.normal(size=64),
    }
    if "base" in system.functions:
        blocks["base"] = evaluate(system.tape, system.functions["base"].refs, blocks)
    result: dict[str, Array] = {}
    for name in _TERMS:
        if name in system.functions:
            with np.errstate(all="ignore"):
                result[name] = np.asarray(evaluate(system.tape, system.functions[name].refs, blocks), dtype=float)
    return {name: block for name, block in result.items() if np.all(np.isfinite(block))}


def _reach(units: Any) -> Array:
    return np.array([1.0 if unit == "rad/s" else 0.05 for unit in units])


def _numbers(data: Any) -> Iterator[tuple[Any, Any, str]]:
    """Yield the container of each geometric number, its key there, and the key of the vector that it is in."""
    items = data.items() if isinstance(data, Mapping) else enumerate(data)
    for key, value in items:
        if isinstance(value, Mapping):
            if key not in ("parameters", "simulation", "initial", "curves"):
                yield from _numbers(value)
        elif isinstance(value, list):
            if key in _AXES or key in _PLACES:
                yield from ((value, k, str(key)) for k, x in enumerate(value) if _is_number(x))
            elif value and isinstance(value[0], Mapping):
                yield from _numbers(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _largest(block: Array) -> float:
    return float(np.max(np.abs(block), initial=0.0))
