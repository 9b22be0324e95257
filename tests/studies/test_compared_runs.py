"""Errors between runs and between formulations, against SciPy's rotations; conditions of ladders; signs of pivots."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation

from eomgen.lie.product import Factor
from eomgen.products.studies.ladders import register, study
from eomgen.products.studies.work_precision.formulations import _apart
from eomgen.products.studies.work_precision.observation import Observation, errors, with_arrays
from eomgen.products.studies.work_precision.reference import RunReference, _extrapolate
from eomgen.simulation.accuracy.motion_size import RunNames
from eomgen.simulation.judgement.invariants import _is_pulse

FACTORS = (Factor("SE3", "base", 0, 7, 0, 6), Factor("R", "hinge", 7, 1, 6, 1), Factor("R", "slide", 8, 1, 7, 1))
UNITS = ("1",) * 4 + ("m",) * 3 + ("rad", "m")
NAMES = RunNames(
    FACTORS, ("q.base",) * 7 + ("q.hinge", "q.slide"), UNITS, ("rad/s",) * 3 + ("m/s",) * 3 + ("rad/s", "m/s"),
    ("z.level", "z.flow"), ("V", "A"), {"tip": "m", "load": "N"},
)  # fmt: skip
TIMES, EVERY = 9, 2


def quaternions(rotation: Rotation) -> np.ndarray:
    return np.asarray(rotation.as_quat(scalar_first=True))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_poses_are_apart_by_the_logarithm_of_the_turn_and_the_way_in_body_axes(
    sign: float, rng: np.random.Generator
) -> None:
    for angle in (0.0, 1e-9, 0.3, 3.0):
        here, axis = Rotation.random(random_state=rng), rng.normal(size=3)
        turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
        places = rng.normal(size=(2, 3))
        one = np.concatenate([quaternions(here), places[0]])
        two = np.concatenate([sign * quaternions(here * turn), places[1]])
        expected = np.concatenate([turn.as_rotvec(), here.inv().apply(places[1] - places[0])])
        np.testing.assert_allclose(_apart(one, two), expected, atol=1e-12)


def observation_of(rng: np.random.Generator, times: int, step: float, **changes: Any) -> Observation:
    turned = Rotation.from_rotvec(rng.normal(size=(times, 3)))
    q = np.column_stack([quaternions(turned), rng.normal(size=(times, 5)) * [1.0, 1.0, 1.0, 3.0, 0.1]])
    given = {
        "t": 1.0 + step * np.arange(times), "q": q, "v": rng.normal(size=(times, 8)),
        "z": rng.normal(size=(times, 2)) * [1.0, 1e-3],
        "multipliers": rng.normal(size=(times, 2)), "components": NAMES, "rows": ("a", "b"),
        "poses": {
            name: np.column_stack([quaternions(Rotation.random(times, random_state=rng)), rng.normal(size=(times, 3))])
            for name in ("arm", "leg")
        },
        "twists": {name: rng.normal(size=(times, 6)) for name in ("arm", "leg")},
        "outputs": {"tip": rng.normal(size=(times, 3)), "load": rng.normal(size=(times, 1))},
    }  # fmt: skip
    return Observation(**(given | changes))


def turn_between(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    rotations = (Rotation.from_quat(array[:, :4], scalar_first=True) for array in (one, two))
    first, second = rotations
    return np.asarray((first.inv() * second).magnitude())


def measured(series: np.ndarray) -> tuple[float, float, float]:
    return series.max(), np.sqrt(np.mean(series**2)), series[-1]


def test_errors_are_relative_to_the_motion_of_each_coordinate_state_and_output(rng: np.random.Generator) -> None:
    true = observation_of(rng, EVERY * (TIMES - 1) + 3, 0.05)
    run = observation_of(rng, TIMES, 0.1)
    at = slice(0, EVERY * (TIMES - 1) + 1, EVERY)
    result = errors(run, true)
    here, there = run.q, true.q[at]

    def apart(one: np.ndarray, two: np.ndarray) -> np.ndarray:
        poses = []
        for array in (one, two):
            pose = np.broadcast_to(np.eye(4), (len(array), 4, 4)).copy()
            pose[:, :3, :3] = Rotation.from_quat(array[:, :4], scalar_first=True).as_matrix()
            pose[:, :3, 3] = array[:, 4:7]
            poses.append(pose)
        screws = [np.real(logm(np.linalg.solve(first, second))) for first, second in zip(*poses, strict=True)]
        return np.array([[*Rotation.from_matrix(expm(s[:3, :3])).as_rotvec(), *s[:3, 3]] for s in screws])

    moved = apart(np.broadcast_to(true.q[:1], true.q.shape), true.q)
    turned, way = (np.linalg.norm(moved[:, k : k + 3], axis=1).max() for k in (0, 3))
    off = np.abs(apart(here, there))
    parts = [
        off[:, :3].max(axis=1) / turned, off[:, 3:].max(axis=1) / way,
        (np.abs(here[:, 7:] - there[:, 7:]) / np.ptp(true.q[:, 7:], axis=0)).max(axis=1),
    ]  # fmt: skip
    q = np.max(parts, axis=0)
    off, kinds = np.abs(run.v - true.v[at]), ([0, 1, 2, 6], [3, 4, 5, 7])
    v = np.max([off[:, kind].max(axis=1) / np.abs(true.v[:, kind]).max() for kind in kinds], axis=0)
    z = (np.abs(run.z - true.z[at]) / np.ptp(true.z, axis=0)).max(axis=1)
    expected = {"q": q, "v": v, "z": z, "state": np.max([q, v, z], axis=0)}
    rows = np.linalg.norm(true.multipliers, axis=1).max()
    expected["multipliers"] = np.linalg.norm(run.multipliers - true.multipliers[at], axis=1) / rows
    for name in ("tip", "load"):
        spans = np.ptp(true.outputs[name], axis=0)
        expected[name] = (np.abs(run.outputs[name] - true.outputs[name][at]) / spans).max(axis=1)
    for name, series in expected.items():
        size = result[name]
        assert (size.largest, size.rms, size.final) == pytest.approx(measured(series), rel=1e-9)
    assert list(result) == list(expected)
    bars = {name: type(result["q"])(1e9, 0.0, 2e9) for name in ("q", "tip")}
    known = RunReference(true, "", "", bars).errors_of(run)
    for name in result:
        bounded = (1e9, result[name].rms, 2e9) if name in bars else tuple(vars(result[name]).values())
        assert tuple(vars(known[name]).values()) == bounded


def test_errors_of_other_coordinates_are_of_poses_and_twists(rng: np.random.Generator) -> None:
    true, run = (
        observation_of(rng, TIMES, 0.1),
        observation_of(rng, TIMES, 0.1, components=NAMES._replace(factors=FACTORS[1:]), rows=("a",)),
    )
    result = errors(run, true)
    poses = [(run.poses[name], true.poses[name]) for name in ("arm", "leg")]
    turned = max(turn_between(np.broadcast_to(there[:1], there.shape), there).max() for _, there in poses)
    way = max(np.linalg.norm(there[:, 4:] - there[0, 4:], axis=1).max() for _, there in poses)
    parts = [turn_between(here, there) / turned for here, there in poses]
    parts += [np.linalg.norm(here[:, 4:] - there[:, 4:], axis=1) / way for here, there in poses]
    twists = []
    for part in (slice(0, 3), slice(3, 6)):
        size = max(np.linalg.norm(array[:, part], axis=1).max() for array in true.twists.values())
        twists += [
            np.linalg.norm(run.twists[name][:, part] - true.twists[name][:, part], axis=1) / size for name in run.twists
        ]
    q, v = np.max(parts, axis=0), np.max(twists, axis=0)
    z = (np.abs(run.z - true.z) / np.ptp(true.z, axis=0)).max(axis=1)
    for name, series in (("q", q), ("v", v), ("z", z), ("state", np.max([q, v, z], axis=0))):
        size = result[name]
        assert (size.largest, size.rms, size.final) == pytest.approx(measured(series), rel=1e-9)
    assert list(result) == ["q", "v", "z", "state", "tip", "load"]
    without = observation_of(
        rng, TIMES, 0.1, components=NAMES._replace(factors=(), z_names=()), rows=(), poses={},
        outputs={"load": np.ones((TIMES, 2))},
    )  # fmt: skip
    assert errors(without, true) == {}
    again = with_arrays(true.arrays, true.components, true.rows)
    assert list(again.arrays) == list(true.arrays)
    assert all(again.arrays[name] is array for name, array in true.arrays.items())


def test_ladders_measure_errors_by_the_motion_and_the_size_of_the_machine(rng: np.random.Generator) -> None:
    model = SimpleNamespace(
        factors=FACTORS, q_units=UNITS, v_units=["rad/s"] * 3 + ["m/s"] * 3 + ["rad/s", "m/s"], z_units=["V", "V", "A"]
    )
    subject: Any = SimpleNamespace(model=lambda kind: model, extent=2.0)
    held, of = (observation_of(rng, TIMES, 0.1) for _ in range(2))
    z = [rng.normal(size=(TIMES, 3)) * [0.01, 1e-9, 0.02] for _ in range(2)]
    arrays = [{"t": one.t, "q": one.q, "v": one.v, "z": states} for one, states in zip((of, held), z, strict=True)]
    of.q[:, 7:] = held.q[:, 7:] + 1e-3
    result = study.difference(subject, *arrays, bound=1e-3)
    turned = max(turn_between(np.broadcast_to(held.q[:1], held.q.shape), held.q).max(), np.ptp([0.0]))
    own = {"rad": turn_between(of.q, held.q).max() / turned}
    way = np.linalg.norm(held.q[:, 4:7] - held.q[0, 4:7], axis=1).max()
    own["m"] = np.linalg.norm(of.q[:, 4:7] - held.q[:, 4:7], axis=1).max() / way
    both = max(turned, np.abs(held.q[:, 7] - held.q[0, 7]).max())
    own["rad"] *= turned / both
    ranges = np.ptp(z[1], axis=0)
    ranges[1] = 1e-3 * ranges[0]
    states = np.abs(z[0] - z[1]).max(axis=0) / ranges
    assert result.position == pytest.approx(max(*own.values(), *states), rel=1e-9)
    off, kinds = np.abs(of.v - held.v), ([0, 1, 2, 6], [3, 4, 5, 7])
    assert result.velocity == pytest.approx(max(off[:, k].max() / np.abs(held.v[:, k]).max() for k in kinds), rel=1e-9)
    assert result.worst == max(result.position, result.velocity / 3.0)
    shorter = {name: array[:5] for name, array in arrays[0].items()}
    assert study.difference(subject, shorter, arrays[1], bound=1e-3) == (np.inf, np.inf)
    for name in ("q", "v", "z"):
        wrong = arrays[0][name].copy()
        wrong[3, -1] = np.nan
        assert study.difference(subject, arrays[0] | {name: wrong}, arrays[1], bound=1e-3) == (np.inf, np.inf)


@pytest.mark.parametrize("turned", [1e-13, 1e-11, 1e-9])
def test_a_rotation_that_is_rounding_is_measured_by_what_moves(turned: float) -> None:
    model = SimpleNamespace(factors=FACTORS[:1], v_units=["rad/s"] * 3 + ["m/s"] * 3, q_units=UNITS[:7], z_units=[])
    subject: Any = SimpleNamespace(model=lambda kind: model, extent=1.0)
    t = np.linspace(0.0, 1.0, 21)
    q, v = np.zeros((21, 7)), np.zeros((21, 6))
    q[:, 0], q[:, 2], q[:, 4], v[:, 3] = 1.0, 0.5 * turned * t, 2.0 * t, 2.0
    off, held = q.copy(), {"t": t, "q": q, "v": v}
    off[:, 2] *= 38.0
    assert study.difference(subject, {**held, "q": off}, held, 0.01).position < 1e-3
    off[:, 4] *= 1.5  # an error of what moves is seen
    assert study.difference(subject, {**held, "q": off}, held, 0.01).position == pytest.approx(0.5)


class LadderSubject(SimpleNamespace):
    """Start, model and conditions of a subject; conditions are kept as given."""

    def model(self, kind: str) -> Any:
        return SimpleNamespace(
            factors=FACTORS, q_units=UNITS, nq=9, v_units=["rad/s"] * 3 + ["m/s"] * 3 + ["rad/s", "m/s"],
            multipliers=self.multipliers,
        )  # fmt: skip

    def conditions(self, **given: Any) -> Any:
        given = {"step": 0.25, **given}
        return SimpleNamespace(**given, vary=lambda **more: SimpleNamespace(**(given | more)))


def test_ladders_turn_spin_and_refine(rng: np.random.Generator) -> None:
    q, v = rng.normal(size=9), rng.normal(size=8)
    subject: Any = LadderSubject(start=(q, v), period=3.0, fine=0.01, multipliers=())
    assert register._angles(subject) == [7] and register._has_angles(subject) == ""
    turned: Any = register.BY_NAME["turns"].conditions(subject, 100.0)
    assert (turned.q - q).tolist() == pytest.approx([0.0] * 7 + [200.0 * np.pi, 0.0])
    right: Any = register.BY_NAME["right_angles"].conditions(subject, 0.25)
    assert right.q.tolist() == [*q[:7], 0.5 * np.pi + 1e-9, q[8]] and q[7] != right.q[7]
    turns = [0, 1, 2, 6]
    spun = register._spin(subject, 0.5)
    assert np.abs(spun.v[turns]).max() * 0.25 == pytest.approx(0.5)
    np.testing.assert_allclose(spun.v * v[0], spun.v[0] * v, rtol=1e-12)
    assert spun.q is q and spun.steps == 2 * register.ROWS
    still: Any = LadderSubject(start=(q, np.where(np.isin(np.arange(8), turns), 0.0, v)), multipliers=("a",))
    rotating = register._spin(still, 0.5).v
    assert rotating[turns].tolist() == [2.0] * 4 and rotating[[3, 4, 5, 7]].tolist() == v[[3, 4, 5, 7]].tolist()
    assert register._spins(still) == "it is held by constraints at rest"
    assert register._spins(subject) == ""
    assert vars(register.BY_NAME["start"].conditions(subject, 1e3))["start"] == 1e3
    assert vars(register.BY_NAME["rho_inf"].conditions(subject, 0.5))["given"] == {"rho_inf": 0.5}
    counted: Any = register.BY_NAME["count"].conditions(subject, 50.0)
    assert (counted.steps, counted.step) == (50, register.STEPS * 0.01 / 50.0)
    for value, steps in ((0.0999, register.STEPS), (0.1, 2 * register.ROWS)):
        stepped: Any = register.BY_NAME["step"].conditions(subject, value)
        assert (stepped.step, stepped.steps) == (value * 3.0, steps)


@pytest.mark.parametrize(("jumps", "pulse"), [(4, True), (6, False)])
def test_an_imbalance_of_a_twentieth_of_the_intervals_is_a_pulse(jumps: int, pulse: bool) -> None:
    off = np.zeros(101)
    off[1 : 1 + jumps] = 1.0
    off = np.cumsum(np.where(off > 0.0, 3.0, 0.0))
    assert _is_pulse(off) is pulse and _is_pulse(-7.0 + 1e-6 * off) is pulse


@pytest.mark.parametrize("order", [1, 2, 4])
def test_extrapolation_removes_the_leading_error(order: int, rng: np.random.Generator) -> None:
    """Runs off by c h^order are extrapolated to the run without error; quaternions stay of unit length."""
    true, off = observation_of(rng, TIMES, 0.1), observation_of(rng, TIMES, 0.1)
    fine, coarse = (
        with_arrays(
            {name: array + size * (name != "t") * off.arrays[name] for name, array in true.arrays.items()},
            NAMES, ("a", "b"),
        )
        for size in (1e-3, 1e-3 * 2.0**order)
    )  # fmt: skip
    result = _extrapolate(fine, coarse, order)
    assert (result.components, result.rows) == (NAMES, ("a", "b"))
    for name, array in result.arrays.items():
        np.testing.assert_allclose(array, true.arrays[name], atol=1e-12)
    wrong = _extrapolate(fine, coarse, order + 1)
    for quaternion in (wrong.q[:, :4], *(pose[:, :4] for pose in wrong.poses.values())):
        np.testing.assert_allclose(np.linalg.norm(quaternion, axis=1), 1.0, rtol=1e-12)
    assert np.abs(wrong.q[:, 4:] - true.q[:, 4:]).max() > 1e-6
