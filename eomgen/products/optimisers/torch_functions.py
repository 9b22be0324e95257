"""Functions of a model for PyTorch on processors: values, first and second derivatives and runs, by the compiled C.

Operators of ``torch.library`` serve all models: values f, tangents J c, gradients J^T w, and curvature, the product of
the second derivative of w . f with c. The derivative of each is one of the others, up to second derivatives.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np

from eomgen.base.calls import checked_call, checked_calls
from eomgen.base.products import optional_package
from eomgen.compiled.argument_derivatives import Sparsity
from eomgen.errors import Problem, UsageError
from eomgen.products.optimisers.arguments import (
    ModelArguments,
    ModelFunctions,
    arguments_of,
    bracket,
    gradient_in_components,
    no_array,
)
from eomgen.products.optimisers.runs import Runs

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model

Tensor = Any


@checked_call("a model")
def torch(model: Model) -> TorchFunctions:
    """Return the dynamics of a model as functions for PyTorch, with exact derivatives and batches in one call.

    The functions are operators of ``torch.library`` with autograd: ``backward``, ``torch.autograd.grad`` with
    ``create_graph``, ``torch.func.grad``, ``jacrev``, ``hessian`` (of ``jacrev``) and ``vmap``, and ``torch.compile``
    apply. Tensors are float64 on the processor. There is no forward mode.

    Parameters
    ----------
    model : Model
        A model of real numbers. Missing derivatives are compiled once.

    Returns
    -------
    TorchFunctions
        ``forward_dynamics``, ``inverse_dynamics`` and ``simulate``.

    Raises
    ------
    UsageError
        PyTorch is not installed.
    ModelError
        A model with force laws in Python.
    """
    return TorchFunctions(model)


@checked_calls("eomgen.torch(model), which makes one")
class TorchFunctions(ModelFunctions):
    """The dynamics of a model as functions of PyTorch tensors.

    Arguments are (..., size) with leading axes that broadcast: a batch is one call of the C, in lanes and threads.
    Arguments that are not given are the values of the scene: inputs follow the formulas at t, parameters and internal
    states have the initial values. Derivatives in q are taken in the coordinates of q: a change of a quaternion turns
    the body, a change of the length does not count.

    Parameters
    ----------
    model : Model
        A compiled model without force laws in Python.
    """

    def __init__(self, model: Model) -> None:
        self._operators = _operators()
        self._model, self._scene = model, ModelArguments("torch", model)
        self._number = len(_MODELS)
        _MODELS.append(self)  # graphs of PyTorch hold the number, for the time of the process

    def _run(self, runs: Runs, nest: Mapping[str, Any]) -> Tensor:
        return self._operators.run(runs, *runs.flat(nest))

    def _evaluate(self, name: str, arguments: Mapping[str, Any]) -> Tensor:
        package, tensors = self._operators.package, dict[str, Tensor]()
        for block, value in arguments.items():
            if value is None and block == "u":
                continue
            if value is None and block in self._scene.defaults:
                tensors[block] = package.from_numpy(np.array(self._scene.defaults[block], float))
            else:
                tensors[block] = self._by_name(value) if isinstance(value, Mapping) else self._array(block, value)
        if "u" not in tensors:
            tensors["u"] = self._inputs_of_scene(*self._broadcast(name, {"t": tensors["t"], "p": tensors["p"]}))
        taken = {block: tensors[block] for block in arguments_of(name)}
        result: Tensor = self._operators.value(self._number, name, *self._broadcast(name, taken))
        return result

    def _array(self, name: str, value: Any) -> Tensor:
        """Return a tensor, or numbers as a tensor, of float64 on the processor. Raises UsageError for tensors of other
        types or devices, and for anything but numbers."""
        package = self._operators.package
        if not package.is_tensor(value):
            try:
                return package.as_tensor(value, dtype=package.float64)
            except (TypeError, ValueError, RuntimeError):
                raise no_array(name, value) from None
        if value.dtype != package.float64:
            fault = f"{name} has the type {value.dtype}, and derivatives are exact to rounding of torch.float64 [E0951]"
            raise UsageError(Problem(name, fault, f"{name}.double(); torch.set_default_dtype(torch.float64)"))
        if value.device.type != "cpu":
            fault = f"{name} is on {value.device}, and the compiled C runs on the processor [E0952]"
            raise UsageError(Problem(name, fault, f"{name}.cpu()"))
        return value

    def _by_name(self, values: Mapping[str, Any]) -> Tensor:
        """Return the tunable parameters in order, (..., np)."""
        package = self._operators.package
        return package.stack(package.broadcast_tensors(*self._scene.parameters(values, self._array)), -1)

    def _broadcast(self, name: str, blocks: Mapping[str, Tensor]) -> list[Tensor]:
        """Return tensors by block with equal leading axes, in order; t has leading axes alone. Raises UsageError for
        sizes that do not fit; `name` is the term, for messages."""
        package, leading = self._operators.package, dict[str, Any]()
        for block, tensor in blocks.items():
            if block == "t":
                leading[block] = tensor.shape
                continue
            size = self._scene.sizes[{"a": "v"}.get(block, block)]
            if not tensor.ndim or tensor.shape[-1] != size:
                fault = f"{block} has the shape {tuple(tensor.shape)}, and {name} takes (..., {size}) [E0953]"
                raise UsageError(Problem(block, fault, "samples along leading axes"))
            leading[block] = tensor.shape[:-1]
        try:
            shape = package.broadcast_shapes(*leading.values())
        except RuntimeError:
            shapes = ", ".join(f"{block} {tuple(axes)}" for block, axes in leading.items())
            fault = f"the leading axes do not broadcast: {shapes} [E0261]"
            raise UsageError(Problem(name, fault, "batches of equal shape")) from None
        return [tensor.expand((*shape, *tensor.shape[len(leading[block]) :])) for block, tensor in blocks.items()]

    def _inputs_of_scene(self, t: Tensor, p: Tensor) -> Tensor:
        """Return the inputs (..., nu) that the formulas of the scene give at t (...) and parameters (..., np).
        Derivatives of these are refused; zero without formulas."""
        if "inputs" not in self._scene.evaluator.functions:
            return t.new_zeros((*t.shape, self.inputs))
        inputs: Tensor = self._operators.inputs(self._number, "inputs", t, p)
        return inputs

    def scene_inputs(self, t: Tensor, p: Tensor) -> Tensor:
        """Evaluate the formulas that the scene gives for inputs; the result has no derivatives.

        Parameters
        ----------
        t : tensor
            Time (...), s.
        p : tensor
            Tunable parameters (..., np), SI units.

        Returns
        -------
        (..., nu) tensor
            In SI units.
        """
        values = self._scene.evaluator.functions("inputs", {"t": t.numpy(force=True), "p": p.numpy(force=True)})[0]
        return self._tensor(values)

    @property
    def inputs(self) -> int:
        """Number of inputs of the scene."""
        return int(self._scene.sizes["u"])

    def size(self, name: str) -> int:
        """Return the number of directions of all arguments of a term.

        Parameters
        ----------
        name : str
            Name of a term.

        Returns
        -------
        int
            Number of directions.
        """
        return sum(self._scene.directions(arguments_of(name)).values())

    def values(self, name: str, tensors: Sequence[Tensor]) -> Tensor:
        """Evaluate a term.

        Parameters
        ----------
        name : str
            Name of a term.
        tensors : sequence of tensor
            Arguments of the term in order.

        Returns
        -------
        (..., nv) tensor
            Its values.
        """
        return self._tensor(getattr(self._model, name)(**self._keywords(name, tensors)))

    def gradient(self, name: str, tensors: Sequence[Tensor], weights: Tensor) -> Tensor:
        """Evaluate the product of the transposed Jacobian of a term with weights.

        Parameters
        ----------
        name : str
            ``forward_dynamics`` or ``inverse_dynamics``.
        tensors : sequence of tensor
            Arguments q, v, a (of ``inverse_dynamics``), z, u, p and t (...) with equal leading axes.
        weights : tensor
            Weights (..., nv) of the components.

        Returns
        -------
        (..., directions) tensor
            J^T weights, by the arguments in the order of ``tensors``; in q left-trivialised, nv directions.
        """
        pattern, nonzeros = self._jacobian(name, tensors)
        return self._by_columns(name, pattern, nonzeros * weights.numpy(force=True)[..., pattern.rows])

    def tangent(self, name: str, tensors: Sequence[Tensor], along: Tensor) -> Tensor:
        """Evaluate the product of the Jacobian of a term with a direction.

        Parameters
        ----------
        name : str
            ``forward_dynamics`` or ``inverse_dynamics``.
        tensors : sequence of tensor
            Arguments q, v, a (of ``inverse_dynamics``), z, u, p and t (...) with equal leading axes.
        along : tensor
            Direction (..., directions), a change of the arguments in the order of ``tensors``; nv numbers for q,
            left-trivialised.

        Returns
        -------
        (..., nv) tensor
            J along, without a graph of autograd.
        """
        pattern, nonzeros = self._jacobian(name, tensors)
        order = np.argsort(pattern.rows, kind="stable")
        products = nonzeros * along.numpy(force=True)[..., self._places(name, pattern)[pattern.columns]]
        return self._tensor(_sums(products[..., order], np.bincount(pattern.rows, minlength=self._scene.sizes["v"])))

    def curvature(self, name: str, tensors: Sequence[Tensor], weights: Tensor, along: Tensor) -> Tensor:
        """Evaluate the change of the scalar (J^T weights) . along, for a change of the arguments along each direction.

        The Hessian is the symmetric part of second derivatives on rotations: X_k X_j f = H_kj + [X_k, X_j] f/2. The
        result has both terms.

        Parameters
        ----------
        name : str
            ``forward_dynamics`` or ``inverse_dynamics``.
        tensors : sequence of tensor
            Arguments q, v, a (of ``inverse_dynamics``), z, u, p and t (...) with equal leading axes.
        weights : tensor
            Weights (..., nv) of the components.
        along : tensor
            Direction (..., directions), a change of the arguments in the order of ``tensors``; nv numbers for q,
            left-trivialised.

        Returns
        -------
        (..., directions) tensor
            Change along each direction, in the order of ``along``, without a graph of autograd.
        """
        pattern = self._model.sparsity(name, 2)
        nonzeros = self._model.hessian(name, weights.numpy(force=True), **self._keywords(name, tensors), sparse=True)
        products = nonzeros * along.numpy(force=True)[..., self._places(name, pattern)[pattern.rows]]
        result = self._by_columns(name, pattern, products)
        turning = [factor for factor in self._scene.evaluator.factors if factor.group != "R"]
        if turning:
            gradient = self.gradient(name, tensors, weights)
            for factor in turning:
                matrix = bracket(self._operators.package, along[..., factor.v])
                result[..., factor.v] -= 0.5 * (gradient[..., factor.v][..., None, :] @ matrix)[..., 0, :]
        return result

    def in_components(self, name: str, tensors: Sequence[Tensor], gradient: Tensor) -> list[Tensor]:
        """Return a gradient along directions in the components of each argument.

        Parameters
        ----------
        name : str
            ``forward_dynamics`` or ``inverse_dynamics``.
        tensors : sequence of tensor
            Arguments q, v, a (of ``inverse_dynamics``), z, u, p and t (...) with equal leading axes.
        gradient : tensor
            Gradient (..., directions), as of ``gradient``.

        Returns
        -------
        list of tensor
            The gradient in each argument, of the argument's shape: (..., nq) in q, orthogonal to each quaternion,
            and (...) in t.
        """
        directions = self._scene.directions(arguments_of(name))
        parts = dict(zip(directions, gradient.split(list(directions.values()), -1), strict=True))
        factors = self._scene.evaluator.factors
        parts["q"] = gradient_in_components(self._operators.package, factors, tensors[0], parts["q"])
        parts["t"] = parts["t"][..., 0]
        return list(parts.values())

    def _tensor(self, array: Any) -> Tensor:
        return self._operators.package.from_numpy(np.array(array, float))

    def _places(self, name: str, pattern: Sparsity) -> Any:
        """Return for each column of a pattern of derivatives its index among the directions of a term's arguments."""
        directions = self._scene.directions(arguments_of(name))
        firsts = dict(zip(directions, np.cumsum([0, *directions.values()]).tolist(), strict=False))
        return np.concatenate([firsts[block] + np.arange(directions[block]) for block in pattern.arguments]).astype(int)

    def _keywords(self, name: str, tensors: Sequence[Tensor]) -> dict[str, Any]:
        """Return the tensors of a term as arrays by keyword of the model's method; arguments of size 0 are left out."""
        arrays = {block: tensor.numpy(force=True) for block, tensor in zip(arguments_of(name), tensors, strict=True)}
        arrays["parameters"] = arrays.pop("p")
        return {block: array for block, array in arrays.items() if block == "t" or array.shape[-1]}

    def _jacobian(self, name: str, tensors: Sequence[Tensor]) -> tuple[Sparsity, Any]:
        pattern = self._model.sparsity(name)
        return pattern, self._model.derivatives(name, **self._keywords(name, tensors), sparse=True)

    def _by_columns(self, name: str, pattern: Sparsity, products: Any) -> Tensor:
        """Return the sums of products (..., nonzeros) over the rows of each column of a pattern, (..., directions)."""
        result = np.zeros((*products.shape[:-1], self.size(name)))
        result[..., self._places(name, pattern)] = _sums(products, np.diff(pattern.starts))
        return self._tensor(result)


#: Functions by the number that operators take.
_MODELS: list[TorchFunctions] = []


def _sums(products: Any, counts: Any) -> Any:
    """Return sums of consecutive products (..., products), as many for each as `counts` says, which may be zero: (...,
    sums)."""
    result = np.zeros((*products.shape[:-1], len(counts)))
    filled = np.flatnonzero(counts)
    if len(filled):
        starts = np.concatenate([[0], np.cumsum(counts)])[filled]
        result[..., filled] = np.add.reduceat(products, starts, axis=-1)
    return result


class TorchOperators(NamedTuple):
    """PyTorch, with the operators of all models."""

    package: Any
    value: Callable[..., Tensor]
    inputs: Callable[..., Tensor]
    run: Callable[..., Tensor]


@functools.cache
def _operators() -> TorchOperators:
    """Return PyTorch with operators for values, inputs of scenes and runs, with rules of derivatives and batches, made
    once. Raises UsageError without PyTorch."""
    missing = Problem("torch", "the package torch is not installed [E0954]", "pip install 'eomgen[torch]'")
    package: Any = optional_package("torch", missing)

    def operator(name: str, takes: str, kernel: Callable[..., Tensor], shape: Callable[..., Tensor]) -> Any:
        """Return an operator of tensors, the number of a model and a term, with the shape of the result."""
        schema = f"({takes}, int model, str term) -> Tensor"
        made = package.library.custom_op(f"eomgen::{name}", kernel, mutates_args=(), schema=schema)
        made.register_fake(shape)
        return made

    value = operator(
        "value",
        "Tensor[] arguments",
        lambda arguments, model, term: _MODELS[model].values(term, arguments),
        lambda arguments, model, term: arguments[1].new_empty(arguments[1].shape),
    )
    tangent = operator(
        "tangent",
        "Tensor[] arguments, Tensor along",
        lambda arguments, along, model, term: _MODELS[model].tangent(term, arguments, along),
        lambda arguments, along, model, term: arguments[1].new_empty(arguments[1].shape),
    )
    gradient = operator(
        "gradient",
        "Tensor[] arguments, Tensor weights",
        lambda arguments, weights, model, term: _MODELS[model].gradient(term, arguments, weights),
        lambda arguments, weights, model, term: weights.new_empty((*weights.shape[:-1], _MODELS[model].size(term))),
    )
    curvature = operator(
        "curvature",
        "Tensor[] arguments, Tensor weights, Tensor along",
        lambda arguments, weights, along, model, term: _MODELS[model].curvature(term, arguments, weights, along),
        lambda arguments, weights, along, model, term: along.new_empty(along.shape),
    )
    inputs = operator(
        "inputs",
        "Tensor t, Tensor p",
        lambda t, p, model, term: _MODELS[model].scene_inputs(t, p),
        lambda t, p, model, term: t.new_empty((*t.shape, _MODELS[model].inputs)),
    )

    def given_alone(arguments: Sequence[Any]) -> Sequence[Any]:
        """Return arguments of ``forward`` without the context, which ``torch.compile`` puts before a variable number of
        arguments if no gradient is needed."""
        return arguments if isinstance(arguments[0], int) else arguments[1:]

    class Function(package.autograd.Function):  # type: ignore[misc]  # a class of a package imported at first use
        """A function of model, term and tensors with equal leading axes; a batch of ``vmap`` is one more axis."""

        @staticmethod
        def setup_context(ctx: Any, inputs: Sequence[Any], output: Tensor) -> None:
            ctx.model, ctx.term, *tensors = inputs
            ctx.save_for_backward(*tensors)

        @classmethod
        def vmap(cls, info: Any, axes: Sequence[int | None], *values: Any) -> tuple[Tensor, int]:
            def in_front(value: Any, axis: int | None) -> Any:
                if not package.is_tensor(value):
                    return value
                return value.expand((info.batch_size, *value.shape)) if axis is None else value.movedim(axis, 0)

            return cls.apply(*map(in_front, values, axes)), 0

    class Value(Function):
        @staticmethod
        def forward(*tensors: Any) -> Tensor:
            model, term, *arguments = given_alone(tensors)
            result: Tensor = value(arguments, model, term)
            return result

        @staticmethod
        def backward(ctx: Any, weights: Tensor) -> tuple[Any, ...]:
            arguments, functions = ctx.saved_tensors, _MODELS[ctx.model]
            of_directions = Gradient.apply(ctx.model, ctx.term, weights, *arguments)
            return None, None, *functions.in_components(ctx.term, arguments, of_directions)

    class Gradient(Function):
        @staticmethod
        def forward(*tensors: Any) -> Tensor:
            model, term, weights, *arguments = given_alone(tensors)
            result: Tensor = gradient(arguments, weights, model, term)
            return result

        @staticmethod
        def backward(ctx: Any, along: Tensor) -> tuple[Any, ...]:
            weights, *arguments = ctx.saved_tensors
            bent = Curvature.apply(ctx.model, ctx.term, weights, along, *arguments)
            of_arguments = _MODELS[ctx.model].in_components(ctx.term, arguments, bent)
            return None, None, Tangent.apply(ctx.model, ctx.term, along, *arguments), *of_arguments

    class Tangent(Function):
        @staticmethod
        def forward(model: int, term: str, along: Tensor, *arguments: Tensor) -> Tensor:
            result: Tensor = tangent(arguments, along, model, term)
            return result

        @staticmethod
        def backward(ctx: Any, weights: Tensor) -> tuple[Any, ...]:
            along, *arguments = ctx.saved_tensors
            bent = Curvature.apply(ctx.model, ctx.term, weights, along, *arguments)
            of_arguments = _MODELS[ctx.model].in_components(ctx.term, arguments, bent)
            return None, None, Gradient.apply(ctx.model, ctx.term, weights, *arguments), *of_arguments

    class Curvature(Function):
        @staticmethod
        def forward(model: int, term: str, weights: Tensor, along: Tensor, *arguments: Tensor) -> Tensor:
            result: Tensor = curvature(arguments, weights, along, model, term)
            return result

        @staticmethod
        def backward(ctx: Any, _: Tensor) -> NoReturn:
            fault = f"third derivatives of {ctx.term}: the compiled C has first and second ones [E0955]"
            raise UsageError(Problem("torch", fault, "second derivatives without create_graph"))

    class Inputs(Function):
        @staticmethod
        def forward(model: int, term: str, t: Tensor, p: Tensor) -> Tensor:
            result: Tensor = inputs(t, p, model, term)
            return result

        @staticmethod
        def backward(ctx: Any, _: Tensor) -> NoReturn:
            fault = "derivatives in t or in parameters, with inputs by the formulas of the scene [E0948]"
            raise UsageError(Problem("u", fault, "u=..., a function of t and of the parameters"))

    class OfRuns(package.autograd.Function):  # type: ignore[misc]  # as of Function
        """A function of runs and their tensors in order; ``vmap`` takes one run after another."""

        @staticmethod
        def setup_context(ctx: Any, inputs: Sequence[Any], output: Tensor) -> None:
            ctx.runs, *tensors = inputs
            ctx.save_for_backward(*tensors)

        @classmethod
        def vmap(cls, info: Any, axes: Sequence[int | None], *values: Any) -> tuple[Any, Any]:
            made = []
            for k in range(info.batch_size):
                pairs = zip(values, axes, strict=True)
                made.append(cls.apply(*(x if axis is None else x.select(axis, k) for x, axis in pairs)))
            if package.is_tensor(made[0]):
                return package.stack(made), 0
            return tuple(package.stack(parts) for parts in zip(*made, strict=True)), (0,) * len(made[0])

    class Run(OfRuns):
        @staticmethod
        def forward(runs: Runs, *tensors: Tensor) -> Tensor:
            values = runs.nest([tensor.numpy(force=True) for tensor in tensors])
            runs.learn_shapes(values)
            return package.from_numpy(runs.outputs(values))

        @staticmethod
        def backward(ctx: Any, weights: Tensor) -> tuple[Any, ...]:
            return None, *Adjoint.apply(ctx.runs, weights, *ctx.saved_tensors)

    class Adjoint(OfRuns):
        @staticmethod
        def forward(runs: Runs, weights: Tensor, *tensors: Tensor) -> tuple[Tensor, ...]:
            values = runs.nest([tensor.numpy(force=True) for tensor in tensors])
            gradient = runs.gradient(values, weights.numpy(force=True))
            if gradient["q"] is not None:
                q, of_q = (package.from_numpy(np.array(x)) for x in (values["q"], gradient["q"]))
                gradient["q"] = gradient_in_components(package, runs.factors, q, of_q)
            return tuple(package.as_tensor(part, dtype=package.float64) for part in runs.flat(gradient))

        @staticmethod
        def backward(ctx: Any, *_: Tensor) -> NoReturn:
            fault = "second derivatives of a run [E0956]"
            raise UsageError(Problem("torch", fault, "model.sensitivities, whose hessian has them"))

    return TorchOperators(package, Value.apply, Inputs.apply, package.compiler.disable(Run.apply))
