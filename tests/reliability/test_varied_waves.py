"""Waves that differ from run to run: heights by a tunable parameter, amplitudes and phases by random variables."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen import random_vibration
from eomgen.base.random_inputs import WAVES, standard_normals
from eomgen.errors import DescriptionError, UsageError
from eomgen.formula.evaluate import evaluate_batch
from eomgen.formula.nodes import Symbol
from eomgen.formula.recording import record
from eomgen.mechanics.derive import derive
from eomgen.products.reliability.vibration.inputs import processes_of
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import EVERYTHING, SceneNames
from eomgen.scene.load import from_data
from eomgen.symbolic.calculus.partials import weighted_gradient
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import ONE, Tape

SEA: dict[str, Any] = {
    "spectrum": {"type": "jonswap", "height": "Hs", "period": 9},
    "seed": 1,
    "components": 5,
    "depth": 30,
    "level": 0.5,
    "spreading": {"exponent": 10, "directions": 2},
}
FORMULAS = [
    "elevation.sea(q.free[4], q.free[5])",
    "slope.sea(1, 2)[1]",
    "water_velocity.sea(q.free[4], q.free[5], q.free[6])[2]",
    "water_acceleration.sea(q.free[4], q.free[5], q.free[6])[0]",
]
VARIED = [{"variables": True}, {"variables": True, "order": 2, "ramp": 20}, {"order": 2}, {}]


def _data(height: float = 3.0, *, tunable: bool = True, **changes: Any) -> dict[str, Any]:
    return {
        "format": 1,
        "name": "buoy",
        "parameters": {"Hs": {"value": height, "unit": "m", "tunable": tunable}},
        "waves": {"sea": SEA | changes},
        "bodies": {"buoy": {"mass": 1000, "inertia": {"xx": 1000, "yy": 1000, "zz": 1000}}},
        "joints": {"free": {"type": "free", "parent": "base", "child": "buoy"}},
        "points": {"middle": {"body": "buoy"}},
        "hulls": {
            "hull": {"body": "buoy", "start": [0, 0, -2], "end": [0, 0, 2], "diameter": 1, "waves": "sea", "wet": 2}
            | {"stations": 2}
        },
        "outputs": {
            "here": {"formula": "elevation.sea(1, 2)"},
            "speed": {"formula": "water_velocity.sea(position.middle[0], 0, position.middle[2])[0]"},
            "place": {"position": "middle"},
        },
        "simulation": {"step": 0.05, "duration": 2.0},
    }


@pytest.mark.parametrize("changes", VARIED)
@pytest.mark.parametrize("text", FORMULAS)
def test_the_tape_has_the_values_and_their_partials(text: str, changes: dict[str, Any]) -> None:
    (sea,) = from_data(_data(**changes)).parts["waves"]
    parameters = ["Hs", *sea.variables]
    formula = read_formula(text, SceneNames(entries={"waves": {"sea": sea}}, joints={"free": "free"}), EVERYTHING)
    tape = Tape()

    def recorded_symbol(symbol: Symbol) -> Scalar:
        if symbol.kind == "parameter":
            return Scalar(tape, tape.input("p", parameters.index(symbol.name)))
        return Scalar(tape, tape.input("t") if symbol.kind == "time" else tape.input("q", symbol.index))

    recorded = record(Algebra(tape), formula, recorded_symbol)
    rng = np.random.default_rng(1)
    q, p = rng.uniform(-5.0, 5.0, (6, 7)), rng.normal(size=(6, len(parameters)))
    p[:, 0], t = rng.uniform(1.0, 4.0, 6), np.array([-1.0, 0.0, 3.0, 12.0, 20.0, 31.0])
    found = evaluate(tape, [recorded.ref], {"q": q, "t": t[:, None], "p": p})[:, 0]

    def number(symbol: Symbol) -> Any:
        if symbol.kind == "parameter":
            return p[:, parameters.index(symbol.name)]
        return t if symbol.kind == "time" else q[:, symbol.index]

    np.testing.assert_allclose(found, evaluate_batch(formula, number), rtol=0, atol=1e-13)
    inputs = [*(tape.input("q", k) for k in range(7)), *(tape.input("p", k) for k in range(len(parameters)))]
    gradient = weighted_gradient(tape, [recorded.ref], [ONE], inputs)
    steps = np.concatenate([q[3], p[3]]) + 1e-30j * np.eye(len(inputs))
    many = {"q": steps[:, :7], "p": steps[:, 7:], "t": np.full((len(steps), 1), t[3])}
    expected = evaluate(tape, [recorded.ref], many)[:, 0].imag / 1e-30
    at = evaluate(tape, gradient, {"q": q[3], "t": t[3], "p": p[3]})
    np.testing.assert_allclose(at, expected, rtol=1e-12, atol=1e-15)


def _other_sea(data: dict[str, Any], height: float, seed: int) -> dict[str, Any]:
    """Return a scene with the height and the seed as numbers in its code."""
    parameters = {"Hs": {"value": height, "unit": "m"}}
    sea = {key: value for key, value in data["waves"]["sea"].items() if key != "variables"}
    return data | {"parameters": parameters, "waves": {"sea": sea | {"seed": seed}}}


def _on_a_spring(order: int) -> dict[str, Any]:
    data = _data(variables=True, order=order)
    del data["hulls"]
    data["joints"] = {"up": {"type": "prismatic", "parent": "base", "child": "buoy", "axis": [0, 0, 1]}}
    lift = "9810 + 3000 * (elevation.sea(q.up, 0) - q.up) + 100 * water_acceleration.sea(0, 0, q.up)[2]"
    data["forces"] = {"lift": {"body": "buoy", "force": [0, 0, lift]}}
    return data


@pytest.mark.slow
@pytest.mark.long_cases("hull")
@pytest.mark.parametrize(
    "data",
    [
        pytest.param(_on_a_spring(2), id="order 2"),
        pytest.param(_data(variables=True), id="hull"),
    ],
)
def test_a_model_has_the_seas_of_other_heights_and_seeds(data: dict[str, Any]) -> None:
    """By parameters, the motion is that of a scene with these numbers: of a sea of order 2, too, whose bound waves go
    with the square of the height."""
    model = eomgen.build(from_data(data))
    seeds, heights = [1, 5], [3.0, 2.0]
    names = [name for name in model.parameters if name != "Hs"]
    assert names == [f"sea_z{k}" for k in range(1, 21)]
    many = model.simulate_many(table={"Hs": heights, "seed.sea": seeds})
    for seed, height, number in zip(seeds, heights, range(2), strict=True):
        drawn = dict(zip(names, standard_normals(seed, len(names), WAVES).tolist(), strict=True))
        run = model.simulate(parameters={"Hs": height, **drawn})
        if number:  # of others than the model's own
            alone = eomgen.build(from_data(_other_sea(data, height, seed))).simulate()
            for name in ("here", "speed", "place"):
                np.testing.assert_allclose(run.outputs[name], alone.outputs[name], rtol=0, atol=1e-9)
        z = run.outputs["place"][:, 2]
        assert np.ptp(z) > 0.3
        assert many.results["output.place[2].max"][number] == pytest.approx(z.max(), abs=1e-9)
        assert many.results["output.place[2].min"][number] == pytest.approx(z.min(), abs=1e-9)


@pytest.mark.slow
def test_a_base_follows_waves_of_other_seeds() -> None:
    data = _data(variables=True) | {"base": {"follow": {"waves": "sea"}, "position": ["t", 0, 1]}}
    data["points"]["deck"] = {"body": "base"}
    data["outputs"]["deck"] = {"position": "deck"}
    model = eomgen.build(from_data(data))
    (sea,) = from_data(data).parts["waves"]
    drawn = standard_normals(9, 20, WAVES)
    run = model.simulate(0.5, parameters={"Hs": 1.5, **dict(zip(sea.variables, drawn.tolist(), strict=True))})
    height = sea.value("elevation", 0, run.t, 0.0 * run.t, run.t, 0.5, *drawn)  # half of the height in the scene
    np.testing.assert_allclose(run.outputs["deck"][:, 2], 1.5 + height, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_random_vibration_in_waves_is_that_of_the_transfer_function() -> None:
    """A buoy on a spring, long after the waves have come: |H|^2 S, and normal."""
    data = {
        "format": 1,
        "name": "raft",
        "waves": {"sea": {"spectrum": {"type": "jonswap", "height": 3, "period": 9}, "variables": True}},
        "bodies": {"raft": {"mass": 100}},
        "joints": {
            "up": {"type": "prismatic", "parent": "base", "child": "raft", "axis": [0, 0, 1]}
            | {"stiffness": 400, "damping": 80}
        },
        "forces": {"lift": {"body": "raft", "force": [0, 0, "100 * 9.81 + 300 * elevation.sea(0, 0)"]}},
        "outputs": {"heave": {"formula": "q.up", "unit": "m"}},
        "simulation": {"step": 0.05, "duration": 60},
    }
    data["waves"]["sea"] |= {"components": 8}  # type: ignore[index]
    model = eomgen.build(from_data(data))
    found = random_vibration(model, "heave", points=False)
    (sea,) = model.description.parts["waves"]
    w, size = (np.array([getattr(wave, name) for wave in sea.components]) for name in ("frequency", "amplitude"))
    assert 16.0 * np.sum(size**2) == pytest.approx(9.0, rel=1e-12)
    transfer = np.abs(300.0 / (400.0 + 80.0j * w - 100.0 * w**2))
    mean, deviation, *_ = found.moments["first_order"]
    assert deviation == pytest.approx(np.sqrt(np.sum((transfer * size) ** 2)), rel=1e-3)
    assert abs(mean) < 1e-9
    (process,) = found.processes
    assert (process.name, process.kind, process.variables) == ("sea", "waves", 16)
    assert sum(process.eigenvalues) == pytest.approx(2.0 * 9.0 / 16.0)


def test_quantities_at_one_place_share_their_sines() -> None:
    """With variables, too: a sine and a cosine more for an elevation, nothing for what is in quadrature."""
    formula = ["elevation.sea(q.free[4], 0)", *(f"water_velocity.sea(q.free[4], 0, q.free[6])[{k}]" for k in (0, 2))]
    counts = []
    for variables in (False, True):
        data = _data(variables=variables, depth=None, spreading=None) | {"outputs": {"all": {"formula": formula}}}
        counts.append(derive(from_data(data), ["outputs"]).counts["outputs"].functions)
    # by wave: elevation with its cosine, then sine, cosine and exponential at the height that it leads to
    assert counts[1] <= counts[0] + 5


def test_heights_of_runs_keep_the_waves_from_breaking() -> None:
    data = _on_a_spring(1)
    data["waves"]["sea"] |= {"variables": False, "components": 2}
    model = eomgen.build(from_data(data))
    for height, text in (
        (30.0, r"\(waves.sea.spectrum\): at the peak waves of 116.8 m break from a height of 15.32 m on, and the sig"),
        (-3.0, r"\(waves.sea.spectrum.height\): the height -3 is not positive at Hs = -3; try: 3"),
    ):
        with pytest.raises(UsageError, match=text):
            model.simulate(parameters={"Hs": height})


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"variables": True, "components": 300}, r"variables\): 600 waves have 1200 variables, more than 1000"),
        ({"variables": True, "amplitudes": "fixed"}, r"variables\): amplitudes are fixed, and variables make"),
        (
            {"variables": True, "spectrum": None, "regular": [{"amplitude": 1, "period": 8}]},
            r"waves.sea.variables\): variables belongs to a spectrum, and these waves are given one by one; try: ",
        ),
    ],
)
def test_variables_are_of_spectra_with_random_amplitudes(changes: dict[str, Any], text: str) -> None:
    with pytest.raises(DescriptionError, match=text):
        from_data(_data(**changes))


def test_a_period_that_varies_is_one_problem() -> None:
    data = _data(spectrum={"type": "jonswap", "height": 3, "period": "Tp"})
    data["parameters"]["Tp"] = {"value": 9, "tunable": True}
    with pytest.raises(DescriptionError, match=r"period\): the tunable parameter 'Tp' cannot be used") as caught:
        from_data(data)
    assert len(caught.value.problems) == 1


def test_waves_are_processes_of_two_variables_each() -> None:
    def processes(**changes: Any) -> Any:
        return processes_of(cast(Any, SimpleNamespace(name="buoy", description=from_data(_data(**changes)))))

    (process,), variables = processes(variables=True)
    (sea,) = from_data(_data(variables=True)).parts["waves"]
    assert (process.name, process.kind, process.variables, process.captured) == ("sea", "waves", 20, 1.0)
    assert variables == [f"sea_z{k}" for k in range(1, 21)]
    energies = sorted((wave.amplitude**2 for wave in sea.components for _ in range(2)), reverse=True)
    assert list(process.eigenvalues) == pytest.approx(energies, rel=1e-12)
    with pytest.raises(UsageError, match=r"no random process; try: variables = true in \[waves.sea\], if it has a"):
        processes()


@pytest.mark.slow
def test_a_standard_normal_variable_that_nothing_draws_is_noted() -> None:
    model = eomgen.build(from_data(_data(variables=True)))
    run = model.simulate(0.02, 0.01, parameters={"sea_z1": -1000.0, "sea_z3": 20.0, "Hs": 9.0}, error_estimate=False)
    assert list(run.metadata["notes"]) == [
        "sea_z1 is 1000 standard deviations out: it is a standard normal variable of a random process or sea (2"
        " variables beyond 8)"
    ]
    usual = model.simulate(0.02, 0.01, parameters={"sea_z1": 4.0, "Hs": 9.0}, error_estimate=False)
    assert not usual.metadata["notes"]
