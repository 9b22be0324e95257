"""A- and L-stability of the passes, by exact polynomials: |denominator|^2 - |numerator|^2 on the imaginary axis has no
negative coefficient. Numbers of a method are polynomials in x = 1/gamma modulo that of which x is a root."""

from __future__ import annotations

from math import comb, factorial
from typing import Any

import pytest
from sympy import QQ, Rational
from sympy.polys.rings import ring

from eomgen.integrators.families.register import method_named

R, x, w = ring("x, w", QQ)
#: Of which x = 1/gamma is a root.
MINIMAL = {
    "tdg1": x**2 - 4 * x + 2,
    "tdg1_star": x**2 - 6,
    "tdg2": x - 4,
    "tdg2s": x**3 - 9 * x**2 + 18 * x - 6,
    "tdg3": x - QQ(200, 33),
}


def laguerre(degree: int) -> list[Any]:
    """Return the coefficients of L_degree."""
    return [QQ((-1) ** k * comb(degree, k), factorial(k)) for k in range(degree + 1)]


def right_radau(degree: int) -> list[Any]:
    """Return the coefficients of P_s - P_{s-1} on (0, 1), monic."""
    legendre = [[QQ((-1) ** (n + k) * comb(n, k) * comb(n + k, k)) for k in range(n + 1)] for n in (degree, degree - 1)]
    found = [a - b for a, b in zip(legendre[0], [*legendre[1], QQ(0)], strict=True)]
    return [coefficient / found[-1] for coefficient in found]


def defect(degree: int) -> list[Any]:
    """Return r: L_{p+1} modulo Radau's polynomial, by L_0 to L_p."""
    top, radau = laguerre(degree + 1), right_radau(degree + 1)
    # Radau's polynomial of s = xi/x times x^(p+1) is monic in xi
    rest = [R(a) - top[-1] * b * x ** (degree + 1 - k) for k, (a, b) in enumerate(zip(top, radau, strict=True))][:-1]
    found: list[Any] = [R(0)] * (degree + 1)
    for k in range(degree, -1, -1):
        one = laguerre(k)
        found[k] = rest[k] * (1 / one[k])
        rest = [a - found[k] * (one[j] if j <= k else 0) for j, a in enumerate(rest)]
    return found


def numerator(name: str, passes: int, degree: int) -> tuple[Any, int]:
    """Return N(w) and the power of 1 - w below it, of y behind a step of y' = z y with w = gamma z."""
    r, last, power = [item.rem(MINIMAL[name]) for item in defect(degree)], R(0), 0
    for _ in range(passes):
        # a_j = (right side)/(1 - w); all over (1 - w)^(power + j + 1)
        parts = [(1 - w) ** power - w * r[0] * last]
        for j in range(1, degree + 1):
            parts.append((-w * parts[-1] - w * r[j] * last * (1 - w) ** j).rem(MINIMAL[name]))
        ends = [sum((c * x**k for k, c in enumerate(laguerre(j))), R(0)) for j in range(degree + 1)]
        value = sum((ends[j] * parts[j] * (1 - w) ** (degree - j) for j in range(degree + 1)), R(0))
        last, power = parts[degree].rem(MINIMAL[name]), power + degree + 1
    return value.rem(MINIMAL[name]), power


def on_the_axis(polynomial: Any) -> Any:
    """Return |polynomial(i y)|^2, in w for y."""
    parts = [R(0), R(0)]
    for powers, coefficient in polynomial.terms():
        parts[powers[1] % 2] += R({powers: -coefficient if powers[1] % 4 in (2, 3) else coefficient})
    return parts[0] ** 2 + parts[1] ** 2


def certificate(name: str) -> tuple[dict[int, Rational], bool]:
    """Return the coefficients of |D(i y)|^2 - |N(i y)|^2 by powers of y = gamma omega h, and whether the degree of N is
    below that of D."""
    method = method_named(name)
    top, power = numerator(name, method.passes, method.degree)  # type: ignore[attr-defined]
    difference = (on_the_axis((1 - w) ** power) - on_the_axis(top)).rem(MINIMAL[name])
    place = Rational(method.gamma.denominator, method.gamma.numerator)  # type: ignore[attr-defined]
    found: dict[int, Rational] = {}
    for (in_x, in_y), coefficient in difference.terms():
        value = Rational(int(coefficient.numerator), int(coefficient.denominator))
        found[in_y] = found.get(in_y, Rational(0)) + value * place**in_x
    assert all(power % 2 == 0 and abs(value) > Rational(1, 10**40) for power, value in found.items())
    return dict(sorted(found.items())), max(k for _, k in top.monoms()) < power


@pytest.mark.parametrize("name", MINIMAL)
def test_the_passes_are_l_stable(name: str) -> None:
    """All poles are 1/gamma, to the right; what agrees with the exponential to order p agrees with |exp(i y)| = 1
    below y^(p+1)."""
    found, vanishes = certificate(name)
    assert found and min(found.values()) > 0 and vanishes
    assert min(found) >= method_named(name).order + 1


@pytest.mark.parametrize(
    ("name", "published"),
    [
        ("tdg1", {4: 0.0212362, 6: 0.00250125, 8: 5.416e-5}),
        ("tdg2s", {6: 0.04825, 8: 0.01369, 10: 0.00135, 12: 4.7e-5}),
    ],
)
def test_polynomials_of_two_methods_are_the_published_ones(name: str, published: dict[int, float]) -> None:
    method, (found, _) = method_named(name), certificate(name)
    ours = {power: float(value * Rational(method.gamma) ** power) for power, value in found.items()}  # type: ignore[attr-defined]
    assert ours == {power: pytest.approx(value, rel=5e-3) for power, value in published.items()}
