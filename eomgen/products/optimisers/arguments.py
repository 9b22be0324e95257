"""Arguments by which a model's terms are differentiated, and tangents of configurations as arrays of JAX and PyTorch.

A change dq of the components of q turns the body, and a change of the length of a quaternion does not count:
with w and x of the quaternion, and n its squared length, the body-frame rotation is 2 (w dx - dw x - x cross dx)/n.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from eomgen.compiled.argument_derivatives import size_of
from eomgen.compiled.model import CompiledModel
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.lie.product import Factor
from eomgen.system.terms import ARGUMENTS, TERMS

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model

Array = Any
#: Terms that are offered as differentiable functions.
OFFERED = ("inverse_dynamics", "forward_dynamics")


def arguments_of(name: str) -> list[str]:
    """Return the arguments in which a term has derivatives, q first."""
    return [block for block in ARGUMENTS if block in TERMS[f"{name}_derivatives"].inputs]


def run_arguments(
    q: Array, v: Array, parameters: object, inputs: object, array: Callable[[str, Any], Array]
) -> dict[str, Any]:
    """Return the arguments of a run in which derivatives are taken: ``q`` and ``v``, or None, and ``parameters`` and
    ``inputs`` by name. `array` makes an array from a name and a value. Raises UsageError for parameters or inputs that
    are not mappings."""
    arguments: dict[str, Any] = {"q": None if q is None else array("q", q), "v": None if v is None else array("v", v)}
    for block, values in (("parameters", parameters), ("inputs", inputs)):
        if not (values is None or isinstance(values, Mapping)):
            fault = f"a mapping from names to values is needed, not {type(values).__name__} [E0526]"
            raise UsageError(Problem(block, fault, f"{block}={{name: value}}"))
        arguments[block] = {name: array(name, value) for name, value in (values or {}).items()}
    return arguments


def no_array(name: str, value: object) -> UsageError:
    """Return the error for an argument without real numbers."""
    return UsageError(
        Problem(name, f"an array of real numbers is needed, not {type(value).__name__} [E2194]", "a list of numbers")
    )


class ModelArguments:
    """Arguments of the functions of a model for a library of arrays.

    Parameters
    ----------
    place : name of the library, for messages
    model : compiled, without force laws in Python

    Attributes
    ----------
    sizes : numbers of each argument
    defaults : values of the scene, of parameters and internal states
    """

    def __init__(self, caller: str, model: Model) -> None:
        if not isinstance(model, CompiledModel):
            fault = f"a model is needed, not {type(model).__name__} [E2193]"
            raise UsageError(Problem(caller, fault, "eomgen.build(scene)"))
        if model.library.layout.get("python"):
            fault = f"{model.name} has force laws in Python [E0945]"
            raise ModelError(Problem(caller, fault, "the laws in C, [laws] source"))
        model.finish_compilation()
        self.place, self.model = caller, model
        self.sizes = self.evaluator.functions.sizes
        self.defaults = {"p": self.evaluator.parameters(None), "z": self.evaluator.internal(None)}

    @property
    def evaluator(self) -> Any:
        """Evaluation of the model's terms."""
        return self.model.evaluator

    def check_unconstrained(self) -> None:
        """Raise ModelError if the model has constraints: its accelerations are not a function of q and v alone."""
        if self.model.multipliers:
            fault = f"{self.model.name} has constraints: accelerations are not a function of q and v alone [E0946]"
            hint = "inverse_dynamics; simulate, whose gradients go through loops"
            raise ModelError(Problem(self.place, fault, hint))

    def parameters(self, named_values: Mapping[str, Any], array: Callable[[str, Any], Array]) -> list[Array]:
        """Return all tunable parameters in order, from some values by name and the scene's values. `array` makes each
        from a name and a value. Raises UsageError for unknown names."""
        names = self.evaluator.parameter_names
        for name in named_values:
            if name not in names:
                self.evaluator.parameters({name: 0.0})
        values = {**dict(zip(names, self.defaults["p"], strict=True)), **named_values}
        return [array(name, values[name]) for name in names]

    def directions(self, blocks: Iterable[str]) -> dict[str, int]:
        """Return the number of directions of arguments."""
        return {block: size_of(self.evaluator.functions, block) for block in blocks}


class FactorRun(NamedTuple):
    """Factors of one group that follow one another in a configuration: arrays have an axis for these.

    Attributes
    ----------
    group : ``R``, ``SO3`` or ``SE3``
    number : of factors
    q, v : of all factors together
    """

    group: str
    number: int
    q: slice
    v: slice

    def each(self, values: Array) -> Array:
        """Return values (..., size) of the run as (..., count, size of one factor)."""
        return values.reshape((*values.shape[:-1], self.number, values.shape[-1] // self.number))

    def together(self, values: Array) -> Array:
        """Return values (..., count, size of one factor) as (..., size)."""
        return values.reshape((*values.shape[:-2], self.number * values.shape[-1]))


def factor_runs(factors: Sequence[Factor]) -> Iterator[FactorRun]:
    """Yield runs of factors of one group, in the order of the configuration."""
    for group, members in itertools.groupby(factors, lambda factor: factor.group):
        run = list(members)
        yield FactorRun(group, len(run), slice(run[0].q.start, run[-1].q.stop), slice(run[0].v.start, run[-1].v.stop))


def left_trivialised(arrays: Any, factors: Sequence[Factor], q: Array, dq: Array) -> Array:
    """Return the left-trivialised tangent (..., nv) of a change dq (..., nq) at q (..., nq).

    Parameters
    ----------
    arrays : ``jax.numpy`` or ``torch``
    """
    parts = []
    for run in factor_runs(factors):
        if run.group == "R":
            parts.append(dq[..., run.q])
            continue
        of_q, of_dq = run.each(q[..., run.q]), run.each(dq[..., run.q])
        w, x, dw, dx = of_q[..., :1], of_q[..., 1:4], of_dq[..., :1], of_dq[..., 1:4]
        cross = arrays.linalg.cross
        velocity = 2.0 * (w * dx - dw * x - cross(x, dx)) / (w * w + (x * x).sum(-1)[..., None])
        if run.group == "SE3":
            turned = of_dq[..., 4:7]
            moved = turned - 2.0 * w * cross(x, turned) + 2.0 * cross(x, cross(x, turned))
            velocity = arrays.concatenate([velocity, moved], -1)
        parts.append(run.together(velocity))
    return arrays.concatenate(parts, -1)


def gradient_in_components(arrays: Any, factors: Sequence[Factor], q: Array, gradient: Array) -> Array:
    """Return the gradient (..., nq) in the components of q of a left-trivialised gradient (..., nv).

    The transposed map of ``left_trivialised``.

    Parameters
    ----------
    arrays : ``jax.numpy`` or ``torch``
    """
    parts = []
    for run in factor_runs(factors):
        if run.group == "R":
            parts.append(gradient[..., run.v])
            continue
        of_q, of_v = run.each(q[..., run.q]), run.each(gradient[..., run.v])
        w, x, g = of_q[..., :1], of_q[..., 1:4], of_v[..., :3]
        cross = arrays.linalg.cross
        length = w * w + (x * x).sum(-1)[..., None]
        components = [-2.0 * (x * g).sum(-1)[..., None] / length, 2.0 * (w * g + cross(x, g)) / length]
        if run.group == "SE3":
            moved = of_v[..., 3:6]
            components.append(moved + 2.0 * w * cross(x, moved) + 2.0 * cross(x, cross(x, moved)))
        parts.append(run.together(arrays.concatenate(components, -1)))
    return arrays.concatenate(parts, -1)


def bracket(arrays: Any, d: Array) -> Array:
    """Return the matrix of the Lie bracket [d, x] in x, for d (..., 3) of a rotation or (..., 6) of a pose, angular
    part first. `arrays` is ``jax.numpy`` or ``torch``."""
    zero = arrays.zeros_like(d[..., 0])

    def crossing(x: Array) -> Array:
        rows = [[zero, -x[..., 2], x[..., 1]], [x[..., 2], zero, -x[..., 0]], [-x[..., 1], x[..., 0], zero]]
        return arrays.stack([arrays.stack(row, -1) for row in rows], -2)

    first = crossing(d[..., :3])
    if d.shape[-1] == 3:
        return first
    top = arrays.concatenate([first, arrays.zeros_like(first)], -1)
    return arrays.concatenate([top, arrays.concatenate([crossing(d[..., 3:]), first], -1)], -2)
