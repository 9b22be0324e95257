"""Kinematics and compliance of an axle as curves: angles, displacements, loads, and their slopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass


@dataclass(frozen=True)
class Car:
    """The car: place of the other axle along x from this one (0: none), m, height of the centre of mass, m, and this
    axle's part in braking."""

    other_axle: float
    height: float
    brake_share: float


@dataclass(frozen=True)
class Wheel:
    """States of a wheel: name, side (1: left, -1: right), centre and the axes x and y of the hub (rows, 9), vector from
    the centre to the contact (rows, 3), and vertical force of the road (rows,). ``rolled`` is the way of the contact
    by a small roll (rows, 3), in any unit; None if the axle does not roll."""

    name: str
    side: float
    pose: Array
    arm: Array
    load: Array
    rolled: Array | None = None

    @property
    def axes(self) -> Array:
        """(rows, 3, 3) axes of the hub, as columns."""
        x, y = self.pose[:, 3:6], self.pose[:, 6:]
        return np.stack([x, y, np.cross(x, y)], axis=2)


@dataclass(frozen=True)
class Curves:
    """Columns over a quantity that varies alone.

    Attributes
    ----------
    name, label, unit : of the range, and of the quantity
    x : (rows,) values of the quantity
    columns, units : (rows,) by name, and their units
    """

    name: str
    label: str
    unit: str
    x: Array
    columns: Mapping[str, Array]
    units: Mapping[str, str]

    def slope(self, column: str) -> float:
        """Return the slope of a column in the middle of the range.

        Parameters
        ----------
        column : str
            Name in ``columns``.

        Returns
        -------
        float
            Unit of the column by unit of ``x``.

        Examples
        --------
        >>> curves = eomgen.suspension("examples/car/system/rear_axle.toml", ["left_hub", "right_hub"], rows=5)
        >>> round(curves.curves["travel"].slope("left_hub toe"), 3)
        0.003
        """
        return float(slopes(self.x, self.columns[column])[len(self.x) // 2])


def slopes(x: Array, values: Array) -> Array:
    """Return the derivatives of rows of values by x, of cubic splines through all rows."""
    return np.asarray(CubicSpline(x, values)(x, 1))


def curves_of(
    names: tuple[str, str, str], x: Array, wheels: Sequence[Wheel], lengths: Mapping[str, Array], car: Car
) -> Curves:
    """Return the curves of a range.

    Parameters
    ----------
    names : name of the range, label and unit of the quantity
    x : (rows,) values of the quantity
    wheels : states of all wheels over the range
    lengths : of springs, m
    car : whose support and turning are computed
    """
    columns: dict[str, tuple[Array, str]] = {}
    middle = len(x) // 2
    for wheel in wheels:
        centre, axis = wheel.pose[:, :3], wheel.pose[:, 6:]
        contact = centre + wheel.arm
        moved = 1e3 * (contact - contact[middle])
        steer = np.degrees(-np.arctan2(axis[:, 0], axis[:, 1]))
        rows = {
            "toe": (-wheel.side * steer, "deg"),
            "camber": (-wheel.side * np.degrees(np.arcsin(axis[:, 2])), "deg"),
            "steer": (steer, "deg"),
            "contact x": (moved[:, 0], "mm"),
            "contact y": (wheel.side * moved[:, 1], "mm"),
            "centre x": (1e3 * (centre - centre[middle])[:, 0], "mm"),
            "load": (wheel.load, "N"),
        }
        if names[0] in ("travel", "roll"):
            rows |= _over_travel(x, wheel, car)
        elif names[0] == "steering":
            rows |= _over_steering(x, wheel)
        columns |= {f"{wheel.name} {name}": row for name, row in rows.items()}
    if names[0] == "travel":
        rise = slopes(x, wheels[0].pose[:, 2] + wheels[0].arm[:, 2])
        ratios = {name: -slopes(x, length) / rise for name, length in lengths.items()}
        columns |= {f"{name} motion ratio": (row, "") for name, row in ratios.items() if np.abs(row).max() > 0.01}
    if names[0] == "steering" and len(wheels) == 2 and car.other_axle:
        left, right = sorted(wheels, key=lambda wheel: -wheel.side)
        angles = [np.radians(columns[f"{wheel.name} steer"][0]) for wheel in (left, right)]
        angles = [angle - angle[middle] for angle in angles]
        cotangents = np.full(len(x), np.nan)
        turned = np.abs(angles[0]) > np.radians(1.0)
        cotangents[turned] = 1.0 / np.tan(angles[1][turned]) - 1.0 / np.tan(angles[0][turned])
        track = (left.pose[middle, 1] + left.arm[middle, 1]) - (right.pose[middle, 1] + right.arm[middle, 1])
        columns["Ackermann"] = 100.0 * abs(car.other_axle) / track * cotangents, "%"
    values = {name: column for name, (column, _) in columns.items()}
    return Curves(*names, x, values, {name: unit for name, (_, unit) in columns.items()})


def _motion(x: Array, wheel: Wheel) -> tuple[Array, Array]:
    """Return velocity of the centre and angular velocity of the hub along a range, (rows, 3) each, by unit of x."""
    rates = np.einsum("rij,rkj->rik", slopes(x, wheel.axes), wheel.axes)
    return slopes(x, wheel.pose[:, :3]), np.stack([rates[:, 2, 1], rates[:, 0, 2], rates[:, 1, 0]], axis=1)


def _over_travel(x: Array, wheel: Wheel, car: Car) -> dict[str, tuple[Array, str]]:
    velocity, turning = _motion(x, wheel)
    contact = wheel.pose[:, :3] + wheel.arm
    along = slopes(x, contact)
    rise = along[:, 2]
    rolled = along if wheel.rolled is None else wheel.rolled
    locked = velocity + np.cross(turning, wheel.arm)  # of the point of a locked wheel at the contact
    rows = {
        "rate": (1e-3 * slopes(x, wheel.load) / rise, "N/mm"),
        "roll centre height": (1e3 * contact[:, 1] * rolled[:, 1] / rolled[:, 2], "mm"),
    }
    for kind, share, forward in (("braking", car.brake_share, locked), ("driving", 1.0, velocity)):
        rows[f"{kind} angle"] = np.degrees(np.arctan(forward[:, 0] / rise)), "deg"
        if car.other_axle:
            rows[f"{kind} support"] = -100.0 * forward[:, 0] / rise * share * car.other_axle / car.height, "%"
    return rows


def _over_steering(x: Array, wheel: Wheel) -> dict[str, tuple[Array, str]]:
    """Return angles of the steering axis, the instantaneous axis of the hub, and its place on the road."""
    velocity, turning = _motion(x, wheel)
    centre, contact = wheel.pose[:, :3], wheel.pose[:, :3] + wheel.arm
    foot = centre + np.cross(turning, velocity) / np.sum(turning**2, axis=1, keepdims=True)
    foot += turning * ((contact - foot)[:, 2:] / turning[:, 2:])
    forward, left = (turning[:, k] / turning[:, 2] for k in (0, 1))
    return {
        "caster": (np.degrees(np.arctan(-forward)), "deg"),
        "kingpin inclination": (np.degrees(np.arctan(-wheel.side * left)), "deg"),
        "scrub radius": (1e3 * wheel.side * (contact - foot)[:, 1], "mm"),
        "trail": (1e3 * (foot - contact)[:, 0], "mm"),
    }
