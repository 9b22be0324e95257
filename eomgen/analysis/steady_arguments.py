"""Arguments of a steady motion, checked: velocities and coordinates by name, against their drives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.text import distinct, shown
from eomgen.compiled.arguments import check_finite, check_name, components, numbers
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

Mask = NDArray[np.bool_]
#: Part of a velocity by which its drive's may differ.
_SAME = 1e-7


def named_values(
    model: CompiledModel, q: Array, velocities: Mapping[str, float] | None, coordinates: Mapping[str, ArrayLike] | None
) -> tuple[Array, Mask, Array, Mask]:
    """Return q with the coordinates given put in, which components are held there, v, and which of its components are
    given.

    Raises
    ------
    UsageError
        Unknown names, components of a rotation, values that are not finite numbers or not as many as are needed.
    """
    q, v = q.copy(), np.zeros(model.nv)
    held_q, held_v = np.zeros(model.nv, dtype=bool), np.zeros(model.nv, dtype=bool)
    names = [name.removeprefix("v.") for name in model.v_names]
    for quantity, given in (("velocities", velocities), ("coordinates", coordinates)):
        if given is not None and not isinstance(given, Mapping):
            raise UsageError(
                Problem(
                    quantity, f"a mapping is needed, not {type(given).__name__}", f'{quantity}={{"{names[0]}": 2.0}}'
                )
            )
    for name, value in (velocities or {}).items():
        if str(name).startswith("q."):
            fault = f"{shown(str(name))} is a position, and a velocity is given here"
            raise UsageError(Problem("velocities", fault, f'coordinates={{"{str(name)[2:]}": ...}}'))
        check_name("component", str(name).removeprefix("v."), names)
        k = names.index(name.removeprefix("v."))
        v[k], held_v[k] = _number(f"velocity {name}", value), True
    joints = {factor.name: factor for factor in model.factors}
    single = {
        label: (factor.q_start + k, factor.v_start + k)
        for factor in model.factors
        if factor.group == "R"
        for k, label in enumerate(names[factor.v])
    }
    for name, numbers_of in (coordinates or {}).items():
        if name in single:
            index, component = single[name]
            q[index], held_q[component] = _number(f"coordinate {name}", numbers_of), True
            continue
        check_name("coordinate or joint", name, [*single, *(joint for joint in joints if joint not in single)])
        factor = joints[name]
        q[factor.q] = components(f"coordinates {name}", numbers_of, factor.q_size)
        held_q[factor.v] = True
    check_finite("coordinates", q, model.q_names)
    q = model.evaluator.configuration(q)
    return q, held_q, v, held_v


def check_drives(model: CompiledModel, driven: Mapping[str, float], v: Array) -> None:
    """Raise UsageError if a given velocity, (nv,), differs from the rate of a drive of the same component."""
    for name, value, unit in zip(model.v_names, v.tolist(), model.v_units, strict=True):
        rate = driven.get(name.removeprefix("v."), value)
        if abs(rate - value) > _SAME * max(abs(rate), abs(value)):
            law_rate, given = distinct(rate, value)
            fault = f"it is driven at {law_rate} {unit}, and {given} {unit} is given"
            hint = 'a tunable parameter in the law, drive = "w*t", and the value as that parameter\'s; or no drive'
            raise UsageError(Problem(f"velocity {name.removeprefix('v.')}", fault, hint))


def _number(name: str, value: ArrayLike) -> float:
    array = numbers(name, value)
    if array.ndim:
        raise UsageError(Problem(name, f"one number is needed, not an array of shape {array.shape}"))
    check_finite(name, array)
    return float(array)
