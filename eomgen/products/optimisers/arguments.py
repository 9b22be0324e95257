"""Arguments in which terms of a model have derivatives; tangents of configurations, for arrays of JAX and of PyTorch.

A change dq of the components of q turns the body, and a change of the length of a quaternion does not count:
with w and x of the quaternion, and n its squared length, the body-frame rotation is 2 (w dx - dw x - x cross dx)/n.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from eomgen.compiled.model import CompiledModel
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.lie.product import Factor
from eomgen.system.terms import ARGUMENTS, TERMS

Array = Any
#: Terms that are offered as differentiable functions.
OFFERED = ("inverse_dynamics", "forward_dynamics")


def arguments_of(name: str) -> list[str]:
    """Return the arguments in which a term has derivatives, q first."""
    return [block for block in ARGUMENTS if block in TERMS[f"{name}_derivatives"].inputs]


def check_model(place: str, model: object) -> None:
    """Raise UsageError for anything but a compiled model, and ModelError for a model with force laws in Python."""
    if not isinstance(model, CompiledModel):
        raise UsageError(Problem(place, f"a model is needed, not {type(model).__name__}", "eomgen.build(scene)"))
    if model.library.layout.get("python"):
        raise ModelError(Problem(place, f"{model.name} has force laws in Python", "the laws in C, [laws] source"))


def of_run(
    q: Array, v: Array, parameters: object, inputs: object, array: Callable[[str, Any], Array]
) -> dict[str, Any]:
    """Return the arguments of a run in which derivatives are taken, nested; ``array`` makes each. Raises UsageError."""
    given: dict[str, Any] = {"q": None if q is None else array("q", q), "v": None if v is None else array("v", v)}
    for block, values in (("parameters", parameters), ("inputs", inputs)):
        if not (values is None or isinstance(values, Mapping)):
            fault = f"a mapping from names to values is needed, not {type(values).__name__}"
            raise UsageError(Problem(block, fault, f"{block}={{name: value}}"))
        given[block] = {name: array(name, value) for name, value in (values or {}).items()}
    return given


def no_array(name: str, value: object) -> UsageError:
    """Return the error for an argument without real numbers."""
    return UsageError(
        Problem(name, f"an array of real numbers is needed, not {type(value).__name__}", "a list of numbers")
    )


def left_trivialised(arrays: Any, factors: Sequence[Factor], q: Array, dq: Array) -> Array:
    """Return the left-trivialised tangent (..., nv) of a change dq (..., nq) at q (..., nq).

    Parameters
    ----------
    arrays : ``jax.numpy`` or ``torch``
    """
    parts = []
    for factor in factors:
        of_q, of_dq = q[..., factor.q], dq[..., factor.q]
        if factor.group == "R":
            parts.append(of_dq)
            continue
        w, x, dw, dx = of_q[..., :1], of_q[..., 1:4], of_dq[..., :1], of_dq[..., 1:4]
        cross = arrays.linalg.cross
        parts.append(2.0 * (w * dx - dw * x - cross(x, dx)) / (w * w + (x * x).sum(-1)[..., None]))
        if factor.group == "SE3":
            turned = of_dq[..., 4:7]
            parts.append(turned - 2.0 * w * cross(x, turned) + 2.0 * cross(x, cross(x, turned)))
    return arrays.concatenate(parts, -1)


def gradient_in_components(arrays: Any, factors: Sequence[Factor], q: Array, gradient: Array) -> Array:
    """Return the gradient (..., nq) in the components of q of a left-trivialised gradient (..., nv).

    The transposed map of ``left_trivialised``.

    Parameters
    ----------
    arrays : ``jax.numpy`` or ``torch``
    """
    parts = []
    for factor in factors:
        of_q, of_v = q[..., factor.q], gradient[..., factor.v]
        if factor.group == "R":
            parts.append(of_v)
            continue
        w, x, g = of_q[..., :1], of_q[..., 1:4], of_v[..., :3]
        cross = arrays.linalg.cross
        length = w * w + (x * x).sum(-1)[..., None]
        parts += [-2.0 * (x * g).sum(-1)[..., None] / length, 2.0 * (w * g + cross(x, g)) / length]
        if factor.group == "SE3":
            moved = of_v[..., 3:6]
            parts.append(moved + 2.0 * w * cross(x, moved) + 2.0 * cross(x, cross(x, moved)))
    return arrays.concatenate(parts, -1)


def bracket(arrays: Any, d: Array) -> Array:
    """Return the matrix of the bracket with d: (..., 3, 3) of a rotation, (..., 6, 6) of a pose, angular first."""
    zero = arrays.zeros_like(d[..., 0])

    def crossing(x: Array) -> Array:
        rows = [[zero, -x[..., 2], x[..., 1]], [x[..., 2], zero, -x[..., 0]], [-x[..., 1], x[..., 0], zero]]
        return arrays.stack([arrays.stack(row, -1) for row in rows], -2)

    first = crossing(d[..., :3])
    if d.shape[-1] == 3:
        return first
    top = arrays.concatenate([first, arrays.zeros_like(first)], -1)
    return arrays.concatenate([top, arrays.concatenate([crossing(d[..., 3:]), first], -1)], -2)
