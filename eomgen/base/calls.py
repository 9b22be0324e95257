"""Error messages for wrong calls from Python: unknown arguments, names and attributes, with the nearest known ones
and equivalents in other tools.

Python's own errors (TypeError, KeyError, AttributeError) name the fault and no remedy. The errors raised here
are ``UsageError``; for names and attributes also the class that Python would raise, which ``hasattr`` and callers may
rely on.

Attributes of models, solutions, simulators and linear models in other tools stand in one table, by public classes (the
key ``""`` is the package itself), and so do names of terms.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import FrozenInstanceError
from functools import cache
from typing import TYPE_CHECKING, Any, NoReturn, ParamSpec, TypeVar

from eomgen.base.data import wrap_method
from eomgen.base.messages import counted, nearest, shown
from eomgen.base.products import fault_of_absent, fault_of_removed, public_names, rows_of
from eomgen.base.verbs import OWNERS, methods
from eomgen.errors import Problem, UsageError

_OF_MOTIONS = "simulate(...).{0}, of a motion; a model has initial_{0}"
_RUN = "simulate(t_end, step=...)"
_STEPS = "step(n=...) or advance(t)"
_CSV = 'save("run.csv")'
_STATES = 'q, v and z; solution["q.joint"] is one column'
_PARAMETERS = "simulate(..., parameters={...}); between steps start(...).set_parameter(name, value)"

#: Names of a term in other programs and in the field, in lower case, and the name of the term in eomgen.
TERMS_ELSEWHERE: Mapping[str, str] = {
    **dict.fromkeys(("inertia", "inertia_matrix", "mass_matrix", "joint_space_inertia", "m", "crba"), "mass"),
    **dict.fromkeys(("h", "bias", "nle", "centrifugal", "gyroscopic", "coriolis_vector", "nonlinear"), "coupling"),
    **dict.fromkeys(("q", "gravity", "forcing", "generalized_force", "applied_force"), "force"),
    **dict.fromkeys(("tau", "torque", "efforts", "rnea", "inverse"), "inverse_dynamics"),
    **dict.fromkeys(("vdot", "aba", "forward", "qdd"), "forward_dynamics"),
    **dict.fromkeys(("kinetic", "potential", "energies", "kinetic_energy", "potential_energy", "lagrangian"), "energy"),
    **dict.fromkeys(("derivatives", "gradients", "tangent"), "partials"),
    **dict.fromkeys(("joint_torque_regressor", "y", "identification"), "regressor"),
    **dict.fromkeys(("inertial_parameters", "dynamic_parameters", "pi"), "regressor_parameters"),
    **dict.fromkeys(("sensitivity", "sensitivities", "parameter_derivatives", "df_dp"), "parameter_partials"),
    **dict.fromkeys(("stiffness", "damping", "linear"), "linearization"),
    **dict.fromkeys(("kinematics", "forward_kinematics", "positions", "frames"), "poses"),
    **dict.fromkeys(("velocity", "velocities"), "twists"),
    **dict.fromkeys(("phi", "constraints", "loops"), "constraint"),
    **dict.fromkeys(("g_q", "phi_q", "lambda", "multipliers"), "constraint_jacobian"),
    **dict.fromkeys(("com", "centre_of_mass", "center_of_gravity", "cog"), "center_of_mass"),
    **dict.fromkeys(("ag", "cmm", "ccrba", "centroidal_map", "centroidal"), "centroidal_momentum"),
    **dict.fromkeys(("dag", "dccrba"), "centroidal_momentum_rate"),
    **dict.fromkeys(("jacobian", "frame_jacobian", "j"), "frame_jacobians"),
    **dict.fromkeys(("jdot", "j_dot", "jacobian_rates", "jacobian_time_variation"), "frame_jacobian_rates"),
    **dict.fromkeys(("jdot_v", "bias_acceleration", "jacobian_drift"), "frame_drifts"),
    **dict.fromkeys(("operational_space_inertia", "osim", "lambda_inverse"), "frame_mobilities"),
    "b": "base_motion",
}

#: Names of attributes in other programs, and the remedy, by class; "" is the package.
ATTRIBUTES: Mapping[str, Mapping[str, str]] = {
    "Model": {
        **dict.fromkeys(("step", "advance"), "start(step=...), whose step(u) takes one step"),
        **dict.fromkeys(("run", "solve", "sim", "integrate_motion", "propagate"), _RUN),
        **dict.fromkeys(("reset", "simulator", "env", "make_data"), "start(step=...), which makes a Simulator"),
        **{name: _OF_MOTIONS.format(name) for name in ("q", "v", "z")},
        **dict.fromkeys(("a", "t", "x", "y", "u", "state", "data"), "simulate(...), whose solution has t, q, v, a, z"),
        **dict.fromkeys(("q0", "x0", "qpos0"), "initial_q"),
        **dict.fromkeys(("v0", "dq0", "qd0", "qdot0"), "initial_v"),
        **dict.fromkeys(("set_parameter", "set_parameters", "set_param"), _PARAMETERS),
        **dict.fromkeys(("set_input", "set_inputs"), "simulate(..., inputs={...}), or start(...).step(u)"),
        **dict.fromkeys(("set_state", "set_initial", "set_q"), "simulate(..., initial={...})"),
        **dict.fromkeys(("joints", "joint_names", "dofs", "coordinates"), "q_names, which names each coordinate"),
        **dict.fromkeys(("links", "link_names", "body_names"), "bodies"),
        "frame_names": "frames",
        **dict.fromkeys(
            ("nle", "nonlinear_effects", "qfrc_bias"), "coupling(q, v) - force(q, v), since forces hold gravity"
        ),
        **dict.fromkeys(("gravity", "g", "generalized_gravity"), "force(q, v), which holds gravity; at rest v = 0"),
        "plot": "simulate(...).plot()",
        "export": "save(path), simulate(...).save(path), or eomgen.generate(scene, folder) for C",
        **dict.fromkeys(("generate", "to_c", "codegen"), "eomgen.generate(scene, folder)"),
    },
    "Solution": {
        **dict.fromkeys(("y", "x", "X", "Y", "states", "state"), _STATES),
        **dict.fromkeys(("time", "times", "ts", "tout", "T"), "t"),
        **dict.fromkeys(("qdd", "qddot", "vdot", "ddq"), "a"),
        **dict.fromkeys(("u", "input", "controls"), "inputs"),
        **dict.fromkeys(("parameters", "params", "parameter_values"), 'metadata["parameters"]'),
        **dict.fromkeys(("lam", "lambda_", "reactions", "forces"), "multipliers, or outputs that name a reaction"),
        **dict.fromkeys(
            ("section_forces", "internal_forces", "stress_resultants", "strains", "internal_loads"),
            "section_loads, by the names of geometrically exact beams",
        ),
        **dict.fromkeys(("to_csv", "csv", "write", "export"), _CSV),
        **dict.fromkeys(("df", "dataframe", "to_df", "to_dataframe"), "to_pandas()"),
        **dict.fromkeys(("keys", "names"), "columns(), which has all columns by name"),
        **dict.fromkeys(("status", "ok", "converged"), "success and message"),
        **dict.fromkeys(("sol", "interpolate"), "at(t)"),
    },
    "Simulator": {
        **dict.fromkeys(("simulate", "run", "integrate", "step_to", "solve"), _STEPS),
        "reset": "set_state(initial), restore(state), or another model.start(...)",
        **dict.fromkeys(("set_input", "set_inputs", "apply"), "step(u), which takes the inputs of its steps"),
        **dict.fromkeys(("set_q", "set_qpos", "set_positions"), 'set_state({"q": q, "v": v})'),
        **dict.fromkeys(("time", "now"), "t"),
        **dict.fromkeys(("x", "y"), "q, v and z"),
        **dict.fromkeys(("u", "input", "controls", "ctrl"), "inputs"),
        **dict.fromkeys(("qdd", "qddot", "vdot", "qacc"), "a"),
        **dict.fromkeys(("result", "results", "history", "trajectory"), "record() at each row, then solution()"),
    },
    "SceneBuilder": {
        **dict.fromkeys(("to_scene", "finish", "make", "compile", "create"), "build(), which returns the Scene"),
    },
    "": {
        **dict.fromkeys(("Simulator", "start"), "eomgen.build(scene).start(...)"),
        **dict.fromkeys(("load_scene", "read", "load_toml", "open"), "load"),
        **dict.fromkeys(("run", "solve"), "eomgen.build(scene).simulate(...)"),
        **dict.fromkeys(("compile", "make"), "build"),
    },
}


P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")
C = TypeVar("C", bound=type)

#: Methods of a compiled model that no verb gives, and users look for at scenes, at systems and at the package.
_OF_COMPILED = frozenset(
    {
        "calibrate",
        "evaluate",
        "mass",
        "force",
        "coupling",
        "inverse_dynamics",
        "forward_dynamics",
        "partials",
        "energy",
        "outputs",
        "pose",
        "twist",
        "point",
        "rhs",
    }
)
#: Names of states in other tools.
_SYMBOLS: Mapping[str, str] = {
    **dict.fromkeys(("qd", "qdot", "dq", "q_dot", "qvel"), "v"),
    **dict.fromkeys(("qpos",), "q"),
}
_MEANING = {"q": "positions", "v": "velocities"}
#: Names of first parameters that a caller does not write.
_OWNERS = ("self", "cls", "model", "solution")


class UnknownName(UsageError, KeyError):
    """A name that results do not have."""

    __str__ = Exception.__str__  # a KeyError shows its text in quotes


class UnknownAttribute(UsageError, AttributeError):
    """An attribute that an object does not have."""


class SingleObject(UsageError, TypeError):
    """A result that is one object, and no sequence."""


class NoAssignment(UsageError, FrozenInstanceError):
    """An attribute that is read, and not assigned to."""


class NamedResults(dict[str, T]):
    """Results by name; a request for a missing name is answered with the nearest names.

    Parameters
    ----------
    kind : str
        Kind of the names: ``output``.
    values : mapping
    absent : mapping, optional
        Names of results that others have -> the reason why they are not here.
    """

    def __init__(self, kind: str, values: Mapping[str, T], absent: Mapping[str, str] | None = None) -> None:
        super().__init__(values)
        self.kind, self.absent = kind, dict(absent or {})

    def __missing__(self, name: object) -> T:
        if name in self.absent:
            others = ", ".join(self) or "another scene"
            raise UnknownName(
                Problem("", f"there is no {self.kind} {shown(name)}: {self.absent[str(name)]} [E0098]", others)
            )
        hint = nearest(str(name), self) if self else f"a scene or a model that has {self.kind}s"
        raise UnknownName(Problem("", f"there is no {self.kind} {shown(name)} [E0100]", hint))

    if not TYPE_CHECKING:  # a type checker knows the attributes without this method

        def __getattr__(self, name: str) -> object:
            if name in self:
                kinds = f"{self.kind}s".replace("ys", "ies")
                fault = f"{kinds} are by name, and {name} is none of the attributes [E0102]"
                raise UnknownAttribute(Problem("", fault, f"[{name!r}] in place of .{name}"))
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


class ReadOnly(NamedResults[T]):
    """Values by name that a caller reads and the package writes; changes such as an assignment raise UsageError.

    Parameters
    ----------
    what_to_try : str
        Remedy in this error: how the values are changed.
    """

    #: Reason for which the values are not written here.
    why = "these are read, and not assigned to [E2224]"

    def __init__(self, kind: str, values: Mapping[str, T], what_to_try: str) -> None:
        super().__init__(kind, values)
        self.what_to_try = what_to_try

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise UsageError(Problem(f"{self.kind}s", self.why, self.what_to_try))

    __setitem__ = __delitem__ = update = pop = popitem = clear = setdefault = __ior__ = _refuse

    def __reduce__(self) -> tuple[type[ReadOnly[T]], tuple[str, dict[str, T], str]]:
        return type(self), (self.kind, dict(self), self.what_to_try)


class Defaults(ReadOnly[T]):
    """Default values by name."""

    why = "these are the defaults, which do not change [E2225]"


def checked_call(
    what_to_try: str = "", others: Callable[[], Mapping[str, str]] = dict, /, **meant: str
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return a decorator under which a call that does not fit the function raises UsageError in place of TypeError.

    A call that fits takes no additional time; errors from within the function pass.

    Parameters
    ----------
    what_to_try : str
        Hint for arguments that are missing.
    others : callable
        Gives further names as of ``meant``, when a call does not fit.
    meant : str
        Names of arguments in other tools, and the names here; or a call in place of an argument, with brackets.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            try:
                return function(*args, **kwargs)
            except (TypeError, UsageError) as error:
                problem = _removed_argument(function, kwargs)
                if problem is None and not isinstance(error, UsageError):
                    problem = _misfit(function, args, kwargs, what_to_try, {**others(), **meant})
                if problem is None:
                    raise
            raise UsageError(problem)

        return call

    return decorate


def names_of(argument: str, kind: str, value: object, example: str) -> tuple[str, ...]:
    """Return the names that a caller gives as a list, as a tuple. Raises UsageError for a single text, and for objects
    that are not texts.

    Parameters
    ----------
    argument : for the message and the remedy
    kind : of the names, plural
    example : a name
    """
    location = "" if argument == kind else argument
    if isinstance(value, str):
        quoted = ", ".join(f'"{name.strip()}"' for name in value[:64].split(","))
        fault = f"{kind} are a list of names, not the text {shown(value)} [E2191]"
        raise UsageError(Problem(location, fault, f"{argument}=[{quoted}]"))
    names: tuple[Any, ...] = tuple(value) if isinstance(value, Iterable) else (value,)
    if not all(isinstance(name, str) for name in names):
        fault = f"{kind} are a list of names, not {shown(value)} [E2192]"
        raise UsageError(Problem(location, fault, f'{argument}=["{example}"]'))
    return names


def with_options_of(source: Callable[..., Any], names: Iterable[str]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return a decorator under which ``inspect.signature`` shows the named options in place of ``**options``; the
    function is not wrapped.

    Parameters
    ----------
    source : callable
        Function that takes the options in the end, with their defaults.
    names : iterable of str
        Options that are handed on.
    """
    source_parameters, handed_on = inspect.signature(source).parameters, set(names)

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function)
        arguments = [item for item in signature.parameters.values() if item.kind is not inspect.Parameter.VAR_KEYWORD]
        others = [
            source_parameters[name] for name in source_parameters if name in handed_on - signature.parameters.keys()
        ]
        function.__signature__ = signature.replace(parameters=[*arguments, *others])  # type: ignore[attr-defined]
        return function

    return decorate


def check_options(
    where: str, options: Iterable[str], known: Iterable[str], meant: Mapping[str, str], arguments: Iterable[str] = ()
) -> None:
    """Raise UsageError for options that the called function does not have.

    Parameters
    ----------
    where : name of the function that a caller has called
    options : names of the caller's options
    known, arguments : options that are handed on, and the function's own arguments
    meant : as of ``checked_call``; or a remedy in place of an option
    """
    named = [*arguments, *known]
    unknown = [name for name in options if name not in named]
    if unknown:
        hints = [meant.get(name) or nearest(name, named) for name in unknown[:3]]
        names = ", ".join(shown(name) for name in unknown)
        raise UsageError(Problem(where, f"there is no argument {names} [E0105]", " and ".join(dict.fromkeys(hints))))


def checked_calls(what_to_try: str = "", **meant: str) -> Callable[[C], C]:
    """Return a class decorator that puts ``checked_call`` on constructor and public methods, also inherited methods."""

    def decorate(kind: C) -> C:
        wrap_method(kind, "__init__", checked_call(what_to_try, **meant))
        for name in dir(kind):
            member = next((vars(base)[name] for base in kind.__mro__ if name in vars(base)), None)
            if inspect.isfunction(member) and not name.startswith("_"):
                setattr(kind, name, checked_call(**meant)(member))
        return kind

    return decorate


def unknown_attribute(owner: object, name: str) -> AttributeError:
    """Return, without raising, the error for an attribute that an object of a public class does not have, with a
    remedy: from the ``__getattr__`` of the class. A plain AttributeError is for names with an underscore, which are not
    for users, and for which Python's protocols ask; a property that fails has its own error."""
    kind = type(owner).__name__
    if name.startswith("_"):
        return AttributeError(f"{kind!r} object has no attribute {name!r}")
    if hasattr(type(owner), name):  # a property failed so, and the error of the property says more
        try:
            object.__getattribute__(owner, name)
        except AttributeError as error:
            return error
    if gone := fault_of_removed("attribute", f"{kind}.{name}"):
        return UnknownAttribute(Problem("", *gone))
    if kind in OWNERS and (absent := fault_of_absent(name)):
        return UnknownAttribute(Problem("", f"a {kind} has no {shown(name)}: {absent[0]} [E0106]", absent[1]))
    return UnknownAttribute(
        Problem("", f"{with_article(kind)} has no {shown(name)} [E0107]", attribute_hint(name, dir(owner), kind))
    )


class NamedAttributes:
    """Base of public classes, which answer a request for a missing attribute with the nearest names."""

    if not TYPE_CHECKING:  # a type checker knows the attributes without this method

        def __getattr__(self, name: str) -> object:
            raise unknown_attribute(self, name)


def none_to_set(owner: object, name: str, arguments: Iterable[str], parameters: Iterable[str]) -> UnknownAttribute:
    """Return, without raising, the error for setting an attribute that a model does not have, with a remedy;
    ``arguments`` are names of arguments of the model's runs, ``parameters`` names of its parameters."""
    kind = type(owner).__name__
    hint = attribute_hint(name, dir(owner), kind)
    if name in arguments:
        hint = f"simulate({name}=...)"
    elif name in parameters:
        hint = f'simulate(parameters={{"{name}": ...}})'
    return UnknownAttribute(Problem("", f"a {kind} has no {shown(name)} to set [E0108]", hint))


def not_unpacked(owner: object, what_to_try: str) -> SingleObject:
    """Return the error for unpacking a result as a tuple: from the ``__iter__`` of the result."""
    fault = f"{with_article(type(owner).__name__)} is one object, and not several to be unpacked [E0110]"
    return SingleObject(Problem("", fault, what_to_try))


def with_article(kind: str) -> str:
    """Return the name of a class with its article."""
    return f"{'an' if kind[0] in 'AEIOUaeiou' else 'a'} {kind}"


def not_assigned_to(what_to_try: str) -> Callable[[C], C]:
    """Return a decorator of a frozen class, under which an assignment raises an error with the remedy ``what_to_try``.

    In ``what_to_try`` the attribute is ``{0}``.
    """

    def refuse(owner: object, name: str, value: object) -> NoReturn:
        kind = type(owner).__name__
        fault = f"a {kind} does not change, so {shown(name)} is not assigned to [E0111]"
        raise NoAssignment(Problem("", fault, what_to_try.format(name)))

    def decorate(kind: C) -> C:
        wrap_method(kind, "__setattr__", lambda _: refuse)
        return kind

    return decorate


def meant_term(name: str) -> str:
    """Return the term known elsewhere by a name; empty if there is none."""
    return TERMS_ELSEWHERE.get(name.lower(), "")


@cache
def attributes_elsewhere() -> Mapping[str, Mapping[str, str]]:
    """Return the rows of ``ATTRIBUTES`` and of all products by class."""
    result: dict[str, dict[str, str]] = {}
    for rows in (ATTRIBUTES, *rows_of("eomgen.attributes", dict)):
        for kind, words in rows.items():
            result.setdefault(kind, {}).update(words)
    return result


def attribute_hint(name: str, attributes: Iterable[str], kind: str = "") -> str:
    """Return the remedy for an attribute that does not exist; ``attributes`` are the object's, ``kind`` is the
    name of the class, empty for the package."""
    if hint := attributes_elsewhere().get(kind, {}).get(name):
        return hint
    if kind == "Model" and name in public_names():
        return f"eomgen.{name}(scene, ...)"
    if name in methods_of_models() and kind != "Model":
        scene = {"SceneBuilder": "builder.build()"}.get(kind, "scene")
        return f"eomgen.build({scene}).{name}(...), of the compiled model"
    if meant := _SYMBOLS.get(name):
        return f"initial_{meant} or {meant}_names; {_MEANING[meant]} are called {meant}" if kind == "Model" else meant
    if kind == "Model" and len(name) > 1 and (term := meant_term(name)):
        return term
    return nearest(name, (item for item in attributes if not item.startswith("_")))


def methods_of_models() -> frozenset[str]:
    """Return the methods of a compiled model that users look for at scenes, at systems and at the package."""
    return methods() | _OF_COMPILED


def _present_name(name: str, meant: Mapping[str, str], named: Sequence[str]) -> str:
    """Return the name here of an argument of another tool, or a call in place of the argument."""
    present_name = meant.get(name, "")
    return present_name if present_name in named or "(" in present_name else nearest(name, named)


def _removed_argument(function: Callable[..., Any], arguments: Iterable[str]) -> Problem | None:
    """Return the fault of an argument of earlier versions, which a function with open arguments hands on."""
    where = function.__name__
    gone = (fault_of_removed("argument", f"{where}({name})") for name in arguments)
    return next((Problem(where, *fault) for fault in gone if fault), None)


def _misfit(
    function: Callable[..., Any],
    args: tuple[Any, ...],
    kwargs: Mapping[str, Any],
    what_to_try: str,
    meant: Mapping[str, str],
) -> Problem | None:
    """Return the fault in the arguments of a call as a Problem; None if the arguments fit the signature.
    ``what_to_try`` and ``meant`` as of ``checked_call``."""
    signature = inspect.signature(function)
    with suppress(TypeError):
        signature.bind(*args, **kwargs)
        return None
    where = type(args[0]).__name__ if function.__name__ == "__init__" else function.__name__
    return Problem(where, *_fault_of_call(signature, args, kwargs, what_to_try, meant))


def _fault_of_call(
    signature: inspect.Signature,
    args: tuple[Any, ...],
    kwargs: Mapping[str, Any],
    what_to_try: str,
    meant: Mapping[str, str],
) -> tuple[str, str]:
    """Return the fault in arguments that do not fit a signature, and a remedy. The model or object to which a method
    belongs does not count."""
    owned = [name for name in signature.parameters if name in _OWNERS][:1] if args else []
    parameters = [item for name, item in signature.parameters.items() if name not in owned]
    named = [item for item in parameters if item.kind not in (item.VAR_POSITIONAL, item.VAR_KEYWORD)]
    names = [item.name for item in named]
    takes_any = any(item.kind is item.VAR_KEYWORD for item in parameters)
    unknown = [] if takes_any else [name for name in kwargs if name not in names]
    if unknown:
        hints = [_present_name(name, meant, names) for name in unknown[:3]]
        hint = " and ".join(dict.fromkeys(filter(None, hints))) or "no arguments"
        return f"there is no argument {', '.join(map(shown, unknown))} [E0105]", hint
    positional = args[len(owned) :]
    in_order = [item.name for item in named if item.kind is not item.KEYWORD_ONLY]
    if len(positional) > len(in_order):
        return _fault_of_places(len(positional), in_order, names[len(in_order) :], takes_any)
    return _fault_of_number(named, in_order[: len(positional)], kwargs, what_to_try)


def _fault_of_places(count: int, in_order: Sequence[str], by_name: Sequence[str], takes_any: bool) -> tuple[str, str]:
    """Return the fault of more arguments without names than a function takes, and a remedy."""
    few = f"{len(in_order)} can be: {', '.join(in_order)}" if in_order else "none can be"
    fault = f"{counted(count, 'argument')} without a name, and {few} [E0112]"
    if len(by_name) > 8 or (takes_any and not by_name):
        return fault, "the others by name"
    return fault, f"{by_name[0]}=..., and likewise for the others" if by_name else "fewer arguments"


def _fault_of_number(
    named: Sequence[inspect.Parameter], in_order: Sequence[str], kwargs: Mapping[str, Any], what_to_try: str
) -> tuple[str, str]:
    """Return the fault in arguments that are given twice or missing, and a remedy; ``in_order`` has the parameters that
    are given by their places."""
    if twice := [name for name in in_order if name in kwargs]:
        return f"the argument {twice[0]} is given twice, by its place and by its name [E0113]", "one of them"
    specified = {*in_order, *kwargs}
    missing = [item.name for item in named if item.default is item.empty and item.name not in specified]
    verb = "is" if len(missing) == 1 else "are"
    fault = f"the argument{'s' * (len(missing) > 1)} {', '.join(missing)} {verb} missing [E0114]"
    return fault, what_to_try or ", ".join(f"{name}=..." for name in missing)
