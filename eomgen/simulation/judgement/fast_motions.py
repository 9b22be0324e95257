"""Motions that are excited and too fast for the steps of a run, which no comparison of longer steps shows.

Implicit steps damp motions that they do not resolve, and so do steps twice and four times as long: these agree, and
do not show the fast motion. So the equations are used: modes of M and K whose oscillation a step does not resolve, and
how large they swing, by two differences of accelerations along a tenth of a radian of the mode. A slow motion that
goes with the angular frequency w swings a mode of frequency W by w/W of its acceleration only, however it curves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.equations import accelerations, has_residual_partials, residual_partials
from eomgen.errors import EomgenError
from eomgen.lie import product
from eomgen.simulation.accuracy.motion_size import reach_of
from eomgen.simulation.stepping.events import parameters_over, parameters_with
from eomgen.simulation.stepping.run import Run

if TYPE_CHECKING:
    from eomgen.results.events import Events

#: Step times angular frequency above which a step does not resolve a mode, and the one that resolves it well.
UNRESOLVED, RESOLVED = 1.0, 0.3
#: Part of the accelerations, by kinetic energy, from which on an excited mode is reported; relative to the larger one
#: of the accelerations there and this quantile of the record, which is not zero if a run begins at rest.
NOTICED, _USUAL = 0.1, 0.9
#: Factor by which an event or a jump must enlarge the oscillation of a mode to have excited it.
_EXCITED = 3.0
#: Deflections of a mode below this part of the coordinates, or of 1 rad, are rounding.
_ROUNDING = 1e-12
#: Angle of the mode that differences of accelerations span, rad.
_SPAN = 0.1
#: Events and jumps that are looked at, at most, and modes of each.
_PLACES, _MODES = 16, 8
#: Singular values of B below this part of the largest belong to rows that repeat others.
_RANK = 1e-10


class _Place(NamedTuple):
    """A state (q, v, z) that a run starts at or goes on from, in words, with the parameters p (np,) that hold there;
    the one before, with its own, and whether formulas jump there in time."""

    words: str
    t: float
    q: Array
    v: Array
    z: Array
    p: Array
    before: tuple[Array, Array, Array, Array] | None = None
    jump: bool = False


class _Swing(NamedTuple):
    """A mode that swings: its part of the accelerations, its angular frequency in 1/s, its dominating velocity."""

    share: float
    frequency: float
    name: str


def unresolved_motion(run: Run, rows: Array, step: float, events: Events | None, acting: Array, jumps: Array) -> str:
    """Return a sentence on an excited motion that is too fast for an implicit method's steps, with a remedy; empty if
    there is none.

    Parameters
    ----------
    rows : (n, width) of the record
    step : s, that the run takes on an average
    events, acting : of the run, and times of the events that changed the motion
    jumps : times of known jumps, s
    """
    if not run.method.implicit or not has_residual_partials(run.model) or not run.model.nv:
        return ""  # explicit methods do not damp the fast motions of a stable step: runs at other steps differ
    first = 1 + run.model.nq + run.model.nv
    accelerations = rows[:, first : first + run.model.nv]
    for place in _places(run, rows, events, acting, jumps):
        try:
            result = _Modes(run, place, step, accelerations).largest()
        except (EomgenError, np.linalg.LinAlgError, ValueError):  # states at which the equations give no numbers
            continue
        if result is not None:
            return _sentence(place.words, result, run, step)
    return ""


def _sentence(words: str, swing: _Swing, run: Run, step: float) -> str:
    hertz, period = swing.frequency / (2.0 * math.pi), 2.0 * math.pi / swing.frequency
    text = (
        f"{words} excites a motion of {swing.name} at {hertz:.3g} Hz, whose period of {period:.2g} s steps of"
        f" {step:.2g} s do not resolve: accelerations, forces and outputs made of them follow the slow motion alone,"
        " and the estimated error need not count the fast one"
    )
    finer = f"a step of {RESOLVED / swing.frequency:.2g} s"
    if run.method.chooses_steps:
        finer = f"a tolerance smaller than {run.settings['tolerance']:.3g}"
    return f"{text}; try: {finer}, or a start in which stiff parts are in balance"


def _places(run: Run, rows: Array, events: Events | None, acting: Array, jumps: Array) -> list[_Place]:
    model = run.model
    ends = np.cumsum([1, model.nq, model.nv, model.nv, len(model.multipliers)])
    t, q, v, _, _, z = np.split(rows, ends, axis=1)
    times, result = t[:, 0], []
    if times[0] == run.grid.start:
        result.append(_Place("the start", float(times[0]), q[0], v[0], z[0], run.parameters))
    if events is not None:
        held = run.parameters
        for record in [item for item in events if item.t in acting and item.t < run.grid.end][:_PLACES]:
            words = f"the event {record.name} at t = {record.t:.6g} s"
            before = record.q_before, record.v_before, record.z_before, held
            held = parameters_with(events, model, run.parameters, record.modes)
            result.append(_Place(words, record.t, record.q, record.v, record.z, held, before))
    for jump in np.setdiff1d(jumps, acting)[:_PLACES]:
        row = int(np.argmin(np.abs(times - jump)))
        if 0 < row < len(times) - 1 and abs(times[row] - jump) < 1e-6 * run.settings["step"]:
            state = q[row], v[row], z[row], parameters_over(events, model, run.parameters, times[row])
            result.append(_Place(f"the jump at t = {jump:.6g} s", float(jump), *state, before=state, jump=True))
    return result


@dataclass(frozen=True)
class _Modes:
    """Modes about a state of a run in steps that do not resolve all of them; accelerations (n, nv) of its record."""

    run: Run
    place: _Place
    step: float
    accelerations: Array

    def largest(self) -> _Swing | None:
        """Return the mode with the largest oscillation; None if no oscillation is noticeable."""
        place, result = self.place, []
        frequencies, forms, mass = self._unresolved()
        energies = np.einsum("ni,ij,nj->n", self.accelerations, mass, self.accelerations)
        usual = float(np.quantile(np.sqrt(np.maximum(energies, 0.0)), _USUAL))
        for frequency, form in list(zip(frequencies, forms.T, strict=True)):
            span = _SPAN / frequency
            later = 0.05 * span if place.jump else 0.0
            swing, size = self._swing(
                (place.q, place.v, place.z, place.p), place.t + later, span, frequency, mass @ form, mass
            )
            size = max(size, usual)
            deflections = swing / frequency**2 * np.abs(form)
            rounding = _ROUNDING * reach_of(self.run.model, place.q)
            if not (swing > NOTICED * size and np.any(deflections > rounding)):
                continue
            if place.before is not None:
                earlier = place.t - 2.05 * span if place.jump else place.t
                before, _ = self._swing(place.before, earlier, span, frequency, mass @ form, mass)
                if not swing > _EXCITED * before:
                    continue
            energy = form * (mass @ form)
            name = self.run.model.v_names[int(np.argmax(energy))]
            result.append(_Swing(swing / size, frequency, name))
        return max(result, default=None)

    def _unresolved(self) -> tuple[Array, Array, Array]:
        """Return angular frequencies (m,), forms (nv, m) of unit kinetic energy, and M, of modes that oscillate too
        fast; the fastest first."""
        model, (_, t, q, v, z, p, *_) = self.run.model, self.place
        u = self._inputs(t)
        a, multipliers = self._accelerations((q, v, z, p), t)
        held = {"multipliers": multipliers} if model.multipliers else {}
        K, C, M = residual_partials(model, q, v, a, t, u, z=z, parameters=p, **held)
        mass = 0.5 * (M + M.T)
        free = np.eye(model.nv)
        if model.multipliers:
            rows = np.atleast_2d(next(iter(model.evaluate("constraint_jacobian", q, t=t, parameters=p).values())))
            _, sizes, directions = np.linalg.svd(rows)
            free = directions[int(np.sum(sizes > _RANK * sizes[0])) :].T
        root = np.linalg.cholesky(free.T @ mass @ free)
        basis = np.linalg.solve(root, free.T).T  # basis^T M basis = 1
        stiffness = basis.T @ K @ basis
        squares, vectors = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
        forms = basis @ vectors
        frequencies = np.sqrt(np.maximum(squares, 0.0))
        decay = 0.5 * np.einsum("im,ij,jm->m", forms, C, forms)
        places = np.flatnonzero((frequencies * self.step > UNRESOLVED) & (decay * self.step < UNRESOLVED))[::-1]
        moved = np.abs(forms.T @ mass @ a)[places]
        moved = np.maximum(moved, np.abs(forms.T @ mass @ v)[places] * frequencies[places])
        places = places[np.argsort(-moved)[:_MODES]]
        return frequencies[places], forms[:, places], mass

    def _swing(
        self,
        state: tuple[Array, Array, Array, Array],
        t: float,
        span: float,
        frequency: float,
        weights: Array,
        mass: Array,
    ) -> tuple[float, float]:
        """Return the amplitude of a mode's acceleration and the size of all, in roots of kinetic energy per s.

        An oscillation of amplitude A has the second derivative -W^2 A cos and the first one -W A sin.
        """
        model, (q, v, z, p) = self.run.model, state
        seen = []
        a, _ = self._accelerations(state, t)
        for number in range(1, 3):
            seen.append(a)
            q, half = product.update(model.factors, q, span * v + 0.5 * span**2 * a), v + 0.5 * span * a
            next_a, _ = self._accelerations((q, v + span * a, z, p), t + number * span)
            v, a = half + 0.5 * span * next_a, next_a
        seen.append(a)
        along = [float(weights @ one) for one in seen]
        second = (along[0] - 2.0 * along[1] + along[2]) / (span * frequency) ** 2
        first = (along[2] - along[0]) / (2.0 * span * frequency)
        swing = math.hypot(first, second)
        size = max(swing, *(math.sqrt(max(float(one @ mass @ one), 0.0)) for one in seen))
        return swing, size

    def _accelerations(self, state: tuple[Array, Array, Array, Array], t: float) -> tuple[Array, Array]:
        model, u, (q, v, z, p) = self.run.model, self._inputs(t), state
        if model.multipliers:
            a, multipliers = model.constrained_dynamics(q, v, t, u, z=z, parameters=p)
            return a, multipliers
        return accelerations(model, q, v, t, u, z=z, parameters=p), np.empty(0)

    def _inputs(self, t: float) -> Array | None:
        return self.run.signals.rows(np.array([t]))[0] if self.run.takes_rows else None
