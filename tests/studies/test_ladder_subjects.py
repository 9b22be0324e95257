"""Subjects of ladders with models in closed form: similarity in other units and at other places, extents and rates."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.errors import EomgenError
from eomgen.products.studies.ladders.runs import ROWS
from eomgen.products.studies.ladders.scaling import LENGTH, MASS, ORIGIN, TIME, SceneUnits
from eomgen.products.studies.ladders.subject import FACTORS, OWN, STEPS, Subject, _data_of, _numbers, _reach

#: Pull of a spring, of a weight, and rate of a state: of a slider of 2 kg, in SI.
STIFFNESS, WEIGHT, MASS_SI = 8.0, 9.0, 2.0


class Slider:
    """A slider on a spring with a state: x'' = -(k (x - origin) + w)/m, s' = v - s/T; with factors if scaled."""

    def __init__(self, scaled: bool, fault: str = "", **facts: Any) -> None:
        self.scaled, self.fault = scaled, fault
        self.initial_q, self.initial_v, self.initial_z = [0.5], [2.0], [0.25]
        self.nq = self.nv = self.nz = 1
        self.q_units, self.v_units, self.z_units = ("m",), ("m/s",), ("m",)
        self.multipliers, self.terms, self.bodies = (), ("poses",), ("near", "far")
        self.description = SimpleNamespace(simulation=SimpleNamespace(step=0.02))
        vars(self).update(facts)

    def _factors(self, parameters: Any) -> tuple[float, float, float, float]:
        given = parameters or {}
        assert self.scaled or not given
        return given.get(LENGTH, 1.0), given.get(MASS, 1.0), given.get(TIME, 1.0), given.get(ORIGIN, 0.0)

    def forward_dynamics(self, q: Any, v: Any, z: Any, parameters: Any) -> np.ndarray:
        length, mass, time, origin = self._factors(parameters)
        k, w, m = STIFFNESS * mass / time**2, WEIGHT * mass * length / time**2, MASS_SI * mass
        if self.fault == "weight" and self.scaled:
            w = WEIGHT
        if self.fault == "refused" and self.scaled:
            raise EomgenError("no such scene", "another")
        return np.array([-(k * (q[0] - origin) + w) / m])

    def internal_rates(self, q: Any, v: Any, z: Any, parameters: Any) -> np.ndarray:
        _, _, time, _ = self._factors(parameters)
        return np.array([v[0] - z[0] / ((3.0 if self.fault != "state" or not self.scaled else 4.0) * time)])

    def pose(self, body: str, q: Any) -> np.ndarray:
        return np.array([1.0, 0.0, 0.0, 0.0, *((q[0], 0.0, 0.0) if body == "near" else (-7.0 * q[0], 0.0, 9.0 * q[0]))])

    def linearize(self, at: str) -> Any:
        assert at == "initial"
        return SimpleNamespace(modes=lambda: SimpleNamespace(eigenvalues=np.array([-1.0 + 2.0j, 3.0])))


def subject_of(fault: str = "", **facts: Any) -> Subject:
    subject = Subject.__new__(Subject)
    subject._models = {OWN: Slider(False, **facts), FACTORS: Slider(True, fault, **facts)}  # type: ignore[dict-item]
    subject.factors, subject.used, subject.why_not = (LENGTH, MASS, TIME, ORIGIN), frozenset(), {}
    return subject


NUMBERS = "its forces are not the same in other units: numbers in its formulas have units of their own"


@pytest.mark.parametrize("factors", [(LENGTH,), (MASS,), (TIME,), (LENGTH, MASS, TIME)])
def test_scenes_are_similar_if_all_numbers_have_units(factors: tuple[str, ...]) -> None:
    assert subject_of().not_similar(factors) == ""
    # doubled mass, length and time: of a weight without units, 1 of 2, 2 and 1/4 remains, and of all three none
    assert subject_of("weight").not_similar(factors) == ("" if len(factors) == 3 else NUMBERS)
    assert subject_of("state").not_similar(factors) == NUMBERS
    assert subject_of("refused").not_similar(factors) == "no such scene"


def test_units_change_conditions() -> None:
    subject = subject_of()
    subject.factors = (LENGTH, TIME)
    plain = subject.conditions(v=np.array([4.0]))
    changed = subject.in_units(SceneUnits(length=10.0, mass=3.0, time=0.5), plain)
    assert (changed.model, changed.step, changed.steps) == (FACTORS, 0.5 * plain.step, STEPS)
    assert [part.tolist() for part in (changed.q, changed.v, changed.z)] == [[5.0], [80.0], [2.5]]
    assert changed.parameters == {LENGTH: 10.0, TIME: 0.5}
    assert [part.tolist() for part in changed.sizes] == [[10.0], [20.0]]
    with_states = subject.in_units(SceneUnits(length=10.0), subject.conditions(z=np.array([3.0])))
    assert with_states.z.tolist() == [30.0]


def test_scenes_at_another_place_have_the_same_accelerations() -> None:
    subject = subject_of()
    moved = subject.conditions(model=FACTORS, parameters={ORIGIN: 3.0}, q=np.array([3.5]))
    assert subject.not_movable(moved) == ""
    assert subject.not_movable(moved.vary(q=np.array([3.5 + 1e-5]))).startswith("its forces are not the same at an")
    assert subject.not_movable(moved.vary(q=np.array([3.5 + 1e-8]))) == ""
    assert subject_of("refused").not_movable(moved) == "no such scene"


def test_extents_rates_and_fine_steps() -> None:
    assert subject_of().extent == 4.5  # along z
    assert subject_of(bodies=("near",)).extent == 0.5  # from the base
    assert subject_of(terms=()).extent == subject_of(bodies=()).extent == subject_of(initial_q=[0.0]).extent == 1.0
    subject = subject_of()
    assert subject.rate == 3.0 and subject.period == pytest.approx(2.0 * np.pi / 3.0)
    assert subject.fine == 0.01 * subject.period and subject.conditions().step == subject.fine
    assert subject.conditions().steps == STEPS == 10 * ROWS
    assert subject_of(v_units=("rad/s",), initial_v=[-5.0]).rate == 5.0

    def refused(at: str) -> Any:
        raise EomgenError("no", "none")

    assert subject_of(linearize=refused).rate == 0.1 / 0.02
    wider = subject_of()
    wider._models[FACTORS].nq = 3  # type: ignore[misc]  # of a model with two more coordinates
    assert wider.conditions(model=FACTORS).q.tolist() == [0.5, 0.0, 0.0]
    consistent = subject_of(multipliers=("a",), consistent=lambda q, v: SimpleNamespace(q=q + 1.0, v=v - 1.0))
    assert [part.tolist() for part in consistent.start] == [[1.5], [1.0]]


def test_numbers_of_geometry_are_directions_and_places() -> None:
    data = {
        "bodies": {"arm": {"mass": 3.0, "center_of_mass": [1.0, "2 * L", True, 4]}},
        "joints": [{"axis": [0, 0, 1], "name": "a"}, {"position": [5.0]}],
        "parameters": {"p": {"position": [1.0]}}, "simulation": {"axis": [1.0]}, "initial": {"position": [1.0]},
        "curves": {"c": {"position": [1.0]}}, "list": [], "numbers": [1.0],
    }  # fmt: skip
    places = [(holder[key], kind) for holder, key, kind in _numbers(data)]
    assert places == [
        (1.0, "center_of_mass"), (4, "center_of_mass"), (0, "axis"), (0, "axis"), (1, "axis"), (5.0, "position"),
    ]  # fmt: skip
    assert _reach(["rad/s", "m/s", "1"]).tolist() == [1.0, 0.05, 0.05]


def test_data_of_scenes(tmp_path: Path) -> None:
    assert _data_of({"name": "a"}, {}) == ({"name": "a"}, Path())
    assert _data_of(object(), {}) == (None, Path())
    path = tmp_path / "a.toml"
    path.write_text('format = 1\nname = "a"\n')
    data, folder = _data_of(path, {"coordinates": "joint"})
    assert data is not None and data["name"] == "a" and folder == tmp_path
    (tmp_path / "b.toml").write_text('format = 1\nname = "a"\n[include.x]\nfile = "a.toml"\n')
    assert _data_of(str(tmp_path / "b.toml"), {})[0] is None
