"""Cross sections of beams: the keys in the scene, the values that follow from the shape (area, second moments, torsion
constant, shear factors by the sizes and Poisson's ratio), and inertia and stiffness as matrices (6, 6).

Torsion of a rectangle is Saint-Venant's series (Timoshenko and Goodier, Theory of Elasticity, 1970, section 109);
shear factors follow Cowper, J. Appl. Mech. 33 (1966) 335.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from eomgen.base.arrays import Array, Flags, Numbers
from eomgen.base.data import dataclass
from eomgen.base.messages import listed
from eomgen.base.rounding import COMPUTED, SUMMED, WRITTEN
from eomgen.formula.nodes import ONE, ZERO, ZERO_VECTOR, Formula, Number, Operation, Vector
from eomgen.formula.substitution import fold, product, total
from eomgen.scene.bodies.cosserat import CONSTRAINED, STRAINS
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.inertia import NO_INERTIA, impossible
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import Values

if TYPE_CHECKING:
    from eomgen.scene.bodies import beam_schema as written
    from eomgen.scene.bodies.beam_schema import BeamKeys


@dataclass(frozen=True)
class ShapeValues:
    """Properties of a section that follow from the shape.

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
    """Return the torsion constant of a rectangle, m^4, for the longer side a and the shorter side b: ab^3 (1/3 - 64
    b/(pi^5 a) sum tanh(k pi a/(2b))/k^5) over odd k, with the sum of 1 - tanh taken off."""
    sum_of_tanh: Formula = Number(1.0045237627951396)  # the sum of 1/k^5 over odd k
    for k in range(1, 12, 2):  # the remainder is below 1e-16
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
    """A shape of cross-sections: keys of its dimensions, in the order of its law's arguments."""

    sizes: tuple[str, ...]
    law: Law


SHAPES: Mapping[str, SectionShape] = {
    "rectangle": SectionShape(("width", "height"), _rectangle),
    "circle": SectionShape(("diameter",), _circle),
    "tube": SectionShape(("diameter", "thickness"), _tube),
    "ellipse": SectionShape(("width", "height"), _ellipse),
}


_OF_SHAPES = ("area", "second_moments", "torsion_constant")
_SIZES = tuple(dict.fromkeys(size for shape in SHAPES.values() for size in shape.sizes))


class SectionReader:
    """Properties of a beam's section as formulas, as given or by the shape; None for a property not given. Faults, and
    notes on implausible density and modulus, go to the report and the notes of ``values``."""

    def __init__(self, key: str, section: written.SectionEntry, values: Values) -> None:
        self.key, self.section, self.values = key, section, values
        self.written = values.keys(key, section)
        self.elastic_modulus: Formula = self.written["elastic_modulus"]
        self.density: Formula = self.written["density"]
        if 0.0 < (density := values.value(self.density)) < 25.0:
            note = f"the density {density:.6g} kg/m^3 is below the density of any foam [W0294]"
            values.note([f"{key}.density: {note}; {1e3 * density:.6g} if it is in g/cm^3"])
        if 0.0 < (modulus := values.value(self.elastic_modulus)) < 2000.0:
            note = f"the modulus {modulus:.6g} Pa is below the modulus of any solid [W0295]"
            values.note([f"{key}.elastic_modulus: {note}; {1e9 * modulus:.6g} if it is in GPa"])
        self._check_shape()
        shape = self._shape()
        self.area, self.second_moments, self.torsion_constant = (
            self.written.get(field) if shape is None else getattr(shape, field) for field in _OF_SHAPES
        )
        self.shear_factors = self.written.get("shear_factors", shape and shape.shear_factors)

    @cached_property
    def shear_modulus(self) -> Formula | None:
        """Shear modulus as given, or by Poisson's ratio: G = E/(2 (1 + nu))."""
        modulus: Formula | None = self.written.get("shear_modulus")
        ratio: Formula | None = self.written.get("poisson_ratio")
        return fold(self.elastic_modulus / (2.0 * (ONE + ratio))) if modulus is None and ratio is not None else modulus

    def _shape(self) -> ShapeValues | None:
        """Return the values of the shape; None without a shape, and for missing
        or faulty sizes, which are reported."""
        if self.section.shape is None:
            return None
        shape = SHAPES[self.section.shape]
        if any(getattr(self.section, size) is None for size in shape.sizes):  # which is reported
            return None
        sizes = [self.written[size] for size in shape.sizes]
        if any(self.values.report.concerns(f"{self.key}.{size}") for size in shape.sizes):
            return None
        if self.section.shape == "tube":
            self.values.require(f"{self.key}.thickness", RELATIONS["wall of a tube"], list(reversed(sizes)))
        ratio, modulus = self.written.get("poisson_ratio", Number(0.0)), self.shear_modulus
        if self.section.poisson_ratio is None and modulus is not None:
            ratio = fold(self.elastic_modulus / (2.0 * modulus) - ONE)
        result = shape.law(sizes, ratio, self.values.value)
        return ShapeValues(
            fold(result.area),
            cast("tuple[Formula, Formula]", tuple(map(fold, result.second_moments))),
            fold(result.torsion_constant),
            cast("tuple[Formula, Formula]", tuple(map(fold, result.shear_factors))),
        )

    def require(self, field: str, instead: Any = ZERO) -> Any:
        """Return the property ``field`` of the section; ``instead``, after a report, if the section lacks the
        property."""
        if (value := getattr(self, field)) is not None:
            return value
        if not self.values.report.concerns(self.key):
            fault = f"the section has no {field}, which a geometrically exact beam needs [E1345]"
            hint = "poisson_ratio = ..." if field == "shear_modulus" else "stiffness = { ... } without a section"
            self.values.report.add(self.key, fault, f"{field} = ..., or {hint}")
        return instead

    def _check_shape(self) -> None:
        """Report keys that the shape of the section does not take or determines, and missing keys."""
        section, report = self.section, self.values.report
        present_sizes = [size for size in _SIZES if getattr(section, size) is not None]
        if section.shear_modulus is not None and section.poisson_ratio is not None:
            fault = "shear_modulus and poisson_ratio are both given [E1346]"
            report.add(f"{self.key}.poisson_ratio", fault, "one of them: shear modulus = E/(2 (1 + ratio))")
        if section.shape is None:
            if present_sizes:
                shapes = [name for name, shape in SHAPES.items() if present_sizes[0] in shape.sizes]
                fault = f"{present_sizes[0]} belongs to a shape, and the section has no shape [E1347]"
                report.add(f"{self.key}.{present_sizes[0]}", fault, " or ".join(f'shape = "{name}"' for name in shapes))
            return
        sizes = SHAPES[section.shape].sizes
        for size in present_sizes:
            if size not in sizes:
                fault = f"a {section.shape} has no {size} [E1348]"
                report.add(f"{self.key}.{size}", fault, listed(sizes))
        for size in sizes:
            if size not in present_sizes:
                report.add(self.key, f"a {section.shape} needs its {size} [E1351]", f"{size} = 0.02")
        for field in _OF_SHAPES:
            if getattr(section, field) is not None:
                fault = f"{field} is given, and follows from the shape too [E1350]"
                report.add(f"{self.key}.{field}", fault, f"{field} without shape, or shape without {field}")


_DEFINITE = "a positive definite matrix"


@dataclass(frozen=True)
class MatrixRule:
    """Rule for a section's matrix (6, 6), given row by row. Numbers that are not finite pass; a matrix that is not
    symmetric breaks the rule. Other faults depend on ``of``: the beam's model for a stiffness, empty for an inertia."""

    of: str = ""
    stage: int = 1

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        rows = np.stack(np.broadcast_arrays(*numbers), axis=-1)
        return np.apply_along_axis(lambda row: bool(self.fault(row)[0]), -1, rows)

    def fault(self, numbers: Sequence[float] | Array) -> tuple[str, str]:
        matrix = np.array(numbers, dtype=float).reshape(6, 6)
        if not np.all(np.isfinite(matrix)):
            return "", ""
        fault = not_symmetric(matrix)
        if fault:
            return f"{fault} [E1806]", "the mean of both"
        return _stiffness_fault(matrix, self.of) if self.of else _inertia_fault(matrix)


def not_symmetric(matrix: Array) -> str:
    """Return the fault of a matrix (n, n) with an entry that differs from the mirror image by more than 1e-9 of the
    largest entry; empty for a symmetric matrix."""
    unlike = np.argwhere(np.abs(matrix - matrix.T) > COMPUTED * float(np.max(np.abs(matrix)))).tolist()
    if not unlike:
        return ""
    row, column = unlike[0]
    return f"the matrix is not symmetric: entry [{row}][{column}] differs from [{column}][{row}]"


def _stiffness_fault(matrix: Array, model: str) -> tuple[str, str]:
    """Return the fault of a symmetric stiffness matrix (6, 6) of the beam ``model`` and a hint, both empty for a valid
    one. Faults are a matrix that does not resist some strain, and one that resists a strain that the model
    constrains."""
    for index in map(STRAINS.index, CONSTRAINED[model]):
        if matrix[index].any():
            fault = f"the model {model} has no {STRAINS[index]}, and row [{index}] of the matrix is not 0 [E1807]"
            return fault, "0 in rows and columns of strains that it does not have"
    free = [index for index, strain in enumerate(STRAINS) if strain not in CONSTRAINED[model]]
    diagonal = np.diag(matrix)[free]
    if not np.all(diagonal > 0.0):
        index = free[int(np.argmin(diagonal))]
        entry = f"entry [{index}][{index}] is {matrix[index, index]:.6g}"
        return f"the section does not resist {STRAINS[index]}: {entry} [E1804]", _DEFINITE
    scale = np.sqrt(diagonal)
    smallest = float(np.linalg.eigvalsh(matrix[np.ix_(free, free)] / np.outer(scale, scale))[0])
    if smallest > SUMMED:
        return "", ""
    least = f"scaled to a diagonal of 1, its smallest eigenvalue is {smallest:.6g}"
    return f"the matrix is not positive definite, so the section gives way to some strain: {least} [E1801]", _DEFINITE


_FORM = "[[J, S], [-S, m]], of rotary inertia J, mass m, and S = m [[0, -z, y], [z, 0, 0], [-y, 0, 0]]"


def inertia_of_matrix(matrix: Sequence[Sequence[Formula]]) -> dict[str, Any]:
    """Return the inertia that follows from a (6, 6) inertia matrix of a section about the beam's axis, with moments
    about the centre of mass. Twists (omega, v) of the section have the kinetic energy 1/2 twist^T matrix twist (Hodges,
    *Nonlinear Composite Beam Theory*, AIAA 2006, section 5.1, there with v first)."""
    mass = matrix[3][3]
    by_y, by_z = matrix[0][5], matrix[1][3]
    y, z = fold(by_y / mass), fold(by_z / mass)
    xx, yy, zz = (matrix[index][index] for index in range(3))
    moments = (fold(xx - y * by_y - z * by_z), fold(yy - z * by_z), fold(zz - y * by_y))
    products = matrix[0][1], matrix[0][2], fold(matrix[1][2] + y * by_z)
    return {"mass_per_length": mass, "rotary_inertia": moments, "center_of_mass": (y, z), "products": products}


def _inertia_fault(matrix: Array) -> tuple[str, str]:
    """Return the fault of a section's symmetric inertia matrix (6, 6) and a hint, both empty for a valid one. A valid
    matrix has the blocks of a rigid section, and is possible about the centre of mass."""
    mass = matrix[3, 3]
    if not mass > 0.0:
        return f"the mass per length, entry [3][3], is {mass:.6g} [E1809]", "a number above 0"
    y, z = matrix[0, 5] / mass, matrix[1, 3] / mass
    static = mass * np.array([[0.0, -z, y], [z, 0.0, 0.0], [-y, 0.0, 0.0]])
    size = float(np.sqrt(mass * np.abs(matrix[:3, :3]).max()))
    for block, corner, form, scale in (
        ("mass", (3, 3), mass * np.eye(3), mass),
        ("product of mass and place", (0, 3), static, size),
    ):
        corner_block = matrix[corner[0] : corner[0] + 3, corner[1] : corner[1] + 3]
        deviation = np.abs(corner_block - form)
        if np.any(deviation > WRITTEN * scale):
            row, column = np.unravel_index(int(deviation.argmax()), (3, 3))
            entry = f"entry [{corner[0] + row}][{corner[1] + column}], a {block}, is {corner_block[row, column]:.6g}"
            expected = f"{form[row, column]:.6g}"
            return f"no rigid section has this inertia: {entry} where {expected} belongs [E1812]", _FORM
    about = matrix[:3, :3] - mass * np.array([[y * y + z * z, 0.0, 0.0], [0.0, z * z, -y * z], [0.0, -y * z, y * y]])
    least, _, largest = np.linalg.eigvalsh(about).tolist()
    hint = "moments about the beam's axis, not about the centre of mass"
    if not least > NO_INERTIA * largest:
        about_center = "the rotary inertia about the centre of mass"
        return f"{about_center} is not positive definite: its smallest eigenvalue is {least:.6g} [E1801]", hint
    fault = impossible(mass, about)
    return (f"about the centre of mass, {fault} [E1808]", hint) if fault else ("", "")


#: Keys in whose place the matrix stands.
_BY_KEYS = ("mass_per_length", "rotary_inertia", "center_of_mass", "section")


def read_inertia(keys: BeamKeys, section: SectionReader | None, values: Values) -> dict[str, Any]:
    """Return the inertia of a beam's section: from the key ``inertia_matrix``, else from the single keys and the
    section's shape and material. Missing and faulty values go to the report of ``values``, and zeros stand for them."""
    if keys["inertia_matrix"] is not None:
        return _inertia_from_matrix(keys, values)
    inertia = {
        "mass_per_length": _mass_per_length(keys, section, values),
        "rotary_inertia": _rotary_inertia(keys, section, values),
    }
    if (center := keys["center_of_mass"]) is not None:
        inertia["center_of_mass"] = values.by_scope(keys.of("center_of_mass"), center, PARAMETERS)
    return inertia


def _inertia_from_matrix(keys: BeamKeys, values: Values) -> dict[str, Any]:
    key = keys.of("inertia_matrix")
    for field in _BY_KEYS:
        if keys[field] is not None and keys.together(field, "inertia_matrix"):
            fault = f"{field} is given, and inertia_matrix too, which has it [E1353]"
            values.report.add(keys.of(field), fault, "one of them")
    matrix: Sequence[Sequence[Formula]] = values.by_scope(key, keys["inertia_matrix"], PARAMETERS)
    if not values.report.concerns(key):
        values.require(key, MatrixRule(), [entry for line in matrix for entry in line])
    faulty = values.report.concerns(key)
    return {"mass_per_length": ZERO, "rotary_inertia": ZERO_VECTOR} if faulty else inertia_of_matrix(matrix)


def _mass_per_length(keys: BeamKeys, section: SectionReader | None, values: Values) -> Formula:
    value = keys["mass_per_length"]
    if value is not None:
        if section is not None and keys.together("mass_per_length", "section"):
            fault = "mass_per_length is given, and follows from the section too [E1354]"
            values.report.add(keys.of("mass_per_length"), fault, "one of them")
        return values.formula(keys.of("mass_per_length"), value, PARAMETERS)
    if section is None:
        fault, hint = "the key mass_per_length is missing [E1315]", "mass_per_length = ..., or a section"
        values.report.add(keys.key, fault, hint)
        return ZERO
    return product(section.density, section.require("area"))


def _rotary_inertia(keys: BeamKeys, section: SectionReader | None, values: Values) -> Vector:
    value = keys["rotary_inertia"]
    if value is not None:
        entries = values.vector(keys.of("rotary_inertia"), value, PARAMETERS)
        if not values.report.concerns(keys.of("rotary_inertia")):
            values.require(keys.of("rotary_inertia"), RELATIONS["rotary inertia"], entries)
        return _not_thin(keys.of("rotary_inertia"), entries, values)
    if section is None:
        fault = "the sections have no rotary inertia, without which their rotations have none [E1355]"
        values.report.add(keys.key, fault, "rotary_inertia = [polar, about y, about z], or a section")
        return ZERO_VECTOR
    across_y, across_z = section.require("second_moments", (ZERO, ZERO))
    density = section.density
    result = product(density, total(across_y, across_z)), product(density, across_z), product(density, across_y)
    return _not_thin(keys.of("section"), result, values)


def _not_thin(key: str, entries: Vector, values: Values) -> Vector:
    """Return rotary inertias as given, after a report if one of three is negligible against the largest."""
    if not values.report.concerns(key):
        values.require(key, RELATIONS["thin section"], entries)
    return entries
