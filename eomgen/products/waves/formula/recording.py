"""Recording of waves on the tape: sums over components are loops (``Map``), and so are their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.products.waves.formula.fields import WORDS, WaveField, in_quadrature
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.operations import Op
from eomgen.symbolic.periodic import harmonic_sum
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Tape


def wave_quantity(algebra: Algebra, waves: WaveField, name: str, component: int, arguments: Sequence[Scalar]) -> Scalar:
    """Record a quantity of waves on the tape and return the scalar; ``name`` and ``component`` as of
    ``WaveField.value``. ``arguments`` are x, y, z (if the quantity depends on z), t, and the values of
    ``waves.extra_arguments``."""
    count = len(WORDS[name].arguments)
    position, t, extra_values = arguments[:count], arguments[count], arguments[count + 1 :]
    grown, growing = _growth(algebra, waves, t)
    result = grown * _full(algebra, waves, name, component, position, t, extra_values)
    if name != "water_acceleration" or waves.ramp == 0.0:
        return result
    return result + growing * _full(algebra, waves, "water_velocity", component, position, t, extra_values)


def wave_value(waves: WaveField, name: str, component: int, *arguments: ArrayLike) -> Array:
    """Return a quantity of waves at arguments as of ``WaveField.value``, by the recorded operations."""
    numbers = np.stack(np.broadcast_arrays(*(np.asarray(item, dtype=float) for item in arguments)), axis=-1)
    algebra = Algebra(Tape())
    result = wave_quantity(algebra, waves, name, component, algebra.block("x", numbers.shape[-1]))
    return np.asarray(evaluate(algebra.tape, [result.ref], {"x": numbers})[..., 0])


def _growth(algebra: Algebra, waves: WaveField, t: Scalar) -> tuple[Scalar, Scalar]:
    """Return the factor of the amplitudes during the ramp, and the rate of this factor in 1/s."""
    if waves.ramp == 0.0:
        return algebra.one, algebra.zero
    s = algebra.call(Op.MIN, algebra.call(Op.MAX, t * (1.0 / waves.ramp), algebra.zero), algebra.one)
    rest = s * (1.0 - s)
    share = (s * s) * (s * s) * (35.0 - s * (84.0 - s * (70.0 - s * 20.0)))
    return share, (140.0 / waves.ramp) * (rest * rest * rest)


def _full(
    algebra: Algebra,
    waves: WaveField,
    name: str,
    component: int,
    position: Sequence[Scalar],
    t: Scalar,
    extra_values: Sequence[Scalar],
) -> Scalar:
    """Return a quantity of waves without the ramp, as a loop over the waves; ``position`` has x, y and perhaps z,
    ``extra_values`` the values of ``extra_arguments``. At a constant place the result is a sum of harmonics of time."""
    column, factors = waves.columns, waves.factors(name, component)
    quadrature = in_quadrature(name, component)
    if not any(factors):
        return algebra.zero
    label = f"{name.replace('_', ' ')} of {waves.name}, wave by wave"
    x, y = (item.constant for item in position[:2])
    scale = algebra.one if waves.factor is None else extra_values[0]  # of a sum over free waves
    plain = not waves.variables and (waves.factor is None or not np.any(waves.bound))
    if len(position) == 2 and x is not None and y is not None and plain:
        # at a place that rests: harmonics of time alone
        angle = np.array(column["kx"]) * x + np.array(column["ky"]) * y + np.array(column["phase"])
        if quadrature:
            angle = angle - 0.5 * np.pi
        columns = (np.array(factors) * np.cos(angle), np.array(column["w"]), np.array(factors) * np.sin(angle))
        loop = harmonic_sum([tuple(item.tolist()) for item in columns], t.ref, label)
        return scale * Scalar(algebra.tape, add_map(algebra.tape, loop).sums[0])
    kernel = _WaveKernel()
    angle_now = kernel.column(column["phase"]) - kernel.column(column["w"]) * kernel.share(t)
    for letter, item in zip(("kx", "ky"), position[:2], strict=True):
        if any(column[letter]):
            angle_now = angle_now + kernel.column(column[letter]) * kernel.share(item)
    variables = extra_values[-len(waves.variables) :]
    term = kernel.column(factors) * _wave(algebra, kernel, waves, angle_now, variables, quadrature=quadrature)
    if len(position) > 2:
        z = kernel.share(_motion_height(algebra, waves, position, t, extra_values))
        depth = kernel.column(column["k"]) * z
        if not any(column["bottom"]):
            e = kernel.algebra.call(Op.EXP, depth)
        else:
            # far below the surface, without waves, the exponential stays above 0: b is divided by it
            e = kernel.algebra.call(Op.EXP, kernel.algebra.call(Op.MAX, depth, kernel.algebra.scalar(-300.0)))
            reflected = kernel.column(column["bottom"]) / e
            e = e + reflected if component < 2 else e - reflected
        term = term * e
    if not plain and waves.factor is not None and np.any(waves.bound):
        # once for a free wave, twice for a bound one
        factor = kernel.share(extra_values[0])
        bound = kernel.column(tuple(waves.bound.astype(float).tolist()))
        term, scale = term * factor * (bound * (factor - 1.0) + 1.0), algebra.one
    return scale * Scalar(algebra.tape, add_map(algebra.tape, kernel.loop(term, len(factors), label)).sums[0])


def _wave(
    algebra: Algebra, kernel: _WaveKernel, waves: WaveField, angle: Scalar, z: Sequence[Scalar], *, quadrature: bool
) -> Scalar:
    """Return the real part of a wave in the kernel, or the imaginary one for ``quadrature``: cos or sin of the angle,
    and with variables ``z`` times the complex factors that they make."""
    call = kernel.algebra.call
    if not waves.variables:
        return call(Op.SIN if quadrature else Op.COS, angle)
    first, second, signs = zip(*waves.drawn, strict=True)
    re, im = (kernel.gather([z[2 * i + part] for i in first]) for part in (0, 1))
    if max(second) >= 0:
        unity = [algebra.one, algebra.zero]
        x, y = (kernel.gather([unity[part] if j < 0 else z[2 * j + part] for j in second]) for part in (0, 1))
        y = y * kernel.column(tuple(float(sign) for sign in signs))
        re, im = re * x - im * y, re * y + im * x
    cosine, sine = call(Op.COS, angle), call(Op.SIN, angle)
    return re * sine + im * cosine if quadrature else re * cosine - im * sine


def _motion_height(
    algebra: Algebra, waves: WaveField, position: Sequence[Scalar], t: Scalar, extra_values: Sequence[Scalar]
) -> Scalar:
    """Return the height above the water at rest, m, at which motion at a place is taken, between bottom and surface and
    changed by stretching."""
    eta = wave_quantity(algebra, waves, "elevation", 0, [*position[:2], t, *extra_values])
    highest = algebra.call(Op.MAX, eta, algebra.zero) if waves.stretching == "none" else eta
    z = algebra.call(Op.MIN, position[2] - waves.level, highest)
    if not np.isinf(waves.depth):
        z = algebra.call(Op.MAX, z, algebra.scalar(-waves.depth))
    if waves.stretching == "none":
        return z
    return z - eta if np.isinf(waves.depth) else (z - eta) / (1.0 + eta * (1.0 / waves.depth))


class _WaveKernel:
    """The tape of one term of a loop over waves, with inputs that differ from wave to wave or are shared, added at
    first use."""

    def __init__(self) -> None:
        self.tape = Tape()
        self.algebra = Algebra(self.tape)
        self.inputs: dict[str, dict[Any, Scalar]] = {"element": {}, "shared": {}, "gather": {}}

    def _input(self, kind: str, key: Any) -> Scalar:
        known = self.inputs[kind]
        if key not in known:
            known[key] = Scalar(self.tape, self.tape.input(kind, len(known)))
        return known[key]

    def column(self, values: tuple[float, ...]) -> Scalar:
        """Return an input of the kernel for numbers that differ from wave to wave; a constant if all are equal."""
        return self.algebra.scalar(values[0]) if len(set(values)) == 1 else self._input("element", values)

    def share(self, value: Scalar) -> Scalar:
        """Return an input of the kernel for a scalar of the outer tape that is the same for all waves; a constant for a
        constant."""
        constant = value.constant
        return self._input("shared", value.ref) if constant is None else self.algebra.scalar(constant)

    def gather(self, values: Sequence[Scalar]) -> Scalar:
        """Return an input of the kernel for scalars of the outer tape, one for each wave."""
        return self._input("gather", tuple(value.ref for value in values))

    def loop(self, term: Scalar, count: int, label: str) -> Map:
        """Return the loop that sums a term over the waves."""
        elements, shared, gather = map(tuple, self.inputs.values())
        return Map(self.tape, count, elements, shared, gather, sums=(term.ref,), label=label)
