"""The names under which callers know the integration methods, and the parameters that go with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from eomgen.errors import ModelError, Problem, UsageError
from eomgen.integrators.families.coefficients import Coefficients, hht, newmark, trapezoidal, wbz
from eomgen.integrators.families.family import FactsLike
from eomgen.integrators.families.generalized_alpha import INDEX_3, STABILISED, GeneralizedAlpha
from eomgen.integrators.families.hermite import Hermite
from eomgen.integrators.families.partitioned import PARTITIONED_RUNGE_KUTTA_4
from eomgen.integrators.families.runge_kutta import RUNGE_KUTTA_MUNTHE_KAAS_4, RungeKuttaMuntheKaas
from eomgen.integrators.families.taylor import Taylor
from eomgen.text import nearest, shown

Method = GeneralizedAlpha | RungeKuttaMuntheKaas | Taylor | Hermite


def check_needs(method: Method, facts: FactsLike) -> None:
    """Raise ModelError naming every need of the method that the system does not meet."""
    problems = [
        Problem(
            "method",
            f"{method.family} needs a system {'with' if need.value else 'without'} {need.fact.replace('_', ' ')}: {need.reason}",
            need.alternative,
        )
        for need in method.needs
        if bool(getattr(facts, need.fact)) is not need.value
    ]
    if problems:
        raise ModelError(problems)


#: Generalized-alpha by name: the form that keeps constraints, and how an increment is put on the group.
_GENERALIZED_ALPHA: Mapping[str, dict[str, Any]] = {
    "generalized_alpha": {},
    "generalized_alpha_f1": {"variant": "F1"},
    "generalized_alpha_f2": {"variant": "F2"},
    "generalized_alpha_spatial": {"variant": "spatial"},
    "generalized_alpha_index3": {"form": "index3"},
    "generalized_alpha_index3_f1": {"form": "index3", "variant": "F1"},
    "generalized_alpha_index3_f2": {"form": "index3", "variant": "F2"},
    "generalized_alpha_index3_spatial": {"form": "index3", "variant": "spatial"},
}
#: Its named cases, and the parameters that each takes.
_CASES: Mapping[str, tuple[str, ...]] = {
    "hht": ("alpha", "rho_inf"),
    "wbz": ("alpha", "rho_inf"),
    "newmark": ("alpha", "beta", "gamma"),
    "trapezoidal": (),
}
#: All methods with parameters of their own.
_TAKES: Mapping[str, tuple[str, ...]] = {**_CASES, "taylor": ("order", "tolerance"), "hermite": ()}
_MAKERS: Mapping[str, Callable[..., Coefficients]] = {"hht": hht, "wbz": wbz, "newmark": newmark, "trapezoidal": trapezoidal}
_INDEX_3 = "_index3"
#: All parameters that some method takes.
PARAMETERS = ("rho_inf", "alpha", "beta", "gamma", "order", "tolerance")
#: Terms of constraints that steppers call, or that bring a state onto the constraints.
_KINEMATIC = ("constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian", "constraint_size")
#: Every name, and the one it stands for.
METHOD_NAMES: Mapping[str, str] = {
    **{name: name for name in _GENERALIZED_ALPHA},
    "chung_hulbert": "generalized_alpha",
    **{name + ending: name + ending for name in _CASES for ending in ("", _INDEX_3)},
    "average_acceleration": "trapezoidal",
    "rk4": "rk4",
    "rkmk4": "rk4",
    "runge_kutta": "rk4",
    "rk4_partitioned": "rk4_partitioned",
    "partitioned": "rk4_partitioned",
    "hermite": "hermite",
    "taylor": "taylor",
}


def canonical_name(name: str) -> str:
    """Return the name of a method that an alias stands for. Raises UsageError with the nearest names."""
    key = str(name).lower().replace("-", "_")
    if key not in METHOD_NAMES:
        raise UsageError(Problem("method", f"there is no method {shown(str(name))}", nearest(key, METHOD_NAMES)))
    return METHOD_NAMES[key]


def method_named(
    name: str, rho_inf: float | None = 0.8, alpha: float | None = None, beta: float | None = None, gamma: float | None = None,
    order: float | None = None, tolerance: float | None = None,
) -> Method:  # fmt: skip
    """Return a method with its parameters; what is None is left to the method, what it does not take is ignored.

    Raises
    ------
    UsageError
        An unknown name, or a parameter out of its range, with the reason.
    """
    name = canonical_name(name)
    if name == "rk4":
        return RUNGE_KUTTA_MUNTHE_KAAS_4
    if name == "rk4_partitioned":
        return PARTITIONED_RUNGE_KUTTA_4
    if name == "hermite":
        return Hermite()
    if name == "taylor":
        said = {"tolerance": tolerance, "order": order}
        return Taylor(**{key: value for key, value in said.items() if value is not None})  # type: ignore[arg-type]  # checked there
    case = name.removesuffix(_INDEX_3)
    if case not in _CASES:
        return GeneralizedAlpha(rho_inf=0.8 if rho_inf is None else rho_inf, **_GENERALIZED_ALPHA[name])
    given = {"rho_inf": None if alpha is not None else rho_inf, "alpha": alpha, "beta": beta, "gamma": gamma}
    coefficients = _MAKERS[case](**{key: given[key] for key in _CASES[case]})
    return GeneralizedAlpha(form=INDEX_3 if name != case else STABILISED, case=coefficients)


def method_parameters(name: str, given: Mapping[str, float | None], scene: Mapping[str, Any]) -> dict[str, float]:
    """Return the parameters of a method: those given, else the scene's, as far as the method takes them.

    Raises
    ------
    UsageError
        A parameter is given that the method does not take, or two that say the same.
    """
    name = canonical_name(name)
    said = {key: value for key, value in given.items() if value is not None}
    explicit = name.startswith("rk4")
    takes = () if explicit else _TAKES.get(name.removesuffix(_INDEX_3), ("rho_inf",))
    for key in said:
        if key not in takes and not (explicit and key == "rho_inf"):  # no numerical damping is what explicit methods have anyway
            raise UsageError(Problem(key, f"{name} takes no {key}", f"only {', '.join(takes)}" if takes else "leave it out"))
    if {"alpha", "rho_inf"} <= set(said):
        what = "alpha and rho_inf say the same: rho_inf = (1 - alpha)/(1 + alpha)"
        raise UsageError(Problem("alpha", what, "one of them"))
    return said or {key: value for key in takes if (value := scene.get(key)) is not None}


def terms_of(name: str, constrained: bool = False, internal: bool = False, mass: bool = True) -> tuple[str, ...]:
    """Return the functions that the stepper of a method calls, for a scene with constraints, or with internal states.

    ``mass``: whether the inertia matrix is at hand; long trees leave it out, and series take forward dynamics then.
    """
    if internal:
        implicit = () if canonical_name(name) in ("rk4", "rk4_partitioned", "taylor", "hermite") else ("equations", "iteration")
        left_out = ("residual", "partials") if implicit else ()
        mechanical = [term for term in terms_of(name, constrained, False, mass) if term not in left_out]
        return tuple(dict.fromkeys([*mechanical, "internal_rate", *implicit]))
    if canonical_name(name) == "rk4":
        return ("forward_dynamics",)
    if canonical_name(name) in ("taylor", "hermite"):
        return ("mass", "residual") if mass else ("forward_dynamics",)
    if canonical_name(name) == "rk4_partitioned":
        if not constrained:  # it is refused, for a better reason than missing terms
            return ("residual",)
        return ("mass", "residual", *_KINEMATIC)
    if constrained:
        return ("mass", "residual", *_KINEMATIC, "jacobian_values", "equations", "iteration")
    return ("forward_dynamics", "residual", "partials")
