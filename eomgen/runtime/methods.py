"""The names under which callers know the integration methods."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.errors import Problem, UsageError
from eomgen.integrators.methods import RUNGE_KUTTA_MUNTHE_KAAS_4, GeneralizedAlpha, Method
from eomgen.integrators.partitioned import PARTITIONED_RUNGE_KUTTA_4
from eomgen.scene.names import nearest, shown

#: Generalized-alpha by name: the form that keeps constraints, and how an increment is put on the group.
_GENERALIZED_ALPHA: Mapping[str, dict[str, str]] = {
    "generalized_alpha": {},
    "generalized_alpha_f1": {"variant": "F1"},
    "generalized_alpha_f2": {"variant": "F2"},
    "generalized_alpha_index3": {"form": "index3"},
    "generalized_alpha_index3_f1": {"form": "index3", "variant": "F1"},
    "generalized_alpha_index3_f2": {"form": "index3", "variant": "F2"},
}

#: Every name, and the one it stands for.
METHOD_NAMES: Mapping[str, str] = {
    **{name: name for name in _GENERALIZED_ALPHA},
    "chung_hulbert": "generalized_alpha",
    "rk4": "rk4",
    "rkmk4": "rk4",
    "runge_kutta": "rk4",
    "rk4_partitioned": "rk4_partitioned",
    "partitioned": "rk4_partitioned",
}


def canonical_name(name: str) -> str:
    """Return the name of a method that an alias stands for. Raises UsageError with the nearest names."""
    key = str(name).lower().replace("-", "_")
    if key not in METHOD_NAMES:
        raise UsageError(Problem("method", f"there is no method {shown(str(name))}", nearest(key, METHOD_NAMES)))
    return METHOD_NAMES[key]


def method_named(name: str, rho_inf: float = 0.8) -> Method:
    """Return a method; ``rho_inf`` matters to generalized-alpha only. Raises UsageError for an unknown name or a bad rho_inf."""
    if canonical_name(name) == "rk4":
        return RUNGE_KUTTA_MUNTHE_KAAS_4
    if canonical_name(name) == "rk4_partitioned":
        return PARTITIONED_RUNGE_KUTTA_4
    return GeneralizedAlpha(rho_inf=rho_inf, **_GENERALIZED_ALPHA[canonical_name(name)])


def terms_of(name: str, constrained: bool = False) -> tuple[str, ...]:
    """Return the functions that the stepper of a method calls."""
    if canonical_name(name) == "rk4":
        return ("forward_dynamics",)
    if canonical_name(name) == "rk4_partitioned":
        if not constrained:  # it is refused, for a better reason than missing terms
            return ("residual",)
        return ("mass", "residual", "constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian")
    if constrained:
        kinematic = ("constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian", "jacobian_values")
        return ("mass", "residual", *kinematic, "equations", "iteration")
    return ("forward_dynamics", "residual", "partials")
