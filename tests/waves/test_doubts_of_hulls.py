"""Notes on heights of hulls at both sides of each limit; values of formulas are given as numbers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.products.waves.hulls.doubts import _doubts, _doubts_of_place

VALUES: Any = SimpleNamespace(value=float)
#: A body that stands on its head, 3 m above the origin: its z axis points down.
TURNED, ORIGIN = np.diag([1.0, -1.0, -1.0]), np.array([5.0, 6.0, 3.0])


def hull_of(**changes: Any) -> Any:
    wave = SimpleNamespace(level=1.0, components=(), free=0)
    given = {
        "name": "spar", "body": "buoy", "density": 1025.0, "diameter": 2.0, "area": None, "waves": wave, "level": 50.0,
        "wet": None, "adds_mass_to": True, "axial_added_mass": None, "axial_drag": None,
        "start": (0.0, 0.0, 0.0), "end": (0.0, 0.0, 1.0),
    }  # fmt: skip
    return SimpleNamespace(**(given | changes))


def of_place(hull: Any, start: float, end: float) -> list[str]:
    places = (np.array([1.0, 2.0, height]) for height in (start, end))
    return list(_doubts_of_place(hull, TURNED, ORIGIN, *places, VALUES))


def test_hulls_that_begin_above_the_water_are_dry() -> None:
    for start, end in ((-2.0, 0.99), (0.99, -2.0)):  # heights 5 and 2.01, the lower end less half a diameter at 1.01
        assert of_place(hull_of(adds_mass_to=False), start, end) == [
            "it begins 1.01 m above the water at rest, where no water acts on it"
        ]
    assert of_place(hull_of(adds_mass_to=False), -2.0, 1.01) == []
    deep = hull_of(waves=None, level=2.0, adds_mass_to=False)
    assert len(of_place(deep, -2.0, 0.0)) == 1 and of_place(deep, -2.0, 0.01) == []
    assert len(of_place(hull_of(), -2.0, 1.0)) == 1


def test_parts_above_the_water_move_none() -> None:
    (text,) = of_place(hull_of(), -2.0, 6.0)  # from 5 m to -3 m, the water at 1 m
    assert text == (
        "all of its 8 m move water, and 4 m of it begin above the water at rest; wet = 4 counts those below"
    )
    assert of_place(hull_of(wet=3.0), -2.0, 6.0) == of_place(hull_of(adds_mass_to=False), -2.0, 6.0) == []
    assert of_place(hull_of(diameter=7.99), -2.0, 6.0) != [] and of_place(hull_of(diameter=8.0), -2.0, 6.0) == []
    assert of_place(hull_of(diameter=0.1), 1.8, 6.0) == []  # 0.2 m of 4.2 m above
    assert of_place(hull_of(diameter=0.1), 1.7, 6.0) != []  # 0.3 m of 4.3 m


@pytest.mark.parametrize(
    ("density", "texts"),
    [
        (0.0, []), (1.9, ["the density 1.9 kg/m^3 is not a density of water; 1900 if it is in t/m^3"]),
        (2.0, ["the density 2 kg/m^3 is not a density of water"]),
        (399.0, ["the density 399 kg/m^3 is not a density of water"]),
        (400.0, []),
    ],
)  # fmt: skip
def test_densities_of_liquids_begin_at_400(density: float, texts: list[str]) -> None:
    assert list(_doubts(hull_of(density=density), {}, VALUES)) == texts


def test_hulls_wider_than_a_fifth_of_the_largest_free_wave_are_noted() -> None:
    largest, small, bound = (0.3, 0.4, 1.0, 2.0), (8.0, 0.0, 1.0, 0.5), (9.0, 0.0, 1.0, 3.0)

    class Wave(tuple[float, ...]):
        @property
        def amplitude(self) -> float:
            return self[3]

    waves = [Wave(one) for one in (small, largest, bound)]
    sea = SimpleNamespace(level=1.0, components=waves, free=2)
    length = 4.0 * np.pi
    (text,) = _doubts(hull_of(waves=sea, diameter=0.2001 * length), {}, VALUES)
    assert text.startswith(f"its diameter of {0.2001 * length:.4g} m is more than a fifth of the length of the largest")
    assert f"wave, {length:.4g} m, which it would turn and reflect" in text
    assert list(_doubts(hull_of(waves=sea, diameter=0.1999 * length), {}, VALUES)) == []


@pytest.mark.parametrize(("area", "noted"), [(0.24, True), (0.26, False), (3.9, False), (4.1, True), (0.0, False)])
def test_areas_within_four_times_the_circle_are_believed(area: float, noted: bool) -> None:
    texts = list(_doubts(hull_of(area=area * np.pi), {}, VALUES))
    assert [text.split(",")[0] for text in texts] == (["its area"] if noted else [])
    assert not noted or texts[0].endswith("which drag goes by, has 3.14159 m^2")


def test_columns_are_drawn_from_below() -> None:
    column = hull_of(start=(0.0, 0.0, 2.0), axial_drag=0.5)
    (text,) = _doubts(column, {}, VALUES)
    assert text.startswith("start is above end in the axes of buoy, and axial_drag is of the lower part of a column")
    assert list(_doubts(hull_of(start=(0.0, 0.0, 1.0), axial_drag=0.5), {}, VALUES)) == []
    assert list(_doubts(hull_of(start=(0.0, 0.0, 2.0)), {}, VALUES)) == []
    places = {"buoy": (np.eye(3), np.array([0.0, 0.0, 9.0]))}
    assert len(list(_doubts(column, places, VALUES))) == 2
