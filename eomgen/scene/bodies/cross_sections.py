"""Cross sections of beams: the keys given, and the values that follow from their shape: area, second moments, torsion
constant and shear factors by their sizes and Poisson's ratio.

Torsion of a rectangle is Saint-Venant's series (Timoshenko and Goodier, Theory of Elasticity, 1970, section 109);
shear factors follow Cowper, J. Appl. Mech. 33 (1966) 335.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import cast

from eomgen.base.data import dataclass
from eomgen.base.text import listed
from eomgen.formula.nodes import ONE, ZERO, Formula, Number, Operation
from eomgen.scene.bodies import beam_schema as written
from eomgen.scene.bodies.arithmetic import folded
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import Values

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


#: Least plausible density of a solid, kg/m^3; smaller numbers suggest other units.
_LIGHTEST = 25.0
#: Least plausible Young's modulus of a solid, Pa.
_SOFTEST = 2000.0
_OF_SHAPES = ("area", "second_moments", "torsion_constant")
_SIZES = tuple(dict.fromkeys(size for shape in SHAPES.values() for size in shape.sizes))


class SectionReader:
    """Properties of a section; None for a property not given. Faults go to the report of ``values``."""

    def __init__(self, key: str, section: written.Section, values: Values) -> None:
        self.key, self.section, self.values = key, section, values
        self.elastic_modulus = self._formula("elastic_modulus", section.elastic_modulus)
        self.density = self._formula("density", section.density)
        if 0.0 < (density := values.value(self.density)) < _LIGHTEST:
            note = f"the density {density:.6g} kg/m^3 is below the density of any foam"
            values.note([f"{key}.density: {note}; {1e3 * density:.6g} if it is in g/cm^3"])
        if 0.0 < (modulus := values.value(self.elastic_modulus)) < _SOFTEST:
            note = f"the modulus {modulus:.6g} Pa is below the modulus of any solid"
            values.note([f"{key}.elastic_modulus: {note}; {1e9 * modulus:.6g} if it is in GPa"])
        self._check_shape()

    @cached_property
    def area(self) -> Formula | None:
        if self._shape is not None:
            return self._shape.area
        return self._optional("area")

    @cached_property
    def second_moments(self) -> tuple[Formula, Formula] | None:
        if self._shape is not None:
            return self._shape.second_moments
        return self._pair("second_moments")

    @cached_property
    def torsion_constant(self) -> Formula | None:
        if self._shape is not None:
            return self._shape.torsion_constant
        return self._optional("torsion_constant")

    @cached_property
    def shear_factors(self) -> tuple[Formula, Formula] | None:
        """Return the given shear factors, else the shape's."""
        if self._shape is not None and self.section.shear_factors is None:
            return self._shape.shear_factors
        return self._pair("shear_factors")

    @cached_property
    def shear_modulus(self) -> Formula | None:
        """By itself, or by Poisson's ratio: G = E/(2 (1 + nu))."""
        given = self.section.poisson_ratio
        if self.section.shear_modulus is not None or given is None:
            return self._optional("shear_modulus")
        return folded(self.elastic_modulus / (2.0 * (ONE + self._ratio)))

    @cached_property
    def _ratio(self) -> Formula:
        if self.section.poisson_ratio is not None:
            return self._formula("poisson_ratio", self.section.poisson_ratio)
        if self.shear_modulus is None:
            return Number(0.0)
        return folded(self.elastic_modulus / (2.0 * self.shear_modulus) - ONE)

    @cached_property
    def _shape(self) -> ShapeValues | None:
        if self.section.shape is None:
            return None
        shape = SHAPES[self.section.shape]
        if any(getattr(self.section, size) is None for size in shape.sizes):  # which is reported
            return None
        sizes = [self._formula(size, getattr(self.section, size)) for size in shape.sizes]
        if any(self.values.report.concerns(f"{self.key}.{size}") for size in shape.sizes):
            return None
        if self.section.shape == "tube":
            self.values.require(f"{self.key}.thickness", RELATIONS["wall of a tube"], list(reversed(sizes)))
        result = shape.law(sizes, self._ratio, self.values.value)
        return ShapeValues(
            folded(result.area),
            cast("tuple[Formula, Formula]", tuple(map(folded, result.second_moments))),
            folded(result.torsion_constant),
            cast("tuple[Formula, Formula]", tuple(map(folded, result.shear_factors))),
        )

    def needed(self, field: str) -> Formula:
        """Return a value of the section; one that is not there is reported."""
        value: Formula | None = getattr(self, field)
        return self._missing(field) if value is None else value

    def needed_pair(self, field: str) -> tuple[Formula, Formula]:
        """Return two values of the section; missing ones are reported."""
        pair: tuple[Formula, Formula] | None = getattr(self, field)
        return (self._missing(field),) * 2 if pair is None else pair

    def _missing(self, field: str) -> Formula:
        if not self.values.report.concerns(self.key):
            fault = f"the section has no {field}, which a geometrically exact beam needs"
            other = "poisson_ratio = ..." if field == "shear_modulus" else "stiffness = { ... } without a section"
            self.values.report.add(self.key, fault, f"{field} = ..., or {other}")
        return ZERO

    def _check_shape(self) -> None:
        """Report keys that the shape of the section does not take, or computes itself, and keys that it lacks."""
        section, report = self.section, self.values.report
        given = [size for size in _SIZES if getattr(section, size) is not None]
        if section.shear_modulus is not None and section.poisson_ratio is not None:
            fault = "shear_modulus and poisson_ratio are both given"
            report.add(f"{self.key}.poisson_ratio", fault, "one of them: shear modulus = E/(2 (1 + ratio))")
        if section.shape is None:
            if given:
                shapes = [name for name, shape in SHAPES.items() if given[0] in shape.sizes]
                fault = f"{given[0]} is of a shape, and the section has none"
                report.add(f"{self.key}.{given[0]}", fault, " or ".join(f'shape = "{name}"' for name in shapes))
            return
        sizes = SHAPES[section.shape].sizes
        for size in given:
            if size not in sizes:
                fault = f"a {section.shape} has no {size}"
                report.add(f"{self.key}.{size}", fault, listed(sizes))
        for size in sizes:
            if size not in given:
                report.add(self.key, f"a {section.shape} needs its {size}", f"{size} = 0.02")
        for field in _OF_SHAPES:
            if getattr(section, field) is not None:
                fault = f"{field} is given, and follows from the shape too"
                report.add(f"{self.key}.{field}", fault, f"{field} without shape, or shape without {field}")

    def _formula(self, field: str, value: float | str) -> Formula:
        return self.values.formula(f"{self.key}.{field}", value, PARAMETERS)

    def _optional(self, field: str) -> Formula | None:
        given = getattr(self.section, field)
        return None if given is None else self._formula(field, given)

    def _pair(self, field: str) -> tuple[Formula, Formula] | None:
        given: Sequence[float | str] | None = getattr(self.section, field)
        if given is None:
            return None
        first, second = (self._formula(f"{field}[{place}]", part) for place, part in enumerate(given))
        return first, second
