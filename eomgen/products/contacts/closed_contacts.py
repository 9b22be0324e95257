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
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.equations import accelerations, free_directions, nonzeros
from eomgen.compiled.initial_state import InitialState
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import record
from eomgen.integrators.families.family import LinearTransitions
from eomgen.integrators.families.register import Method
from eomgen.lie import product
from eomgen.lie.groups import group_named
from eomgen.lie.numeric import difference, rotation_matrix
from eomgen.mechanics.forces.frame_pairs import FramePair, FramePose
from eomgen.products.contacts import friction_laws
from eomgen.products.contacts.law import ContactForces
from eomgen.products.contacts.laws import LOCAL_NAMES, rate_name, state_name
from eomgen.products.contacts.pair import PairMotion
from eomgen.products.contacts.section import Contact
from eomgen.products.contacts.surfaces import FOLLOWER
from eomgen.results.finding import Finding
from eomgen.simulation.accuracy.step_path import StepPath
from eomgen.simulation.stepping.run import Run
from eomgen.symbolic.calculus.partials import gradient
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar, apply, dot, plus
from eomgen.symbolic.tape import Tape

#: Time after which the gap is asked for again, s; and rad or m by which coordinates move to measure motions of bodies.
_SOON, _ASIDE = 1e-5, 1e-6
#: Laws that a library keeps, by contact and values of their keys; and pairs that act on one another, the stiffest.
_MOST = 64
#: Results of laws along and about the axes of a contact, and the motions on which they depend.
_FORCES = ("force_x", "force_y", "force", "moment_x", "moment_y", "moment_z")
_MOTIONS = tuple(name for name in LOCAL_NAMES if name not in ("deflection", "load"))
_VELOCITIES = _MOTIONS[1:-3]


class _Start:
    """Formulas at a start as constants on a tape, in place of the quantities of a scene, and pairs between two bodies,
    whose twists, (12,), are inputs of the tape. Raises KeyError for quantities that have no
    value before the equations."""

    def __init__(self, path: StepPath) -> None:
        self.algebra, self.path = Algebra(Tape()), path
        self.kinematics = SimpleNamespace(local=lambda _, position: (1, position))
        self.local, self.state_numbers = dict[tuple[str, str], Scalar](), dict[str, int]()
        self._inputs = [Scalar(self.algebra.tape, self.algebra.tape.input("twist", k)) for k in range(12)]

    def input(self, _: str, index: int) -> Scalar:
        return Scalar(self.algebra.tape, self.algebra.tape.input("local", index))

    def __call__(self, symbol: Symbol) -> Scalar:
        if (symbol.kind, symbol.name) in self.local:
            return self.local[symbol.kind, symbol.name]
        if not self.path.knows(symbol):
            raise KeyError(symbol.name)
        return self.algebra.scalar(float(self.path.values(symbol, self.path.at_rows)[0]))

    def formula(self, formula: Formula) -> Scalar:
        return record(self.algebra, formula, self)

    def vector(self, formulas: Any) -> Any:
        return self.algebra.vector([self.formula(item) for item in formulas])

    def motion(self, item: Contact, poses: Mapping[str, Array]) -> PairMotion:
        """Return the motion of a contact, by poses (7,) of the bodies that are not the base."""
        algebra, frames, placed = self.algebra, list[FramePose](), {}
        for link, frame in enumerate((item.first, item.second)):
            pose = poses.get(frame.body, np.eye(1, 7)[0])
            R = rotation_matrix(pose[:4])
            placed[link] = algebra.matrix(R.tolist()), algebra.vector(pose[4:].tolist())
            origin = plus(placed[link][1], apply(placed[link][0], self.vector(frame.position)))
            frames.append(FramePose(link, algebra.matrix((R @ np.array(frame.orientation)).tolist()), origin))
        twists = {k: (tuple(self._inputs[k : k + 3]), tuple(self._inputs[k + 3 : k + 6])) for k in (0, 6)}
        known: Any = SimpleNamespace(pose=placed.__getitem__, twist=lambda link: twists[6 * link])
        motion: Any = self
        return PairMotion(motion, item, FramePair(known, frames[0], frames[1], *algebra.zero_vector))

    def by_twists(self, scalars: Sequence[Scalar]) -> Array:
        """Return the derivatives of velocities by the twists, (n, 12)."""
        tape, inputs = self.algebra.tape, [item.ref for item in self._inputs]
        slopes = [slope for scalar in scalars for slope in gradient(tape, scalar.ref, inputs)]
        return evaluate(tape, slopes, {"twist": np.zeros(12)}).reshape(-1, 12)


class _Laws:
    """Forces of a contact and rates of its internal states, as functions of ``_MOTIONS`` and ``states``, by name."""

    def __init__(self, item: Contact, start: _Start) -> None:
        friction, tape, zero = item.tangential, start.algebra.tape, start.algebra.zero
        self.states = [] if friction is None else [*friction_laws.LAWS[friction.name].states]
        self._inputs = [*_MOTIONS, *self.states]
        known = {name: Scalar(tape, tape.input("local", k)) for k, name in enumerate(self._inputs)}
        known |= {"overlap": -known["gap"], "deflection": start.algebra.call(Op.MAX, -known["gap"], zero)}
        known["depth"] = zero if item.shape == FOLLOWER else known["deflection"]
        start.state_numbers = {state_name(item.name, state): len(_MOTIONS) + k for k, state in enumerate(self.states)}
        start.local = {(of, item.name): known[name] for name, of in LOCAL_NAMES.items() if name in known}
        motion: Any = SimpleNamespace(local=known, along_normal=known, steepness=start.algebra.one)
        forces = ContactForces(start, item, motion)  # type: ignore[arg-type]  # a start in place of a scene
        start.local["normal_force", item.name] = forces.normal["load"]
        results = {**forces.normal, **forces.tangential}
        self._tape, self._results = tape, [results[name].ref for name in (*_FORCES, *map(rate_name, self.states))]
        inputs = [known[name].ref for name in self._inputs]
        self._slopes = [slope for result in self._results for slope in gradient(tape, result, inputs)]

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


class _Closing(NamedTuple):
    """A pair whose gap closes.

    Attributes
    ----------
    directions : velocities along and about the axes of the contact, for unit velocities, (6, nv)
    motions : of ``_VELOCITIES`` by ``directions``, (n, 6)
    resting, sliding : motions at rest on the surface, and in the slip of the start
    impact, rate : deflection at the impact, m, and its rate, m/s, 0 for a pair that is closed
    frequency : angular frequency of the impact, 1/s
    """

    name: str
    laws: _Laws
    directions: Array
    motions: Array
    resting: Mapping[str, float]
    sliding: Mapping[str, float]
    impact: float
    rate: float
    frequency: float


class ClosedContacts:
    """The contacts of a run, ``items``, that close from its start at ``state``."""

    def __init__(self, run: Run, state: InitialState, items: Sequence[Contact]) -> None:
        self._run, model, p, t = run, run.model, run.parameters, run.grid.start
        aside = _ASIDE * np.concatenate([np.eye(model.nv), -np.eye(model.nv)])
        around = product.update(model.factors, np.repeat(state.q[np.newaxis], len(aside), axis=0), aside)
        after, before = np.split(model.evaluate("poses", around, t=t, parameters=p)["pose"], 2)
        twists = difference(group_named("SE3", 6), before, after) / (2.0 * _ASIDE)
        moving = {name: twist.T for name, twist in zip(model.bodies, np.moveaxis(twists, 1, 0), strict=True)}
        self._v, u = state.v, run.signals.rows(np.array([t]))[0] if run.takes_rows else None
        held, basis = {"z": state.z, "parameters": p}, free_directions(model, state.q, t, p)
        inertia = nonzeros(model, "mass", state.q[np.newaxis], parameters=p)
        assert inertia is not None  # models for runs have it, or its nonzeros
        M = basis.T @ inertia.block(slice(0, model.nv))[0] @ basis
        self._mobility = basis @ np.linalg.solve(M, basis.T)
        a = accelerations(model, state.q, state.v, t, u, **held)
        none = np.zeros(len(model.multipliers))
        path = StepPath(run, np.concatenate([[t], state.q, state.v, a, none, state.z])[np.newaxis], p)
        ways = np.array([0.0 * a, *(_SOON * (sign * state.v + 0.5 * _SOON * a) for sign in (1.0, -1.0))])
        places = product.update(model.factors, np.repeat(state.q[np.newaxis], 3, axis=0), ways)
        poses = model.evaluate("poses", places, t=t, parameters=p)["pose"]
        known = [dict(zip(model.bodies, pose, strict=True)) for pose in poses]
        kept: dict[object, _Laws] = run.model.library.kept.setdefault("laws of contacts", {})
        closing = []
        for item in items:
            try:
                start = _Start(path)
                laws = self._laws(item, start, kept)
                here, *near = (start.motion(item, poses) for poses in known)
                curvature = 2.0 * _gap(here) - sum(map(_gap, near))
                fixed = np.zeros((6, model.nv))
                both = np.concatenate([moving.get(frame.body, fixed) for frame in (item.first, item.second)])
                if (
                    pair := self._closing_of(item.name, laws, here, start.by_twists, both, curvature / _SOON**2)
                ) is not None:
                    closing.append(pair)
            except (KeyError, ZeroDivisionError):  # a formula without a value before the equations; no closest point
                continue
        self._closing = sorted(closing, key=lambda pair: pair.frequency)[-_MOST:]

    @staticmethod
    def _laws(item: Contact, start: _Start, kept: dict[object, _Laws]) -> _Laws:
        """Return the laws of a contact, recorded once for each set of values of their keys."""
        if len(kept) > _MOST:
            kept.clear()
        named = {symbol for formula, _ in item.formulas() for symbol in symbols(formula) if symbol.name != item.name}
        key = item.name, tuple(sorted((str(symbol), start(symbol).constant) for symbol in named))
        if key not in kept:
            kept[key] = _Laws(item, _Start(start.path))
        return kept[key]

    def _closing_of(
        self, name: str, laws: _Laws, pair: PairMotion, by_twists: Callable[..., Array], twists: Array, pull: float
    ) -> _Closing | None:
        axes, local = (*pair.tangents, pair.normal), pair.local
        directions = by_twists([dot(axis, way) for way in (pair.slip, pair.turning) for axis in axes]) @ twists
        motions = by_twists([local[name] for name in _VELOCITIES]) @ twists
        normal, span = directions[2], self._run.grid.end - self._run.grid.start
        rate, gap = float(normal @ self._v), max(_gap(pair), 0.0)
        mobility, square = float(normal @ self._mobility @ normal), rate * rate + 2.0 * pull * gap
        if not mobility > 0.0 or not square >= 0.0 or (gap and max(pull, -rate) <= 0.0):
            return None
        if gap and 2.0 * gap > (math.sqrt(square) - rate) * (span or math.inf):
            return None
        depths = max(-_gap(pair), 0.0) + np.concatenate([[0.0], np.geomspace(1e-9, 1.0, 400)])
        loads = laws.loads(depths)
        at_rest = max(pull / mobility + loads[0], 0.0)
        work = np.concatenate([[0.0], np.cumsum(0.5 * (loads[1:] + loads[:-1]) * np.diff(depths))])
        reached = np.flatnonzero(0.5 * square / mobility + at_rest * (depths - depths[0]) >= work)
        sliding = dict(zip(_VELOCITIES, (motions @ self._v).tolist(), strict=True))
        fixed = {"camber": local["camber"], **{f"contact_{axis}": value for axis, value in pair.place.items()}}
        sliding |= {name: float(value.constant or 0.0) for name, value in fixed.items()}
        sliding |= {"gap": -float(np.interp(at_rest, np.maximum.accumulate(loads), depths)), "rate": 0.0}
        resting = sliding | dict.fromkeys(("slip_velocity_x", "slip_velocity_y"), 0.0)
        impact, rate = float(depths[reached[-1]]), math.sqrt(square) if gap else 0.0
        slopes = laws.slopes({"gap": -impact})
        stiffness, damping = (-mobility * slopes[name][2] for name in ("gap", "rate"))
        frequency = math.sqrt(max(stiffness - 0.25 * damping * damping, 0.0))
        frequency = frequency if frequency * rate > pull else 0.0  # no oscillation above its load
        own = motions @ np.linalg.pinv(directions)
        return _Closing(name, laws, directions, own, resting, sliding, impact, rate, frequency)

    def _spectrum(self, *, friction: bool) -> tuple[Array, str]:
        """Return the eigenvalues, 1/s, of pairs that are closed, at rest with friction or at the impact without, in
        their own directions, and the name of the stiffest pair."""
        pairs, counts = self._closing, [len(pair.laws.states) if friction else 0 for pair in self._closing]
        every = np.concatenate([pair.directions for pair in pairs])
        moved, n = every @ self._mobility @ every.T, len(every)
        matrix, forces, sizes = np.zeros((2 * n + sum(counts),) * 2), np.zeros((n, 2 * n + sum(counts))), []
        matrix[:n, n : 2 * n], first = np.eye(n), 2 * n
        for k, (pair, count) in enumerate(zip(pairs, counts, strict=True)):
            slopes = pair.laws.slopes(pair.resting if friction else {"gap": -pair.impact})
            rows = np.zeros((6 + len(pair.laws.states), len(matrix)))
            rows[:, 6 * k + 2] = slopes["gap"]
            rows[:, n + 6 * k : n + 6 * k + 6] = np.stack([slopes[name] for name in _VELOCITIES], axis=1) @ pair.motions
            for place, state in enumerate(pair.laws.states[:count]):
                rows[:, first + place] = slopes[state]
            acting = slice(0, 6) if friction else slice(2, 3)
            forces[6 * k : 6 * k + 6][acting] = rows[:6][acting]
            matrix[first : first + count] = rows[6 : 6 + count]
            sizes.append(float(np.linalg.norm(moved[:, 6 * k : 6 * k + 6] @ forces[6 * k : 6 * k + 6])))
            first += count
        matrix[n : 2 * n] = moved @ forces
        values = np.linalg.eigvals(matrix) if np.all(np.isfinite(matrix)) else np.zeros(0)
        return np.asarray(values), pairs[int(np.argmax(sizes))].name

    def _states_in_sliding(self, pair: _Closing) -> Array:
        """Return the eigenvalues, 1/s, of internal states that follow the slip of the start."""
        laws, begun = pair.laws, pair.laws.rates(pair.sliding)
        if not begun.any():
            return np.zeros(0)
        paths = np.geomspace(1e-9, 1e3, 400)[:, np.newaxis] * begun
        along = laws.rates({**pair.sliding, **dict(zip(laws.states, paths.T, strict=True))}) @ begun
        reached = paths[np.flatnonzero(along > 1e-3 * begun @ begun)[-1]]
        slopes = laws.slopes({**pair.sliding, **dict(zip(laws.states, reached.tolist(), strict=True))})
        return np.linalg.eigvals(np.array([slopes[name][6:] for name in laws.states]).T)

    def findings(self, unresolved: float, steady: float) -> Iterator[Finding]:
        """Yield a finding on the fastest motion in which explicit steps grow by more than ``steady``, else on the
        shortest impact, if its angular frequency times the step is above ``unresolved``."""
        if not self._closing:
            return
        step, growth = self._run.settings["step"], _growth(self._run.method)
        spectra = [
            ("normal force", *self._spectrum(friction=False)),
            ("friction", *self._spectrum(friction=True)),
            *(("friction", self._states_in_sliding(pair), pair.name) for pair in self._closing),
        ]
        every = [(abs(value), value, law, name) for law, values, name in spectra for value in values]
        if growing := [item for item in every if growth(step * item[1]) > steady]:
            # the normal force, the first, has its motions with friction too
            size, value, law, name = max(growing, key=lambda item: round(math.log(item[0]), 6))
            text = f"steps of {step:.3g} s grow with the {law} of the contact {name}"
            stable = step
            while growth(stable * value) > 0.0:
                stable *= 0.98
            hint = f"a step below {stable:.2g} s, or generalized_alpha"
            yield Finding(value=float(size), text=f"{text}, which has a rate of {size:.3g} 1/s", hint=hint)
            return
        frequency, rate, name = max((item.frequency, item.rate, item.name) for item in self._closing)
        if step * frequency > unresolved and rate:
            lasting = math.pi / frequency
            text = f"steps of {step:.3g} s do not resolve the impact at the contact {name} with {rate:.3g} m/s, which"
            hint = f"a step below {0.1 * lasting:.2g} s"
            yield Finding(value=frequency, text=f"{text} lasts {lasting:.2g} s", hint=hint)


def _gap(pair: PairMotion) -> float:
    return math.nan if pair.gap.constant is None else pair.gap.constant


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
