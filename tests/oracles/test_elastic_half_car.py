"""The half cars HC and EV-1 against the digits of dossier 1.10.2."""

import numpy as np
import pytest

from tests.oracles.elastic_half_car import half_car

FREQUENCIES = {
    0: [0.9972426559, 1.2725072378, 11.1306354504, 11.7419927652],
    2: [0.996732223, 1.2701992547, 11.1292923503, 11.7347715115, 13.8581613517, 38.1171541771],
    3: [0.9966695974, 1.2701992546, 11.1292103363, 11.7347709745, 13.8581608929, 38.117151178, 74.6973370967],
}


@pytest.mark.parametrize("modes", list(FREQUENCIES))
def test_undamped_frequencies_are_the_published_ones(modes: int) -> None:
    np.testing.assert_allclose(half_car(modes).frequencies(), FREQUENCIES[modes], rtol=1e-9)


def test_eigenvalues_of_the_rigid_car_and_of_the_first_bending_are_the_published_ones() -> None:
    pairs = [-1.1556481667 + 6.2097535556j, -2.8033555443 + 7.7010564334j]
    pairs += [-16.3873787217 + 67.4240293752j, -23.2654365997 + 68.1011971004j]
    found = half_car(0).eigenvalues()
    found = found[found.imag > 0]
    np.testing.assert_allclose(found[np.argsort(np.abs(found))], pairs, atol=1e-9)
    elastic = half_car(2).eigenvalues()
    assert np.abs(elastic - (-1.3026745981 + 86.1256718623j)).min() < 1e-9


def test_beam_alone_has_the_published_frequencies() -> None:
    car, roots = half_car(3), np.array([4.730040744862704, 7.8532046240958376, 10.995607838001671])
    alone = np.sqrt(1.0e6 / 4.496574038330936**3 / 730.0) * roots**2
    np.testing.assert_allclose(alone / (2 * np.pi), [13.8218393897, 38.1004325166, 74.6920815899], rtol=1e-11)
    np.testing.assert_allclose(np.diag(car.mass)[2:5], 730.0, rtol=1e-12)
