"""Steps of methods, each written once as operations on values: for C with second derivatives
(``products.optimisers.discrete_steps``), and for linear steps of runs side by side (``linear_operations``).

Operations are calls of functions of the model, sums, and functions of the configuration group. With unknowns, a step
has equations that are zero in a solution.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Generic, NamedTuple, Protocol, Self, TypeVar


class Parted(Protocol):
    """Consecutive values."""

    def part(self, start: int, size: int) -> Self:
        """Return some of the values."""


V = TypeVar("V", bound=Parted)
#: Shares of a step at which generalized-alpha evaluates accelerations to start, and weights of these in h d vdot/dt.
STAGES, WEIGHTS = (0.0, 0.5, 1.0), (-3.0, 4.0, -1.0)


class StepTerm(NamedTuple, Generic[V]):
    """The term factor h^power times some values in a sum, with h the length of the step."""

    factor: float
    value: V
    power: int = 0


class StepOperations(ABC, Generic[V]):
    """Operations of which a step consists, on values of some kind.

    Attributes
    ----------
    nv, nz, nl : numbers of velocities, internal states and multipliers
    q, v, z : at the start
    unknowns : by name
    equations : values that are zero in a solution
    """

    nv: int
    nz: int
    nl: int
    q: V
    v: V
    z: V
    unknowns: dict[str, V]
    equations: list[V]

    @abstractmethod
    def call(self, name: str, **state: V) -> V:
        """Return the result of a function of the model. ``state`` are values of its arguments by block; inputs,
        parameters and time are the step's unless given."""

    @abstractmethod
    def sum(self, *terms: StepTerm[V]) -> V:
        """Return a sum of terms of equal size."""

    @abstractmethod
    def time(self, share: float) -> V:
        """Return the time after a share of the step."""

    @abstractmethod
    def update(self, q: V, increment: V) -> V:
        """Return q o exp(increment)."""

    @abstractmethod
    def increment_rate(self, increment: V, v: V) -> V:
        """Return the rate of an increment at a velocity, up to two brackets."""

    @abstractmethod
    def cotangent(self, increment: V, momentum: V) -> V:
        """Return a momentum, taken along an increment."""

    @abstractmethod
    def balance(self, state: Mapping[str, V], impulse: V, *terms: StepTerm[V]) -> None:
        """Add the equation that the sum of terms and the reactions of an impulse at a state is zero."""

    @abstractmethod
    def ends_with(self, q: V, v: V, z: V) -> None:
        """Set the end of the step."""

    def project(self, q: V, v: V, z: V, share: float) -> tuple[V, V]:
        """Return q and v after a share of an explicit step, on the constraints; as they are without constraints."""
        return q, v

    def rate_of_states(self, **state: V) -> V:
        """Return the rates of the internal states; no values without states."""
        return self.call("internal_rate", **state) if self.nz else self.z


def runge_kutta(step: StepOperations[V], method: Any) -> None:
    """Take an explicit Runge-Kutta step in the Lie algebra, whose increments start at zero. The method has coefficients
    A, b and c."""
    slopes: list[tuple[V, V, V]] = []

    def move(weights: Sequence[Any], share: float) -> tuple[V, V, V, V]:
        """Return the increment, q, v and z after a share of the step, for weights of the slopes so far."""
        used = [(float(weight), slope) for weight, slope in zip(weights, slopes, strict=False) if weight]
        of_theta, of_v, of_z = ([StepTerm(weight, slope[k], 1) for weight, slope in used] for k in range(3))
        theta, v = step.sum(*of_theta), step.sum(StepTerm(1.0, step.v), *of_v)
        z = step.sum(StepTerm(1.0, step.z), *of_z)
        return theta, *step.project(step.update(step.q, theta), v, z, share), z

    for row, share in zip(method.A, map(float, method.c), strict=True):
        theta, q, v, z = move(row, share) if slopes else (step.v, step.q, step.v, step.z)
        state = {"q": q, "v": v, "z": z, "t": step.time(share)}
        rate = step.increment_rate(theta, v) if slopes else v
        slopes.append((rate, step.call("forward_dynamics", **state), step.rate_of_states(**state)))
    step.ends_with(*move(method.b, 1.0)[1:])


def composition(step: StepOperations[V], method: Any) -> None:
    """Take a step of a symplectic composition of kicks and drifts."""
    parts, q, v = method.composition, step.q, step.v
    for number, (kick, time) in enumerate(zip(parts.kicks, parts.kick_times, strict=True)):
        a = step.call("forward_dynamics", q=q, v=v, t=step.time(float(time)))
        v = step.sum(StepTerm(1.0, v), StepTerm(float(kick), a, 1))
        if number < len(parts.drifts):
            q = step.update(q, step.sum(StepTerm(float(parts.drifts[number]), v, 1)))
    step.ends_with(q, v, step.z)


def variational_unknowns(nv: int, nl: int, nz: int) -> dict[str, int]:
    """Return the numbers of unknowns of a RATTLie step by name: mean velocity, velocity at the end, impulses at both
    ends, and internal states."""
    return {"mean": nv, "first": nl, "v_next": nv, "last": nl, "z_next": nz}


def variational(step: StepOperations[V]) -> None:
    """Take a RATTLie step: momenta are moved along half an increment from each end to the middle, and constraints have
    impulses at both ends.

    With theta = h w, w the mean velocity, C(theta) = T(theta)^-T, m = (p(q, w) + p(q', w))/2 and R = dT/dq + Q
    (``integrators.families.rattlie``):

        C(-theta) m - p(q, v) - h/2 R(q, w, z) + B(q)^T mu = 0,        Phi(q') = 0,
        p(q', v') - C(theta) m - h/2 R(q', w, z') + B(q')^T mu' = 0,   B(q') v' + Phi_t = 0,
        z - z' + h/2 (F(q, w, z) + F(q', w, z')) = 0.
    """
    nv, mean, v, z = step.nv, *(step.unknowns[name] for name in ("mean", "v_next", "z_next"))
    increment = step.sum(StepTerm(1.0, mean, 1))
    start, end = {"q": step.q, "z": step.z}, {"q": step.update(step.q, increment), "z": z, "t": step.time(1.0)}
    momenta = [step.call("momenta", **state) for state in ({**start, "v": mean}, {**end, "v": mean})]
    middle = step.sum(*(StepTerm(0.5, momentum.part(0, nv)) for momentum in momenta))
    back = step.cotangent(step.sum(StepTerm(-1.0, mean, 1)), middle)
    for state, velocity, moved, rate, impulse, sign in (
        (start, step.v, back, momenta[0], "first", -1.0),
        (end, v, step.cotangent(increment, middle), momenta[1], "last", 1.0),
    ):
        momentum = step.call("momenta", **{**state, "v": velocity}).part(0, nv)
        terms = StepTerm(sign, momentum), StepTerm(-sign, moved), StepTerm(-0.5, rate.part(nv, nv), 1)
        step.balance(state, step.unknowns[impulse], *terms)
    if step.nl:
        step.equations += [step.call(name, **{**end, "v": v}) for name in ("constraint", "constraint_velocity")]
    if step.nz:
        slopes = [StepTerm(0.5, step.rate_of_states(**{**state, "v": mean}), 1) for state in (start, end)]
        step.equations.append(step.sum(StepTerm(1.0, step.z), StepTerm(-1.0, z), *slopes))
    step.ends_with(end["q"], v, z)
