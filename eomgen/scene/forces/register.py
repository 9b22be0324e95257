"""The register of force elements, in the order of the sections in a file; a row is imported for scenes that have such
elements."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.base.data import dataclass, field
from eomgen.base.products import LateRow

_HERE = __name__.rpartition(".")[0]


@dataclass(frozen=True)
class LateElement(LateRow):
    """A section of force elements; ``offers`` as of its row, which formulas of scenes without elements ask for, too."""

    offers: Mapping[str, str] = field(default_factory=dict)


def _element(key: str, row: str, offers: Mapping[str, str] | None = None) -> LateElement:
    return LateElement(key, f"{_HERE}.{row}", offers=offers or {})


ELEMENTS = (
    _element("springs", "springs:SECTION", {"length": "element", "rate": "element", "tension": "tension"}),
    _element("torsion_springs", "springs:TORSION_SECTION"),
    _element(
        "tendons",
        "tendons:SECTION",
        {"path_length": "element", "path_rate": "element", "path_tension": "tension"},
    ),
    _element("bushings", "bushings:SECTION"),
    _element("forces", "forces:SECTION"),
    _element("distributed_loads", "distributed_loads:SECTION"),
    _element("efforts", "forces:EFFORT_SECTION"),
)
