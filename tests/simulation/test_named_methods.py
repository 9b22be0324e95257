"""Named cases of generalized-alpha where users choose them: calls, scene files, the command line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from tests.models.scenes import PENDULUM_TOML, absolute, pendulum


@pytest.mark.slow
def test_cases_of_the_same_coefficients_run_the_same() -> None:
    model = pendulum()
    runs = [
        model.simulate(0.3, 1e-2, method="trapezoidal"),
        model.simulate(0.3, 1e-2, method="average_acceleration"),
        model.simulate(0.3, 1e-2, method="newmark"),
        model.simulate(0.3, 1e-2, method="hht", alpha=0.0),
        model.simulate(0.3, 1e-2, method="wbz", rho_inf=1.0),
    ]
    assert all(run.success for run in runs)
    assert all(np.array_equal(run.q, runs[0].q) for run in runs[1:])
    damped = model.simulate(0.3, 1e-2, method="hht", alpha=0.1)
    same = model.simulate(0.3, 1e-2, method="hht", rho_inf=0.9 / 1.1)
    assert damped.metadata["settings"]["beta"] == pytest.approx(0.3025, rel=1e-15)
    np.testing.assert_allclose(damped.q, same.q, rtol=1e-12)
    assert not np.array_equal(damped.q, runs[0].q)


@pytest.mark.long
def test_undamped_and_damped_cases_bear_constraints() -> None:
    ends = [
        absolute().simulate(0.2, 2e-3, method=name, **more)
        for name, more in (("trapezoidal", {}), ("hht", {"alpha": 0.05}))
    ]
    fine = absolute().simulate(0.2, 2e-4)
    for run in ends:
        assert run.success and run.stats["max_constraint_velocity"] < 1e-9
        np.testing.assert_allclose(run.q[-1], fine.q[-1], atol=3e-5)


@pytest.mark.slow
def test_a_case_that_index_3_bears_with_damping_needs_none_in_the_scene() -> None:
    damped = absolute().simulate(0.1, 1e-3, method="newmark_index3", alpha=0.1)
    same = absolute().simulate(0.1, 1e-3, method="newmark_index3", beta=0.3025, gamma=0.6)
    assert damped.success and damped.metadata["settings"]["beta"] == pytest.approx(0.3025, rel=1e-15)
    np.testing.assert_allclose(damped.q, same.q, rtol=1e-12)
    np.testing.assert_allclose(damped.q[-1], absolute().simulate(0.1, 1e-4).q[-1], atol=3e-3)


@pytest.mark.slow
def test_what_a_user_should_know_is_in_the_message() -> None:
    run = pendulum().simulate(0.05, 1e-2, method="newmark", beta=0.125)
    assert run.success and "newmark with 2 beta < gamma is stable only while step times the highest" in run.message
    assert "below 2.828" in run.metadata["notes"][-1]


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"method": "trapezoidal", "rho_inf": 0.8}, "rho_inf: trapezoidal takes no rho_inf; try: leave it out"),
        ({"alpha": 0.1}, "alpha: generalized_alpha takes no alpha; try: only rho_inf"),
        ({"method": "hht", "alpha": "much"}, "alpha: a number is needed, not str"),
        (
            {"method": "newmark_index3"},
            "newmark has a spectral radius of 1 here, and index 3 is weakly unstable then: nothing damps the errors of"
            " the multipliers, which alternate from step to step and grow; try: newmark without _index3, the stabilised"
            " form, or hht_index3 with alpha = 0.05",
        ),
        ({"method": "newmark_index3", "alpha": 0.0}, "newmark has a spectral radius of 1 here, and index 3 is weakly"),
        ({"method": "newmark", "beta": 0.1}, "beta: newmark cannot run on constraints: with 2 beta < gamma"),
    ],
)
def test_what_does_not_fit_is_refused(options: dict[str, object], text: str) -> None:
    with pytest.raises(eomgen.UsageError, match=re.escape(text)):
        absolute().simulate(0.1, 1e-2, **options)


def test_c_of_a_case_without_damping_is_not_written_for_index_3(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    with pytest.raises(eomgen.UsageError, match="newmark has a spectral radius of 1 here, and index 3 is weakly"):
        eomgen.generate(path, tmp_path / "c", method="newmark_index3")


@pytest.mark.slow
def test_a_scene_file_chooses_a_case(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML + 'method = "hht"\nalpha = 0.1\n', encoding="utf-8")
    assert main(["simulate", str(path), "--out", str(tmp_path / "out"), "--t-end", "0.1", "--no-plots"]) == 0
    assert "hht, step 0.001 s, alpha_m 0, alpha_f 0.1, beta 0.3025, gamma 0.6" in " ".join(
        capsys.readouterr().out.split()
    )
    other = ["--method", "newmark", "--beta", "0.3", "--gamma", "0.55", "--no-plots", "--t-end", "0.1"]
    assert main(["simulate", str(path), "--out", str(tmp_path / "out"), *other]) == 0
    assert "newmark, step 0.001 s, alpha_m 0, alpha_f 0, beta 0.3, gamma 0.55" in " ".join(
        capsys.readouterr().out.split()
    )


@pytest.mark.parametrize(
    ("lines", "key", "text"),
    [
        ('method = "hht"\nalpha = 0.5\n', "alpha", "alpha of hht must lie in 0..1/3, not 0.5"),
        (
            'method = "hht"\nrho_inf = 0.2\n',
            "rho_inf",
            "hht has spectral radii at infinite frequency of 1/2 to 1, not 0.2",
        ),
        ('method = "hht"\nrho_inf = 0.6\nalpha = 0.1\n', "alpha", "alpha and rho_inf say the same"),
        ('method = "trapezoidal_index3"\n', "method", "index 3 is weakly unstable"),
    ],
)
def test_a_scene_file_with_wrong_parameters_is_refused_at_its_line(
    tmp_path: Path, lines: str, key: str, text: str
) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML + lines, encoding="utf-8")
    written = path.read_text(encoding="utf-8").splitlines()
    line = next(number for number, text_of_line in enumerate(written, 1) if text_of_line.startswith(f"{key} ="))
    with pytest.raises(eomgen.DescriptionError, match=rf"scene\.toml:{line} \(simulation\.{key}\).*{re.escape(text)}"):
        eomgen.build(eomgen.load(path), profile="quick")
