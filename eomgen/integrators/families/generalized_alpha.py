"""Methods as data with a conscience: exact coefficients, declared order, needs and source, checked when they are made.

Generalized-alpha on Lie groups: Bruls and Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002; Arnold, Bruls and Cardona,
Numer. Math. 129 (2015) 149; scaling: Arnold and Hante, J. Comput. Nonlinear Dyn. 12 (2017) 021002.
Equations of first order beside them: Jansen, Whiting and Hulbert, Comput. Methods Appl. Mech. Engrg. 190 (2000) 305.
Runge-Kutta on Lie groups: Munthe-Kaas, Appl. Numer. Math. 29 (1999) 115.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction

from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.coefficients import Coefficients
from eomgen.integrators.families.family import Need, hold

GENERALIZED_ALPHA = "generalized_alpha"
_CONDITIONALLY_STABLE = Need(
    "constraints", False, "with 2 beta < gamma the highest frequency limits its step, and constraints are infinitely stiff",
    "beta of at least gamma/2: newmark with alpha, trapezoidal, hht or generalized_alpha",
)  # fmt: skip
_SOURCE = "Bruls and Cardona 2010; Arnold, Bruls and Cardona 2015; Arnold and Hante 2017"
#: How constraints enter a step: positions only, or positions and velocities with one more multiplier per holonomic row.
INDEX_3, STABILISED = "index3", "stabilised"
#: How the increment of a step is cut into exponentials: one; velocity and acceleration; velocity and both accelerations.
#: ``spatial``: one exponential, and what a step takes over from the last one is carried along with its rotation.
SPATIAL = "spatial"
VARIANTS = ("F0", "F1", "F2", SPATIAL)
#: Largest spectral radius at which index 3 is known to damp what its start excites, and where it is known to fail.
INDEX_3_SAFE_RHO, INDEX_3_REFUSED_RHO = 0.9, 0.99


@dataclass(frozen=True)
class GeneralizedAlpha:
    """Generalized-alpha on a Lie group: the optimal parameters for a spectral radius at infinite frequency, or a named case.

    Parameters
    ----------
    rho_inf : float
        0 (asymptotic annihilation) to 1 (no dissipation); below 0.99 in index 3. Raises UsageError outside.
    form : str
        For constrained systems: ``stabilised`` (index 2: constraints and their rates hold at every step) or ``index3``
        (constraints hold, their rates to second order only).
    variant : str
        ``F0`` (q_n o exp(h Dq)), ``F1`` or ``F2``: velocity and acceleration, or velocity and both accelerations, in exponentials
        of their own. ``spatial``: velocities and accelerations are interpolated as a frame sees them that does not
        turn with the body.
    case : Coefficients, optional
        Of HHT, WBZ, Newmark or the trapezoidal rule; ``rho_inf`` is then theirs, whatever was said.
    """

    rho_inf: float = 0.9
    form: str = STABILISED
    variant: str = "F0"
    case: Coefficients | None = None
    family: str = field(default=GENERALIZED_ALPHA, init=False)
    order: int = field(default=2, init=False)
    source: str = field(default=_SOURCE, init=False)
    needs: tuple[Need, ...] = field(default=(), init=False)

    def __post_init__(self) -> None:
        if self.case is not None:
            self._take(self.case)
        elif not (isinstance(self.rho_inf, int | float) and math.isfinite(self.rho_inf) and 0.0 <= self.rho_inf <= 1.0):
            raise UsageError(
                Problem(
                    "method.rho_inf", f"the spectral radius at infinite frequency must lie in 0..1, not {self.rho_inf!r}",
                    "0.9 for mild numerical damping, 1 for none, 0 for the most",
                )
            )  # fmt: skip
        for key, value, known in (("form", self.form, (STABILISED, INDEX_3)), ("variant", self.variant, VARIANTS)):
            if value not in known:
                raise UsageError(Problem(f"method.{key}", f"there is no {key} {value!r}", f"one of {', '.join(known)}"))
        if self.form == INDEX_3 and self.rho_inf >= INDEX_3_REFUSED_RHO:
            self._refuse_index_3()
        self._check()

    def _take(self, case: Coefficients) -> None:
        """Let order, source, needs and spectral radius be those of a named case."""
        values: dict[str, object] = {"order": case.order, "source": f"{case.source}; {_SOURCE}"}
        values["rho_inf"] = case.radius_at_infinity
        if not case.unconditionally_stable:
            values["needs"] = (*self.needs, _CONDITIONALLY_STABLE)
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _refuse_index_3(self) -> None:
        what = (
            f"index 3 does not bear a spectral radius of {self.rho_inf:g}: on the fast heavy top Newton's iteration "
            "diverges after 351 steps of 1e-3 s at 1, after 472 at 0.99, because nothing damps the multipliers"
        )
        hint = "form stabilised, which runs at any radius, or a radius of at most 0.9"
        if self.case is not None:
            what = (
                f"{self.case.name} has a spectral radius of {self.rho_inf:.4g} here, and index 3 is weakly unstable then: "
                "nothing damps the errors of the multipliers, which alternate from step to step and grow"
            )
            hint = f"{self.case.name} without _index3, the stabilised form, or hht_index3 with alpha = 0.05"
        raise UsageError(Problem("method.rho_inf", what, hint))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user of these settings should know, one sentence each."""
        if self.case is not None and not self.case.unconditionally_stable:
            return (
                f"{self.case.name} with 2 beta < gamma is stable only while step times the highest angular frequency stays below "
                f"{self.case.largest_phase:.4g}",
            )
        if self.form == INDEX_3 and self.rho_inf > INDEX_3_SAFE_RHO:
            return (
                f"index 3 with a spectral radius of {self.rho_inf:.4g} damps multipliers too little: errors of its start live "
                "for many steps, and from 0.99 on it fails; take at most 0.9, or the stabilised form",
            )
        return ()

    @property
    def parameters(self) -> dict[str, Fraction]:
        """What the compiled stepper takes: the spectral radius, or the four coefficients of a named case."""
        if self.case is None:
            return {"rho_inf": self.rho}
        return {"alpha_m": self.alpha_m, "alpha_f": self.alpha_f, "beta": self.beta, "gamma": self.gamma}

    @property
    def rho(self) -> Fraction:
        """The spectral radius as the decimal number that was written."""
        return Fraction(repr(float(self.rho_inf)))

    @property
    def alpha_m(self) -> Fraction:
        return (2 * self.rho - 1) / (self.rho + 1) if self.case is None else self.case.alpha_m

    @property
    def alpha_f(self) -> Fraction:
        return self.rho / (self.rho + 1) if self.case is None else self.case.alpha_f

    @property
    def gamma(self) -> Fraction:
        return Fraction(1, 2) + self.alpha_f - self.alpha_m if self.case is None else self.case.gamma

    @property
    def beta(self) -> Fraction:
        return (self.gamma + Fraction(1, 2)) ** 2 / 4 if self.case is None else self.case.beta

    @property
    def rate_alpha_m(self) -> Fraction:
        """What alpha_m is to internal states z, equations of first order (Jansen, Whiting and Hulbert 2000); a case's own."""
        return (3 * self.rho - 1) / (2 * (self.rho + 1)) if self.case is None else self.case.alpha_m

    @property
    def rate_gamma(self) -> Fraction:
        return Fraction(1, 2) + self.alpha_f - self.rate_alpha_m if self.case is None else self.case.gamma

    @property
    def rate_gain(self) -> Fraction:
        """Change of zdot with (z - z_n)/step."""
        return (1 - self.rate_alpha_m) / (self.rate_gamma * (1 - self.alpha_f))

    def _check(self) -> None:
        if self.case is not None:
            return
        hold("order 2: gamma = 1/2 + alpha_f - alpha_m", self.gamma == Fraction(1, 2) + self.alpha_f - self.alpha_m)
        hold("stability: alpha_m <= alpha_f <= 1/2", self.alpha_m <= self.alpha_f <= Fraction(1, 2))
        hold("stability: beta >= 1/4 + (alpha_f - alpha_m)/2", self.beta >= Fraction(1, 4) + (self.alpha_f - self.alpha_m) / 2)
        optimal = Coefficients("chung_hulbert", self.alpha_m, self.alpha_f, self.beta, self.gamma, _SOURCE)
        hold("the spectral radius at infinite frequency is rho_inf", abs(optimal.radius_at_infinity - float(self.rho)) < 1e-4)
        at_infinity = max(self.alpha_f / (1 - self.alpha_f), abs(1 - self.rate_gamma) / self.rate_gamma)
        hold("the same for internal states", at_infinity == self.rho)
