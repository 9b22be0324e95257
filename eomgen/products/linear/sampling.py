"""Linear models from sample to sample: inputs are held, so the exponential of a matrix is exact; the loop of a linear
model and its sampled states, from one common period to the next.

With delays the input that holds in a sample is first the input of an earlier sample, then the present one; an input
that was requested and does not act yet is a state (K. J. Åström and B. Wittenmark, Computer-Controlled Systems, 3rd ed.
1997, section 2.3). The integrals of a quadratic cost and of white noise over a sample follow C. F. Van Loan (Computing
integrals involving the matrix exponential, IEEE Transactions on Automatic Control 23, 1978).

Between samples s' = A s + B z_s, and the sampled states z_s stay; at a sample the states that are due take new values,
level by level. The product of these matrices over a common period is the monodromy matrix (Floquet; Francis and
Georgiou, Stability theory for linear time-invariant plants with periodic digital controllers, IEEE Transactions on
Automatic Control 33 (1988) 820).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from scipy.linalg import expm

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import COMPUTED
from eomgen.compiled.arguments import number_of
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.products.linear.freedom import Partials
from eomgen.products.linear.state_space import HasStateSpace, StateSpace, labels, state_space_of, with_more


def discretized(space: StateSpace | HasStateSpace, sample: float | str, delay: float | str = 0.0) -> StateSpace:
    """Return the exact model from sample to sample under inputs and disturbances that are held.

    Parameters
    ----------
    space : StateSpace or Linearization
        A model in continuous time.
    sample : float or str
        Time between two samples in s, or a text with a unit.
    delay : float or str, optional
        Time from a sample to when inputs take effect, of any length; disturbances are not delayed.

    Returns
    -------
    StateSpace
        Sampled; outputs are those right after a sample, when inputs that are not delayed are at work already. With a
        delay, inputs that wait are additional states, ``NAME_before``, ``NAME_before_2`` and so on.

    Raises
    ------
    UsageError
        A model that is sampled already, a time that is not positive, a delay that is negative or of more than 1000
        samples, motions that overflow within a sample.

    Examples
    --------
    >>> from eomgen.control import delay, discretized
    >>> discretized(delay("a", "b", 0.1), "10 ms").sample
    0.01
    """
    space = state_space_of(space)
    ns, nu = space.B.shape
    return sampled_with_cost(space, sample, delay, np.zeros((ns + nu, ns + nu)))[0]


def sampled_with_cost(
    space: StateSpace, sample: float | str, delay: float | str, cost: Array
) -> tuple[StateSpace, Array]:
    """Return the model from sample to sample, and the matrix of the cost [s, u]^T cost [s, u] integrated over a sample.

    Inputs that wait are states ``NAME_before``, ``NAME_before_2``, ... after the other states: the input of the
    previous sample, and so on.

    Parameters
    ----------
    space : StateSpace
        A model in continuous time.
    sample, delay : float or str
        Time between two samples, and delay of the inputs, in s or texts with units.
    cost : (ns + nu, ns + nu) ndarray
        Weights of states and inputs, per second.

    Raises
    ------
    UsageError
        As for ``discretized``.
    """
    period, late = number_of("sample", sample), number_of("delay", delay)
    if space.sample is not None:
        fault = f"the model is sampled already, every {space.sample:.6g} s [E0457]"
        raise UsageError(Problem("sample", fault, "the model in continuous time"))
    if not period > 0.0:
        fault = f"the time between two samples is {period:.6g} s [E0459]"
        raise UsageError(Problem("sample", fault, "a time above zero"))
    if not 0.0 <= late <= 1000 * period:
        fault = f"the delay is {late:.6g} s, and a sample lasts {period:.6g} s [E0458]"
        raise UsageError(Problem("delay", fault, "a delay from zero to 1000 samples"))
    whole = math.floor(late / period + COMPUTED)
    part = late - whole * period
    part = part if part > COMPUTED * period else 0.0
    ns, nu = space.B.shape
    nw = space.E.shape[1]
    waiting = whole + (part > 0.0)
    # of [s, w, past inputs from the newest to the oldest, u]: inputs acting at first, and from `part` on
    newest = ns + nw
    asked = newest + waiting * nu
    size = asked + nu
    inputs = [slice(asked, size), *(slice(newest + k * nu, newest + (k + 1) * nu) for k in range(waiting))]
    pieces = ((inputs[whole + 1], part), (inputs[whole], period - part)) if part else ((inputs[whole], period),)
    whole_step, total = np.eye(size), np.zeros((size, size))
    for at_work, duration in pieces:
        rates = np.zeros((size, size))
        rates[:ns, :ns], rates[:ns, ns:newest], rates[:ns, at_work] = space.A, space.E, space.B
        select = np.concatenate([np.eye(size)[:ns], np.eye(size)[at_work]])
        with np.errstate(over="ignore", invalid="ignore"):
            total += whole_step.T @ _cost_over(rates, select.T @ cost @ select, duration) @ whole_step
            whole_step = expm(rates * duration) @ whole_step
    if not (np.isfinite(whole_step).all() and np.isfinite(total).all()):
        fault = f"motions over {period:.6g} s are beyond all numbers [E2238]"
        raise UsageError(Problem("sample", fault, "a shorter time between two samples, or smaller weights"))
    kept = [*range(ns), *range(newest, asked)]
    A = np.zeros((ns + waiting * nu, ns + waiting * nu))
    B = np.zeros((len(A), nu))
    A[:ns], B[:ns] = whole_step[np.ix_(range(ns), kept)], whole_step[:ns, inputs[0]]
    if waiting:
        B[ns : ns + nu] = np.eye(nu)
        A[ns + nu :, ns:-nu] = np.eye((waiting - 1) * nu)
    E = np.zeros((len(A), nw))
    E[:ns] = whole_step[:ns, ns:newest]
    C, D = np.zeros((len(space.outputs), len(A))), np.zeros_like(space.D)
    C[:, :ns] = space.C
    if not waiting:
        D = space.D
    else:  # right after a sample, the input of `waiting` samples before is still at work
        C[:, ns + (waiting - 1) * nu :] = space.D
    order = [*kept, *range(asked, size)]
    named = _with_waiting_inputs(space, waiting)
    result = replace(named, A=A, B=B, E=E, C=C, D=D, sample=period, input_delay=late)
    return result, (total + total.T)[np.ix_(order, order)] / 2.0


def noise_over_a_sample(A: Array, intensity: Array, period: float) -> Array:
    """Return the covariance added in a sample by white noise of an intensity (ns, ns), in sdot = A s + noise."""
    return _cost_over(A.T, intensity, period)


def _cost_over(rates: Array, density: Array, duration: float) -> Array:
    """Return the integral over t from 0 to `duration` of e^(rates^T t) density e^(rates t), for matrices (n, n)."""
    size = len(rates)
    # the exponential of a short time squared up: over a long one the block with the opposite sign overflows
    halvings = max(0, math.ceil(math.log2(max(float(np.linalg.norm(rates, 1)) * duration, 1e-300))))
    short = math.ldexp(duration, -halvings)
    whole = expm(np.block([[-rates.T, density], [np.zeros_like(rates), rates]]) * short)
    step = whole[size:, size:]
    integral = step.T @ whole[:size, size:]
    for _ in range(halvings):
        integral = integral + step.T @ integral @ step
        step = step @ step
    return np.asarray((integral + integral.T) / 2.0)


def _with_waiting_inputs(space: StateSpace, waiting: int) -> StateSpace:
    """Return a model whose states include the inputs of ``waiting`` previous samples, by name, unit and reference
    value. The new states are ``NAME_before``, ``NAME_before_2`` and so on; matrices are unchanged and still to be
    set."""
    ends = {k: f"_before_{k}" if k > 1 else "_before" for k in range(1, waiting + 1)}
    named = {f"{name}{end}": (name, k) for k, end in ends.items() for name in space.inputs}
    more = with_more(space, {"states": labels(space, "inputs") * waiting})
    return replace(space, states=(*space.states, *named), waiting=named, **more)


#: Largest numerator and denominator of ratios of periods, and largest number of samples in a common period.
_MOST = 10_000


@dataclass(frozen=True)
class SampledPart:
    """Sampled states of a system, and the partial derivatives of the values that they take at samples.

    Attributes
    ----------
    names : (n,)
    places : (n,) indices among all internal states
    periods, offsets : (n,), s
    levels : (n,) order of updates at the same time
    by_q, by_v : (n, nv), by_z : (n, nz) of all internal states
    """

    names: tuple[str, ...]
    places: tuple[int, ...]
    periods: tuple[float, ...]
    offsets: tuple[float, ...]
    levels: tuple[int, ...]
    by_q: Array
    by_v: Array
    by_z: Array

    @property
    def others(self) -> list[int]:
        """Places of the internal states that are not sampled."""
        return [k for k in range(self.by_z.shape[1]) if k not in self.places]

    @property
    def common_period(self) -> float:
        """The least time that is a multiple of all periods, s. Raises ModelError if there is none that is short."""
        first = self.periods[0]
        ratios = [Fraction(period / first).limit_denominator(_MOST) for period in self.periods]
        pairs = zip(self.periods, ratios, strict=True)
        exact = all(abs(period - first * ratio) <= COMPUTED * period for period, ratio in pairs)
        whole = Fraction(math.lcm(*(of.numerator for of in ratios)), math.gcd(*(of.denominator for of in ratios)))
        if not exact or whole * sum(1 / of for of in ratios) > _MOST:
            listed = ", ".join(f"{period:.9g} s" for period in dict.fromkeys(self.periods))
            fault = f"the periods {listed} have no common multiple within {_MOST} samples [E0460]"
            raise ModelError(Problem("sampled loop", fault, "periods that are multiples of one another"))
        return first * float(whole)

    def samples(self) -> list[tuple[float, list[int]]]:
        """Return the sample times (s) within the common period from t = 0 on, each with the indices of the states due
        then."""
        end = self.common_period
        due: dict[int, list[int]] = {}
        for k, (period, offset) in enumerate(zip(self.periods, self.offsets, strict=True)):
            for number in range(round(end / period)):
                phase = ((offset + number * period) / end) % 1.0
                due.setdefault(round(phase / COMPUTED) % round(1.0 / COMPUTED), []).append(k)
        return [(phase * COMPUTED * end, due[phase]) for phase in sorted(due)]


def held_as_inputs(partials: Partials, part: SampledPart) -> Partials:
    """Return partials in which sampled states are inputs after the other inputs, and no longer internal states."""
    p, held, kept = partials, list(part.places), part.others
    return replace(
        p,
        B=np.hstack([p.B, -p.Rz[:, held]]),
        Rz=p.Rz[:, kept],
        Fq=p.Fq[kept],
        Fv=p.Fv[kept],
        Fz=p.Fz[np.ix_(kept, kept)],
        Fu=np.hstack([p.Fu[kept], p.Fz[np.ix_(kept, held)]]),
        Fw=p.Fw[kept],
        Yz=p.Yz[:, kept],
        Yu=np.hstack([p.Yu, p.Yz[:, held]]),
    )


def over_a_period(part: SampledPart, A: Array, B: Array, of_q: Array, of_v: Array) -> Array:
    """Return the matrix (ns + n, ns + n) that maps (s, z_s) over a common period.

    The period begins just before the samples at its start; s are the continuous states, z_s the n sampled states.

    Parameters
    ----------
    part : the sampled states
    A : (ns, ns), B : (ns, n) of the continuous part with z_s as inputs; internal states of this part are the last
        components of s
    of_q, of_v : (nv, ns) dq and dv by s
    """
    ns, n = B.shape
    rates = np.block([[A, B], [np.zeros((n, ns + n))]])
    z = np.zeros((part.by_z.shape[1], ns + n))
    places = [*part.others, *part.places]
    z[places, range(ns + n - len(places), ns + n)] = 1.0
    values = part.by_z @ z
    values[:, :ns] += part.by_q @ of_q + part.by_v @ of_v
    whole, now, end = np.eye(ns + n), 0.0, part.common_period
    for time, due in part.samples():
        whole = expm(rates * (time - now)) @ whole
        whole, now = _at_sample(part, values, due, ns) @ whole, time
    return np.asarray(expm(rates * (end - now)) @ whole)


def _at_sample(part: SampledPart, values: Array, due: Sequence[int], ns: int) -> Array:
    """Return the matrix (ns + n, ns + n) that maps (s, z_s) over a sample of the states `due`, level by level. `values`
    (n, ns + n) gives the new value of each sampled state by (s, z_s)."""
    whole = np.eye(values.shape[1])
    for level in sorted({part.levels[k] for k in due}):
        step = np.eye(values.shape[1])
        for k in due:
            if part.levels[k] == level:
                step[ns + k] = values[k]
        whole = step @ whole
    return whole
