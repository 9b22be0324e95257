"""Coefficients of named generalized-alpha cases from one parameter each.

(1 - alpha_m) a' + alpha_m a = (1 - alpha_f) vdot' + alpha_f vdot, and Newmark's formulas with beta and gamma on a.
Newmark, J. Eng. Mech. Div. 85 (1959) 67; Hilber, Hughes and Taylor, Earthquake Eng. Struct. Dyn. 5 (1977) 283; Wood,
Bossak and Zienkiewicz, Int. J. Numer. Methods Eng. 15 (1980) 1562; as one family: Chung and Hulbert, J. Appl. Mech. 60
(1993) 371.
"""

from __future__ import annotations

import math
from fractions import Fraction

from eomgen.base.data import dataclass
from eomgen.errors import Problem, UsageError

_HALF = Fraction(1, 2)
_NEWMARK = "Newmark 1959"


@dataclass(frozen=True)
class Coefficients:
    """Exact coefficients of a case, with name and source."""

    name: str
    alpha_m: Fraction
    alpha_f: Fraction
    beta: Fraction
    gamma: Fraction
    source: str

    @property
    def order(self) -> int:
        """2 if and only if gamma = 1/2 + alpha_f - alpha_m, else 1."""
        return 2 if self.gamma == _HALF + self.alpha_f - self.alpha_m else 1

    @property
    def unconditionally_stable(self) -> bool:
        """Whether the method is unconditionally stable on undamped linear systems."""
        return self.alpha_m <= self.alpha_f <= _HALF and 2 * self.beta >= self.gamma >= _HALF

    @property
    def radius_at_infinity(self) -> float:
        """The largest eigenvalue modulus of one step on x'' = -w^2 x as w step grows without bound.

        Equilibrium then forces x = 0 at both ends of the step, so vdot is free and x' = 0 gives a'.
        """
        import numpy as np  # noqa: PLC0415  # the only number crunching of this module

        b, g, am, af = float(self.beta), float(self.gamma), float(self.alpha_m), float(self.alpha_f)
        if abs(1.0 - af) < 1e-15:
            return math.inf
        # unknowns of a step, scaled by powers of the step: (v, a, vdot) with x = 0 throughout
        # 0 = v + (1/2 - b) a + b a',  v' = v + (1 - g) a + g a',  (1 - am) a' + am a = (1 - af) vdot' + af vdot
        a_next = np.array([-1.0, -(0.5 - b), 0.0]) / b
        v_next = np.array([1.0, 1.0 - g, 0.0]) + g * a_next
        vdot_next = ((1.0 - am) * a_next + np.array([0.0, am, 0.0]) - np.array([0.0, 0.0, af])) / (1.0 - af)
        return float(np.max(np.abs(np.linalg.eigvals(np.array([v_next, a_next, vdot_next])))))

    @property
    def largest_phase(self) -> float:
        """Largest stable w step of an undamped oscillation, rad, in Newmark's cases; infinite if always stable."""
        return math.inf if self.unconditionally_stable else float(self.gamma / 2 - self.beta) ** -0.5


def hht(alpha: float | None = None, rho_inf: float | None = None) -> Coefficients:
    """Return the method of Hilber, Hughes and Taylor: alpha of the forces are taken at the start of the step.

    Parameters
    ----------
    alpha : float
        0 (no damping) to 1/3; the authors and Abaqus write -alpha.
    rho_inf : float
        In place of ``alpha``, the spectral radius at infinite frequency, 1/2 to 1: alpha = (1 - rho_inf)/(1 + rho_inf).

    Raises
    ------
    UsageError
    """
    a = _damping(
        "hht",
        alpha,
        rho_inf,
        Fraction(1, 3),
        "at high frequencies it damps less again above 1/3, and wbz goes to 1",
    )
    return Coefficients("hht", Fraction(0), a, (1 + a) ** 2 / 4, _HALF + a, "Hilber, Hughes and Taylor 1977")


def wbz(alpha: float | None = None, rho_inf: float | None = None) -> Coefficients:
    """Return the method of Wood, Bossak and Zienkiewicz: -alpha of the inertia is from the start of the step.

    Parameters
    ----------
    alpha : float
        0 (no damping) to 1 (asymptotic annihilation); the authors write -alpha.
    rho_inf : float
        In place of ``alpha``, the spectral radius at infinite frequency: alpha = (1 - rho_inf)/(1 + rho_inf).

    Raises
    ------
    UsageError
    """
    a = _damping("wbz", alpha, rho_inf, Fraction(1), "1 is a spectral radius of zero already")
    return Coefficients("wbz", -a, Fraction(0), (1 + a) ** 2 / 4, _HALF + a, "Wood, Bossak and Zienkiewicz 1980")


def newmark(beta: float | None = None, gamma: float | None = None, alpha: float | None = None) -> Coefficients:
    """Return a method of Newmark's family, by default average acceleration.

    Parameters
    ----------
    beta, gamma : float
        beta > 0, gamma >= 1/2; 1/4 and 1/2 by default. A gamma above 1/2 damps and lowers the order to 1; 2 beta <
        gamma limits the step.
    alpha : float
        In place of ``beta`` and ``gamma``, the damped family gamma = 1/2 + alpha, beta = (1 + alpha)^2/4, 0 to 1, with
        (1 - alpha)/(1 + alpha) as spectral radius at infinite frequency.

    Raises
    ------
    UsageError
    """
    if alpha is not None:
        if beta is not None or gamma is not None:
            fault = "newmark takes alpha, or beta and gamma, not both [E0342]"
            raise UsageError(Problem("method.alpha", fault, "alpha alone: gamma = 1/2 + alpha, beta = (1 + alpha)^2/4"))
        a = _damping("newmark", alpha, None, Fraction(1), "1 is a spectral radius of zero already")
        return Coefficients("newmark", Fraction(0), Fraction(0), (1 + a) ** 2 / 4, _HALF + a, _NEWMARK)
    b = Fraction(1, 4) if beta is None else exact("method.beta", beta)
    g = _HALF if gamma is None else exact("method.gamma", gamma)
    if b <= 0:
        fault = f"beta must be positive, not {beta!r}: with zero the step is explicit, and below it unstable [E0340]"
        raise UsageError(Problem("method.beta", fault, "0.25, or rk4 for an explicit method"))
    if g < _HALF:
        fault = f"gamma must be at least 1/2, not {gamma!r}: below it every oscillation grows [E0341]"
        raise UsageError(Problem("method.gamma", fault, "0.5"))
    return Coefficients("newmark", Fraction(0), Fraction(0), b, g, _NEWMARK)


def trapezoidal() -> Coefficients:
    """Return the trapezoidal rule, Newmark's average acceleration: beta = 1/4, gamma = 1/2, no damping."""
    return Coefficients("trapezoidal", Fraction(0), Fraction(0), Fraction(1, 4), _HALF, _NEWMARK)


def exact(where: str, value: object) -> Fraction:
    """Return a number as the decimal fraction that was written. Raises UsageError."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise UsageError(Problem(where, f"a finite number is needed, not {value!r} [E0343]", "0.25"))
    return Fraction(repr(float(value)))


def _damping(name: str, alpha: float | None, rho_inf: float | None, largest: Fraction, reason: str) -> Fraction:
    """Return alpha of the case `name` as an exact fraction, from ``alpha`` or from the radius ``rho_inf`` at infinity.
    Raises UsageError for an alpha outside 0 to `largest`, with the reason, or for a wrong radius."""
    if alpha is not None:
        value = exact("method.alpha", alpha)
        if not 0 <= value <= largest:
            why = "the papers and Abaqus have the opposite sign" if value < 0 else reason
            fault = f"alpha of {name} must lie in 0..{largest}, not {alpha!r}: {why} [E0345]"
            raise UsageError(Problem("method.alpha", fault, f"{-alpha!r}" if -largest <= value < 0 else "0.05"))
        return value
    rho = Fraction(1) if rho_inf is None else exact("method.rho_inf", rho_inf)
    smallest = (1 - largest) / (1 + largest)
    if not smallest <= rho <= 1:
        fault = f"{name} has spectral radii at infinite frequency of {smallest} to 1, not {rho_inf!r} [E0344]"
        hint = "generalized_alpha or wbz, which go to 0" if 0 <= rho < smallest else "0.9 for mild numerical damping"
        raise UsageError(Problem("method.rho_inf", fault, hint))
    return (1 - rho) / (1 + rho)
