"""The full car's oracle: its body alone against closed forms, and the body as one that turns and lifts without
bending."""

import numpy as np

from tests.oracles.elastic_full_car import ACROSS, ALONG, BODY, LENGTH, PITCH, ROLL, full_car, height


def test_body_alone_has_the_frequencies_of_a_uniform_beam() -> None:
    car, rigid = full_car(), full_car(stiffer=0.0)
    body = slice(3, 7)
    alone = np.sqrt(np.diag(car.stiffness - rigid.stiffness)[body] / np.diag(car.mass)[body])
    bending = np.sqrt(2.5e6 / (BODY * LENGTH**3)) * np.array([4.730040744862704, 7.8532046240958376]) ** 2
    twisting = np.pi * np.array([1.0, 2.0]) * np.sqrt(6.0e6 / (ROLL * LENGTH))
    np.testing.assert_allclose(alone, [*bending, *twisting], rtol=1e-11)
    np.testing.assert_allclose(
        car.mass[:7, :7], np.diag([BODY, PITCH, ROLL, BODY, BODY, ROLL / 2, ROLL / 2]), atol=1e-9
    )


def test_heights_are_those_of_a_turned_plane_and_of_twisted_ends() -> None:
    for x, y, row in zip(ALONG, ACROSS, full_car().corners, strict=True):
        np.testing.assert_allclose(row[:3], [1.0, -x, y])
    np.testing.assert_allclose(height(-LENGTH / 2, 0.5)[3:7], [2.0, 2.0, 0.5, 0.5], rtol=1e-12)
    np.testing.assert_allclose(height(LENGTH / 2, 0.5)[3:7], [2.0, -2.0, -0.5, 0.5], rtol=1e-12)
