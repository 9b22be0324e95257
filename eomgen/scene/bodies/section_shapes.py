"""Shapes of sections: area, second moments, torsion constant and shear factors by their sizes and Poisson's ratio.

Torsion of a rectangle is Saint-Venant's series (Timoshenko and Goodier, Theory of Elasticity, 1970, section 109);
shear factors follow Cowper, J. Appl. Mech. 33 (1966) 335.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from eomgen.formula.nodes import Formula, Number, Operation

#: Terms of the series of a rectangle: its remainder is below 1e-16 if the first side is the longer one.
_TERMS = 6
_ZETA_OF_FIVE_ODD = 1.0045237627951396  # the sum of 1/k^5 over odd k


@dataclass(frozen=True)
class ShapeValues:
    """Properties of a section that follow from its shape.

    Attributes
    ----------
    area : m^2
    second_moments : integrals of y^2 and of z^2, m^4
    torsion_constant : m^4
    shear_factors : shear areas along y and z by the area
    """

    area: Formula
    second_moments: tuple[Formula, Formula]
    torsion_constant: Formula
    shear_factors: tuple[Formula, Formula]


#: Map from sizes, m, Poisson's ratio and an evaluator of formulas to the properties of the section.
Law = Callable[[Sequence[Formula], Formula, Callable[[Formula], float]], ShapeValues]


def _rectangle(sizes: Sequence[Formula], ratio: Formula, number: Callable[[Formula], float]) -> ShapeValues:
    width, height = sizes
    shear = 10.0 * (1.0 + ratio) / (12.0 + 11.0 * ratio)
    moments = height * width * width * width / 12.0, width * height * height * height / 12.0
    ordered = (width, height) if number(width) >= number(height) else (height, width)
    return ShapeValues(width * height, moments, _torsion_of_rectangle(*ordered), (shear, shear))


def _torsion_of_rectangle(first: Formula, second: Formula) -> Formula:
    """Return ab^3 (1/3 - 64 b/(pi^5 a) sum tanh(k pi a/(2b))/k^5) over odd k, with the sum of 1 - tanh taken off."""
    sum_of_tanh: Formula = Number(_ZETA_OF_FIVE_ODD)
    for k in range(1, 2 * _TERMS, 2):
        small = Operation("exp", (-k * math.pi * first / second,))
        sum_of_tanh = sum_of_tanh - (2.0 / k**5) * small / (1.0 + small)
    return first * second * second * second * (1.0 / 3.0 - 64.0 / math.pi**5 * second / first * sum_of_tanh)


def _circle(sizes: Sequence[Formula], ratio: Formula, _: Callable[[Formula], float]) -> ShapeValues:
    (diameter,) = sizes
    shear = 6.0 * (1.0 + ratio) / (7.0 + 6.0 * ratio)
    square = diameter * diameter
    moment = math.pi / 64.0 * square * square
    return ShapeValues(math.pi / 4.0 * square, (moment, moment), 2.0 * moment, (shear, shear))


def _tube(sizes: Sequence[Formula], ratio: Formula, _: Callable[[Formula], float]) -> ShapeValues:
    diameter, thickness = sizes
    inner = diameter - 2.0 * thickness
    outside, inside = diameter * diameter, inner * inner
    share = inside / outside
    both = (1.0 + share) * (1.0 + share)
    shear = 6.0 * (1.0 + ratio) * both / ((7.0 + 6.0 * ratio) * both + (20.0 + 12.0 * ratio) * share)
    area = math.pi * thickness * (diameter - thickness)
    moment = area * (outside + inside) / 16.0
    return ShapeValues(area, (moment, moment), 2.0 * moment, (shear, shear))


def _ellipse(sizes: Sequence[Formula], ratio: Formula, _: Callable[[Formula], float]) -> ShapeValues:
    width, height = sizes
    a, b = width * width, height * height

    def shear(along: Formula, across: Formula) -> Formula:
        below = (40.0 + 37.0 * ratio) * along * along + (16.0 + 10.0 * ratio) * along * across
        return 12.0 * (1.0 + ratio) * along * (3.0 * along + across) / (below + ratio * across * across)

    area = math.pi / 4.0 * width * height
    torsion = area * a * b / (4.0 * (a + b))
    return ShapeValues(area, (area * a / 16.0, area * b / 16.0), torsion, (shear(a, b), shear(b, a)))


@dataclass(frozen=True)
class SectionShape:
    """A shape of sections: the keys of its sizes, in the order of its law."""

    sizes: tuple[str, ...]
    law: Law


SHAPES: Mapping[str, SectionShape] = {
    "rectangle": SectionShape(("width", "height"), _rectangle),
    "circle": SectionShape(("diameter",), _circle),
    "tube": SectionShape(("diameter", "thickness"), _tube),
    "ellipse": SectionShape(("width", "height"), _ellipse),
}
