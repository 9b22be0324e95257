"""Evaluation of one term with user arguments: validation, defaults, base, inputs and accelerations if needed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.compiled.arguments import (
    WHERE,
    Requirements,
    by_name,
    check_finite,
    check_quaternions,
    components,
    numbers,
    read_only,
)
from eomgen.compiled.constraints import Blocks, acceleration_partials, accelerations, blocks_of, solvable
from eomgen.compiled.coordinates import coordinate_names, coordinate_units
from eomgen.compiled.functions import Functions
from eomgen.errors import Problem, UsageError
from eomgen.formula.evaluate import evaluate_batch
from eomgen.lie.product import Factor
from eomgen.system.description import Description, FixedFrame
from eomgen.system.terms import TERMS
from eomgen.toolchain.library import Library

Parameters = Mapping[str, ArrayLike | str] | ArrayLike | None
Inputs = Mapping[str, ArrayLike] | ArrayLike | None
States = Mapping[str, ArrayLike] | ArrayLike | None


class Terms:
    """Evaluator of a compiled model's terms on NumPy arrays.

    Validates arguments, completes omitted ones from the scene (base, inputs, internal states, multipliers), and has the
    names and units of the components of q, v and z.
    """

    def __init__(self, library: Library, description: Description) -> None:
        """Read names, units, sizes and initial values from the layout of a library."""
        layout: Mapping[str, Any] = library.layout
        self.functions = Functions(library)
        self.bodies: tuple[str, ...] = tuple(layout["bodies"])
        self.frames: tuple[str, ...] = tuple(layout["frames"])
        self.fixed_frames = {frame.name: frame for frame in description.frames}
        self.beams = frozenset(item.name for item in description.coordinates if item.length)
        self.multipliers: tuple[str, ...] = tuple(layout["multipliers"])
        self.factors = tuple(Factor(**factor) for factor in layout["factors"])
        self.angles = tuple(str(name) for name in layout["angles"])
        self.description = description
        self.q_names, self.v_names = coordinate_names(self.factors)
        self.q_units, self.v_units = coordinate_units(self.factors, description.coordinates)
        self.q_names += [f"q.{name}" for name in self.angles]
        self.q_units += ["rad"] * len(self.angles)
        self.initial_q = read_only(layout["initial_q"])
        self._first_angles = self.initial_q[int(layout["sizes"]["q"]) - len(self.angles) :]
        self.moving_base = bool(layout["facts"]["moving_base"])
        self.carried = self.moving_base and not description.joints  # absolute bodies hang in the world
        self.fixed_parameters = tuple(description.fixed)
        self.parameter_names = [str(item["name"]) for item in layout["parameters"]]
        self.parameter_units = {str(item["name"]): str(item["unit"]) for item in layout["parameters"]}
        self.input_names = tuple(str(item["name"]) for item in layout["inputs"])
        self.state_names = tuple(str(item["name"]) for item in layout["states"])
        self._initial_z = read_only(layout["initial_z"])
        self._base_zeros = [int(component) for component in layout["base_zeros"]]
        self._defaults = read_only([item["value"] for item in layout["parameters"]])
        self.digits_lost: dict[bytes, float] = {}  # relative errors of accelerations, by the bytes of parameters
        self._requirements = Requirements(description, self.parameter_names)
        self._fixed_values = description.fixed
        # a person makes the first calls
        self.motions_to_check = 16 if "constraint_bias" in self.functions else 0

    @property
    def library(self) -> Library:
        """The library that evaluates the terms: on the tape engine until the compiler is done, then the compiled
        one."""
        return self.functions.library

    @property
    def facts(self) -> Mapping[str, bool]:
        """Whether facts of the scene hold, by the words by which the register of terms says when a term exists."""
        layout = self.library.layout
        return {
            "constraints": bool(self.multipliers),
            "unconstrained": not self.multipliers,
            "states": bool(self.state_names),
            "large": "iteration" in self.functions,
            "absolute": bool(self.description.joints),
            "outputs": bool(layout["outputs"]),
            "rigid_tree": bool(self.description.linear_parameters),
            "tunable": bool(self.parameter_names),
            "tunable_outputs": bool(self.parameter_names) and bool(layout["outputs"]),
            "samples": bool(layout["sampled"]),
            "moving_base": self.carried,
            "given_inputs": "inputs" in self.functions,
            "exact_beams": bool(self.description.exact_beams),
        }

    def existing(self, terms: Iterable[str]) -> tuple[str, ...]:
        """Return the terms that the scene has, of several terms."""
        facts = [name for name, holds in self.facts.items() if holds]
        return tuple(name for name in terms if TERMS[name].exists_with(facts))

    def _other_scene(self, term: str) -> str:
        """Return words on the scenes that have a term; empty if this scene has the term, or may have it."""
        needed, facts = TERMS[term].exists if term in TERMS else (), self.facts
        if not needed or any(facts.get(fact, True) for fact in needed):
            return ""
        return f"a scene with {' or '.join(needed)}".replace("unconstrained", "no constraints").replace("_", " ")

    def parameters(self, parameters: Parameters) -> Array:
        """Return tunable parameters as (..., np).

        Raises
        ------
        UsageError
            Unknown names, wrong shapes, values that are not finite, or values that the scene would refuse as its own.
        """
        if parameters is None:
            return self._defaults
        if isinstance(parameters, Mapping):
            fixed, units = self.fixed_parameters, self.parameter_units
            array = by_name("parameter", parameters, self.parameter_names, self._defaults, fixed, units)
        else:
            array = components("parameters", parameters, len(self.parameter_names))
        check_finite("parameters", array, [f"parameter {name}" for name in self.parameter_names])
        self._requirements.check(array)
        return array

    def one_set(self, parameters: Parameters, instead_of_batches: str = "") -> Array:
        """Return tunable parameters as (np,). Raises UsageError as ``parameters``, and for a batch."""
        p = self.parameters(parameters)
        if p.ndim != 1:
            fault = f"one set of parameters is needed, not a batch of shape {p.shape} [E0278]"
            raise UsageError(Problem("parameters", fault, instead_of_batches))
        return p

    def place_of(self, frame: FixedFrame, parameters: Parameters) -> Array:
        """Return the position of a frame's origin in axes of the body that carries the frame, (..., 3), m, at
        parameters (..., np)."""
        rows = self.parameters(parameters)
        values: dict[str, float | Array] = {**self._fixed_values}
        values |= {name: rows[..., k] for k, name in enumerate(self.parameter_names)}
        entries = [evaluate_batch(formula, lambda symbol: values[symbol.name]) for formula in frame.position]
        return np.stack(np.broadcast_arrays(*entries), axis=-1)

    def base_at(self, t: ArrayLike, parameters: Parameters, base: ArrayLike | None) -> Array:
        """Return the state of a moving base at t, (..., 19): the caller's, or the scene's own."""
        if base is not None:
            return self.base(base)
        return self.functions("base", {"t": numbers("t", t), "p": self.parameters(parameters)})[0]

    def configuration(self, q: ArrayLike) -> Array:
        """Return q as (..., nq). Raises UsageError for a wrong shape and for quaternions that are not of unit length.

        References of angles that are left out are taken from the initial state.
        """
        array = components("q", self.with_references("q", q), self.functions.sizes["q"])
        check_quaternions("q", array, self.factors)
        return array

    def with_references(self, name: str, q: ArrayLike) -> ArrayLike:
        """Return q with the initial state's references of angles after the poses, if a caller gives the poses
        alone."""
        if not self.angles:
            return q
        array = numbers(name, q)
        if array.ndim == 0 or array.shape[-1] != self.functions.sizes["q"] - len(self.angles):
            return array
        return np.concatenate(
            [array, np.broadcast_to(self._first_angles, (*array.shape[:-1], len(self.angles)))], axis=-1
        )

    def follow_angles(self, q: Array, t: float, parameters: Array, base: Array | None = None) -> Array:
        """Return q (..., nq) with references of angles that follow the angles, each reference within half a turn of the
        angle."""
        if not self.angles:
            return q
        return np.concatenate(
            [q[..., : -len(self.angles)], self.angle_motion(q, None, t, parameters, base)[0]], axis=-1
        )

    def angle_motion(
        self, q: Array, v: Array | None, t: ArrayLike, parameters: Array, base: Array | None = None
    ) -> tuple[Array, Array]:
        """Return the angles that are counted over turns, rad, and the rates, rad/s, (..., number of angles) each. ``v``
        None: at rest. ``base`` None: the scene's motion at t in s."""
        values = {
            "q": q,
            "v": np.zeros(self.functions.sizes["v"]) if v is None else v,
            "t": numbers("t", t),
            "p": parameters,
        }
        if "base" in self.functions.inputs("joint_angles"):
            values["base"] = self.functions("base", values)[0] if base is None else base
        angle, rate = self.functions("joint_angles", values)
        return angle, rate

    def velocity(self, name: str, v: ArrayLike) -> Array:
        """Return v or a as (..., nv)."""
        return components(name, v, self.functions.sizes["v"])

    def zeros(self, block: str, t: ArrayLike, base: ArrayLike | None, p: Parameters, **more: ArrayLike) -> Array:
        """Check arguments, and return zeros (..., size) with the size of ``block``; ``more`` are q, v, a, and so on."""
        arrays = [numbers("t", t)[..., np.newaxis], self.parameters(p), self.configuration(more.pop("q"))]
        arrays += [self.velocity(name, value) for name, value in more.items()]
        arrays += [] if base is None else [self.base(base)]
        return np.zeros((*np.broadcast_shapes(*(array.shape[:-1] for array in arrays)), self.functions.sizes[block]))

    def internal(self, z: States) -> Array:
        """Return internal states as (..., nz). Raises UsageError."""
        if z is None:
            return self._initial_z
        if isinstance(z, Mapping):
            return by_name("state", z, self.state_names, self._initial_z)
        return components("z", z, len(self.state_names))

    def call(self, term: str, **arguments: Any) -> tuple[Array, ...]:
        """Return the outputs of a term at a state, arrays with the leading axes of the arguments, in the order of the C
        code.

        Parameters
        ----------
        arguments : q and parameters; v, a, t, u, z, multipliers, base, weights and time derivatives, as far as the term
            depends on them
            Values that are missing or None: accelerations by forward dynamics, multipliers 0, inputs and base by the
            scene's formulas, internal states at their initial values.

        Raises
        ------
        UsageError
            Missing velocities, accelerations that cannot be computed, and arguments of wrong shapes.
        """
        try:
            blocks = set(self.functions.inputs(term))
        except (UsageError, TypeError):  # a list of terms has no hash
            raise self.functions.missing(str(term), self._other_scene(str(term))) from None
        if "v" in blocks and arguments.get("v") is None:
            raise UsageError(Problem("v", f"the term {term} needs velocities [E0279]"))
        missing_a = "a" in blocks and arguments.get("a") is None
        constrained = "forward_dynamics" not in self.functions and solvable(self.functions)
        if missing_a:
            blocks |= blocks_of(self.functions) if constrained else self._acceleration_blocks(term)
        values = {"q": self.configuration(arguments["q"]), "p": self.parameters(arguments["parameters"])}
        for block in ("v", "a"):
            if arguments.get(block) is not None:
                values[block] = self.velocity(block, arguments[block])
        values["t"] = self._times(term, arguments, values, needed="t" in blocks)
        if "z" in blocks or arguments.get("z") is not None:
            values["z"] = self.internal(arguments.get("z"))
        if "lam" in blocks:
            size = self.functions.sizes["lam"]
            multipliers = arguments.get("multipliers")
            values["lam"] = np.zeros(size) if multipliers is None else components("multipliers", multipliers, size)
        self._prescribe(term, values, arguments, blocks)
        if missing_a and constrained:
            values["a"], multipliers = accelerations(self.functions, values)
            if arguments.get("multipliers") is None:
                values["lam"] = multipliers
        elif missing_a:
            values["a"] = self.functions("forward_dynamics", values)[0]
        if not blocks.isdisjoint(DERIVATIVES):
            values |= derivative_values(self, term, arguments, values)
        return self.functions(term, values)

    def _acceleration_blocks(self, term: str) -> set[str]:
        """Return the input blocks of forward dynamics, by which the accelerations of a term are computed."""
        if "forward_dynamics" not in self.functions:
            fault = f"the term {term} needs accelerations, and the model has no forward_dynamics [E0280]"
            raise UsageError(Problem("a", fault, "a=..."))
        return set(self.functions.inputs("forward_dynamics"))

    def at(self, t: ArrayLike, parameters: Parameters, u: Inputs = None, base: ArrayLike | None = None) -> TermsAt:
        """Return the terms at one time, parameters, inputs and base, for calls at many states."""
        return TermsAt(self, t, parameters, u, base)

    def accelerations(self, **arguments: Any) -> tuple[Array, Array]:
        """Return vdot (..., nv) and the multipliers (..., rows) of a constrained model, arguments as in ``call``."""
        return accelerations(self.functions, self._states(arguments))

    def acceleration_partials(self, moves: Iterable[tuple[Blocks, Blocks, float]], **arguments: Any) -> Array:
        """Return difference quotients of vdot of a constrained model over moves of the state, (..., nv, moves).
        ``moves`` are as in ``constraints.acceleration_partials``, ``arguments`` as in ``call``."""
        return acceleration_partials(self.functions, self._states(arguments), moves)

    def _states(self, arguments: Mapping[str, Any]) -> dict[str, Array]:
        """Return the input blocks for the accelerations of a constrained model, checked, from arguments of ``call``."""
        if not solvable(self.functions):
            self.functions.inputs("forward_dynamics")  # says that the term is missing
        values = {"q": self.configuration(arguments["q"]), "v": self.velocity("v", arguments["v"])}
        blocks = blocks_of(self.functions)
        values["p"] = self.parameters(arguments["parameters"])
        values["t"] = self._times("forward_dynamics", arguments, values, needed="t" in blocks)
        values["z"] = self.internal(arguments.get("z"))
        self._prescribe("forward_dynamics", values, arguments, blocks)
        return values

    def _times(self, term: str, arguments: Mapping[str, Any], values: Mapping[str, Array], *, needed: bool) -> Array:
        """Return the times t (...), s, from the arguments of a call; 0 if not given. Raises UsageError for nv numbers
        with one state if the term does not depend on time (``needed`` false): these are efforts, as in the functions of
        (q, v, tau) of other tools."""
        t = numbers("t", arguments.get("t", 0.0))
        single = all(values[block].ndim == 1 for block in ("q", "v") if block in values)
        if t.ndim == 1 and single and not needed and arguments.get("u") is None and len(t) == self.functions.sizes["v"]:
            fault = f"{len(t)} times for one state, and {term} does not depend on time [E0281]"
            inputs = "u=..." if self.input_names else "u=... in a scene with inputs, of other formats actuated=True"
            raise UsageError(Problem("t", fault, f"efforts by inputs: {inputs}"))
        return t

    def _prescribe(self, term: str, values: dict[str, Array], arguments: Mapping[str, Any], blocks: set[str]) -> None:
        """Add weights, the state of the base and the inputs to ``values``, in place, if ``blocks`` of the term need
        these. They are the caller's in ``arguments``, else the scene's at the time in ``values``."""
        if "weights" in blocks:
            if "weights" not in arguments:
                derived = term.removesuffix("_hessian")
                call = "sensitivities(...).hessian" if derived == term else f'hessian("{derived}", weights, q, ...)'
                raise UsageError(Problem("weights", f"the term {term} needs weights [E2244]", f"model.{call}"))
            values["weights"] = arguments["weights"]
        if arguments.get("base") is not None:
            values["base"] = self.base(arguments["base"])
        elif "base" in blocks:
            values["base"] = self.functions("base", values)[0]
        if "u" in blocks or arguments.get("u") is not None:
            values["u"] = self.inputs(arguments.get("u"), values)

    def base(self, base: ArrayLike) -> Array:
        """Return the caller's state of the base as (..., 19).

        Raises
        ------
        UsageError
            The scene's base is at rest, or a component is not zero that the base's law keeps at zero at all times.
        """
        if not self.moving_base:
            raise UsageError(
                Problem("base", "the base of this scene is at rest [E0282]", "a [base] section in the scene")
            )
        values = components("base", base, self.functions.sizes["base"])
        self._check_zeros("base", values, [(component, component) for component in self._base_zeros])
        return values

    def base_rates(self, rates: ArrayLike) -> Array:
        """Return the caller's derivatives of the base's twist from the second on, (..., orders, 6), as (..., 6 orders).
        Raises UsageError for a base at rest, a wrong shape, and components that the base's law keeps at zero."""
        if not self.moving_base:
            raise UsageError(
                Problem("base_rates", "the base of this scene is at rest [E0282]", "a [base] section in the scene")
            )
        size = self.functions.sizes["base_rates"]
        values = _flat("base_rates", rates, (size // 6, 6), size)
        from eomgen.system.system import base_place  # noqa: PLC0415  # few calls give a motion of the base

        first = base_place("omega_dot")
        of_twist = [component for component in self._base_zeros if component >= first]
        places = [(6 * row + component - first, component) for row in range(size // 6) for component in of_twist]
        self._check_zeros("base_rates", values, places)
        return values

    def _check_zeros(self, name: str, values: Array, places: Sequence[tuple[int, int]]) -> None:
        """Raise UsageError if one of the components of ``values`` is not zero that the base's law keeps at zero at all
        times. ``places`` are (index in ``values``, component of the base struct); the equations are compiled without
        these."""
        for index, component in places:
            wrong = values[..., index][values[..., index] != 0.0]
            if wrong.size:
                from eomgen.system.system import base_component  # noqa: PLC0415  # for a mistake only

                of_base = base_component(component)
                fault = (
                    f"component {index} is {wrong[0]:.6g}, but {of_base} of the base is 0 at all times by the scene's"
                    " law, and the equations are without it [E0283]"
                )
                raise UsageError(Problem(name, fault, f"0 there, or a law in [base] by which {of_base} changes"))

    def formula_inputs(self, values: Mapping[str, Array]) -> Array:
        """Return the inputs that the scene specifies at ``values["t"]``, 0 for any other input."""
        if "inputs" in self.functions:
            return self.functions("inputs", values)[0]
        return np.zeros((*values["t"].shape, len(self.input_names)))

    def inputs(self, u: Inputs, values: Mapping[str, Array]) -> Array:
        """Return inputs as (..., nu), SI units; inputs that a mapping or None leaves out follow the scene
        (``formula_inputs``). ``values`` are the blocks t and p. Raises UsageError for unknown names and wrong
        shapes."""
        if u is not None and not isinstance(u, Mapping):
            if not self.input_names and (size := numbers("u", u).size):
                fault = f"{size} number{'s' * (size != 1)} cannot be inputs: the scene has none [E0284]"
                raise UsageError(Problem("u", fault, WHERE["input"]))
            return components("u", u, len(self.input_names))
        of_scene = self.formula_inputs(values)
        return of_scene if u is None else by_name("input", u, self.input_names, of_scene)


class TermsAt:
    """Terms at one time, or at several at once, with parameters, inputs and a base that are checked once, for searches
    that call them at many states: checks and the scene's laws of time take longer than a small term.

    Parameters
    ----------
    t, parameters, u, base : as of ``Terms.call``
    """

    def __init__(self, terms: Terms, t: ArrayLike, parameters: Parameters, u: Inputs, base: ArrayLike | None) -> None:
        self._functions = terms.functions
        self._values = {"t": numbers("t", t), "p": terms.parameters(parameters)}
        if base is not None:
            self._values["base"] = terms.base(base)
        elif "base" in terms.functions:
            self._values["base"] = terms.functions("base", self._values)[0]
        self._values["u"] = terms.inputs(u, self._values)

    def __call__(self, term: str, **state: Array) -> tuple[Array, ...]:
        """Return the outputs of a term.

        Parameters
        ----------
        state : all further blocks of the term, as q, v, a, z and lam: arrays of doubles (..., size)
        """
        return self._functions(term, {**self._values, **state})

    def row(self, number: int) -> TermsAt:
        """Return the terms at index ``number`` of the several times, sets of parameters, inputs or bases."""
        result = TermsAt.__new__(TermsAt)
        result._functions = self._functions
        result._values = {
            name: value if value.ndim == (name != "t") else value[number] for name, value in self._values.items()
        }
        return result


class EvaluatedModel(Protocol):
    """A model whose terms can be evaluated: the first argument of functions that are methods of models."""

    @property
    def evaluator(self) -> Terms: ...


class ExtensibleModel(EvaluatedModel, Protocol):
    """A model that other terms can be added to."""

    def having(self, terms: Sequence[str]) -> Self:
        """Return a model of the same scene that has all of some terms."""
        ...


#: Blocks of time derivatives.
DERIVATIVES = frozenset({"j", "s", "a_higher", "u_dot", "u_ddot", "u_higher", "base_rates"})
_MEANING = {"j": "the first time derivative of a", "s": "the second time derivative of a"}
_MEANING["a_higher"] = "the time derivatives of a from the third on"


def check_derivatives(names: Iterable[str]) -> None:
    """Raise UsageError for names of arguments that are not blocks of time derivatives, ``DERIVATIVES``."""
    for name in names:
        if name not in DERIVATIVES:
            raise UsageError(
                Problem(
                    name, "no term takes an argument of this name [E0285]", f"one of {', '.join(sorted(DERIVATIVES))}"
                )
            )


def derivative_values(
    terms: Terms, term: str, state: Mapping[str, Any], values: Mapping[str, Array]
) -> dict[str, Array]:
    """Return the blocks of derivatives that a term takes.

    Parameters
    ----------
    state : arguments of the caller; missing derivatives of inputs are the scene's, or zero for inputs that the caller
        gives
    values : the remaining blocks

    Raises
    ------
    UsageError
        For derivatives of a that are missing, arrays of the wrong shape, names that do not exist, and a base without
        rates.
    """
    blocks = terms.functions.inputs(term)
    result: dict[str, Array] = {}
    for block in ("j", "s", "a_higher"):
        if block in blocks:
            if state.get(block) is None:
                raise UsageError(Problem(block, f"the term {term} needs {_MEANING[block]} [E0286]", f"{block}=..."))
            result[block] = (
                _rows(terms, term, block, state[block]) if block == "a_higher" else terms.velocity(block, state[block])
            )
    if any(block in blocks for block in ("u_dot", "u_ddot", "u_higher")):
        result |= _input_derivatives(terms, term, blocks, state, values)
    if "base_rates" in blocks:
        result["base_rates"] = _base_derivatives(terms, state, values)
    return result


def _input_derivatives(
    terms: Terms, term: str, blocks: list[str], arguments: Mapping[str, Any], values: Mapping[str, Array]
) -> dict[str, Array]:
    """Return the blocks u_dot, u_ddot and u_higher as far as the term takes them (``blocks``). They are the
    caller's in ``arguments``, else the scene's own, and zero for inputs that the caller gives."""
    of_scene: dict[str, Array] = {}
    if "input_rates" in terms.functions:
        of_scene = dict(
            zip(terms.functions.output_names("input_rates"), terms.functions("input_rates", values), strict=True)
        )
    driven = arguments.get("u")
    names = terms.input_names
    by_caller = np.array(
        [driven is not None and (not isinstance(driven, Mapping) or name in driven) for name in names], bool
    )
    result: dict[str, Array] = {}
    for block in ("u_dot", "u_ddot"):
        if block not in blocks:
            continue
        default = np.where(by_caller, 0.0, of_scene[block]) if block in of_scene else np.zeros(len(names))
        rates = arguments.get(block)
        if rates is None:
            result[block] = default
        elif isinstance(rates, Mapping):
            result[block] = by_name("input", rates, names, default)
        else:
            result[block] = components(block, rates, len(names))
    if "u_higher" in blocks:
        if arguments.get("u_higher") is not None:
            result["u_higher"] = _rows(terms, term, "u_higher", arguments["u_higher"])
        else:
            rows = np.where(by_caller, 0.0, of_scene["u_higher"]) if of_scene else np.zeros((1, len(names)))
            size = terms.functions.sizes["u_higher"]
            result["u_higher"] = rows.reshape(*rows.shape[:-2], -1) if of_scene else np.zeros(size)
    return result


def _base_derivatives(terms: Terms, arguments: Mapping[str, Any], values: Mapping[str, Array]) -> Array:
    if arguments.get("base_rates") is not None:
        return terms.base_rates(arguments["base_rates"])
    if arguments.get("base") is not None:
        fault = "a base that is given needs the further derivatives of its twist as well [E0287]"
        raise UsageError(
            Problem("base_rates", fault, "base_rates=..., or neither of the two for the scene's own motion")
        )
    (rates,) = terms.functions("base_rates", values)
    return rates.reshape(*rates.shape[:-2], -1)


def _rows(terms: Terms, term: str, block: str, value: ArrayLike) -> Array:
    """Return derivatives from the third on, given as (..., order of the term - 2, n), flat as (..., size), zeros at the
    end. ``block`` is ``a_higher`` or ``u_higher``. Raises UsageError for another shape."""
    size = terms.functions.sizes[block]
    width = terms.functions.sizes["v" if block == "a_higher" else "u"]
    return _flat(block, value, (int(term.rsplit("_", 1)[1]) - 2, width), size)


def _flat(block: str, value: ArrayLike, shape: tuple[int, int], size: int) -> Array:
    array = numbers(block, value)
    if array.shape[-2:] != shape:
        hint = f"{block} row by row, one derivative each, or a batch of that along leading axes"
        raise UsageError(
            Problem(block, f"the shape is {array.shape}, (..., {shape[0]}, {shape[1]}) is needed [E0288]", hint)
        )
    batch = array.shape[:-2]
    flat = np.zeros((*batch, size))
    flat[..., : shape[0] * shape[1]] = array.reshape(*batch, shape[0] * shape[1])
    return flat
