"""Forces of a tendon through a ring against 40 digits; MuJoCo ends its own search for the point of contact at 1e-6."""

from __future__ import annotations

from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

import eomgen


def expected(q: float) -> float:
    """Return -k (L - L0) dL/dq, L being the shortest way over the circle of the ring, N m."""
    with mp.workdps(40):
        place = mp.matrix([mp.mpf("0.03"), mp.mpf("0.45")])
        cosine, sine, radius = mp.cos(mp.mpf(q)), mp.sin(mp.mpf(q)), mp.mpf("0.1")
        turn = mp.matrix([[cosine, -sine], [sine, cosine]])
        slope = mp.matrix([[-sine, -cosine], [cosine, -sine]]) * place
        first, last = mp.matrix([mp.mpf("0.2"), mp.mpf("-0.3")]) + turn * place, mp.matrix([-0.25, mp.mpf("0.1")])

        def contact(angle: mp.mpf) -> mp.matrix:
            return radius * mp.matrix([mp.cos(angle), mp.sin(angle)])

        def length(angle: mp.mpf) -> mp.mpf:
            return mp.norm(first - contact(angle)) + mp.norm(last - contact(angle))

        start = min((mp.mpf(k) / 50 for k in range(315)), key=length)
        angle = mp.findroot(lambda x: mp.diff(length, x), start)
        straight = first - contact(angle)
        rate = (straight.T * slope)[0] / mp.norm(straight)
        return float(-100 * (length(angle) - mp.mpf("0.1")) * rate)


@pytest.mark.slow
def test_forces_have_all_digits() -> None:
    pytest.importorskip("mujoco")
    model = eomgen.build(Path(__file__).with_name("ring.xml"))
    for q in np.linspace(-0.15, 0.25, 5).tolist():
        assert model.force([q], [0.0])[0] == pytest.approx(expected(q), rel=1e-14)


def test_mujoco_with_all_digits_has_the_same_equations() -> None:
    mujoco_exact = pytest.importorskip("tests.oracles.mjcf_oracle")
    imported = mujoco_exact.Imported.of(Path(__file__).with_name("rings.xml"))
    assert imported.model.body_sameframe[1] == 1  # MuJoCo takes the centre of mass as the origin of the frame
    assert max(imported.errors(spread=0.2)) < 1e-13
