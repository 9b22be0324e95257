"""The examples of Hamiltonian systems against equations written by hand, and what they conserve."""

from __future__ import annotations

import math
import re
import runpy
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.arrays import Array
from eomgen.cli import main
from eomgen.integrators.compositions import composition_named
from eomgen.products.fields.documents.reading import load_hamiltonian

EXAMPLES = Path(__file__).parents[2] / "examples"
SYSTEMS = {name: EXAMPLES / name / "system" / f"{name}.toml" for name in ("henon_heiles", "outer_solar_system")}


@cache
def model(name: str) -> Any:
    return eomgen.build(SYSTEMS[name])


def test_the_star_moves_by_its_equations() -> None:
    def rate(_: float, state: Array) -> list[float]:
        y, x, p_y, p_x = state
        return [p_y, p_x, -y - x**2 + y**2, -x - 2 * x * y]

    run = model("henon_heiles").simulate(50.0, 0.02, method="yoshida6")
    start = [0.12, 0.0, 0.12, math.sqrt(2 / 8 - 2 * 0.12**2 + 2 * 0.12**3 / 3)]
    exact = solve_ivp(rate, (0, 50), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    np.testing.assert_allclose([*run.q[-1], *run.p[-1]], exact, atol=2e-9)
    assert run.energy["total"][0] == pytest.approx(1 / 8, rel=1e-15)


@pytest.mark.long_cases(
    "henon_heiles-kahan_li8-0.1-10000000-1.8e-13", "outer_solar_system-leapfrog-200.0-10000000-0.0013"
)
@pytest.mark.parametrize(
    ("name", "method", "step", "steps", "bound"),
    [
        ("henon_heiles", "leapfrog", 0.1, 10**6, 3.6e-3),
        ("henon_heiles", "omf4", 0.1, 10**6, 1.7e-8),
        ("henon_heiles", "yoshida6", 0.1, 10**6, 5.2e-7),
        ("henon_heiles", "kahan_li8", 0.1, 10**7, 1.8e-13),
        ("outer_solar_system", "leapfrog", 200.0, 10**7, 1.3e-3),
    ],
)
def test_energy_errors_are_bounded_over_many_steps(
    name: str, method: str, step: float, steps: int, bound: float
) -> None:
    options: Any = {"record_every": steps // 10_000, "compensated": True, "error_estimate": False}
    run = model(name).simulate(steps * step, step, method=method, **options)
    error = np.abs(run.energy["total"] / run.energy["total"][0] - 1)
    assert 0.5 * bound < error.max() < bound
    assert steps > 10**6 or error[len(error) // 2 :].max() < 1.3 * error[: len(error) // 2].max()


def test_distances_are_divided_by_once() -> None:
    """A pair costs one root and one division, though its force divides by the distance three times."""
    counts = eomgen.derive(load_hamiltonian(SYSTEMS["outer_solar_system"])).counts["kick"]  # type: ignore[arg-type]
    assert (counts.divisions, counts.functions) == (15, 15)


def _newton(days: float) -> Array:
    """Return places of the six bodies, (6, 3), by Newton's equations in positions and velocities."""
    document = load_hamiltonian(SYSTEMS["outer_solar_system"])
    mass = np.array([item.value for item in document.parameters][1:])
    places = np.array([item.value for item in document.coordinates]).reshape(6, 3)
    speeds = np.array([item.value for item in document.momenta]).reshape(6, 3) / mass[:, None]

    def rate(_: float, state: Array) -> Array:
        x, v = state.reshape(2, 6, 3)
        between = x[None, :] - x[:, None]
        distance = np.sqrt((between**2).sum(axis=2)) + np.eye(6)
        pull = 2.95912208286e-4 * mass[None, :, None] * between / distance[..., None] ** 3
        return np.concatenate([v, pull.sum(axis=1)]).ravel()

    start = np.concatenate([places, speeds]).ravel()
    found = solve_ivp(rate, (0, days), start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    return np.asarray(found.reshape(2, 6, 3)[0])


def test_the_planets_move_by_newtons_equations() -> None:
    run = model("outer_solar_system").simulate(
        20_000.0, 10.0, method="yoshida6", record_every=100, error_estimate=False
    )
    np.testing.assert_allclose(run.q[-1].reshape(6, 3), _newton(20_000.0), atol=2e-8)


def test_what_the_planets_conserve() -> None:
    run = model("outer_solar_system").simulate(1_000_000.0, 100.0, method="omf4", record_every=50, error_estimate=False)
    assert run.energy_error < 2.2e-7
    momentum = run.outputs["angular_momentum"]
    assert np.abs(momentum / momentum[0] - 1).max() < 5e-14
    linear = run.p.reshape(-1, 6, 3).sum(axis=1)
    assert np.abs(linear - linear[0]).max() < 1e-18  # of masses of 1e-3 at 5e-3 au a day


@pytest.mark.parametrize("name", SYSTEMS)
def test_commands_of_the_readme_run(name: str, tmp_path: Path) -> None:
    assert main(["simulate", str(SYSTEMS[name]), "--out", str(tmp_path), "--no-plots"]) == 0
    assert (tmp_path / "solution.npz").is_file()


def test_the_page_holds_what_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (EXAMPLES.parent / "docs" / "hamiltonian.md").read_text(encoding="utf-8")
    whole, piece = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    Path("henon_heiles.toml").write_text(whole, encoding="utf-8")
    Path("page.py").write_text(re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0], encoding="utf-8")
    names = runpy.run_path("page.py")
    assert names["run"].success and names["along"][0].shape == (2,)
    assert piece in SYSTEMS["outer_solar_system"].read_text(encoding="utf-8")


def test_the_page_has_the_figures_of_the_table() -> None:
    page = (EXAMPLES.parent / "docs" / "hamiltonian.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| (\d) \| (\d+) \| ([\d.]+) \| ([\d.]+) \| (\S+) \|$", page, re.MULTILINE)
    assert len(rows) == 14
    for name, order, gradients, limit, share, error in rows:
        found = composition_named(name)
        assert (found.order, found.gradients) == (int(order), int(gradients))
        assert found.stability_limit == pytest.approx(float(limit), abs=6e-4)
        assert found.stability_limit / found.gradients == pytest.approx(float(share), abs=6e-4)
        assert found.error_constant == pytest.approx(float(error), rel=6e-3)


#: Numbers of a script that make its runs long, and shorter ones.
SHORTER = {
    "henon_heiles": [("1_000_000", "20_000"), ("20_000.0", "2_000.0")],
    "outer_solar_system": [("9_900_000.0", "198_000.0"), ("1e6 * steps[0]", "1e4 * steps[0]")],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_the_scripts_draw_their_pictures(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of shorter runs."""
    script = EXAMPLES / name / "demo.py"
    text = script.read_text(encoding="utf-8")
    for long, short in SHORTER[name]:
        assert long in text
        text = text.replace(long, short)
    monkeypatch.setattr(sys, "argv", [str(script), "--out", str(tmp_path)])
    exec(compile(text, str(script), "exec"), {"__name__": "__main__", "__file__": str(script)})
    assert (tmp_path / f"{name}.png").stat().st_size > 50_000
