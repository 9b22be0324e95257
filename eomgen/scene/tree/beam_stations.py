"""Stations of geometrically exact beams: the places along the axis at which anything of a scene is attached."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.formula.nodes import Vector
from eomgen.scene.section import Reading, in_reading_order


def stations_of(beams: Sequence[str], reading: Reading) -> Mapping[str, Sequence[float]]:
    """Return x of every station, m, by beam, NaN if it is not known.

    Parameters
    ----------
    beams : names of the beams that are geometrically exact
    reading : before anything is attached; all of it is read again with the nodes that follow
    """
    stations: dict[str, list[float]] = {name: [] for name in beams}
    if not beams:
        return stations

    def note(key: str, body: str, position: Vector) -> tuple[str, Vector]:
        if body in stations and not aside.report.concerns(key):
            stations[body].append(aside.values.value(position[0]))
        return body, position

    aside = reading.aside(note)
    for row in in_reading_order(reading.rows):
        if row.attached:
            aside.items[row.key] = row.read(aside)
    return stations
