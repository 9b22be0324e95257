"""Forces of a tendon through a ring against 40 digits; MuJoCo ends its own search for the point of contact at 1e-6."""

from __future__ import annotations

from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

import eomgen

MODEL = """<mujoco model="ring"><option gravity="0 0 0"/><worldbody>
<site name="b" pos="-0.25 0.1 0"/><site name="inside" pos="0 0.02 0"/>
<geom name="ring" type="sphere" size="0.1" mass="0" contype="0" conaffinity="0"/>
<body pos="0.2 -0.3 0"><joint name="hinge" axis="0 0 1"/><geom size="0.02" pos="0.02 0.4 0" mass="1"/>
<site name="a" pos="0.03 0.45 0"/></body></worldbody>
<tendon><spatial stiffness="100" springlength="0.1"><site site="a"/><geom geom="ring" sidesite="inside"/>
<site site="b"/></spatial></tendon></mujoco>"""


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
def test_forces_have_all_digits(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    path = tmp_path / "ring.xml"
    path.write_text(MODEL, encoding="utf-8")
    model = eomgen.build(path)
    for q in np.linspace(-0.15, 0.25, 5).tolist():
        assert model.force([q], [0.0])[0] == pytest.approx(expected(q), rel=1e-14)


PULLEYS = """<mujoco model="rings"><worldbody>
<site name="a" pos="-0.2 0.15 0.1"/><site name="c" pos="0.3 0.1 -0.2"/>
<body><freejoint name="float"/><inertial pos="2e-9 -1e-9 1e-9" mass="178" diaginertia="3 4 5"/>
<geom name="barrel" type="cylinder" size="0.1 0.3" contype="0" conaffinity="0"/>
<site name="inside" pos="0.01 0.03 0"/><site name="b" pos="0.2 -0.2 0.15"/></body>
<body pos="0.5 0 0"><joint name="hinge" axis="0 1 1"/><geom size="0.02" pos="0.02 0.4 0" mass="1"/>
<site name="d" pos="0.1 0.3 0.2"/></body></worldbody>
<tendon><spatial name="rope" stiffness="300" damping="4" springlength="0.2"><site site="a"/>
<geom geom="barrel" sidesite="inside"/><site site="b"/><pulley divisor="2"/><site site="c"/>
<geom geom="barrel" sidesite="inside"/><site site="d"/></spatial></tendon></mujoco>"""


def test_mujoco_with_all_digits_has_the_same_equations(tmp_path: Path) -> None:
    mujoco_exact = pytest.importorskip("tests.oracles.mjcf_oracle")
    path = tmp_path / "rings.xml"
    path.write_text(PULLEYS, encoding="utf-8")
    imported = mujoco_exact.Imported.of(path)
    assert imported.model.body_sameframe[1] == 1  # MuJoCo takes the centre of mass as the origin of the frame
    assert max(imported.errors(spread=0.2)) < 1e-13
