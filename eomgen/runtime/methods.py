"""The names under which callers know the integration methods."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.errors import Problem, UsageError
from eomgen.integrators.methods import RUNGE_KUTTA_MUNTHE_KAAS_4, GeneralizedAlpha, Method
from eomgen.scene.names import nearest, shown

#: Every name, and the one it stands for.
METHOD_NAMES: Mapping[str, str] = {
    "generalized_alpha": "generalized_alpha",
    "chung_hulbert": "generalized_alpha",
    "rk4": "rk4",
    "rkmk4": "rk4",
    "runge_kutta": "rk4",
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
    return GeneralizedAlpha(rho_inf=rho_inf)


def terms_of(name: str) -> tuple[str, ...]:
    """Return the functions that the stepper of a method calls."""
    if canonical_name(name) == "rk4":
        return ("forward_dynamics",)
    return ("forward_dynamics", "residual", "partials")
