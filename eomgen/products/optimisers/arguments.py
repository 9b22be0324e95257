"""Functions of a model for JAX and PyTorch: their arguments, and tangents of configurations as arrays.

A change dq of the components of q turns the body, and a change of the length of a quaternion does not count:
with w and x of the quaternion, and n its squared length, the body-frame rotation is 2 (w dx - dw x - x cross dx)/n.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from eomgen.compiled.argument_derivatives import size_of
from eomgen.compiled.model import CompiledModel
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.lie.product import Factor
from eomgen.products.optimisers.runs import Runs
from eomgen.system.terms import ARGUMENTS, TERMS

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model

Array = Any
#: Terms that are offered as differentiable functions.
OFFERED = ("inverse_dynamics", "forward_dynamics")


def arguments_of(name: str) -> list[str]:
    """Return the arguments in which a term has derivatives, q first."""
    return [block for block in ARGUMENTS if block in TERMS[f"{name}_derivatives"].inputs]


def no_array(name: str, value: object) -> UsageError:
    """Return the error for an argument without real numbers."""
    fault = f"an array of real numbers is needed, not {type(value).__name__} [E2194]"
    return UsageError(Problem(name, fault, "a list of numbers"))


class ModelArguments:
    """Arguments of the functions of a model for a library of arrays.

    Parameters
    ----------
    library_name : name of the library, for messages
    model : compiled, without force laws in Python

    Attributes
    ----------
    sizes : numbers of each argument
    defaults : values of the scene, of parameters and internal states
    """

    def __init__(self, library_name: str, model: Model) -> None:
        if not isinstance(model, CompiledModel):
            fault = f"a model is needed, not {type(model).__name__} [E2193]"
            raise UsageError(Problem(library_name, fault, "eomgen.build(scene)"))
        if model.library.layout.get("python"):
            fault = f"{model.name} has force laws in Python [E0945]"
            raise ModelError(Problem(library_name, fault, "the laws in C, [laws] source"))
        model.finish_compilation()
        self.library_name, self.model = library_name, model
        self.sizes = self.evaluator.functions.sizes
        self.defaults = {"p": self.evaluator.parameters(None), "z": self.evaluator.internal(None)}

    @property
    def evaluator(self) -> Any:
        """Evaluation of the model's terms."""
        return self.model.evaluator

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


class ModelFunctions(ABC):
    """The dynamics of a model as functions for a library of arrays."""

    _scene: ModelArguments

    def forward_dynamics(
        self,
        q: Array,
        v: Array,
        t: Array = 0.0,
        u: Array | None = None,
        *,
        z: Array | None = None,
        parameters: Array | Mapping[str, Array] | None = None,
    ) -> Array:
        """Return the acceleration vdot = M^-1 (Q - h - b), (..., nv), rad/s^2 and m/s^2.

        Leading axes are samples, which broadcast; in JAX there are none, and ``jax.vmap`` makes batches.

        Parameters
        ----------
        q, v : (..., nq) and (..., nv) arrays
            Configuration, and left-trivialised velocity.
        t : (...) array, optional
            Time, s.
        u, z : (..., nu) and (..., nz) arrays, optional
            Inputs and internal states, SI units; by default inputs by the scene's formulas at t, else zero, and
            initial internal states. A moving base follows its law at t, also in derivatives.
        parameters : (..., np) array, or mapping of (...) arrays, optional
            Tunable parameters, all in order or some by name, SI units; else values of the scene.

        Returns
        -------
        (..., nv) array
            Accelerations, left-trivialised; rad/s^2 and m/s^2.

        Raises
        ------
        UsageError
            A wrong shape, complex numbers, float32, a tensor of another device, or an unknown parameter; a derivative
            in ``t`` or ``parameters`` while ``u`` is not given and follows formulas of the scene; a third derivative.
        ModelError
            A scene with constraints.
        """
        if (model := self._scene.model).multipliers:
            fault = f"{model.name} has constraints: accelerations are not a function of q and v alone [E0946]"
            hint = "inverse_dynamics; simulate, whose gradients go through loops"
            raise ModelError(Problem(self._scene.library_name, fault, hint))
        return self._evaluate("forward_dynamics", {"q": q, "v": v, "t": t, "u": u, "z": z, "p": parameters})

    def inverse_dynamics(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array = 0.0,
        u: Array | None = None,
        *,
        z: Array | None = None,
        parameters: Array | Mapping[str, Array] | None = None,
    ) -> Array:
        """Return the generalized forces that a motion needs, tau = M a + h + b - Q, (..., nv), N m and N.

        Leading axes are samples, which broadcast; in JAX there are none, and ``jax.vmap`` makes batches.

        Parameters
        ----------
        q, v, a : (..., nq), (..., nv) and (..., nv) arrays
            Configuration, and left-trivialised velocity and acceleration.
        t : (...) array, optional
            Time, s.
        u, z : (..., nu) and (..., nz) arrays, optional
            Inputs and internal states, SI units; by default inputs by the scene's formulas at t, else zero, and
            initial internal states. A moving base follows its law at t, also in derivatives.
        parameters : (..., np) array, or mapping of (...) arrays, optional
            Tunable parameters, all in order or some by name, SI units; else values of the scene.

        Returns
        -------
        (..., nv) array
            Generalized forces in addition to the scene's own, with constraint forces among them; N m along angles, N
            along lengths.

        Raises
        ------
        UsageError
            Arguments or derivatives that are refused as in ``forward_dynamics``; scenes with constraints are not.
        """
        return self._evaluate("inverse_dynamics", {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "p": parameters})

    def simulate(
        self,
        t_end: float | None = None,
        step: float | None = None,
        *,
        q: Array | None = None,
        v: Array | None = None,
        parameters: Mapping[str, Array] | None = None,
        inputs: Mapping[str, Array] | None = None,
        of: Sequence[str] | None = None,
        method: str | None = None,
        record_every: int | None = None,
        settings: Mapping[str, float] | None = None,
    ) -> dict[str, Array]:
        """Return the outputs of a run, whose reverse derivatives are one adjoint of the discrete steps.

        Derivatives are taken in all arrays that are given here: the initial state, parameters, and inputs at every
        step; first reverse derivatives alone: ``model.sensitivities`` has tangents and Hessians. Runs are stepped in C,
        and a batch of ``vmap`` takes one run after another. With JAX each call first makes a run at the scene's values,
        with given inputs zero, also when ``jax.jit`` traces the call.

        Parameters
        ----------
        t_end, step : float, optional
            End and step, s; values of the scene if not given.
        q, v : (nq,) and (nv,) arrays, optional
            Initial state; the start of the scene if not given.
        parameters : mapping, optional
            Tunable parameters by name, SI units.
        inputs : mapping, optional
            Inputs by name -> values at all steps, (steps + 1,), linear in between; else formulas of the scene, or zero.
        of : sequence of str, optional
            Outputs; all of the scene by default.
        method : str, optional
            Integration method, ``generalized_alpha``, ``rattlie`` or ``rk4`` for instance; the scene's by default.
        record_every : int, optional
            Steps from row to row, a divisor of the number of steps; by default the scene's.
        settings : mapping, optional
            Of the method, by name.

        Returns
        -------
        dict
            Output -> (rows,) array, or (rows, size), at the recorded rows: the start, and each ``record_every`` steps.

        Raises
        ------
        UsageError
            As ``model.sensitivities``: no outputs, a method without derivatives, an end that is not a whole number of
            steps; a wrong shape or type of an array; forward or second derivatives.
        NumericalError
            The run fails, or an event ends the run. Within ``jax.jit`` or ``jax.grad`` the failure of a run is an
            error of JAX, except of the run at the scene's values.

        Examples
        --------
        >>> import jax
        >>> jax.config.update("jax_enable_x64", True)
        >>> functions = eomgen.jax(eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml"))
        >>> def end(mass):
        ...     return functions.simulate(0.1, 1e-3, parameters={"m2": mass}, of=["energy"])["energy"][-1]
        >>> jax.grad(end)(1.0).shape
        ()
        """
        nest: dict[str, Any] = {
            name: None if value is None else self._array(name, value) for name, value in (("q", q), ("v", v))
        }
        for block, values in (("parameters", parameters), ("inputs", inputs)):
            if not (values is None or isinstance(values, Mapping)):
                fault = f"a mapping from names to values is needed, not {type(values).__name__} [E0526]"
                raise UsageError(Problem(block, fault, f"{block}={{name: value}}"))
            nest[block] = {name: self._array(name, value) for name, value in (values or {}).items()}
        options = {"t_end": t_end, "step": step, "of": of, "method": method, "record_every": record_every}
        runs = Runs(self._scene.model, {**options, "settings": settings}, nest)
        table = self._run(runs, nest)
        return runs.by_output(table)

    @abstractmethod
    def _evaluate(self, name: str, arguments: Mapping[str, Any]) -> Array:
        """Return the values of a term for arguments by block, of which some are None or mappings by name."""

    @abstractmethod
    def _array(self, name: str, value: Any) -> Array:
        """Return an argument as an array of the library. Raises UsageError for other values."""

    @abstractmethod
    def _run(self, runs: Runs, nest: Mapping[str, Any]) -> Array:
        """Return the table of outputs, with derivatives in the arrays of a nest."""


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
