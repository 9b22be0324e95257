"""Identification from inverse dynamics: base parameters of a two-link arm from motions and efforts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.cli import main
from eomgen.pipeline.pipeline import build_for_run
from eomgen.scene.load import from_data
from tests.models.library import scene
from tests.models.toml_text import toml_text

UPPER = {"mass": 2.0, "center_of_mass": [0, 0, -0.3], "inertia": [0.05, 0.06, 0.02]}
LOWER = {"mass": 1.0, "center_of_mass": [0.02, 0, -0.2], "inertia": [0.02, 0.03, 0.01]}
SCENE = scene(
    "arm",
    gravity=[0, 0, -10],
    bodies={"upper": UPPER, "lower": LOWER},
    joints__shoulder__damping=0.4,
    joints__elbow__damping=0.2,
    joints__elbow__child="lower",
    joints__elbow__position=[0, 0, -0.5],
    inputs={"motor": {"unit": "N m"}},
    efforts={"drive": {"joint": "elbow", "effort": "motor"}},
    points=None,
    outputs={"angle": {"formula": "q.elbow"}},
)
#: By hand: what a planar arm is moved by, Khalil and Dombre 2002, example 9.2.
TRUE = {
    "upper.inertia_yy": 0.06 + 2.0 * 0.09 + 1.0 * 0.25,
    "upper.first_moment_x": 0.0,
    "upper.first_moment_z": -0.6 - 0.5 * 1.0,
    "lower.inertia_yy": 0.03 + 1.0 * (0.2**2 + 0.02**2),
    "lower.first_moment_x": 0.02,
    "lower.first_moment_z": -0.2,
    "shoulder.damping": 0.4,
    "elbow.damping": 0.2,
}
NOISE = np.array([0.3, 0.05])


@pytest.fixture(scope="module")
def arm() -> eomgen.Model:
    return build_for_run(from_data(SCENE))


def data(seed: int = 0, rows: int = 300) -> dict[str, Array]:
    """Return a motion with its efforts by the equations of a double pendulum, written by hand."""
    t = np.linspace(0.0, 6.0, rows)
    q, v, a = (np.zeros((rows, 2)) for _ in range(3))
    for k, terms in enumerate((((1.3, 0.8), (2.9, 0.5)), ((1.7, 1.1), (4.1, 0.4)))):
        for omega, size in terms:
            q[:, k] += size * np.sin(omega * t + k)
            v[:, k] += size * omega * np.cos(omega * t + k)
            a[:, k] -= size * omega**2 * np.sin(omega * t + k)
    first, second = q[:, 0], q.sum(axis=1)
    I1, X1, Z1, I2, X2, Z2, d1, d2 = TRUE.values()
    # d/dt of the momenta of links that turn about y by q1 and q1 + q2; a point (x, z) of a link turned by s is at
    # (x cos s + z sin s, z cos s - x sin s)
    c, s = np.cos(q[:, 1]), np.sin(q[:, 1])
    along, across = -0.5 * (Z2 * c - X2 * s), -0.5 * (-Z2 * s - X2 * c)  # of l (m c), and its derivative in q2
    sum_a, sum_v = a.sum(axis=1), v.sum(axis=1)
    lower = I2 * sum_a + along * a[:, 0] - across * v[:, 0] ** 2 - 10.0 * (X2 * np.cos(second) + Z2 * np.sin(second))
    upper = I1 * a[:, 0] + along * sum_a + across * sum_v**2 - 10.0 * (X1 * np.cos(first) + Z1 * np.sin(first))
    tau = np.column_stack([upper + lower + d1 * v[:, 0], lower + d2 * v[:, 1]])
    tau = tau + NOISE * np.random.default_rng(seed).standard_normal((rows, 2))
    columns = {"t": t, "tau.shoulder": tau[:, 0], "tau.elbow": tau[:, 1]}
    for letter, table in (("q", q), ("v", v), ("a", a)):
        columns |= {f"{letter}.shoulder": table[:, 0], f"{letter}.elbow": table[:, 1]}
    return columns


@pytest.mark.slow
def test_base_parameters_from_noisy_efforts(arm: eomgen.Model) -> None:
    found = eomgen.identify(arm, data(), by="torque")
    assert [one.name.split()[0] for one in found.estimates] == list(arm.base_parameters().names)
    assert len(found.estimates) == 8 and found.runs == 0
    for one in found.estimates:
        lead = one.name.split()[0]
        assert abs(one.value - TRUE[lead]) < 3.5 * one.deviation, one.name
        assert one.start == pytest.approx(TRUE[lead], abs=1e-12) and one.state == "determined"
    np.testing.assert_allclose([one.deviation for one in found.columns], NOISE, rtol=0.1)
    assert found.degrees_of_freedom == 592 and [one.unit for one in found.columns] == ["N m", "N m"]
    assert found.notes == ()


def test_the_command_reads_efforts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "arm.toml").write_text(toml_text(SCENE), encoding="utf-8")
    given = data()
    rows = [",".join(map(repr, row)) for row in np.column_stack(list(given.values())).tolist()]
    (tmp_path / "run.csv").write_text("\n".join([",".join(given), *rows]), encoding="utf-8")
    words = ["identify", str(tmp_path / "arm.toml"), "--data", str(tmp_path / "run.csv"), "--by", "torque"]
    assert main([*words, "--out", str(tmp_path / "out")]) == 0
    assert "8 of 8 unknowns determined by 600 samples" in capsys.readouterr().err
    assert (tmp_path / "out" / "fit_run.png").stat().st_size > 5000
