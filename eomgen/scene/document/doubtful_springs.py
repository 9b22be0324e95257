"""Notes on springs and dampers that are allowed but hardly ever meant: they push away, or have no effect."""

from __future__ import annotations

from collections.abc import Iterator

from eomgen.base.text import key_of
from eomgen.scene.document.schema import Document

_SPRUNG = ("joints", "springs", "torsion_springs")


def negative_laws(document: Document) -> list[str]:
    """Return a note on each joint and spring whose damping or stiffness is a number below zero."""
    return [
        *(
            f"{key}.damping: the damping {value:.6g} is negative, and adds energy to every motion;"
            f" {-value:.6g} takes it away"
            for key, value in _below_zero(document, "damping")
        ),
        *(
            f"{key}.stiffness: the stiffness {value:.6g} is negative, and pushes away from where the spring is slack;"
            f" {-value:.6g} pulls back"
            for key, value in _below_zero(document, "stiffness")
        ),
    ]


def _below_zero(document: Document, field: str) -> Iterator[tuple[str, float]]:
    for section in _SPRUNG:
        for name, entry in document.section(section).items():
            written = getattr(entry, field)
            for value in written if isinstance(written, tuple) else (written,):
                if isinstance(value, int | float) and value < 0.0:
                    yield key_of(section, name), value


def springs_within_bodies(document: Document) -> list[str]:
    """Return a note on each spring between two points of one body, which has no effect on its motion."""
    notes = []
    points = {**document.section("frames"), **document.section("points")}
    for name, spring in document.section("springs").items():
        first, second = points.get(spring.first), points.get(spring.second)
        if first is None or second is None:
            continue
        if first.body == second.body and first.body not in document.section("beams"):
            note = f"both its points are fixed in {first.body}, so the spring moves nothing"
            notes.append(f"{key_of('springs', name)}: {note}")
    return notes
