"""Initial shapes of beams in closed form: circles, clothoids, helices, splines through points, frames that turn as
little as possible."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.scene.bodies import initial_shapes as shapes
from eomgen.scene.bodies.initial_shapes import CurvatureShape, HelixShape, RotatedSectionShape, through_frames

Array = np.ndarray


def test_constant_curvature_is_one_screw() -> None:
    shape = CurvatureShape(4.0, lambda x: np.array([0.3, 0.0, -0.4]), lambda first, last: True)
    twist, turn = shape.between(Fraction(1), Fraction(3))
    np.testing.assert_allclose(twist, [0.6, 0.0, -0.8, 2.0, 0.0, 0.0])
    assert turn == pytest.approx(1.0)


@pytest.mark.parametrize(("start", "end"), [(0, 1), (1, 2), (2, 3)])
def test_varying_curvature_is_the_integral_of_its_frames(start: int, end: int) -> None:
    """Of a twisted clothoid, against an integration of H' = H k."""

    def curvature(x: float) -> Array:
        return np.array([0.2 * x, -0.1, 0.5 * x])

    def rate(x: float, h: Array) -> Array:
        turned, along = h[:9].reshape(3, 3), curvature(x)
        skew = np.array([[0.0, -along[2], along[1]], [along[2], 0.0, -along[0]], [-along[1], along[0], 0.0]])
        return np.concatenate([(turned @ skew).ravel(), turned[:, 0]])

    shape = CurvatureShape(4.0, curvature, lambda first, last: False)
    twist, turn = shape.between(Fraction(start), Fraction(end))
    at_start = np.concatenate([np.eye(3).ravel(), np.zeros(3)])
    run = solve_ivp(rate, (start, end), at_start, "DOP853", rtol=1e-12, atol=1e-13)
    pose = numeric.exp(SE3, twist)
    np.testing.assert_allclose(numeric.rotation_matrix(pose[:4]), run.y[:9, -1].reshape(3, 3), atol=1e-6)
    np.testing.assert_allclose(pose[4:], run.y[9:, -1], atol=1e-6)
    x = np.linspace(start, end, 2001)
    angles = np.trapezoid(np.linalg.norm([curvature(place) for place in x], axis=1), x)
    assert turn == pytest.approx(angles, rel=2e-3)


def test_shapes_through_frames_go_from_piece_to_piece() -> None:
    first, second = np.array([0.0, 0.0, 0.8, 2.0, 0.0, 0.0]), np.array([0.5, 0.0, 0.0, 3.0, 0.0, 0.0])
    poses = [shapes.IDENTITY, numeric.exp(SE3, first)]
    poses.append(numeric.compose(SE3, poses[1], numeric.exp(SE3, second)))
    shape = through_frames(np.array(poses))
    assert isinstance(shape, HelixShape) and shape.length == pytest.approx(5.0)
    np.testing.assert_allclose(shape.lengths, [2.0, 3.0])
    for start, end, parts in (
        (0, 1, [0.5 * first]),
        (1, 2, [0.5 * first]),
        (2, 5, [second]),
        (1, 3, [0.5 * first, second / 3.0]),
        (0, 5, [first, second]),
    ):
        twist, turn = shape.between(Fraction(start), Fraction(end))
        pose = shapes.IDENTITY
        for part in parts:
            pose = numeric.compose(SE3, pose, numeric.exp(SE3, part))
        np.testing.assert_allclose(twist, numeric.log(SE3, pose), atol=1e-13)
        assert turn == pytest.approx(sum(float(np.linalg.norm(part[:3])) for part in parts))


def test_sections_turn_about_the_axis_by_the_pretwist() -> None:
    straight = CurvatureShape(4.0, lambda x: np.zeros(3), lambda first, last: True)
    shape = RotatedSectionShape(straight, lambda x: 0.3 * x)
    assert shape.length == 4.0
    twist, turn = shape.between(Fraction(1), Fraction(3))
    np.testing.assert_allclose(twist, [0.6, 0.0, 0.0, 2.0, 0.0, 0.0], atol=1e-15)
    assert turn == pytest.approx(0.6)
    bent = CurvatureShape(4.0, lambda x: np.array([0.0, 0.0, 0.5]), lambda first, last: True)
    twist, turn = RotatedSectionShape(bent, lambda x: -0.25 * math.pi * x).between(Fraction(2), Fraction(2))
    np.testing.assert_allclose(twist, np.zeros(6), atol=1e-15)
    twist, turn = RotatedSectionShape(bent, lambda x: 0.5 * math.pi).between(Fraction(0), Fraction(1))
    np.testing.assert_allclose(twist, [0.0, 0.5, 0.0, 1.0, 0.0, 0.0], atol=1e-14)  # z of the curve is y of the section
    assert turn == pytest.approx(0.5)


def cubic(t: Array) -> Array:
    """Return places on a cubic that leaves the origin along x."""
    return np.stack([t + 0.2 * t**2, 0.3 * t**2 - 0.1 * t**3, 0.05 * t**3], axis=-1)


def rate_of_cubic(t: Array) -> Array:
    return np.stack([1.0 + 0.4 * t, 0.6 * t - 0.3 * t**2, 0.15 * t**2], axis=-1)


@pytest.mark.parametrize("knots", [[0.0, 1.0, 1.5, 3.0], [0.0, 0.7, 2.0], [0.0, 1.0, 2.0, 2.5, 4.0]])
def test_splines_are_exact_for_cubics_that_leave_along_x(knots: list[float]) -> None:
    t = np.array(knots)
    np.testing.assert_allclose(shapes._spline(t, cubic(t))(t, 1), rate_of_cubic(t), atol=1e-12)


def test_two_points_are_joined_by_a_parabola() -> None:
    t = np.array([0.0, 2.0])
    points = np.stack([t, 0.3 * t**2, 0.0 * t], axis=1)
    np.testing.assert_allclose(shapes._spline(t, points)(t, 1), [[1.0, 0.0, 0.0], [1.0, 1.2, 0.0]], atol=1e-14)


def test_frames_along_a_helix_turn_against_its_torsion() -> None:
    """A rotation-minimising frame turns about the tangent by minus the integral of the torsion against Frenet's."""
    radius, rise, ends = 2.0, 0.7, 3.0
    c = math.hypot(radius, rise)
    s = np.linspace(0.0, ends, 400)
    angle = s / c
    flat = np.stack([radius * np.sin(angle), radius * (1.0 - np.cos(angle)), rise * angle], axis=1)
    tangent = np.stack([radius * np.cos(angle), radius * np.sin(angle), rise + 0.0 * angle], axis=1) / c
    normal = np.stack([-np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
    turned = np.column_stack([tangent[0], normal[0], np.cross(tangent[0], normal[0])])
    poses = shapes._least_turning(flat @ turned, tangent @ turned)  # in the frame of its first section
    assert np.array_equal(poses[0], shapes.IDENTITY)
    matrices = numeric.rotation_matrix(poses[:, :4])
    np.testing.assert_allclose(matrices[:, :, 0], tangent @ turned, atol=1e-12)
    np.testing.assert_allclose(poses[:, 4:], flat @ turned, atol=1e-12)
    binormal = np.cross(tangent, normal) @ turned
    cosine, sine = (np.sum(matrices[:, :, 1] * other, axis=1) for other in (normal @ turned, binormal))
    torsion = rise / c**2
    np.testing.assert_allclose(np.unwrap(np.arctan2(sine, cosine)), -torsion * s, atol=1e-6)


def test_shapes_through_points_have_the_length_of_the_curve() -> None:
    """Points on a circle of radius 1 that leaves along x: 90 degrees in steps of 15."""
    angles = np.radians(np.arange(0.0, 91.0, 15.0))
    shape = shapes.through_points(np.stack([np.sin(angles), 1.0 - np.cos(angles), 0.0 * angles], axis=1))
    assert shape.length == pytest.approx(0.5 * math.pi, rel=2e-4)
    twist, turn = shape.between(Fraction(0), Fraction(shape.length))
    np.testing.assert_allclose(numeric.exp(SE3, twist)[4:], [1.0, 1.0, 0.0], atol=1e-9)
    assert turn == pytest.approx(0.5 * math.pi, rel=3e-3)


@pytest.mark.parametrize(
    ("before", "after", "angle"),
    [
        ([], [([0.0, 0.0, 2.0], 3.5)], 3.5),
        ([([0.0, 0.0, 1.0], 1.0)], [([0.0, 0.0, -1.0], 2.5)], 3.5),
        ([([0.0, 0.0, 1.0], -1.0)], [([0.0, 0.0, 1.0], 2.5)], 3.5),
        ([([0.0, 1.0, 0.0], 1.0)], [([0.0, 0.0, 1.0], 2.5)], 0.0),
        ([], [], 0.0),
        ([], [([0.0, 0.0, 1.0], 1.0), ([0.0, 0.0, 1.0], 1.0)], 0.0),
    ],
)
def test_turns_about_one_axis_may_exceed_half_a_turn(before: list, after: list, angle: float) -> None:  # type: ignore[type-arg]
    given = [[(np.array(axis), turn) for axis, turn in rotations] for rotations in (before, after)]
    assert shapes._turn_about_one_axis(*given) == pytest.approx(angle)
