"""The elastic slider-crank against the published reference and the samples of dossier 1.10.3."""

import numpy as np
import pytest

from tests.anchors import anchor
from tests.oracles.elastic_crank import RATE, START, START_RATE, Crank

TIMES = np.array([0.02, 0.04, 0.06, 0.08, 0.1])
SAMPLES = {
    True: [
        [4.110157510e-5, 4.395553e-6, -4.598649e-6, -6.984661e-6],
        [-8.613938109e-4, -8.888424e-6, 9.710279e-6, 1.598879e-5],
        [1.158721352e-4, 1.358116e-5, -4.859118e-6, -7.474370e-6],
        [-1.463240575e-3, -1.853838e-5, 7.844118e-6, 1.310218e-5],
        [0.1893192899613509e-3, 0.2375751249879174e-4, -0.5323896770569702e-5, -0.8363313279112129e-5],
    ],
    False: [
        [4.109835271e-5, 4.392023e-6, -4.601444e-6, -6.967148e-6],
        [-8.613935569e-4, -8.887972e-6, 9.688926e-6, 1.600558e-5],
        [1.158645569e-4, 1.358377e-5, -4.861999e-6, -7.440091e-6],
        [-1.463233117e-3, -1.853999e-5, 7.856765e-6, 1.313526e-5],
        [1.893081e-4, 2.376201e-5, -5.281025e-6, -8.303554e-6],
    ],
}


@pytest.mark.long
def test_published_variant_is_the_published_reference() -> None:
    crank = Crank(published=True)
    elastic = crank.simulate(TIMES)
    np.testing.assert_allclose(elastic[:, :4], SAMPLES[True], rtol=5e-7)
    q, v = crank.state(0.1, elastic[-1])
    a, multipliers = crank.acceleration(0.1, elastic[-1])
    assert q[:3] == pytest.approx(anchor("elastic_crank_positions").reference, rel=1e-8)
    crank_rate, rod_rate, *elastic_rates, slider_rate = anchor("elastic_crank_velocities").reference
    rates = [crank_rate, rod_rate, slider_rate, *elastic_rates]
    assert v[:5] == pytest.approx(rates[:5], rel=2e-6)
    assert v == pytest.approx(rates, rel=1e-4)
    second = [0.0, 6488.737541276957, 2167.938629509884, 33.91137060286523, 0.1715134772216488]
    assert a == pytest.approx([*second, -1.422449408912512, 1.003946428124810], rel=1e-3)
    assert multipliers == pytest.approx([-62.32935833287916, -163.7920993367306, 25.29857947066878], rel=1e-6)


@pytest.mark.long
def test_consistent_variant_moves_as_sampled() -> None:
    elastic = Crank(published=False).simulate(TIMES[:2])
    np.testing.assert_allclose(elastic[:, :4], SAMPLES[False][:2], rtol=5e-7)


@pytest.mark.slow
def test_mass_matrix_and_forces_are_those_of_kinetic_energy() -> None:
    """Lagrange's equations by complex step of T(q, v), which is itself a quadrature, hold M and c."""
    crank, rng = Crank(published=True), np.random.default_rng(3)
    q, v = rng.uniform(-0.4, 0.4, 7), rng.uniform(-1.0, 1.0, 7)
    M, c = crank.mass_and_coupling(q, v)
    size = 1e-6

    def mass(point: np.ndarray) -> np.ndarray:
        return crank.mass_and_coupling(point, v)[0]

    slopes = np.array([(mass(q + size * unit) - mass(q - size * unit)) / (2 * size) for unit in np.eye(7)])
    wanted = np.einsum("kij,k,j->i", slopes, v, v) - 0.5 * np.einsum("kij,i,j->k", slopes, v, v)
    np.testing.assert_allclose(c, wanted, atol=1e-8 * np.abs(c).max())
    np.testing.assert_allclose(M, M.T, rtol=1e-14)


@pytest.mark.slow
def test_start_obeys_the_constraints() -> None:
    q, v = Crank(published=True).state(0.0, np.concatenate([START, START_RATE]))
    assert q[:3] == pytest.approx([0.0, 0.0, 0.450016933], abs=1e-9)
    assert v[:3] == pytest.approx([RATE, -74.9957670, -0.268938672e-5], rel=1e-8)
    crank, size = Crank(published=True), 1e-7
    rows = [(crank.constraint(q + size * unit) - crank.constraint(q - size * unit)) / (2 * size) for unit in np.eye(7)]
    np.testing.assert_allclose(crank.constraint_jacobian(q)[:2], np.transpose(rows), atol=1e-8)
