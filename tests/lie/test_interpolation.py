"""Curves between states against motions known in closed form, on every group."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.lie import product
from eomgen.lie.product import Factor, cubic, group_curve


def motion(group):
    """Return factors and (q, v) of t, analytic in t: a turn about z, then one about the new x, and a path in space."""

    def angles(t):
        return 0.8 * np.sin(1.3 * t), 0.6 * t + 0.4 * np.cos(0.9 * t)

    def angular(t):
        (_, x), (z_rate, x_rate) = angles(t), (1.04 * np.cos(1.3 * t), 0.6 - 0.36 * np.sin(0.9 * t))
        return np.stack([x_rate, np.sin(x) * z_rate, np.cos(x) * z_rate], axis=-1)

    def turn(t):
        z, x = (0.5 * angle for angle in angles(t))
        return np.stack(
            [np.cos(z) * np.cos(x), np.cos(z) * np.sin(x), np.sin(z) * np.sin(x), np.sin(z) * np.cos(x)], axis=-1
        )

    def place(t):
        return np.stack([np.sin(t), t**2 / 3.0, np.cos(2.0 * t)], axis=-1)

    def speed(t):
        return np.stack([np.cos(t), 2.0 * t / 3.0, -2.0 * np.sin(2.0 * t)], axis=-1)

    def body_speed(t):
        z, x = angles(t)
        v = speed(t)
        along, across = np.cos(z) * v[..., 0] + np.sin(z) * v[..., 1], np.cos(z) * v[..., 1] - np.sin(z) * v[..., 0]
        up = v[..., 2]
        return np.stack([along, np.cos(x) * across + np.sin(x) * up, np.cos(x) * up - np.sin(x) * across], axis=-1)

    def both(first, second):
        return lambda t: np.concatenate([first(t), second(t)], axis=-1)

    return {
        "R": ([Factor("R", "x", 0, 3, 0, 3)], place, speed),
        "SO3": ([Factor("SO3", "x", 0, 4, 0, 3)], turn, angular),
        "SE3": ([Factor("SE3", "x", 0, 7, 0, 6)], both(turn, place), both(angular, body_speed)),
        "R3xSO3": ([Factor("R3xSO3", "x", 0, 7, 0, 6)], both(turn, place), both(angular, speed)),
    }[group]


def acceleration(v, t):
    return v(t + 1e-30j).imag / 1e-30


def state(group, t):
    _, q, v = motion(group)
    return q(t), v(t), acceleration(v, t)


GROUPS = ["R", "SO3", "SE3", "R3xSO3"]


@pytest.mark.parametrize("group", GROUPS)
def test_orders_of_the_quintic(group):
    factors = motion(group)[0]
    spacings, errors = [0.2, 0.1, 0.05], []
    for spacing in spacings:
        start = np.arange(0.0, 1.0 - 1e-9, spacing)
        worst = np.zeros(3)
        for s in (0.2, 0.45, 0.7):
            ends = state(group, start), state(group, start + spacing)
            found = group_curve(factors, *ends, np.full_like(start, spacing), np.full_like(start, s))
            q, v, a = state(group, start + s * spacing)
            off = (product.difference(factors, q, found[0]), found[1] - v, found[2] - a)
            worst = np.maximum(worst, [np.abs(x).max() for x in off])
        errors.append(worst)
    slopes = np.polyfit(np.log(spacings), np.log(errors), 1)[0]
    assert slopes == pytest.approx([6.0, 5.0, 4.0], abs=0.25), errors


@pytest.mark.parametrize("group", GROUPS)
def test_ends_are_met_and_quaternions_are_of_unit_length(group):
    factors = motion(group)[0]
    start, h = np.array([0.1, 0.6]), np.array([0.3, 0.5])
    first, last = state(group, start), state(group, start + h)
    for s, expected in ((0.0, first), (1.0, last)):
        for found, known in zip(group_curve(factors, first, last, h, np.full(2, s)), expected, strict=True):
            np.testing.assert_allclose(found, known, atol=1e-13)
    if group != "R":
        q = group_curve(factors, first, last, h, np.full(2, 0.37))[0]
        np.testing.assert_allclose(np.linalg.norm(q[:, :4], axis=1), 1.0, atol=4e-16)


def test_the_cubic_meets_values_and_derivatives():
    first, last = (np.array([[1.0, 2.0]]), np.array([[0.5, -1.0]])), (np.array([[3.0, 1.0]]), np.array([[2.0, 0.0]]))
    for s, (value, rate) in ((0.0, first), (1.0, last)):
        found = cubic(first, last, np.array([0.4]), np.array([s]))
        np.testing.assert_allclose(found[0], value, atol=1e-15)
        np.testing.assert_allclose(found[1], rate, atol=1e-13)


def test_differences_lie_where_velocities_do_whatever_the_order_of_factors():
    factors = [Factor("R", "position", 4, 3, 3, 3), Factor("SO3", "orientation", 0, 4, 0, 3)]
    q = np.array([0.5, -0.5, 0.5, 0.5, 1.0, 2.0, 3.0])
    theta = np.array([0.3, -0.2, 0.1, 4.0, 5.0, 6.0])
    np.testing.assert_allclose(product.difference(factors, q, product.update(factors, q, theta)), theta, atol=1e-14)
