"""Before a run of fixed steps: contacts that close, made linear, against the step.

With closed gaps and friction that holds, forces of contacts are linear in small motions, and with the inertia of the
scene they have eigenvalues s. An explicit method grows at a step h if its stability function abs(R(h s)) exceeds 1
(Hairer, Wanner: Solving Ordinary Differential Equations II, 1996, IV.2). An impact lasts pi / Im s, of which steps of
1 / Im s see three states. Rates of bristles are taken in sliding at the velocity of the start as well.

A contact closes if its gap does at the acceleration of the start. Its speed and its load decide how deep it goes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.equations import accelerations, free_directions
from eomgen.compiled.initial_state import InitialState
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import record
from eomgen.integrators.families.family import LinearTransitions
from eomgen.integrators.families.register import Method
from eomgen.lie import product
from eomgen.lie.numeric import rotated, rotation_matrix
from eomgen.mechanics.forces.frame_pairs import FramePair, FramePose
from eomgen.products.contacts import friction_laws, normal_laws
from eomgen.products.contacts.laws import LOCAL_NAMES, rate_name
from eomgen.products.contacts.pair import PairMotion
from eomgen.products.contacts.section import Contact
from eomgen.products.contacts.slip_laws import OF_FILE
from eomgen.products.contacts.surfaces import FOLLOWER
from eomgen.results.finding import Finding
from eomgen.simulation.stepping.run import Run
from eomgen.symbolic.calculus.partials import gradient
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Tape

#: Kinds of symbols that have a value at a start; time has the empty name.
_KNOWN = ("parameter", "input", "time")
#: Time after which the gap is asked for again, s.
_SOON = 1e-5
#: Laws that a library keeps, by contact and parameters.
_MOST_LAWS = 64
#: Results of laws along the rows of ``_Pair.directions``, and the motions on which they depend.
_FORCES = ("force_x", "force_y", "force", "moment_x", "moment_y", "moment_z")
_MOTIONS = tuple(name for name in LOCAL_NAMES if name not in ("deflection", "load", "camber"))


class _Numbers:
    """Formulas of parameters, inputs and time as constants on a tape, in place of the quantities of a scene. Raises
    KeyError for other quantities."""

    def __init__(self, values: Mapping[str, float]) -> None:
        self.algebra, self._values = Algebra(Tape()), values

    def __call__(self, symbol: Symbol) -> Scalar:
        return self.algebra.scalar(
            self._values[symbol.name if symbol.kind in _KNOWN else f"{symbol.kind}.{symbol.name}"]
        )

    def formula(self, formula: Formula) -> Scalar:
        return record(self.algebra, formula, self)

    def vector(self, formulas: Any) -> Any:
        return self.algebra.vector([self.formula(item) for item in formulas])


class _Bodies(NamedTuple):
    """Poses of bodies, quaternion and origin by name, and their twists (nv, 6), angular first, for unit velocities."""

    poses: Mapping[str, Array]
    twists: Mapping[str, Array]
    size: int

    def motion(self, item: Contact, numbers: _Numbers) -> PairMotion:
        """Return the geometry of a contact."""
        algebra, frames = numbers.algebra, list[FramePose]()
        for frame in (item.first, item.second):
            pose = self.poses.get(frame.body, np.eye(1, 7)[0])
            origin = rotated(pose[:4], _values(numbers.vector(frame.position))) + pose[4:]
            axes = rotation_matrix(pose[:4]) @ np.array(frame.orientation)
            frames.append(FramePose(0, algebra.matrix(axes.tolist()), algebra.vector(origin.tolist())))
        pair = FramePair(None, frames[0], frames[1], *algebra.zero_vector)  # type: ignore[arg-type]  # held
        return PairMotion(numbers, item, pair)  # type: ignore[arg-type]  # constants

    def velocities(self, item: Contact, point: Array) -> tuple[Array, Array]:
        """Return relative angular velocities of the bodies, and velocities at a point, (3, nv) each, for unit
        velocities."""
        turning, moving = np.zeros((2, self.size, 3))
        for frame, sign in ((item.first, -1.0), (item.second, 1.0)):
            if frame.body in self.poses:
                R, twists = rotation_matrix(self.poses[frame.body][:4]), self.twists[frame.body]
                turned = twists[:, :3] @ R.T
                turning += sign * turned
                moving += sign * (twists[:, 3:] @ R.T + np.cross(turned, point - self.poses[frame.body][4:]))
        return turning.T, moving.T


class _Laws:
    """Forces of a contact and rates of its internal states, as functions of ``_MOTIONS`` and ``states``, by name."""

    def __init__(self, item: Contact, values: Mapping[str, float]) -> None:
        self._name, numbers = item.name, _Numbers(values)
        algebra, tape, zero = numbers.algebra, numbers.algebra.tape, numbers.algebra.zero
        friction = None if item.tangential is None else friction_laws.LAWS[item.tangential.name]
        self.states = [] if friction is None else [*friction.states]
        self._inputs = [*_MOTIONS, *self.states]
        known = {name: Scalar(tape, tape.input("local", k)) for k, name in enumerate(self._inputs)}
        known |= {"deflection": algebra.call(Op.MAX, -known["gap"], zero), "camber": zero}
        known["depth"] = zero if item.shape == FOLLOWER else known["deflection"]
        results, normal = dict.fromkeys(_FORCES, zero), normal_laws.LAWS.get(item.normal.name, OF_FILE)
        for law, applied in ((normal, item.normal), (friction, item.tangential)):
            if law is not None and applied is not None:
                keys = {name: self._key(numbers, known, value) for name, value in applied.values.items()}
                results |= law.record(algebra, {**known, **keys})
                known["load"] = results["force"]
        self._tape, self._results = tape, [results[name].ref for name in (*_FORCES, *map(rate_name, self.states))]
        symbols = [known[name].ref for name in self._inputs]
        self._slopes = [slope for result in self._results for slope in gradient(tape, result, symbols)]

    def _key(self, numbers: _Numbers, known: Mapping[str, Scalar], formula: Formula) -> Scalar:
        local = {of: known[name] for name, of in LOCAL_NAMES.items() if name in known}

        def value(symbol: Symbol) -> Scalar:
            return local[symbol.kind] if symbol.name == self._name and symbol.kind in local else numbers(symbol)

        return record(numbers.algebra, formula, value)

    def _at(self, refs: list[int], motions: Mapping[str, float | Array]) -> Array:
        columns = np.broadcast_arrays(*(motions.get(name, 0.0) for name in self._inputs))
        with np.errstate(all="ignore"):
            return evaluate(self._tape, refs, {"local": np.stack(columns, axis=-1)})

    def loads(self, depths: Array) -> Array:
        """Return the normal force at deflections, N."""
        return self._at(self._results[2:3], {"gap": -depths})[..., 0]

    def rates(self, motions: Mapping[str, float | Array]) -> Array:
        """Return the rates of internal states, (..., states)."""
        return self._at(self._results[len(_FORCES) :], motions)

    def slopes(self, motions: Mapping[str, float | Array]) -> dict[str, Array]:
        """Return the partials of forces and rates of states in each motion and state, by name."""
        table = self._at(self._slopes, motions).reshape(len(self._results), -1)
        return dict(zip(self._inputs, table.T, strict=True))


class _Pair:
    """A contact at a start.

    Attributes
    ----------
    gap : m
    directions : velocities along and about the axes of the contact, for unit velocities, (6, nv)
    place : coordinates of the contact point in the first frame, m, by name
    motions : the quantities of ``_MOTIONS`` that are velocities, for unit velocities, by name, (nv,) each
    """

    def __init__(self, item: Contact, laws: _Laws, bodies: _Bodies, values: Mapping[str, float]) -> None:
        self.name, self.laws, geometry = item.name, laws, bodies.motion(item, _Numbers(values))
        self.gap = _values([geometry.gap])[0]
        self.place = {f"contact_{axis}": float(_values([value])[0]) for axis, value in geometry.place.items()}
        turning, moving = bodies.velocities(item, _values(geometry.point))
        at_centre = bodies.velocities(item, _values(geometry.pair.second.origin))[1]
        axes = np.array([_values(axis) for axis in (*geometry.tangents, geometry.normal)])
        self.directions = np.concatenate([axes @ moving, axes @ turning])
        self.motions = {
            **dict(zip(("slip_velocity_x", "slip_velocity_y", "rate"), axes @ moving, strict=True)),
            **dict(zip(("velocity_x", "velocity_y"), axes @ at_centre, strict=False)),
            **dict(zip(("turn_x", "turn_y", "spin"), axes @ turning, strict=True)),
            "wheel_speed": _values(geometry.axis) @ turning,
        }


def _values(scalars: Any) -> Array:
    """Return the numbers of constants."""
    return np.array([math.nan if scalar.constant is None else scalar.constant for scalar in scalars])


class _Closing(NamedTuple):
    """A pair whose gap closes: motions at rest on the surface and in the slip of the start; the deflection at the
    impact, m, its rate, m/s, 0 for a pair that is closed, and the acceleration that closes the gap, m/s^2."""

    pair: _Pair
    resting: Mapping[str, float]
    sliding: Mapping[str, float]
    impact: float
    rate: float
    pull: float


class ClosedContacts:
    """The contacts of a run, ``items``, that close from its start at ``state``."""

    def __init__(self, run: Run, state: InitialState, items: Sequence[Contact]) -> None:
        self._run, model, p, t = run, run.model, run.parameters, run.grid.start
        values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
        units = np.concatenate([np.zeros((1, model.nv)), np.eye(model.nv)])
        twists = np.moveaxis(model.evaluate("twists", state.q, units, t=t, parameters=p)["twist"], -2, 0)
        moving = {name: twist[1:] - twist[0] for name, twist in zip(model.bodies, twists, strict=True)}
        basis = free_directions(model, state.q, t, p)
        M = basis.T @ model.mass(state.q, parameters=p) @ basis
        self._mobility = basis @ np.linalg.solve(M, basis.T)
        self._v, u = state.v, run.signals.rows(np.array([t]))[0] if run.takes_rows else None
        values |= {"": t, **dict(zip(run.signals.names, [] if u is None else u.tolist(), strict=False))}
        a = accelerations(model, state.q, state.v, t, u, z=state.z, parameters=p)
        ways = np.array([_SOON * (sign * state.v + 0.5 * _SOON * a) for sign in (0.0, 1.0, -1.0)])
        ways[0] = 0.0
        places = product.update(model.factors, np.repeat(state.q[np.newaxis], 3, axis=0), ways)
        poses = model.evaluate("poses", places, t=t, parameters=p)["pose"]
        here, *near = (_Bodies(dict(zip(model.bodies, pose, strict=True)), moving, model.nv) for pose in poses)
        kept: dict[tuple[str, bytes], _Laws] = run.model.library.kept.setdefault("laws of contacts", {})
        if len(kept) > _MOST_LAWS:
            kept.clear()
        self._closing = []
        for item in items:
            try:
                if (key := (item.name, np.array([*values.values()]).tobytes())) not in kept:
                    kept[key] = _Laws(item, values)
                pair = _Pair(item, kept[key], here, values)
                gaps = [_values([bodies.motion(item, _Numbers(values)).gap])[0] for bodies in near]
            except (KeyError, ZeroDivisionError):  # a formula of positions or velocities; no single closest point
                continue
            pull = (2.0 * pair.gap - sum(gaps)) / _SOON**2
            if (closing := self._closing_of(pair, float(pull))) is not None:
                self._closing.append(closing)

    def _closing_of(self, pair: _Pair, pull: float) -> _Closing | None:
        normal, span = pair.directions[2], self._run.grid.end - self._run.grid.start
        rate, gap = float(normal @ self._v), max(float(pair.gap), 0.0)
        mobility, square = float(normal @ self._mobility @ normal), rate * rate + 2.0 * pull * gap
        if not mobility > 0.0 or not square >= 0.0 or (gap and max(pull, -rate) <= 0.0):
            return None
        if gap and 2.0 * gap > (math.sqrt(square) - rate) * (span or math.inf):
            return None
        depths = max(-pair.gap, 0.0) + np.concatenate([[0.0], np.geomspace(1e-9, 1.0, 400)])
        loads = pair.laws.loads(depths)
        at_rest = max(pull / mobility + loads[0], 0.0)
        work = np.concatenate([[0.0], np.cumsum(0.5 * (loads[1:] + loads[:-1]) * np.diff(depths))])
        reached = np.flatnonzero(0.5 * square / mobility + at_rest * (depths - depths[0]) >= work)
        sliding = {name: float(row @ self._v) for name, row in pair.motions.items()}
        sliding |= pair.place | {"gap": -float(np.interp(at_rest, np.maximum.accumulate(loads), depths)), "rate": 0.0}
        resting = sliding | dict.fromkeys(("slip_velocity_x", "slip_velocity_y"), 0.0)
        return _Closing(pair, resting, sliding, float(depths[reached[-1]]), math.sqrt(square) if gap else 0.0, pull)

    def _spectrum(
        self, points: Sequence[tuple[_Pair, Mapping[str, float]]], *, friction: bool
    ) -> tuple[NDArray[Any], str]:
        """Return the eigenvalues, 1/s, of pairs that are closed, each at its motions, with or without friction, and the
        name of the stiffest pair."""
        nv, counts = len(self._v), [len(pair.laws.states) if friction else 0 for pair, _ in points]
        matrix, first, sizes = np.zeros((2 * nv + sum(counts), 2 * nv + sum(counts))), 2 * nv, []
        matrix[:nv, nv : 2 * nv] = np.eye(nv)
        acting = slice(0, 6) if friction else slice(2, 3)
        for (pair, motions), count in zip(points, counts, strict=True):
            slopes, own = pair.laws.slopes(motions), slice(first, first + count)
            rows = np.zeros((6 + len(pair.laws.states), len(matrix)))
            rows[:, :nv] = np.outer(slopes["gap"], pair.directions[2])
            rows[:, nv : 2 * nv] = sum(np.outer(slopes[name], row) for name, row in pair.motions.items())
            for place, name in enumerate(pair.laws.states[:count]):
                rows[:, first + place] = slopes[name]
            moved = self._mobility @ pair.directions[acting].T @ rows[acting]
            matrix[nv : 2 * nv] += moved
            matrix[own] = rows[6 : 6 + count]
            sizes.append(float(np.linalg.norm(moved)))
            first += count
        values = np.linalg.eigvals(matrix) if np.all(np.isfinite(matrix)) else np.zeros(0)
        return values, points[int(np.argmax(sizes))][0].name

    def _states_in_sliding(self, closing: _Closing) -> NDArray[Any]:
        """Return the eigenvalues, 1/s, of internal states that follow the slip of the start."""
        pair, begun = closing.pair, closing.pair.laws.rates(closing.sliding)
        if not begun.any():
            return np.zeros(0)
        paths = np.geomspace(1e-9, 1e3, 400)[:, np.newaxis] * begun
        along = pair.laws.rates({**closing.sliding, **dict(zip(pair.laws.states, paths.T, strict=True))}) @ begun
        reached = paths[np.flatnonzero(along > 1e-3 * begun @ begun)[-1]]
        slopes = pair.laws.slopes({**closing.sliding, **dict(zip(pair.laws.states, reached.tolist(), strict=True))})
        return np.linalg.eigvals(np.array([slopes[name][6:] for name in pair.laws.states]).T)

    def findings(self, unresolved: float, steady: float) -> Iterator[Finding]:
        """Yield a finding on the fastest motion in which explicit steps grow by more than ``steady``, else on the
        shortest impact, if its angular frequency times the step is above ``unresolved``."""
        if not self._closing:
            return
        step, growth = self._run.settings["step"], _growth(self._run.method)
        deepest = [(item.pair, {"gap": -item.impact}) for item in self._closing]
        at_rest = [(item.pair, item.resting) for item in self._closing]
        spectra = [
            ("normal force", *self._spectrum(deepest, friction=False)),
            ("friction", *self._spectrum(at_rest, friction=True)),
            *(("friction", self._states_in_sliding(item), item.pair.name) for item in self._closing),
        ]
        every = [(abs(value), value, law, name) for law, values, name in spectra for value in values]
        if growing := [item for item in every if growth(step * item[1]) > steady]:
            size, value, law, name = max(growing, key=lambda item: item[0])
            text = f"steps of {step:.3g} s grow with the {law} of the contact {name}"
            stable = step
            while growth(stable * value) > 0.0:
                stable *= 0.98
            hint = f"a step below {stable:.2g} s, or generalized_alpha"
            yield Finding(value=float(size), text=f"{text}, which has a rate of {size:.3g} 1/s", hint=hint)
            return
        impacts = [(*self._impact(item), item.pair.name) for item in self._closing if item.rate]
        frequency, rate, name = max(impacts, default=(0.0, 0.0, ""))
        if step * frequency > unresolved:
            lasting = math.pi / frequency
            text = f"steps of {step:.3g} s do not resolve the impact at the contact {name} with {rate:.3g} m/s, which"
            hint = f"a step below {0.1 * lasting:.2g} s"
            yield Finding(value=frequency, text=f"{text} lasts {lasting:.2g} s", hint=hint)

    def _impact(self, closing: _Closing) -> tuple[float, float]:
        """Return angular frequency, 1/s, and rate, m/s, of an impact; 0 without an oscillation above its load."""
        slopes, normal = closing.pair.laws.slopes({"gap": -closing.impact}), closing.pair.directions[2]
        stiffness, damping = (-(normal @ self._mobility @ normal) * slopes[name][2] for name in ("gap", "rate"))
        frequency = math.sqrt(max(stiffness - 0.25 * damping * damping, 0.0))
        return (frequency if frequency * closing.rate > closing.pull else 0.0), closing.rate


def _growth(method: Method) -> Callable[[complex], float]:
    """Return the growth of steps of an explicit method by radian, a function of step times eigenvalue."""
    if (composition := getattr(method, "composition", None)) is not None:
        return lambda z: abs(z.imag) - float(composition.stability_limit)
    if not method.real_stability or not isinstance(method.linear_step, LinearTransitions):
        return lambda z: 0.0
    A, b = np.array(method.linear_step.A), np.array(method.linear_step.b)

    def growth(z: complex) -> float:
        factor = abs(1.0 + z * (b @ np.linalg.solve(np.eye(len(b)) - z * A, np.ones(len(b)))))
        return math.log(factor) / abs(z) if z.real <= 0.0 < min(factor, abs(z)) else 0.0

    return growth
