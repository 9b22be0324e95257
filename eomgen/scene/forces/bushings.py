"""Bushings in scene files, keys, bounds and data: springs and dampers in all six directions between two frames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from eomgen.base.data import dataclass
from eomgen.base.messages import key_of
from eomgen.base.rounding import COMPUTED
from eomgen.formula.nodes import ZERO, ZERO_VECTOR, Formula, Number
from eomgen.scene.bodies.cross_sections import not_symmetric
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.joints.constraint_schema import FrameEntry
from eomgen.scene.joints.frames import Site, read_frame
from eomgen.scene.joints.model import Frame
from eomgen.scene.reading.key_metadata import Table, key, of_parameters, optional
from eomgen.scene.reading.kinds import ORIGIN, Rotations, SixBySix, Triple
from eomgen.scene.reading.requirements import DAMPING, STIFFNESS
from eomgen.scene.reading.values import Values
from eomgen.scene.rotations import rows, sequence

_NOTHING = "`[0, 0, 0]`"
Rows = tuple[tuple[Formula, ...], ...]


class BushingEntry(Table):
    """A spring and damper in all six directions between two frames."""

    first: FrameEntry = key("a frame in one body", kind="frame")
    second: FrameEntry = key("a frame in another", kind="frame")
    stiffness: Triple | None = of_parameters("stiffness along x, y, z of `first`", unit="N/m", shown_default=_NOTHING)
    damping: Triple | None = of_parameters("damping along x, y, z", unit="N s/m", shown_default=_NOTHING)
    rotational_stiffness: Triple | None = of_parameters(
        "stiffness about x, y, z of `first`", unit="N m/rad", shown_default=_NOTHING
    )
    rotational_damping: Triple | None = of_parameters("damping about x, y, z", unit="N m s/rad", shown_default=_NOTHING)
    stiffness_matrix: SixBySix | None = optional(
        "symmetric stiffness, rotations first, in place of both stiffnesses", kind="6x6 numbers"
    )
    damping_matrix: SixBySix | None = optional("damping, rotations first, for both dampings", kind="6x6 numbers")
    rest: Triple = key("origin of the second frame in the first for slack springs", ORIGIN, unit="m", names=PARAMETERS)
    rest_rotation: Rotations = key("axes of the second frame in the first then, by angles of fixed parameters", ())
    preload: Triple = key("force on the second frame then, in the first one's axes", ORIGIN, unit="N", names=PARAMETERS)
    rotational_preload: Triple = key("moment on the second frame then", ORIGIN, unit="N m", names=PARAMETERS)


@dataclass(frozen=True)
class Bushing(ForceElement):
    """Spring and damper in six directions between two frames, angular first, in the axes of the first frame.

    Attributes
    ----------
    stiffness, damping : 6 rows of 6; the stiffness is symmetric
    rest : origin of the second frame in the first when the springs are slack, m
    rest_orientation : axes of the second frame in the first then, as columns, row by row
    preload : moment (N m) and force (N) on the second frame at rest
    """

    section: ClassVar[str] = "bushings"
    law: ClassVar[str] = "eomgen.mechanics.forces.bushings:LAW"

    first: Frame
    second: Frame
    stiffness: tuple[tuple[Formula, ...], ...]
    damping: tuple[tuple[Formula, ...], ...]
    rest: tuple[Formula, Formula, Formula]
    rest_orientation: tuple[tuple[float, float, float], ...]
    preload: tuple[Formula, ...]

    def lengths(self) -> tuple[Formula, ...]:
        return self.rest

    def frames(self) -> tuple[Frame, Frame]:
        return self.first, self.second


def read_bushing(name: str, entry: BushingEntry, site: Site) -> Bushing:
    """Return the bushing of an entry of [bushings]; faults, and a bushing without any force, go to the report of the
    site's values."""
    key, values = key_of("bushings", name), site.values
    first, second = (
        read_frame(f"{key}.{side}", "bushing", frame, "any", site)
        for side, frame in (("first", entry.first), ("second", entry.second))
    )
    stiffness, damping = _rows(key, entry, "stiffness", values), _rows(key, entry, "damping", values)
    preload = sum(values.keys(key, entry, "rotational_preload", "preload").values(), ())
    parts = [entry for row in (*stiffness, *damping, preload) for entry in row]
    if not values.report.concerns(key) and all(part in (ZERO, Number(-0.0)) for part in parts):
        fault = "the bushing has no stiffness, damping or preload [E1491]"
        values.report.add(key, fault, "stiffness = [1e5, 1e5, 1e5]")
    return Bushing(
        name=name,
        first=first,
        second=second,
        stiffness=stiffness,
        damping=damping,
        **values.keys(key, entry, "rest"),
        rest_orientation=rows(sequence(values.constant_rotations(f"{key}.rest_rotation", entry.rest_rotation) or [])),
        preload=preload,
    )


def _rows(key: str, entry: BushingEntry, quantity: str, values: Values) -> Rows:
    """Return the six rows of the stiffness or the damping, as ``quantity`` says, rotations first: from the (6, 6)
    matrix, else the diagonal of both keys, zeros without them. A matrix is checked, and faults are reported."""
    fields = (f"rotational_{quantity}", quantity)
    matrix = getattr(entry, f"{quantity}_matrix")
    if matrix is None:
        formulas = values.keys(key, entry, *fields)
        diagonal = [part for field in fields for part in formulas.get(field, ZERO_VECTOR)]
        return tuple(tuple(diagonal[i] if i == j else ZERO for j in range(6)) for i in range(6))
    for field in fields:
        if getattr(entry, field) is not None:
            values.report.add(f"{key}.{field}", f"{field} and {quantity}_matrix are both given [E1492]", "one of them")
    _check_matrix(f"{key}.{quantity}_matrix", matrix, quantity, values)
    return tuple(tuple(Number(number) for number in row) for row in matrix)


def _check_matrix(key: str, rows_given: Sequence[Sequence[float]], quantity: str, values: Values) -> None:
    """Report a stiffness matrix (6, 6) that is not symmetric, so has no potential, and a stiffness or damping whose
    symmetric part has a negative eigenvalue."""
    matrix = np.array(rows_given)
    size = float(np.max(np.abs(matrix)))
    if quantity == "stiffness" and (fault := not_symmetric(matrix)):
        values.report.add(key, f"{fault} [E1494]", "the mean of both")
        return
    smallest = float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0])
    if smallest < -COMPUTED * size:
        fault = f"the {quantity} is negative in some direction: the smallest eigenvalue is {smallest:.6g} [E1493]"
        values.report.add(key, fault, "a positive semidefinite matrix")


_BOUNDS = {"stiffness": STIFFNESS, "rotational_stiffness": STIFFNESS, "damping": DAMPING, "rotational_damping": DAMPING}
_ANY = ("first.position", "second.position", "rest", "preload", "rotational_preload")
SECTION = ElementSection(
    key="bushings",
    entry=BushingEntry,
    model=Bushing,
    reader=read_bushing,
    bounds={**_BOUNDS, **dict.fromkeys(_ANY)},
    positional=("first", "second"),
    documentation="""
    Add a spring and damper in six directions between two frames (as of constraints), in the first one's axes.

    Stiffnesses and dampings are given along and about x, y, z, or as 6 x 6 matrices, rotations first. At
    ``rest`` and ``rest_rotation``, the second frame's place in the first, only the preload acts on the second
    frame.""",
)
