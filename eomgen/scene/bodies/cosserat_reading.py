"""Reading of geometrically exact beams: their parts, and the section data of each element."""

from __future__ import annotations

import heapq
import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import accumulate, pairwise

from eomgen.base.data import replace
from eomgen.base.messages import key_of
from eomgen.formula.nodes import ZERO, Formula, Number
from eomgen.formula.substitution import product, total
from eomgen.scene.bodies import beam_schema as written
from eomgen.scene.bodies.beam_schema import BeamKeys
from eomgen.scene.bodies.cosserat import CONSTRAINED, STRAINS, BeamElement, BeamSection, Cosserat, Rows
from eomgen.scene.bodies.cross_sections import MatrixRule, SectionReader, read_inertia
from eomgen.scene.bodies.element_sections import varying_element
from eomgen.scene.bodies.initial_shapes import InitialShape, bent_shape, pretwist, read_shape
from eomgen.scene.bodies.model import AT_END
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import Values


def widths_between(places: Sequence[Fraction], count: int) -> tuple[Fraction, ...]:
    """Return the lengths, in order, of ``count`` elements with nodes at ``places``; at least one element between two
    places, even if ``count`` is smaller.

    The longest element is as short as possible: each further element splits the piece with the longest elements.

    Parameters
    ----------
    places : in increasing order, including both ends
    """
    pieces = [end - start for start, end in pairwise(places)]
    counts = [1] * len(pieces)
    longest = [(-piece, number) for number, piece in enumerate(pieces)]
    heapq.heapify(longest)
    for _ in range(count - len(pieces)):
        _, number = heapq.heappop(longest)
        counts[number] += 1
        heapq.heappush(longest, (-pieces[number] / counts[number], number))
    return tuple(piece / parts for piece, parts in zip(pieces, counts, strict=True) for _ in range(parts))


#: Keys that belong to one model alone.
_OF_DEFLECTIONS = (
    "start", "polar_inertia", "mass_profile", "polar_profile", "order", "stiffening", "bending_y", "bending_z",
    "stretch", "torsion",
)  # fmt: skip  # a table
_OF_EXACT = (
    "elements", "parts", "stiffness", "stiffness_matrix", "damping", "stiffness_damping", "rotary_inertia", "curvature",
    "shape", "pretwist", "prestrain", "group", "center_of_mass", "inertia_matrix",
)  # fmt: skip  # a table
#: Section values used after a fault, so that reading goes on.
_SECTION_UNKNOWN = (Number(math.nan),) * 6


def check_keys(name: str, entry: written.BeamEntry, values: Values) -> None:
    """Report the keys of a beam that belong to another beam model, and strains that the model does not have."""
    exact, model = entry.model in CONSTRAINED, entry.model or "euler_bernoulli"
    for field in _OF_DEFLECTIONS if exact else _OF_EXACT:
        if field in entry.model_fields_set:
            fault = f"a beam of the model {model} has no {field} [E1333]"
            hint = _COUNTERPARTS.get(field, "without it") if exact else 'model = "cosserat"'
            values.report.add(key_of("beams", name, field), fault, hint)
    if not exact and entry.section is not None and entry.section.shear_factors is not None:
        fault = "a beam of the model euler_bernoulli does not shear [E1332]"
        values.report.add(key_of("beams", name, "section", "shear_factors"), fault, 'model = "cosserat"')
    if exact:
        _check_strains(name, entry, values)


def _check_strains(name: str, entry: written.BeamEntry, values: Values) -> None:
    """Report stiffnesses, damping and prestrains of strains that a beam does not have."""
    model = str(entry.model)
    without = CONSTRAINED[model]
    tables: list[tuple[tuple[str | int, ...], written.BeamEntry | written.BeamPart]] = [((), entry)]
    tables += [(("parts", number), part) for number, part in enumerate(entry.parts)]
    keys: list[tuple[str | int, ...]] = []
    for before, table in tables:
        if table.section is not None and table.section.shear_factors is not None and "shear_y" in without:
            keys.append((*before, "section", "shear_factors"))
        for field in ("stiffness", "damping", "prestrain"):
            inner = getattr(table, field)
            keys += [(*before, field, strain) for strain in without if inner and strain in inner.model_fields_set]
    for parts in keys:
        last = str(parts[-1])
        fault = f"a beam of the model {model} does not {'stretch' if last == 'stretch' else 'shear'} [E1334]"
        models = [name for name, strains in CONSTRAINED.items() if last not in strains and name != model]
        hint = " or ".join(f'model = "{name}"' for name in (models if last in STRAINS else ["cosserat"]))
        values.report.add(key_of("beams", name, *parts), fault, f"without it, or {hint}")


_COUNTERPARTS: Mapping[str, str] = {
    "start": "the frame at the beam's first end",
    "polar_inertia": "rotary_inertia = [polar, about y, about z]",
    **dict.fromkeys(("bending_y", "bending_z", "stretch", "torsion"), "stiffness = { ... }, for all strains at once"),
}


def read_cosserat(name: str, entry: written.BeamEntry, values: Values, stations: Sequence[float] = ()) -> Cosserat:
    """Return the geometrically exact beam of an entry of [beams]; faults go to the report of ``values``.

    Parameters
    ----------
    stations : x of the places of attachments, m, which become nodes; places beyond the beam are left out
    """
    key = key_of("beams", name)
    whole = BeamKeys(key, entry)
    shape = read_shape(whole, values)
    pieces = _with_nodes(whole, _pieces(whole, shape, values), stations, values)
    ends = list(accumulate((sum(widths, Fraction(0)) for _, widths in pieces), initial=Fraction(0)))
    if shape is None:
        shape = bent_shape([(float(end), keys) for end, (keys, _) in zip(ends[1:], pieces, strict=True)], values)
    shape = pretwist(whole, shape, values)
    elements: list[BeamElement] = []
    most = 0.0
    for start, (keys, widths) in zip(ends, pieces, strict=False):
        sections = _BeamSections(keys, float(ends[-1]), values)
        for begin, width in zip(accumulate(widths, initial=start), widths, strict=False):
            twist, turn = shape.between(begin, begin + width)
            most = max(most, turn)
            element = sections.element(begin, width, tuple(twist.tolist()))
            elements.append(elements[-1] if elements and elements[-1] == element else element)
    _check_fold(whole, most, len(elements), values)
    beam = Cosserat(name, tuple(elements), whole.model)
    if values.report.concerns(whole.key) or not (fault := _beyond_numbers(beam, values)):
        return beam
    message = f"{fault} is too large or too small to be squared in double precision [E1335]"
    values.report.add(whole.key, message, "SI units")
    return Cosserat(name, tuple(replace(part, length=Fraction(1)) for part in elements), whole.model)


def _beyond_numbers(beam: Cosserat, values: Values) -> str:
    """Return words for an element's length, mass or stiffness that is out of the range 1e-150 to 1e150, for a message;
    empty if all are in range."""
    for part in {id(part): part for part in beam.parts}.values():  # equal neighbours are one object
        length, mass = float(part.length), values.value(part.section.mass_per_length)
        stiffness = max((abs(values.value(entry)) for row in part.section.stiffness for entry in row), default=0.0)
        numbers = {
            f"the length of an element, {length:.6g} m,": length,
            f"the mass of an element, {mass:.6g} kg/m over {length:.6g} m,": mass * length,
            f"the stiffness of an element, {stiffness:.6g} by {length:.6g} m,": stiffness / length,
            f"the stiffness of an element, {stiffness:.6g} over {length:.6g} m,": stiffness * length,
        }
        for label, number in numbers.items():
            if not math.isnan(number) and not 1e-150 < number < 1e150:  # beyond, products overflow
                return label
    return ""


#: Keys of a part of the beam, and the widths of its elements.
_Piece = tuple[BeamKeys, tuple[Fraction, ...]]


def _pieces(whole: BeamKeys, shape: InitialShape | None, values: Values) -> list[_Piece]:
    """Return the parts of a beam with equal elements each; one piece for a beam without a list of parts. Missing or
    contradictory keys are reported, and a missing length or number becomes 1."""
    entry, report = whole.entry, values.report
    if not entry.parts:
        if entry.elements is None:
            fault = f"a beam of the model {whole.model} needs the number of its elements [E1336]"
            report.add(whole.key, fault, "elements = 16")
        elements = entry.elements or 1
        return [(whole, (_length(whole, shape, values) / elements,) * elements)]
    for field in ("length", "elements", "shape"):
        if getattr(entry, field) is not None:
            fault = f"{field} is given, and parts too, which have their own [E1338]"
            hint = "curvature in the parts" if field == "shape" else f"{field} in the parts alone"
            report.add(f"{whole.key}.{field}", fault, hint)
    count = sum(part.elements for part in entry.parts)
    if count > written.MOST_EXACT_ELEMENTS:
        fault = f"the parts have {count} elements, and {written.MOST_EXACT_ELEMENTS} are the most of a beam [E1337]"
        report.add(f"{whole.key}.parts", fault, "fewer elements")
    pieces: list[_Piece] = []
    for number, part in enumerate(entry.parts):
        keys = BeamKeys(whole.key, entry, f"{whole.key}.parts[{number}]", part)
        length = _positive(f"{keys.part_key}.length", "a part of a beam", part.length, values)
        pieces.append((keys, (length / part.elements,) * part.elements))
    return pieces


def _with_nodes(whole: BeamKeys, pieces: Sequence[_Piece], stations: Sequence[float], values: Values) -> list[_Piece]:
    """Return pieces with a node at every station, x in m. The number of elements stays unless too small, which is
    noted; elements of a piece with new nodes may have different lengths."""
    result: list[_Piece] = []
    start, tolerance = Fraction(0), Fraction(AT_END) * sum(sum(widths) for _, widths in pieces)
    for keys, widths in pieces:
        inner: list[Fraction] = []
        nodes = list(accumulate(widths))
        for x in sorted(Fraction(x) - start for x in stations if math.isfinite(x)):
            if (inner[-1] if inner else 0) + tolerance < x < nodes[-1] - tolerance:
                inner.append(x)
        if not all(min(abs(node - x) for node in nodes) <= tolerance for x in inner):
            widths = widths_between([Fraction(0), *inner, nodes[-1]], len(widths))  # noqa: PLW2901  # with nodes there
        result.append((keys, widths))
        start += nodes[-1]
    before, after = (sum(len(widths) for _, widths in some) for some in (pieces, result))
    if after > before:
        note = f"{before} elements become {after}, since something is attached at more places than they have nodes"
        values.note([f"{whole.key}.elements: {note} [W0293]"])
    return result


def _length(whole: BeamKeys, shape: InitialShape | None, values: Values) -> Fraction:
    if shape is not None:
        if whole.entry.length is not None:
            fault = "length is given, and follows from the shape too [E1339]"
            values.report.add(f"{whole.key}.length", fault, "one of them")
        return Fraction(shape.length)
    if whole.entry.length is None:
        if whole.entry.shape is None:  # one that is wrong is reported
            values.report.add(whole.key, "the key length is missing [E1311]", "length = 1.0")
        return Fraction(1)
    return _positive(f"{whole.key}.length", "a beam", whole.entry.length, values)


def _positive(key: str, beam_or_part: str, value: float | str, values: Values) -> Fraction:
    length = values.constant(key, value)
    if not length > 0.0:
        if not math.isnan(length):
            values.report.add(key, f"the length of {beam_or_part} is {length:.6g} [E1340]", "a number above 0")
        return Fraction(1)
    return Fraction(length)


class _BeamSections:
    """Sections along a beam or a part of a beam; one section for all elements if no value varies. ``whole`` is the
    length of the whole beam, m."""

    def __init__(self, keys: BeamKeys, whole: float, values: Values) -> None:
        self.keys, self.whole, self.values = keys, whole, values
        self.last: BeamSection | None = None
        self.varied: Mapping[str, Formula] = {}

    def element(self, start: Fraction, length: Fraction, twist: tuple[float, ...]) -> BeamElement:
        """Return an element of the length ``length`` from x = ``start`` on, m, with the section in its middle; if
        sections vary, with inertia and compliance integrated along the element. ``twist`` (6,) is the logarithm between
        both end frames at rest."""
        faulty = self.values.report.concerns(self.keys.key)
        if self.last is None or (self.varied and not faulty):
            there = self.values.at(float((start + length / 2) / Fraction(self.whole)))
            self.last, self.varied = _section(self.keys, there), there.varied
            faulty = self.values.report.concerns(self.keys.key)
        element = BeamElement(length, self.last, twist)
        if faulty or not self.varied:
            return element
        return varying_element(element, float(start), self.whole, self.knots, self._at, self.values.value)

    @cached_property
    def knots(self) -> tuple[float, ...]:
        """Places from 0 to 1 along the beam at which sections are not smooth."""
        return self.values.knots(self.varied.values())

    def _at(self, s: float) -> BeamSection | None:
        section = _section(self.keys, self.values.again_at(s, self.varied))
        return None if self.values.report.concerns(self.keys.key) else section


def _section(keys: BeamKeys, values: Values) -> BeamSection:
    reader = SectionReader(keys.of("section"), keys["section"], values) if keys["section"] is not None else None
    stiffness = _stiffness(keys, reader, values)
    inertia = read_inertia(keys, reader, values)
    damping, prestrain = _damping(keys, stiffness, values), _by_strain(keys, "prestrain", values)
    key = f"{keys.of('prestrain')}.stretch"
    if not values.report.concerns(key):
        values.require(key, RELATIONS["length at rest"], [prestrain[STRAINS.index("stretch")]])
    return BeamSection(stiffness=stiffness, damping=damping, prestrain=tuple(prestrain), **inertia)


def _stiffness(keys: BeamKeys, section: SectionReader | None, values: Values) -> Rows:
    """Return the (6, 6) stiffness of a section as rows of formulas, in the order of ``STRAINS``: from a matrix, from
    strains, or from shape and material; NaN, after a report, without any."""
    if keys["stiffness"] is not None and keys["stiffness_matrix"] is not None:
        fault = "stiffness and stiffness_matrix are both given [E1341]"
        values.report.add(keys.of("stiffness_matrix"), fault, "one of them")
    free = [strain for strain in STRAINS if strain not in CONSTRAINED[keys.model]]
    if (entries := keys["stiffness_matrix"]) is not None:
        key = keys.of("stiffness_matrix")
        matrix: Rows = values.by_scope(key, entries, PARAMETERS)
        if not values.report.concerns(key):
            values.require(key, MatrixRule(keys.model), [entry for line in matrix for entry in line])
        return matrix
    if (by_strain := keys["stiffness"]) is not None:
        key = keys.of("stiffness")
        for strain in free:
            if getattr(by_strain, strain) is None:
                values.report.add(key, f"the key {strain} is missing [E1343]", f"{strain} = ...")
        formulas = values.keys(key, by_strain, *free)
        return _diagonal([formulas.get(strain, ZERO) for strain in STRAINS])
    if section is None:
        fault = "the sections have no stiffness [E1342]"
        values.report.add(keys.key, fault, f"stiffness = {{ {free[-1]} = ..., ... }}, stiffness_matrix, or a section")
        return _diagonal(_SECTION_UNKNOWN)
    area, shear, torsion = (section.require(field) for field in ("area", "shear_modulus", "torsion_constant"))
    across_y, across_z = section.require("second_moments", (ZERO, ZERO))
    along_y, along_z = section.require("shear_factors", (ZERO, ZERO)) if "shear_y" in free else (ZERO, ZERO)
    modulus = section.elastic_modulus
    result = {
        "torsion": product(shear, torsion),
        "bending_z": product(modulus, across_z),
        "bending_y": product(modulus, across_y),
        "stretch": product(modulus, area),
        "shear_y": product(shear, area, along_y),
        "shear_z": product(shear, area, along_z),
    }
    return _diagonal([result[strain] if strain in free else ZERO for strain in STRAINS])


def _damping(keys: BeamKeys, stiffness: Rows, values: Values) -> Rows:
    rows = _diagonal(_by_strain(keys, "damping", values))
    if keys["stiffness_damping"] is None:
        return rows
    share = values.formula(keys.of("stiffness_damping"), keys["stiffness_damping"], PARAMETERS)
    return tuple(
        tuple(
            total(part, product(share, elastic)) if elastic != ZERO else part
            for part, elastic in zip(*pair, strict=True)
        )
        for pair in zip(rows, stiffness, strict=True)
    )


def _by_strain(keys: BeamKeys, field: str, values: Values) -> list[Formula]:
    """Return the formulas of a table ``field``, ``damping`` or ``prestrain``, in the order of ``STRAINS``; zeros if
    there is no table."""
    table = keys[field]
    return [ZERO] * 6 if table is None else list(values.keys(keys.of(field), table, *STRAINS).values())


def _diagonal(entries: Sequence[Formula]) -> Rows:
    return tuple(tuple(entries[row] if row == column else ZERO for column in range(6)) for row in range(6))


def _check_fold(whole: BeamKeys, turn: float, elements: int, values: Values) -> None:
    """Report a beam if ``turn``, the largest angle along one element at rest, rad, is pi or more; ``elements`` is the
    number of elements."""
    if turn < math.pi or values.report.concerns(whole.key):
        return
    least = math.floor(turn * elements / math.pi) + 1
    fields = [field for field in ("pretwist", "shape", "curvature", "parts") if getattr(whole.entry, field)]
    which = "each of" if fields == ["curvature"] else "one of"
    degrees = f"{math.degrees(turn):.6g} degrees"
    fault = f"{which} the {elements} elements turns by {degrees} at rest, and only less than 180 is unique [E1344]"
    values.report.add(f"{whole.key}.{fields[0]}", fault, f"elements = {4 * least}; {least} is the least")
