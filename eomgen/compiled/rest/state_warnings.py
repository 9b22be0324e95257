"""Warnings about states of a model: the register of warnings of equilibria, beams that are bent too far, unbalance, and
an inertia matrix that is not positive definite.

Curvature w'' is linear in the deflection w. A bent axis has w''/(1 - w'^2)^(1/2), so strain energy is wrong by
a part of w'^2, and the kinematics of order = 2 by as much. Half the mean square of the slope is also the shortening of
the axis, as a part of its length, so beyond 1 no beam is like that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.limits import Limit, doubt_settings
from eomgen.base.products import rows_of
from eomgen.base.rounding import SUMMED
from eomgen.compiled.terms import Inputs
from eomgen.errors import Message, NumericalError
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula
from eomgen.lie.numeric import rotated
from eomgen.solvers.regular_inertia import inertia_with_rows
from eomgen.system.description import BASE, WORLD

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


class SceneMeasures:
    """Measures of a scene at given parameters, and the positions of points in a configuration.

    Parameters
    ----------
    p : (np,) tunable parameters
    t : time, s
    base : (19,) state of the base, None for a base that is the world
    """

    def __init__(self, model: CompiledModel, p: Array, t: float, base: Array | None) -> None:
        self.model, self.p, self.t, self.base = model, p, t, base
        self.values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))

    def number(self, formula: Formula) -> float:
        """Return the value of a formula at the parameters; 0 for a division by zero or an unknown symbol."""
        try:
            return float(evaluate(formula, lambda symbol: self.values[symbol.name]))
        except (ArithmeticError, KeyError):
            return 0.0

    def vector(self, formulas: Sequence[Formula]) -> Array:
        return np.array([self.number(formula) for formula in formulas])

    def length(self, q: Array) -> float:
        """Return the largest length of the scene at q (nq,), m: of the description and coordinates; 1 m without any."""
        units = self.model.q_units
        lengths = [*self._lengths, *(abs(value) for value, unit in zip(q.tolist(), units, strict=True) if unit == "m")]
        finite = [length for length in lengths if math.isfinite(length)]
        return max(finite, default=0.0) or 1.0

    @cached_property
    def _lengths(self) -> list[float]:
        """Lengths of the description."""
        every = dict.fromkeys(self.model.description.lengths)
        return [float(np.linalg.norm(self.vector(vector))) for vector in every]

    def gravity(self) -> float:
        """Return the acceleration of gravity, m/s^2."""
        return float(np.linalg.norm(self.vector(self.model.description.gravity)))

    def mass(self) -> float:
        """Return the mass of the scene, kg."""
        return sum(self.number(solid.mass) for solid in self.model.description.drawing.solids)

    def poses(self, path: Array) -> dict[str, tuple[Array, Array]]:
        """Return quaternion and position (rows, ...) in world axes of all bodies at configurations (rows, nq)."""
        rows, model = len(path), self.model
        pose = model.evaluate("poses", path, t=self.t, parameters=self.p, base=self.base)["pose"]
        pose_of = {name: pose[:, index] for index, name in enumerate(model.bodies)}
        still = np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], (rows, 1))
        pose_of |= {WORLD: still, BASE: still if self.base is None else np.tile(self.base[:7], (rows, 1))}
        return {name: (values[:, :4], values[:, 4:]) for name, values in pose_of.items()}


class Rest:
    """A static equilibrium, from which warnings follow.

    Parameters
    ----------
    path : sequence of (nq,)
        Configurations from the start to the equilibrium.
    u : inputs
    """

    def __init__(self, measures: SceneMeasures, path: Sequence[Array], u: Inputs) -> None:
        self.measures, self.path, self.u = measures, path, u

    @cached_property
    def poses(self) -> dict[str, tuple[Array, Array]]:
        """Quaternion and position of all bodies along the path."""
        return self.measures.poses(np.array(self.path))


@dataclass(frozen=True)
class StateWarning:
    """A kind of warning of a static equilibrium: a row of the register.

    Attributes
    ----------
    name : of the row
    evaluate : from the equilibrium to sentences, none if there is no doubt
    alone : whether the warning is left out if there is another one
    limits : thresholds that ``evaluate`` compares with, for the documentation
    """

    name: str
    evaluate: Callable[[Rest], list[str]]
    alone: bool = False
    limits: tuple[Limit, ...] = ()


#: The group of rows that products add.
GROUP = "eomgen.state_warnings"


def equilibrium_notes(measures: SceneMeasures, path: Sequence[Array], u: Inputs) -> list[Message]:
    """Return the warnings of all rows of the register about an equilibrium, the last configuration of ``path``. None
    without the term ``poses`` or for a path of one configuration; rows that the scene silences are left out. ``u`` are
    the inputs. Raises NumericalError with the warnings if the scene wants these as errors."""
    sentences: list[Message] = []
    if "poses" not in measures.model.functions or len(path) < 2:
        return sentences
    rest, settings = Rest(measures, path, u), doubt_settings(measures.model.description.parts)
    for row in rows_of(GROUP, StateWarning):
        if row.name not in settings.quiet and not (row.alone and sentences):
            sentences.extend(Message(text, row.name) for text in row.evaluate(rest))
    if settings.strict and sentences:
        raise NumericalError(settings.problems(sentences))
    return sentences


_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def off_axis_hint(model: CompiledModel, measures: SceneMeasures, q: Array, v: Array) -> str:
    """Return a remedy, as text, if bodies that turn with v (nv,) at q (nq,) are out of balance; empty if none is. Half
    a turn of a single coordinate moves a centre of mass by twice the distance from the axis."""
    if "poses" not in model.functions:
        return ""
    worst, result, gravity = 0.0, "", measures.vector(model.description.gravity)
    for factor in model.factors:
        k = factor.v_start
        if factor.group != "R" or factor.v_size != 1 or not v[k] or model.v_units[k] != "rad/s":
            continue
        half = q.copy()
        half[factor.q] += np.pi
        poses = measures.poses(np.array([q, half]))
        before, moment, across = worst, np.zeros(3), np.zeros(3)
        for solid in model.description.drawing.solids:
            turn, origin = poses[solid.name]
            center = origin + rotated(turn, measures.vector(solid.center_of_mass))
            off, mass = 0.5 * float(np.linalg.norm(center[1] - center[0])), measures.number(solid.mass)
            moment += 0.5 * mass * (center[0] - center[1])
            if off > SUMMED * measures.length(q) and mass * off > worst:
                worst = mass * off
                result = (
                    f"centres of mass on the axis of {factor.name} (the centre of {solid.name} is {off:.6g} m off,"
                    f" {worst:.6g} kg m), with gravity and springs that are the same all round it; unbalance acts on"
                    " the balanced rotor as a force that turns (docs/python.md, Rotors)"
                )
                # half a turn reverses the part of gravity across the axis alone
                across = gravity - rotated(turn[1], rotated(turn[0] * _CONJUGATE, gravity))
        # a twentieth of the largest moment remains of balanced blades, which sag
        is_balanced = worst > before and float(np.linalg.norm(moment)) <= 0.05 * worst
        if is_balanced and float(np.linalg.norm(across)) > SUMMED * measures.gravity():
            result = (
                f"gravity along the axis of {factor.name} or none, for the centres of mass balance about this axis, and"
                " gravity across it turns relative to each part; floquet (of a model, in Python) takes such a motion,"
                f" with a drive of {factor.name}"
            )
    return result


LARGE_SHORTENING = Limit(0.05, "1", "shortening of a bent beam in parts of its length", "half of a large error")


class LargestBending(NamedTuple):
    """The place of largest bending of a beam.

    Attributes
    ----------
    beam : name of the beam
    time : s
    shortening : of the axis, as a part of the beam's length: half the mean square of the slope
    """

    beam: str
    time: float
    shortening: float

    @property
    def possible(self) -> bool:
        """Whether there is a beam that is bent so."""
        return self.shortening < 1.0

    def __str__(self) -> str:
        where = f"the beam {self.beam} bends by slopes of {np.sqrt(2.0 * self.shortening):.3g} (root mean square) at"
        shorter = f"t = {self.time:.6g} s, which shortens it by {100.0 * self.shortening:.3g} % of its length"
        wrong = "its equations, linear in curvature, are wrong by as much"
        return f"{where} {shorter}: {wrong}; try: a stiffer beam, smaller loads, or shorter beams in a chain"


def shortenings(model: CompiledModel, q: Array) -> Array:
    """Return the shortening of each beam's axis at q (n, nq), as a part of the length, (n, beams); infinity for NaN."""
    places = {factor.name: factor.q for factor in model.factors}
    beams = model.library.layout["slopes"]
    result = np.empty((len(q), len(beams)))
    with np.errstate(over="ignore", invalid="ignore"):
        for k, item in enumerate(beams):
            bent = q[:, places[item["name"]]]
            result[:, k] = 0.5 * np.einsum("nk,kl,nl->n", bent, np.array(item["squares"]), bent) / item["length"]
    return np.where(np.isnan(result), np.inf, result)


def largest_bending(model: CompiledModel, t: Array, q: Array) -> LargestBending | None:
    """Return the beam that is bent most in any row of a run, t (n,) in s and q (n, nq), with time and shortening. None
    unless the shortening is above ``LARGE_SHORTENING``, the range of the linear theory."""
    shares, beams = shortenings(model, q), model.library.layout["slopes"]
    rows = shares.argmax(axis=0)
    candidates = [
        LargestBending(item["name"], float(t[row]), float(shares[row, k]))
        for k, (item, row) in enumerate(zip(beams, rows, strict=True))
    ]
    most = max(candidates, key=lambda bending: bending.shortening, default=None)
    return most if most is not None and not most.shortening <= LARGE_SHORTENING else None


class InertiaWarning(NamedTuple):
    """The fault of the inertia matrix of a state, and a remedy."""

    text: str
    hint: str


def inertia_warning(
    model: CompiledModel, q: Array, p: Array, start: Array | None = None, step: float = 0.0, where: str = "there"
) -> InertiaWarning | None:
    """Return a warning if the inertia matrix at q (nq,) is not positive definite; None if positive definite or unknown.

    Parameters
    ----------
    p : parameters (np,)
    start : (nq,)
        State at the start of the run that led to q, with steps of ``step`` seconds.
    where : name of the state in the message
    """
    smallest = _smallest(model, q, p)
    if smallest is None or smallest > 0.0:
        return None
    text = f"the inertia matrix {where} is not positive definite, its smallest eigenvalue is {smallest:.3g}"
    beams = beams_beyond_linear_range(model, q, p)
    if beams:
        text += f": this is beyond the range of order = 1 of beam{'s' * (len(beams) > 1)} {', '.join(beams)}"
    if start is not None and _definite(model, start, p):  # the masses are fine, and the state has run away
        return InertiaWarning(text, f"a step smaller than {step:.3g} s{', then order = 2' if beams else ''}")
    return InertiaWarning(text, "order = 2" if beams else "masses and inertias that bodies can have")


def beams_beyond_linear_range(model: CompiledModel, q: Array, p: Array) -> Sequence[str]:
    """Return the names of the beams of order 1 whose deformation at q makes the inertia matrix not positive definite.
    Empty if the matrix is positive definite, or if it would not be so without deformation either."""
    first = {item.name for item in model.description.coordinates if item.linear}
    factors = [factor for factor in model.factors if factor.name in first]
    straight = q.copy()
    for factor in factors:
        straight[factor.q] = 0.0
    if not factors or _definite(model, q, p) or not _definite(model, straight, p):
        return ()
    causes = []
    for factor in factors:
        alone = straight.copy()
        alone[factor.q] = q[factor.q]
        if not _definite(model, alone, p):
            causes.append(factor.name)
    return tuple(causes or (factor.name for factor in factors))


def _definite(model: CompiledModel, q: Array, p: Array) -> bool:
    smallest = _smallest(model, q, p)
    return smallest is not None and smallest > 0.0


def _smallest(model: CompiledModel, q: Array, p: Array) -> float | None:
    """Return the smallest eigenvalue of M at q; if it is not positive, of M with the constraints' rows added. None
    without a finite M."""
    if "mass" not in model.functions:
        return None
    M = model.mass(q, parameters=p)
    if not M.size or not np.all(np.isfinite(M)):
        return None
    smallest = float(np.linalg.eigvalsh(M)[0])
    if smallest > 0.0 or "constraint_jacobian" not in model.functions or not model.multipliers:
        return smallest
    (B,) = model.evaluate("constraint_jacobian", q, parameters=p).values()
    return float(np.linalg.eigvalsh(inertia_with_rows(M, B, np.ones(model.nv)))[0])
