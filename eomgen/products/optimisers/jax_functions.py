"""Functions of a model for JAX on processors: values, first and second derivatives by the compiled C, batches in lanes.

JAX calls one C function for all models (``templates/optimisers/xla.c.jinja``) through the foreign function interface of
XLA, with the address of a description of the term. Python takes no part in a call.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.calls import checked_call, checked_calls
from eomgen.base.data import dataclass
from eomgen.base.messages import Log
from eomgen.base.products import objects_of, optional_package
from eomgen.base.threads import thread_count
from eomgen.codegen.targets.c.templates import environment
from eomgen.compiled.functions import LEAST, Choice, Functions, LaneCompanions, chosen
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.products.optimisers.arguments import (
    OFFERED,
    ModelArguments,
    ModelFunctions,
    arguments_of,
    bracket,
    factor_runs,
    gradient_in_components,
    left_trivialised,
    no_array,
)
from eomgen.products.optimisers.runs import Runs
from eomgen.system.sparsity import unpacked_places
from eomgen.system.terms import ARGUMENTS, TERMS
from eomgen.toolchain.builder import Builder
from eomgen.toolchain.compiler import RunningCompilers, in_background
from eomgen.toolchain.large_stack import stack_size

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model

Array = Any
_LOG = Log(__name__)
_TARGET = "eomgen"
#: Operations of a thread at least, some milliseconds; a thread takes a tenth of this time to start.
_SHARE = 10_000_000
#: Samples by which lanes are compared with the model.
_COMPARED = 64


@checked_call("a model")
def jax(model: Model) -> JaxFunctions:
    """Return the dynamics of a model as functions for JAX, with exact derivatives and batches in one call.

    The functions are pure, so that ``jax.jit``, ``vmap``, ``jvp``, ``vjp``, ``jacfwd``, ``jacrev``, ``hessian`` and
    ``lax.scan`` apply. Arrays are float64: ``jax.config.update("jax_enable_x64", True)`` comes first. A batch of
    ``vmap`` is one call of the C, in lanes and threads.

    Parameters
    ----------
    model : Model
        A model of real numbers. Missing derivatives are compiled once.

    Returns
    -------
    JaxFunctions
        ``forward_dynamics``, for models without constraints, ``inverse_dynamics`` and ``simulate``.

    Raises
    ------
    UsageError
        JAX is not installed, or is set to float32.
    ModelError
        A model with force laws in Python.
    ToolchainError
        There is no compiler.

    Examples
    --------
    >>> import jax
    >>> jax.config.update("jax_enable_x64", True)
    >>> functions = eomgen.jax(eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml"))
    >>> jax.jacfwd(functions.forward_dynamics)(np.array([0.3, 0.2]), np.zeros(2)).shape
    (2, 2)
    """
    return JaxFunctions(model)


@checked_calls("eomgen.jax(model), which makes one")
class JaxFunctions(ModelFunctions):
    """The dynamics of a model as functions of JAX arrays.

    Arguments that are not given are the values of the scene: inputs follow the formulas at t, parameters and internal
    states have the initial values. Derivatives in q are taken in the coordinates of q: a change of a quaternion turns
    the body, a change of the length does not count.

    Parameters
    ----------
    model : Model
        A compiled model without force laws in Python.
    """

    def __init__(self, model: Model) -> None:
        self._jax = _package()
        _check_precision(self._jax)
        self._model, self._scene = model, ModelArguments("jax", model)
        self._factors = tuple(self._scene.evaluator.factors)
        self._calls: dict[str, _TermCall] = {}
        self._dynamics = {name: self._differentiable(name) for name in OFFERED}

    def _run(self, runs: Runs, nest: Mapping[str, Any]) -> Array:
        jnp = self._jax.numpy
        _check_precision(self._jax)
        unknown = {name: np.zeros(array.shape) for name, array in nest["inputs"].items()}
        runs.learn_shapes({"q": None, "v": None, "parameters": {}, "inputs": unknown})
        shape = functools.partial(self._jax.ShapeDtypeStruct, dtype=np.float64)
        changes = self._jax.tree.map(lambda array: shape(array.shape), nest)
        if nest["q"] is not None:
            changes["q"] = shape((self._model.nv,))
        factors = self._factors

        def rows(values: Any) -> Array:
            if not any(isinstance(leaf, self._jax.core.Tracer) for leaf in self._jax.tree.leaves(values)):
                runs.outputs(values)  # whose errors are the ones of eomgen, not of a callback
            return self._jax.pure_callback(runs.outputs, shape(runs.shape), values, vmap_method="sequential")

        def rows_and_values(values: Any) -> tuple[Array, Any]:
            return once(rows)(values), values

        def gradients(values: Any, weights: Array) -> Any:
            return self._jax.pure_callback(runs.gradient, changes, values, weights, vmap_method="sequential")

        def once(function: Callable[..., Any]) -> Any:
            """Return a function without derivatives."""
            result, fault = self._jax.custom_jvp(function), "simulate has first reverse derivatives alone [E2197]"
            result.defjvp(_refusal("jax", fault, "model.sensitivities(...), with tangents and Hessians"))
            return result

        def adjoint(values: Any, weights: Array) -> tuple[Any]:
            gradient = once(gradients)(values, weights)
            if values["q"] is not None:
                gradient = {**gradient, "q": gradient_in_components(jnp, factors, values["q"], gradient["q"])}
            return (gradient,)

        run = self._jax.custom_vjp(rows)
        run.defvjp(rows_and_values, adjoint)
        return run(nest)

    @property
    def in_lanes(self) -> dict[str, bool]:
        """Whether batches of the terms called so far are evaluated in lanes, by term."""
        return {name: call.in_lanes for name, call in self._calls.items()}

    def _evaluate(self, name: str, arguments: Mapping[str, Any]) -> Array:
        jnp = self._jax.numpy
        values = {}
        for block, value in arguments.items():
            if value is None and block not in ("q", "v", "a", "t"):
                array = jnp.asarray(self._inputs(arguments) if block == "u" else self._scene.defaults[block])
            else:
                array = self._by_name(value) if isinstance(value, Mapping) else self._array(block, value)
            expected = () if block == "t" else (self._scene.sizes[{"a": "v"}.get(block, block)],)
            if array.shape != expected:
                fault = f"{block} has the shape {array.shape}, and {name} takes {expected} [E0947]"
                raise UsageError(Problem(block, fault, f"one sample; jax.vmap({name}) for a batch"))
            values[block] = array.reshape(1) if block == "t" else array
        return self._dynamics[name](*(values[block] for block in arguments_of(name)))

    def _by_name(self, values: Mapping[str, Any]) -> Array:
        return self._jax.numpy.stack(self._scene.parameters(values, self._array))

    def _array(self, name: str, value: Any) -> Array:
        """Return an argument as a JAX array of float64. Raises UsageError for complex numbers, no numbers, or JAX set
        to float32."""
        _check_precision(self._jax)
        try:
            array = self._jax.numpy.asarray(np.array(value) if value is None else value)
        except (TypeError, ValueError):
            raise no_array(name, value) from None
        if self._jax.numpy.iscomplexobj(array):
            raise UsageError(Problem(name, "the numbers are complex [E2190]", "real numbers; jax.jvp has derivatives"))
        return array.astype(float)

    def _inputs(self, arguments: Mapping[str, Any]) -> Array:
        """Return the inputs (nu,) that the formulas of the scene give at t and the parameters among arguments; zero
        without formulas. Derivatives of these inputs are refused."""
        if "inputs" not in self._scene.evaluator.functions:
            return np.zeros(self._scene.sizes["u"])
        jnp = self._jax.numpy
        p = arguments["p"]
        p = self._scene.defaults["p"] if p is None else self._by_name(p) if isinstance(p, Mapping) else p
        return self._held_inputs(jnp.asarray(arguments["t"], float).reshape(1), jnp.asarray(p, float))

    @functools.cached_property
    def _held_inputs(self) -> Callable[..., Array]:
        fault = "derivatives in t or in parameters, with inputs by the formulas of the scene [E0948]"
        return self._function(
            "inputs", ("t", "p"), _refusal("u", fault, "u=..., a function of t and of the parameters")
        )

    def _function(self, term: str, blocks: Sequence[str], tangents: Callable[..., Any]) -> Callable[..., Array]:
        """Return a term as a function of JAX arrays of arguments, whose derivatives are ``tangents``."""
        return functools.partial(_primitive().bind, of=_Function(self._term, term, tuple(blocks), tangents))

    def _term(self, term: str) -> _TermCall:
        if term not in self._calls:
            model = self._model.having((term,)) if term in TERMS else self._model
            functions = model.evaluator.functions
            functions.renew()
            self._calls[term] = _TermCall(
                functions, term, self._samples, [card.kernels(model, term) for card in _cards()]
            )
        return self._calls[term]

    def _samples(self, sizes: Mapping[str, int]) -> list[Array]:
        """Return arguments of some samples near the initial state, (samples, size) each, in the order of `sizes`, the
        sizes by block. Results of lanes are compared with results of the model at these."""
        generator = np.random.default_rng(1)
        values = {block: generator.uniform(-0.5, 0.5, (_COMPARED, size)) for block, size in sizes.items()}
        fixed = {"t": np.zeros(1), "p": self._scene.defaults["p"], "q": self._scene.evaluator.initial_q}
        values |= {block: np.tile(fixed[block], (_COMPARED, 1)) for block in sizes if block in fixed}
        if "base" in values:
            at_rest = {"t": np.zeros(1), "p": self._scene.defaults["p"]}
            values["base"] = np.tile(self._scene.evaluator.functions("base", at_rest)[0], (_COMPARED, 1))
        return list(values.values())

    def _differentiable(self, name: str) -> Callable[..., Array]:
        """Return the term `name` as a function of JAX arrays in the order of ``arguments_of``, with first and second
        derivatives. Third derivatives raise UsageError. Tangents are of one sample: ``_primitive`` maps these over
        batches."""
        jnp, blocks = self._jax.numpy, arguments_of(name)
        sizes = self._scene.directions(ARGUMENTS)
        firsts = dict(zip(sizes, np.cumsum([0, *sizes.values()]).tolist(), strict=False))
        positions = np.full(sum(sizes.values()), -1)
        taken = np.concatenate([firsts[block] + np.arange(sizes[block]) for block in blocks]).astype(int)
        positions[taken] = np.arange(len(taken))
        height, turning = sizes["v"], [factor for factor in self._factors if factor.group != "R"]

        def pattern(ending: str) -> tuple[Array, Array]:
            """Return rows and columns of the nonzeros in the Jacobian, or in the lower triangle of the Hessian."""
            functions = self._model.having((f"{name}{ending}",)).evaluator.functions
            rows, columns = unpacked_places(functions.library.layout["patterns"][f"{name}{ending}"])
            return rows, columns

        @functools.cache
        def products() -> tuple[Array, ...]:
            """Return the products whose sums are the changes of the Jacobian's nonzeros: rows and columns of the
            nonzeros; then for each product the nonzero, the Hessian entry and the direction's component.

            A Hessian of a row has entries of columns alone on which the row depends, factors of rotation as wholes.
            """
            rows, columns = pattern("_derivatives")
            columns, (low, high) = positions[columns], (positions[index] for index in pattern("_hessian"))
            off = np.flatnonzero(low != high)
            touched, others = np.concatenate([low, high[off]]), np.concatenate([high, low[off]])
            entries, order = np.concatenate([np.arange(len(low)), off]), np.argsort(touched, kind="stable")
            firsts, ends = (np.searchsorted(touched[order], columns, side) for side in ("left", "right"))
            counts = ends - firsts
            of_change = np.repeat(np.arange(len(rows)), counts)
            taken_from = order[np.arange(len(of_change)) + np.repeat(firsts - np.cumsum(counts) + counts, counts)]
            group = np.arange(len(taken))
            for factor in turning:
                group[factor.v] = factor.v.start
            depends = rows * len(taken) + group[columns]
            kept = np.isin(rows[of_change] * len(taken) + group[others[taken_from]], depends)
            taken_from = taken_from[kept]
            return rows, columns, of_change[kept], entries[taken_from], others[taken_from]

        @functools.cache
        def turns() -> list[tuple[Any, ...]]:
            """Return for each run of rotations the nonzeros in columns of the run, (m,), and for each nonzero the
            factor's nonzeros in the same row, (m, size), the factor's number and its column, (m,)."""
            rows, columns = products()[:2]
            places = {entry: k for k, entry in enumerate(zip(rows.tolist(), columns.tolist(), strict=True))}
            result = []
            for run in (run for run in factor_runs(self._factors) if run.group != "R"):
                size = (run.v.stop - run.v.start) // run.number
                within = np.flatnonzero((columns >= run.v.start) & (columns < run.v.stop))
                number, column = np.divmod(columns[within] - run.v.start, size)
                firsts = (columns[within] - column).tolist()
                row = [
                    [places.get((i, first + k), len(rows)) for k in range(size)]
                    for i, first in zip(rows[within].tolist(), firsts, strict=True)
                ]
                result.append((run, within, np.array(row, int).reshape(-1, size), number, column))
            return result

        def directions(arguments: Sequence[Array], along: Sequence[Array]) -> Array:
            """Return tangents of all arguments as one vector, q left-trivialised."""
            parts = [
                left_trivialised(jnp, self._factors, argument, tangent) if block == "q" else tangent
                for block, argument, tangent in zip(blocks, arguments, along, strict=True)
            ]
            return jnp.concatenate(parts)

        def jacobian_along(arguments: Sequence[Array], along: Sequence[Array]) -> tuple[Array, Array]:
            """Return the nonzeros of the Jacobian and the change of the nonzeros, from one Hessian for each row.

            The Hessian has the symmetric part of the second derivatives on rotations: X_d X_j f = H d + [X_d, X_j] f/2.
            """
            nonzeros = jacobian(*arguments)
            d = directions(arguments, along)
            rows, _, of_change, entries, others = products()
            # the terms before the weighted one have weights, too
            weights = self._model.having((f"{name}_hessian",)).evaluator.functions.sizes["weights"]
            second = self._jax.vmap(lambda w: hessian(*arguments, w))(jnp.eye(height, weights))
            change = jnp.zeros(len(rows)).at[of_change].add(second[rows[of_change], entries] * d[others])
            padded = jnp.append(nonzeros, 0.0)
            for run, within, row, number, column in turns():
                brackets = bracket(jnp, run.each(d[run.v]))
                change = change.at[within].add(0.5 * (padded[row] * brackets[number, :, column]).sum(-1))
            return nonzeros, change

        def along_values(arguments: Sequence[Array], along: Sequence[Array]) -> tuple[Array, Array]:
            rows, columns = pattern("_derivatives")
            tangents = jacobian(*arguments) * directions(arguments, along)[positions[columns]]
            return value(*arguments), jnp.zeros(height).at[rows].add(tangents)

        third = _refusal("jax", f"{name} has no third derivatives [E2198]", "first and second derivatives")
        hessian = self._function(f"{name}_hessian", (*blocks, "weights"), third)
        jacobian = self._function(f"{name}_derivatives", blocks, jacobian_along)
        value = self._function(name, blocks, along_values)
        return value


@dataclass(frozen=True, eq=False)  # JAX keys its programs by the object
class _Function:
    """A term as a function of JAX arrays, with a rule of derivatives.

    Parameters
    ----------
    terms : function that returns a term by name, compiled
    name, blocks : of the term, and arguments in order
    tangents : function of arguments and tangents of one sample, which returns values and tangents
    """

    terms: Callable[[str], _TermCall]
    name: str
    blocks: tuple[str, ...]
    tangents: Callable[[Sequence[Array], Sequence[Array]], tuple[Array, Array]]

    @property
    def size(self) -> int:
        return sum(self.terms(self.name).outputs[:1])  # none of a term without nonzeros

    def values(self, package: Any, arguments: Sequence[Array]) -> Array:
        """Return the values (..., size) of the term at arguments (..., size) in order; a moving base follows the law of
        the scene. `package` is JAX."""
        blocks, call = dict(zip(self.blocks, arguments, strict=True)), self.terms(self.name)
        if "base" in call.inputs:
            base = self.terms("base")
            blocks["base"] = base(package, {block: blocks[block] for block in base.inputs})
        return call(package, blocks)


def _leading(arguments: Iterable[Array]) -> tuple[int, ...]:
    """Return the batch axes of arguments (..., size)."""
    return np.broadcast_shapes(*(argument.shape[:-1] for argument in arguments))


@functools.cache
def _primitive() -> Any:
    """Return the primitive of JAX, made once, that evaluates all functions of all models, with rules for batches and
    tangents. Rules of ``custom_jvp`` are lost in reverse derivatives of ``lax.scan``, and the rules of a primitive are
    not."""
    package = _package()
    core, ad, batching, mlir = (
        import_module(f"jax.{name}")
        for name in ("extend.core", "interpreters.ad", "interpreters.batching", "interpreters.mlir")
    )
    primitive, jnp = core.Primitive(_TARGET), package.numpy

    def values(*arguments: Array, of: _Function) -> Array:
        return of.values(package, arguments)

    def shape(*arguments: Array, of: _Function) -> Any:
        return package.core.ShapedArray((*_leading(arguments), of.size), np.float64)

    def batch(arguments: Sequence[Array], axes: Sequence[int | None], *, of: _Function) -> tuple[Array, int]:
        def first(x: Array, axis: int | None) -> Array:
            return x[np.newaxis] if axis is None else jnp.moveaxis(x, axis, 0) if axis else x

        return primitive.bind(*map(first, arguments, axes), of=of), 0

    def along(arguments: Sequence[Array], tangents: Sequence[Array], *, of: _Function) -> tuple[Array, Array]:
        parts = [*arguments, *map(ad.instantiate_zeros, tangents)]

        def rule(*both: Array) -> tuple[Array, Array]:
            return of.tangents(both[: len(arguments)], both[len(arguments) :])

        mapped: Callable[..., tuple[Array, Array]] = rule
        for _ in range(arguments[0].ndim - 1):
            mapped = _map(package, mapped)
        return mapped(*parts)

    primitive.def_impl(package.jit(primitive.bind, static_argnames="of"))
    primitive.def_abstract_eval(shape)
    mlir.register_lowering(primitive, mlir.lower_fun(values, multiple_results=False))
    batching.primitive_batchers[primitive] = batch
    ad.primitive_jvps[primitive] = along
    return primitive


def _map(package: Any, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that maps another over the first axis of all arguments; axes of length 1 count as constant. If
    all are constant, the result has an axis of length 1 as well."""

    def map_arguments(*arguments: Array) -> Any:
        constant = [argument.shape[0] == 1 for argument in arguments]
        parts = [x[0] if is_constant else x for x, is_constant in zip(arguments, constant, strict=True)]
        if all(constant):
            return package.tree.map(lambda x: x[np.newaxis], function(*parts))
        return package.vmap(function, [None if is_constant else 0 for is_constant in constant])(*parts)

    return map_arguments


def _refusal(where: str, fault: str, remedy: str) -> Callable[..., Any]:
    """Return a rule of derivatives that raises UsageError."""

    def refuse(*_: Sequence[Array]) -> None:
        raise UsageError(Problem(where, fault, remedy))

    return refuse


class _TermCall:
    """One compiled term of a model as a call from programs of JAX.

    Parameters
    ----------
    functions : of the model
    term : name
    samples : function from sizes by block to arguments, at which lanes are compared with the model
    cards : address of the kernels of the term, for JAX on cards

    Attributes
    ----------
    inputs, outputs : names of the arguments, sizes of the results
    address : of the C description of the term, which programs of JAX hold
    """

    def __init__(
        self,
        functions: Functions,
        term: str,
        samples: Callable[[Mapping[str, int]], list[Array]],
        cards: Sequence[int] = (),
    ) -> None:
        """Describe a compiled term in C memory that programs of JAX refer to; begin to compile lanes if these may be
        faster."""
        self.inputs = functions.inputs(term)
        self._library = library = functions.library
        number = library.index[term]
        function = library.layout["functions"][number]
        self.outputs = [int(output["size"]) for output in function["outputs"]]
        ffi, _ = _handler()
        self._term = ffi.new("eomgen_term *")
        _KEPT.append((self._term, library))  # compiled programs of JAX hold the address, for the time of the process
        sizes = [int(size) for size in function["input_sizes"]]
        of_term = self._term
        of_term.call = ffi.cast("model_call *", library.address("eomgen_call"))
        of_term.function = number
        of_term.inputs, of_term.outputs = len(sizes), len(self.outputs)
        of_term.sizes[0 : len(sizes) + len(self.outputs)] = [*sizes, *self.outputs]
        self._sizes = sizes
        operations = max(1, int(function["operations"]))
        of_term.least, of_term.share = LEAST, max(1, _SHARE // operations)
        of_term.threads = min(64, thread_count())
        of_term.stack = stack_size(int(library.layout.get("stack", 0)))
        self.address = int(ffi.cast("uintptr_t", of_term))
        self._of_lanes = (term, operations, samples)
        if cards:
            of_term.card = ffi.cast("void *", cards[0])
        elif self.outputs and library.companion is not None and (choice := chosen()) is not Choice.OFF:
            if choice is Choice.NOW:
                self._compile_lanes(RunningCompilers())
            else:
                in_background("eomgen-lanes", self._compile_lanes)

    def __call__(self, package: Any, blocks: Mapping[str, Array]) -> Array:
        """Return the first output (..., size) of the term as a JAX array, for arguments (..., size) by block. Batch
        axes broadcast: an axis of length 1 is constant. `package` is JAX."""
        arguments = [blocks[block] for block, size in zip(self.inputs, self._sizes, strict=True) if size]
        leading = _leading(blocks.values())
        if not self.outputs:
            return package.numpy.zeros((*leading, 0))
        shapes = tuple(package.ShapeDtypeStruct((*leading, size), np.float64) for size in self.outputs)
        return package.ffi.ffi_call(_TARGET, shapes)(*arguments, term=np.int64(self.address))[0]

    @property
    def in_lanes(self) -> bool:
        return bool(self._term.lanes)

    def _compile_lanes(self, _: RunningCompilers) -> None:
        """Compile the term in lanes, and use the lanes from then on if they have the bits of the model and are faster.
        Failures are logged, and leave the term without lanes."""
        lanes, (term, operations, samples) = LaneCompanions.of(self._library), self._of_lanes
        try:
            companion = lanes.expect(term, operations, _COMPARED, Choice.NOW)
            if companion is None:
                return
            inputs = samples(dict(zip(self.inputs, self._sizes, strict=True)))
            library = lanes.judge(companion, term, inputs, self.outputs, chosen())
        except (EomgenError, OSError) as error:
            _LOG.info("lanes of %s are left out: %s", term, error)
            return
        if library is not None:
            _KEPT.append((self._term, library))
            ffi, _lib = _handler()
            self._term.stack = stack_size(8 * int(library.layout.get("stack", 0)))  # of 8 samples side by side at most
            self._term.of_lanes = library.index[term]
            self._term.lanes = ffi.cast("model_call *", library.address("eomgen_call"))


#: Descriptions of terms, with the libraries of the terms.
_KEPT: list[tuple[Any, Any]] = []


def _check_precision(package: Any) -> None:
    if not package.config.jax_enable_x64:
        hint = 'jax.config.update("jax_enable_x64", True) before the first array'
        raise UsageError(Problem("jax", "JAX is set to float32 [E0950]", hint))


@functools.cache
def _package() -> Any:
    """Return the package JAX, imported and with the C handler registered once. Raises UsageError if JAX is not
    installed."""
    missing = Problem("jax", "the package jax is not installed [E0949]", "pip install 'eomgen[jax]'")
    package = optional_package("jax", missing)
    _, address = _handler()
    package.ffi.register_ffi_target(_TARGET, package.ffi.pycapsule(ctypes.c_void_p(address)), platform="cpu")
    return package


@functools.cache
def _cards() -> tuple[Any, ...]:
    """Return the rows of products by which terms run on cards, registered with JAX; none if JAX has no cards."""
    package = _package()
    rows = objects_of("eomgen.jax_cards") if package.default_backend() == "gpu" else ()
    for row in rows:
        address = ctypes.c_void_p(_handler(row.launch)[1])
        package.ffi.register_ffi_target(_TARGET, package.ffi.pycapsule(address), platform=row.platform)
    return rows


@functools.cache
def _handler(launch: str = "") -> tuple[Any, Any]:
    """Return cffi's ``ffi`` of the handler that XLA calls, and the handler's address; compiled at the first call.
    `launch` names the template by which a batch runs on a card."""
    package = import_module("jaxlib")
    header = import_module("jax").ffi.include_dir()
    text = environment().get_template("optimisers/xla.c.jinja")
    source = text.render(header=f"{header}/xla/ffi/api/c_api.h", version=package.__version__, launch=launch)
    declared = environment().get_template("optimisers/term.h").render()
    ffi, library = Builder().build_routine(source, f"{declared}\nvoid *eomgen_xla(void *);")
    _KEPT.append((ffi, library))
    return ffi, int(ffi.cast("uintptr_t", ffi.addressof(library, "eomgen_xla")))
