"""A front end of another distribution: a lattice given by its Hamiltonian goes all the way without a line in the
package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import eomgen
from eomgen.errors import ModelError
from tests.models.lattice import Lattice

CELLS = 12
#: Slopes of the potentials.
SLOPES = {"fput": lambda s: s + 0.25 * s**2, "pendulums": np.sin}


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Install a distribution that names the front end."""
    information = tmp_path / "lattices-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: lattices\nVersion: 1.0\n", encoding="utf-8")
    entry = "[eomgen.front_ends]\nlattices = tests.models.lattice:LATTICES\n"
    (information / "entry_points.txt").write_text(entry, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)


def lattice(potential: str) -> Lattice:
    mode = np.sin(np.pi * np.arange(1, CELLS + 1) / (CELLS + 1))
    return Lattice(potential, potential, tuple((0.8 * mode).tolist()))


def reference(potential: str, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return displacements (nt, cells) by SciPy from forces written for themselves."""
    slope = SLOPES[potential]

    def rate(_: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        q, v = state[:CELLS], state[CELLS:]
        return np.concatenate([v, np.diff(slope(np.diff(q, prepend=0.0, append=0.0)))])

    start = np.concatenate([lattice(potential).displacements, np.zeros(CELLS)])
    return solve_ivp(rate, (0.0, times[-1]), start, method="DOP853", rtol=1e-12, atol=1e-13, t_eval=times).y[:CELLS].T


@pytest.mark.slow
@pytest.mark.parametrize("potential", SLOPES)
@pytest.mark.parametrize(("method", "bound"), [("generalized_alpha", 1e-3), ("rk4", 1e-7), ("taylor", 1e-9)])
def test_a_lattice_moves_as_its_hamiltonian_says(potential: str, method: str, bound: float) -> None:
    model = eomgen.build(lattice(potential), profile="quick")
    run = model.simulate(20.0, 0.01, method=method, **({"rho_inf": 1.0} if method == "generalized_alpha" else {}))
    assert run.success and run.message.startswith("reached t = 20 s"), run.message
    np.testing.assert_allclose(run.q, reference(potential, run.t), atol=bound)
    assert np.ptp(run.energy["total"]) < bound * run.energy["total"][0]
    assert np.ptp(run.energy["potential"]) > 0.1 * run.energy["total"][0]


@pytest.mark.slow
def test_it_has_names_units_and_a_linear_model() -> None:
    model = eomgen.build(lattice("fput"), profile="quick")
    assert isinstance(model.scene, Lattice) and model.q_names[1] == "q.cell1" and model.v_units == ["m/s"] * CELLS
    found = np.sort(np.abs(model.linearize().modes().eigenvalues.imag))
    exact = 2.0 * np.sin(np.pi * np.arange(1, CELLS + 1) / (2 * (CELLS + 1)))
    np.testing.assert_allclose(np.unique(np.round(found, 9)), np.round(exact, 9), atol=1e-8)


def test_its_c_stands_alone(tmp_path: Path) -> None:
    names = {file.name for file in eomgen.generate(lattice("fput"), tmp_path / "c", method="rk4")}
    assert {"fput.h", "fput.c", "fput_step.c", "README.md"} <= names


@pytest.mark.slow
def test_a_document_that_is_no_scene_is_not_saved(tmp_path: Path) -> None:
    model = eomgen.build(lattice("fput"), profile="quick")
    with pytest.raises(ModelError, match=r"save: fput was not made from a scene; try: eomgen\.build"):
        model.save(tmp_path / "lattice.eomgen")
