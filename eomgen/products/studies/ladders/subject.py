"""The scene under study: models, fastest motion, start, durations of cells, and perturbations of its structure: numbers
near 0, 1 and coordinate axes, which change the equations by as little.

A perturbed structure needs no reference: code that takes 1e-9 for 0 in one place and not in the other changes forces by
their own size.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError
from eomgen.integrators.families.register import AUTO
from eomgen.lie.product import update
from eomgen.pipeline import documents, pipeline
from eomgen.pipeline.model import Model
from eomgen.products.studies.ladders.runs import REACHED, REFUSED, ROWS, RunConditions, RunEnding
from eomgen.products.studies.ladders.scaling import (
    DAMPING,
    GRAVITY,
    LENGTH,
    MASS,
    ORIGIN,
    RATIO,
    RATIO_LAST,
    STIFFNESS,
    TIME,
    SceneUnits,
    used_factors,
    with_factors,
)
from eomgen.products.studies.method_facts import FineBy, Ladders, MethodFacts
from eomgen.products.studies.work_precision.axes import candidates, reason
from eomgen.products.studies.work_precision.observation import extent_of
from eomgen.scene.load import data_of, from_data
from eomgen.scene.scene import Scene
from eomgen.symbolic.evaluate import evaluate
from eomgen.system.system import System

#: Models of a subject: unchanged, with tunable factors, in single precision.
OWN, FACTORS, SINGLE = "own", "factors", "single"
#: Sets of factors, the first that the scene can have is taken: lengths may have to be fixed numbers.
_SETS = (
    (LENGTH, MASS, TIME, STIFFNESS, DAMPING, GRAVITY, RATIO, RATIO_LAST, ORIGIN),
    (MASS, TIME, STIFFNESS, DAMPING, GRAVITY, RATIO, RATIO_LAST),
    (STIFFNESS, DAMPING, GRAVITY, RATIO, RATIO_LAST),
    (GRAVITY,),
)
#: Steps of a short run.
STEPS = 10 * ROWS


class Subject:
    """A scene with its models and the facts that ladders of extreme conditions need.

    Parameters
    ----------
    scene : argument of ``eomgen.load``
    reading : options of ``eomgen.load``
    """

    def __init__(self, scene: Any, reading: Mapping[str, Any]) -> None:
        self.scene = documents.load_scene(scene, **reading) if isinstance(scene, str | Path | Mapping) else scene
        self.scene = documents.as_document(self.scene)[0]
        self.data, self.folder = _data_of(scene, reading)
        self.coordinates = reading.get("coordinates")
        self._models: dict[str, Model] = {}
        self.why_not: dict[str, str] = {}
        self.factors: tuple[str, ...] = ()
        self.used: frozenset[str] = frozenset()

    @property
    def name(self) -> str:
        return str(self.model(OWN).name)

    def model(self, which: str) -> Model:
        """Return the model of a formulation. Raises EomgenError if the scene has no such model."""
        if which not in self._models:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                self._models[which] = self._build(which)
        return self._models[which]

    def _build(self, which: str) -> Model:
        if which != FACTORS:
            return pipeline.build(self.scene, real="float" if which == SINGLE else "double")
        scene, self.factors = self._with_factors()
        return pipeline.build(scene, real="double")

    def _with_factors(self) -> tuple[Scene, tuple[str, ...]]:
        """Return the scene with tunable factors in its numbers, and the names of the factors. The largest set of
        factors with which the scene can be read is taken. Raises EomgenError, of the first set, if none can be read, or
        if the scene is given as a Scene."""
        if self.data is None:
            raise EomgenError(
                "the scene is given as a Scene, whose numbers have no text [E1100]", "the path of its file"
            )
        failures: list[EomgenError] = []
        for wanted in _SETS:
            try:
                scaled = with_factors(copy.deepcopy(self.data), wanted)
                self.used = used_factors(scaled, wanted)
                return self.read(scaled), wanted
            except EomgenError as error:
                failures.append(error)
            except (TypeError, ValueError, KeyError) as error:
                failures.append(EomgenError(f"its numbers cannot be scaled: {error} [E1101]", "numbers and formulas"))
        raise failures[0]

    def read(self, data: Mapping[str, Any]) -> Scene:
        """Return the scene of nested data. Raises DescriptionError."""
        return from_data(data, folder=self.folder, coordinates=self.coordinates)

    def has(self, which: str) -> bool:
        """Return whether a model (``own``, ``factors`` or ``single``) can be built; the reason against it goes to
        ``why_not``."""
        if which in self.why_not:
            return False
        try:
            self.model(which)
        except EomgenError as error:
            self.why_not[which] = reason(error)
            return False
        return True

    def not_similar(self, factors: Sequence[str]) -> str:
        """Return the reason why the scene with other units of the given `factors` is not the same scene, empty if it
        is. Numbers without units are such a reason. A test with doubled units is sufficient, because doubling is exact
        in floating-point arithmetic."""
        doubled = {LENGTH: "length", MASS: "mass", TIME: "time"}
        units = SceneUnits(**{doubled[name]: 2.0 for name in factors})
        q, v = self.start
        v = np.random.default_rng(1).normal(size=len(v)) * max(1.0, float(np.max(np.abs(v), initial=0.0)))
        z = np.random.default_rng(2).normal(size=self.model(OWN).nz)
        conditions = self.in_units(units, self.conditions(v=v, z=z))
        assert conditions.sizes is not None  # for mypy: in_units sets them
        scale = units.time / np.concatenate([conditions.sizes[1], self._sizes_of_states(units)])
        faulty = "its forces are not the same in other units: numbers in its formulas have units of their own"
        return self._differs((q, v, z), conditions, scale, 1e-300, faulty)

    def not_movable(self, conditions: RunConditions) -> str:
        """Return the reason for which the scene at another place is not the same scene: formulas with places in the
        world."""
        z = np.array(self.model(OWN).initial_z)
        faulty = "its forces are not the same at another place: its formulas take places in the world"
        return self._differs((*self.start, z), conditions.vary(z=z), np.ones(1), 1e-9, faulty)

    def _differs(
        self, motion: tuple[Array, Array, Array], conditions: RunConditions, scale: Array, least: float, faulty: str
    ) -> str:
        """Return the text `faulty` if accelerations and rates under conditions, times `scale`, differ from the scene's.
        The scene's rates are at the state `motion` (q, v, z), to 1e-6 and `least`. Empty if they agree; the reason if
        rates cannot be computed."""
        try:
            expected = _rates(self.model(OWN), *motion, {})
            rates = _rates(self.model(FACTORS), conditions.q, conditions.v, conditions.z, conditions.parameters)
        except EomgenError as error:
            return reason(error)
        same = np.abs(rates * scale - expected) <= 1e-6 * float(np.max(np.abs(expected), initial=0.0)) + least
        return "" if np.all(same) else faulty

    def runs(self, method: str) -> bool:
        """Return whether the scene has the properties that a method, given by name, needs."""
        return bool(method != AUTO and candidates(OWN, self.model(OWN), [method], {}))

    def methods(self, *, ladders: Ladders | None = None, fine_by: FineBy = "") -> list[str]:
        """Return the names of methods for a kind of `ladders`, or for references of the kind `fine_by`, that can step
        the scene. Methods that only help with constraints or rotations are left out for scenes without these."""

        def chosen(facts: MethodFacts) -> bool:
            return facts.fine_by == fine_by if fine_by else ladders in facts.ladders

        return [candidate.row.name for candidate in candidates(OWN, self.model(OWN), (), {}, chosen)]

    @cached_property
    def start(self) -> tuple[Array, Array]:
        """Initial state of all runs of a ladder: q (nq,) and v (nv,) of the scene, moved onto the constraints."""
        model = self.model(OWN)
        q, v = np.array(model.initial_q), np.array(model.initial_v)
        if model.multipliers:
            consistent = model.consistent(q, v)
            q, v = np.array(consistent.q), np.array(consistent.v)
        return q, v

    @cached_property
    def extent(self) -> float:
        """Length of the scene at the start, m."""
        return extent_of(self.model(OWN), self.start[0])

    @cached_property
    def rate(self) -> float:
        """The fastest of the scene's linear motions and spins, rad/s; without any, estimated from the scene's step."""
        model, scene_step = self.model(OWN), self.model(OWN).description.simulation.step
        rates = [0.0]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                rates.append(float(np.max(np.abs(model.linearize(at="initial").modes().eigenvalues), initial=0.0)))
        except EomgenError:
            pass
        angular = [unit == "rad/s" for unit in model.v_units]
        rates.append(float(np.max(np.abs(self.start[1][angular]), initial=0.0)))
        result = max(rate for rate in rates if np.isfinite(rate))
        return result if result > 0.0 else 0.1 / scene_step

    @property
    def period(self) -> float:
        """The shortest period, s."""
        return float(2.0 * np.pi / self.rate)

    @property
    def fine(self) -> float:
        """A step at which methods are accurate, s: a hundredth of the shortest period."""
        return 0.01 * self.period

    def conditions(self, **changes: Any) -> RunConditions:
        """Return the conditions of a short run at a fine step, with changes."""
        q, v = self.start
        model = self.model(str(changes.get("model", OWN)))
        q = np.concatenate([q, np.zeros(model.nq - len(q))]) if model.nq > len(q) else q
        return RunConditions(**{"model": OWN, "step": self.fine, "steps": STEPS, "q": q, "v": v, **changes})

    def _sizes_of_states(self, units: SceneUnits) -> Array:
        return np.array([units.size(unit) for unit in self.model(OWN).z_units])

    def in_units(self, units: SceneUnits, conditions: RunConditions) -> RunConditions:
        """Return conditions in other units: step, state and factors are scaled, for the model with factors. The units
        of the state, ``sizes``, are kept in the conditions."""
        model = self.model(OWN)
        q_sizes, v_sizes = (
            np.array([units.size(unit) for unit in labels]) for labels in (model.q_units, model.v_units)
        )
        return conditions.vary(
            model=FACTORS,
            step=conditions.step * units.time,
            q=conditions.q * q_sizes,
            v=conditions.v * v_sizes,
            z=(np.array(model.initial_z) if conditions.z is None else conditions.z) * self._sizes_of_states(units),
            parameters={name: x for name, x in units.parameters.items() if name in self.factors},
            sizes=(q_sizes, v_sizes),
        )


def _rates(model: Model, q: Array, v: Array, z: Array | None, parameters: Mapping[str, float]) -> Array:
    """Return accelerations (nv,), followed by the rates of internal states if there are any, at a state and
    parameters."""
    values = dict(parameters) or None
    if model.multipliers:
        accelerations = np.asarray(model.constrained_dynamics(q, v, z=z, parameters=values)[0])
    else:
        accelerations = np.asarray(model.forward_dynamics(q, v, z=z, parameters=values))
    rates: Array = model.internal_rates(q, v, z, parameters=values) if model.nz else np.zeros(0)
    return np.concatenate([accelerations, rates])


def _data_of(scene: Any, reading: Mapping[str, Any]) -> tuple[Mapping[str, Any] | None, Path]:
    """Return the nested data of a scene and the folder of its relative paths; no data for a Scene or a file with
    includes."""
    if isinstance(scene, Mapping):
        return scene, Path()
    if not isinstance(scene, str | Path):
        return None, Path()
    data = data_of(scene, **{name: x for name, x in reading.items() if name != "coordinates"})
    return (None if "include" in data else data), Path(scene).parent


#: Keys whose numbers are geometry: directions, and places.
_AXES, _PLACES = ("axis", "second_axis", "x_axis", "z_axis"), ("position", "center_of_mass")
_TERMS = ("mass", "coupling", "force", "inverse_dynamics", "constraint", "constraint_jacobian", "poses")


class StructuralZeros:
    """Terms of a scene's equations at one state, compared with the terms after small changes of geometric numbers.
    ``condition`` is for each term the size of its change per change of the numbers, far from special values."""

    def __init__(self, subject: Subject) -> None:
        self.subject = subject
        self.values = self._values_after_change(0.0)
        self.condition = {name: max(_largest(block), 0.01) for name, block in self.values.items()}
        try:
            far, further = self._values_after_change(1e-3), self._values_after_change(1e-3 + 1e-6)
        except EomgenError:  # loops that close with these numbers alone
            return
        for name, least in self.condition.items():
            if name in far and name in further and far[name].shape == further[name].shape:
                self.condition[name] = max(_largest(further[name] - far[name]) / 1e-6, least)

    def verdict_after_change(self, amount: float) -> tuple[RunEnding, float]:
        """Return the end of the derivation with numbers changed at random by an amount, and the ratio of the effect to
        its limit. Above 1 the equations differ by more than the change explains. A scene that is refused has the ratio
        0."""
        try:
            values = self._values_after_change(amount)
        except EomgenError as error:
            return RunEnding(REFUSED, str(error)), 0.0
        worst, name = 0.0, ""
        for block, condition in self.condition.items():
            if block not in values or values[block].shape != self.values[block].shape:
                continue
            change = _largest(values[block] - self.values[block])
            excess = change / (100.0 * (amount + 1e-13) * condition)  # rounding, with a safety factor
            worst, name = max((worst, name), (excess, block))
        return RunEnding(REACHED, f"{name} changes most" if worst > 1.0 else ""), worst

    def _values_after_change(self, amount: float) -> dict[str, Array]:
        assert self.subject.data is not None  # for mypy: scenes without data are sorted out before
        data = copy.deepcopy(dict(self.subject.data))
        rng = np.random.default_rng(3)
        for holder, key, kind in list(_numbers(data)):
            sign = float(rng.choice([-1.0, 1.0]))
            holder[key] = holder[key] + sign * amount * (1.0 if kind in _AXES else max(abs(holder[key]), 0.1))
        system = pipeline.derive(self.subject.read(data), terms=_TERMS)
        return _evaluate_terms(system, self.subject)


def _evaluate_terms(system: System, subject: Subject) -> dict[str, Array]:
    """Return the values of a system's terms by name, at a random state with a fixed seed; terms with infinite values
    are left out."""
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
    """Yield (list, index, key) of each geometric number in nested data: components of axes and places. `key` is the
    name of the vector, such as ``axis`` or ``position``."""
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
