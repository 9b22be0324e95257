"""Named cases of generalized-alpha where users choose them: calls, scene files, the command line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import eomgen
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


@pytest.mark.slow
def test_undamped_and_damped_cases_bear_constraints() -> None:
    fine = absolute().simulate(0.1, 4e-4)
    for name, more in (("trapezoidal", {}), ("hht", {"alpha": 0.05})):
        run = absolute().simulate(0.1, 2e-3, method=name, **more)
        assert run.success and run.stats["max_constraint_velocity"] < 1e-9
        np.testing.assert_allclose(run.q[-1], fine.q[-1], atol=3e-5)


REFUSED: dict[str, dict[str, object]] = {
    "rho_inf: trapezoidal takes no rho_inf; try: leave it out": {"method": "trapezoidal", "rho_inf": 0.8},
    "alpha: generalized_alpha takes no alpha; try: only rho_inf": {"alpha": 0.1},
    "alpha: a number is needed, not str": {"method": "hht", "alpha": "much"},
    "newmark has a spectral radius of 1 here, and index 3 is weakly unstable": {"method": "newmark_index3"},
    "newmark has a spectral radius of 1 here, and": {"method": "newmark_index3", "alpha": 0.0},
    "beta: newmark cannot run on constraints: with 2 beta < gamma": {"method": "newmark", "beta": 0.1},
}


@pytest.mark.slow
@pytest.mark.parametrize("text", REFUSED)
def test_what_does_not_fit_is_refused(text: str) -> None:
    with pytest.raises(eomgen.UsageError, match=re.escape(text)):
        absolute().simulate(0.1, 1e-2, **REFUSED[text])


def test_c_of_a_case_without_damping_is_not_written_for_index_3(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    with pytest.raises(eomgen.UsageError, match="newmark has a spectral radius of 1 here, and index 3 is weakly"):
        eomgen.generate(path, tmp_path / "c", method="newmark_index3")


#: Lines of a scene: what they say wrong, at which key.
WRONG = {
    "alpha of hht must lie in 0..1/3, not 0.5": ('method = "hht"\nalpha = 0.5\n', "alpha"),
    "hht has spectral radii at infinite frequency of 1/2 to 1": ('method = "hht"\nrho_inf = 0.2\n', "rho_inf"),
    "alpha and rho_inf say the same": ('method = "hht"\nrho_inf = 0.6\nalpha = 0.1\n', "alpha"),
    "index 3 is weakly unstable": ('method = "trapezoidal_index3"\n', "method"),
}


@pytest.mark.parametrize("text", WRONG)
def test_a_scene_file_with_wrong_parameters_is_refused_at_its_line(tmp_path: Path, text: str) -> None:
    (lines, key), path = WRONG[text], tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML + lines, encoding="utf-8")
    written = path.read_text(encoding="utf-8").splitlines()
    line = next(number for number, text_of_line in enumerate(written, 1) if text_of_line.startswith(f"{key} ="))
    with pytest.raises(eomgen.DescriptionError, match=rf"scene\.toml:{line} \(simulation\.{key}\).*{re.escape(text)}"):
        eomgen.build(eomgen.load(path), profile="quick")
