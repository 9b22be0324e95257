"""Identification by efforts of models whose regressor is given in closed form, against least squares by hand."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from eomgen.errors import NumericalError, UsageError
from eomgen.products.studies.identification.estimation import (
    DependentColumns,
    LeastSquares,
    Predictions,
    form_of,
    words,
)
from eomgen.products.studies.identification.judgement import combinations_of
from eomgen.products.studies.identification.torques import identified_by_torque

#: Names, values of the scene and units of the parameters of the regressor.
PI = {"inertia": 2.0, "friction": 0.5, "weight": 3.0, "armature": 4.0}
UNITS = {"inertia": "kg m^2", "friction": "N m s", "weight": "N m", "armature": "kg"}


def regressor(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Return Y (n, 2, 4): a hinge with friction and weight, a slider with an armature."""
    Y = np.zeros((len(q), 2, 4))
    Y[:, 0, 0], Y[:, 0, 1], Y[:, 0, 2], Y[:, 1, 3] = a[:, 0], v[:, 0], np.sin(q[:, 0]), a[:, 1]
    return Y


def model_of(inputs: tuple[str, ...] = ()) -> Any:
    def of(q: np.ndarray, v: np.ndarray, a: np.ndarray, t: np.ndarray, u: Any, parameters: Any) -> Any:
        assert parameters == {"load": 1.5}
        remainder = np.stack([0.1 * t, -v[:, 1]], axis=1) if u is None else -np.pad(u, ((0, 0), (0, 1)))
        return SimpleNamespace(matrix=regressor(q, v, a), remainder=remainder)

    base = SimpleNamespace(
        expressions=("inertia + 0", "friction", "weight", "armature"), values=np.array(list(PI.values())),
        units=tuple(UNITS.values()), columns=(0, 1, 2, 3),
    )  # fmt: skip
    return SimpleNamespace(
        name="arm", q_names=["q.hinge", "q.slider"], v_names=["v.hinge", "v.slider"], v_units=["rad/s", "m/s"],
        inputs=list(inputs), nu=len(inputs), input_values=lambda t: np.zeros((len(t), len(inputs))),
        regressor_parameters=lambda parameters: PI, regressor=of, base_parameters=lambda parameters: base,
        description=SimpleNamespace(linear_parameters=[SimpleNamespace(unit=unit) for unit in UNITS.values()]),
    )  # fmt: skip


def data_of(rng: np.random.Generator, count: int, noise: tuple[float, float] = (0.02, 0.3)) -> dict[str, np.ndarray]:
    t = np.linspace(0.0, 3.0, count)
    q, v, a = (rng.normal(size=(count, 2)) for _ in range(3))
    tau = regressor(q, v, a) @ list(PI.values()) + np.stack([0.1 * t, -v[:, 1]], axis=1)
    tau += rng.normal(size=tau.shape) * noise
    columns = {"t": t}
    for k, joint in enumerate(("hinge", "slider")):
        columns |= {f"q.{joint}": q[:, k], f"v.{joint}": v[:, k], f"a.{joint}": a[:, k], f"tau.{joint}": tau[:, k]}
    return columns


def by_hand(data: dict[str, np.ndarray], names: list[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q, v, a of the columns as Y of some parameters, and the efforts less the known part."""
    q, v, a, tau = (np.stack([data[f"{n}.hinge"], data[f"{n}.slider"]], axis=1) for n in ("q", "v", "a", "tau"))
    Y = regressor(q, v, a)
    held = np.array([0.0 if name in names else value for name, value in PI.items()])
    known = np.stack([0.1 * data["t"], -v[:, 1]], axis=1) + Y @ held
    return Y[..., [list(PI).index(name) for name in names]], tau - known, tau


NAMES = list(PI)
VALUES = {"load": 1.5}


@pytest.mark.parametrize("given", [True, False])
def test_estimates_are_weighted_least_squares_with_intervals(given: bool, rng: np.random.Generator) -> None:
    runs = [data_of(rng, 60), data_of(rng, 25)]
    deviations = {"tau.hinge": 0.02, "tau.slider": 0.3} if given else None
    result = identified_by_torque(model_of(), runs, NAMES, VALUES, deviations, "refuse", 0.9)
    parts = [by_hand(run, NAMES) for run in runs]
    Y, right = np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
    # efforts share no parameter: each is a problem of its own, whatever the weights
    hinge = np.linalg.lstsq(Y[:, 0, :3], right[:, 0], rcond=None)[0]
    slider = np.array([Y[:, 1, 3] @ right[:, 1] / (Y[:, 1, 3] @ Y[:, 1, 3])])
    expected = np.concatenate([hinge, slider])
    np.testing.assert_allclose([one.value for one in result.estimates], expected, rtol=1e-9)
    left = right - Y @ expected
    sigma = np.array([0.02, 0.3]) if given else np.sqrt(np.mean(left**2, axis=0) / (1.0 - 4 / 170))
    covariance = np.zeros((4, 4))
    covariance[:3, :3] = np.linalg.inv(Y[:, 0, :3].T @ Y[:, 0, :3]) * sigma[0] ** 2
    covariance[3, 3] = sigma[1] ** 2 / (Y[:, 1, 3] @ Y[:, 1, 3])
    spread = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose([one.deviation for one in result.estimates], spread, rtol=1e-5)
    np.testing.assert_allclose(result.correlation, covariance / np.outer(spread, spread), atol=1e-6)
    reach = stats.norm.ppf(0.95) if given else stats.t.ppf(0.95, 166)
    np.testing.assert_allclose([one.high for one in result.estimates], expected + reach * spread, rtol=1e-5)
    np.testing.assert_allclose([one.low for one in result.estimates], expected - reach * spread, rtol=1e-5)
    assert [(one.name, one.unit, one.start, one.state) for one in result.estimates] == [
        (name, UNITS[name], PI[name], "determined") for name in NAMES
    ]
    assert (result.scene, result.confidence, result.degrees_of_freedom) == ("arm", 0.9, 166)
    assert result.noise == ("given" if given else "estimated") and result.notes == () and result.combinations == ()
    for k, (column, label) in enumerate(zip(result.columns, ("tau.hinge", "tau.slider"), strict=True)):
        assert (column.name, column.unit, column.samples) == (label, ("N m", "N")[k], 85)
        assert column.deviation == pytest.approx(sigma[k], rel=1e-5)
        assert column.rms == pytest.approx(np.sqrt(np.mean(left[:, k] ** 2)))
        one, two = left[:60, k], left[60:, k]
        products = one[1:] @ one[:-1] + two[1:] @ two[:-1]
        assert column.autocorrelation == pytest.approx(products / (one @ one + two @ two))
    for record, run, begin in zip(result.records, runs, (0, 60), strict=True):
        assert record.t.tolist() == run["t"].tolist()
        for k, label in enumerate(("tau.hinge", "tau.slider")):
            assert record.data[label].tolist() == run[label].tolist()
            part = left[begin : begin + len(run["t"]), k]
            np.testing.assert_allclose(record.model[label], run[label] - part, atol=1e-9)
    assert [record.name for record in result.records] == ["run1", "run2"]


def test_parameters_that_are_not_asked_for_keep_the_values_of_the_scene(rng: np.random.Generator) -> None:
    data = data_of(rng, 80)
    result = identified_by_torque(model_of(), [data], ["weight", "inertia"], VALUES, None, "refuse", 0.95)
    Y, right, _ = by_hand(data, ["weight", "inertia"])
    expected = np.linalg.lstsq(Y[:, 0], right[:, 0], rcond=None)[0]
    np.testing.assert_allclose([one.value for one in result.estimates], expected, rtol=1e-9)
    assert [(one.name, one.unit) for one in result.estimates] == [("weight", "N m"), ("inertia", "kg m^2")]
    base = identified_by_torque(model_of(), [data], [], VALUES, None, "refuse", 0.95)
    assert [(one.name, one.unit) for one in base.estimates] == [
        ("inertia + 0", "kg m^2"), *((name, UNITS[name]) for name in NAMES[1:]),
    ]  # fmt: skip
    every = identified_by_torque(model_of(), [data], NAMES, VALUES, None, "refuse", 0.95)
    assert [one.value for one in base.estimates] == pytest.approx([one.value for one in every.estimates], rel=1e-12)


def test_unknowns_that_motions_do_not_separate_are_one_combination(rng: np.random.Generator) -> None:
    data = data_of(rng, 50, (0.0, 0.0))
    data["v.hinge"], data["tau.hinge"] = 0.5 * data["a.hinge"], data["tau.hinge"] * 0.0
    data["tau.hinge"] = 2.25 * data["a.hinge"] + 3.0 * np.sin(data["q.hinge"]) + 0.1 * data["t"]
    data["a.slider"] = np.zeros(50)
    result = identified_by_torque(model_of(), [data], NAMES, VALUES, 0.1, "refuse", 0.95)
    (one,) = result.combinations
    texts = {"inertia + 0.5 friction": 2.25, "friction + 2 inertia": 4.5}
    assert one.value == pytest.approx(texts[one.text], rel=1e-9) and set(one.members) == {"inertia", "friction"}
    Y, *_ = by_hand(data, ["inertia", "weight"])
    spread = 0.1 * np.sqrt(np.linalg.inv(Y[:, 0].T @ Y[:, 0])[0, 0]) * (texts[one.text] / 2.25)
    reach = stats.norm.ppf(0.975) * spread
    assert (one.deviation, one.low, one.high) == pytest.approx((spread, one.value - reach, one.value + reach), rel=1e-6)
    assert [estimate.state for estimate in result.estimates] == ["undetermined"] * 2 + ["determined", "undetermined"]
    assert [estimate.deviation for estimate in result.estimates if estimate.state != "determined"] == [np.inf] * 3
    assert result["armature"].value == PI["armature"]
    assert result.notes == (f"only {one.text} is determined", "these motions do not depend on armature")
    assert np.isfinite(result.correlation[2, 2]) and np.isnan(np.delete(result.correlation, 2, 0)).all()


def test_columns_that_are_nearly_parallel_are_told_by_their_condition(rng: np.random.Generator) -> None:
    data = data_of(rng, 400)
    data["v.hinge"] = data["a.hinge"] + 1e-3 * data["v.hinge"]
    result = identified_by_torque(model_of(), [data], NAMES, VALUES, 1.0, "refuse", 0.95)
    Y = by_hand(data, NAMES)[0].reshape(-1, 4)
    condition = np.linalg.cond(Y / np.linalg.norm(Y, axis=0))
    assert result.notes == (f"motions excite the parameters unevenly: the condition number is {condition:.3g}",)


def test_rows_with_gaps_are_dropped_on_demand(rng: np.random.Generator) -> None:
    data = data_of(rng, 30)
    data["q.hinge"][4] = data["tau.slider"][9] = np.nan
    with pytest.raises(UsageError, match=r'run1: 2 of 30 rows have missing values; try: missing="drop"'):
        identified_by_torque(model_of(), [data], NAMES, VALUES, None, "refuse", 0.95)
    result = identified_by_torque(model_of(), [data], NAMES, VALUES, None, "drop", 0.95)
    clean = {name: np.delete(values, [4, 9]) for name, values in data.items()}
    expected = identified_by_torque(model_of(), [clean], NAMES, VALUES, None, "refuse", 0.95)
    assert [one.value for one in result.estimates] == [one.value for one in expected.estimates]
    assert result.records[0].t.tolist() == clean["t"].tolist()


def test_measured_inputs_stand_in_for_efforts(rng: np.random.Generator) -> None:
    data = data_of(rng, 40, (0.0, 0.0))
    data["input.push"] = data.pop("tau.hinge") - 0.1 * data["t"]
    data["a.slider"] *= 0.0
    del data["tau.slider"]
    result = identified_by_torque(model_of(("pull", "push")[1:]), [data], NAMES[:3], VALUES, 1.0, "refuse", 0.95)
    assert [one.value for one in result.estimates] == pytest.approx([2.0, 0.5, 3.0], rel=1e-9)


MISTAKES = {
    "coordinates": (("q.hinge", "a.slider"), {}, "the columns q.hinge, a.slider are missing, and inverse dynamics"),
    "efforts": (
        ("tau.hinge", "tau.slider"),
        {},
        "there is neither a column of efforts nor one of an input; try: columns",
    ),
    "one effort": (("tau.slider",), {}, "the efforts tau.slider are missing; try: 0 without one"),
    "strange": ((), {"tau.hynge": np.zeros(30)}, "column 'tau.hynge': no joint has this effort; try: tau.hinge"),
}


@pytest.mark.parametrize(("absent", "more", "message"), MISTAKES.values(), ids=MISTAKES)
def test_missing_and_strange_columns_are_named(
    absent: tuple[str, ...], more: dict[str, Any], message: str, rng: np.random.Generator
) -> None:
    data = {name: values for name, values in (data_of(rng, 30) | more).items() if name not in absent}
    with pytest.raises(UsageError, match=re.escape(message)):
        identified_by_torque(model_of(), [data], NAMES, VALUES, None, "refuse", 0.95)


def test_samples_are_as_many_as_unknowns_at_least(rng: np.random.Generator) -> None:
    data = {name: values[:2] for name, values in data_of(rng, 30).items()}
    assert identified_by_torque(model_of(), [data], NAMES, VALUES, 1.0, "refuse", 0.95).degrees_of_freedom == 1
    gap = data | {"q.hinge": np.array([1.0, np.nan])}
    with pytest.raises(UsageError, match="there are 2 samples for 4 unknowns; try: more samples, or fewer unknowns"):
        identified_by_torque(model_of(), [gap], NAMES, VALUES, 1.0, "drop", 0.95)
    with pytest.raises(UsageError, match="parameter of the regressor 'waight'; try: weight"):
        identified_by_torque(model_of(), [data], ["waight"], VALUES, 1.0, "refuse", 0.95)


@pytest.mark.parametrize(
    ("values", "coefficients", "text", "value"),
    [
        ([6.0, 3.0], [-2.0], "k / m", 2.0), ([6.0, 3.0], [2.0], "k m", 18.0), ([6.0, 3.0], [4.0], "k m^2", 54.0),
        ([6.0, 3.0], [-1.0], "k / m^0.5", 6.0 / 3.0**0.5), ([6.0, 3.0], [0.5], "k m^0.25", 6.0 * 3.0**0.25),
    ],
)  # fmt: skip  # a table
def test_products_that_data_determine_are_read_with_their_exponents(
    values: list[float], coefficients: list[float], text: str, value: float
) -> None:
    """Changes of m by dm act as changes of k by c dm: k m^e is determined, e = c m / k."""
    parts = DependentColumns((0,), (1,), np.array([coefficients]))
    told, number = words(parts, 0, ["k", "m"], np.array(values), "product")
    assert (told, number) == (text, pytest.approx(value))
    x, J = np.array(values), np.array([[2.0, 2.0 * coefficients[0]]])
    exponent = coefficients[0] * values[1] / values[0]

    def change(at: np.ndarray) -> float:
        product = (at[0] / x[0]) * (at[1] / x[1]) ** exponent
        return float(abs(2.0 * x[0] * (product - 1.0)))

    assert form_of(parts, 1, x, J, change) == "product"
    assert form_of(parts, 1, x, J, lambda at: float(abs(J[0] @ (at - x)))) == ("product" if exponent == -1.0 else "sum")
    assert form_of(parts, 1, x, J, lambda at: float(abs(J[0] @ (at - x)) + 0.1 * abs(at[1] - x[1]))) == "first order"
    (one,) = combinations_of(parts, ["k", "m"], x, np.array([0.1, np.inf]), 2.0, lambda k: "product")
    assert (one.text, one.form, one.members) == (text, "product", ("k", "m"))
    assert (one.value, one.deviation) == pytest.approx((value, 0.1 * value / values[0]))
    assert (one.low, one.high) == pytest.approx((value - 2.0 * one.deviation, value + 2.0 * one.deviation))
    sums, total = words(parts, 0, ["k", "m"], x, "sum")
    factor = "" if abs(coefficients[0]) == 1.0 else f"{abs(coefficients[0]):g} "
    assert sums == f"k {'-' if coefficients[0] < 0.0 else '+'} {factor}m"
    assert total == pytest.approx(values[0] + coefficients[0] * values[1])


def test_runs_that_fail_on_the_way_are_kept_and_the_last_result_is_repeated() -> None:
    asked: list[float] = []

    def run(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        asked.append(float(x[0]))
        if x[0] < 0.0:
            raise UsageError("no such run", "another")
        return np.array([np.inf if x[0] > 9.0 else x[0]]), np.ones((1, 1))

    predict = Predictions(run)
    assert predict(np.array([1.0])) is not None and predict(np.array([1.0])) is not None and asked == [1.0]
    assert predict(np.array([-1.0])) is None and predict(np.array([10.0])) is None
    assert (predict.runs, predict.failures) == (3, ["no such run", "outputs are not finite numbers"])
    with pytest.raises(UsageError, match="no such run"):
        Predictions(run)(np.array([-1.0]))
    search = LeastSquares(predict, np.zeros(1), np.zeros(1, int), (np.zeros(1), np.ones(1)), None, 9)
    with pytest.raises(NumericalError, match="identify: the run fails: no such run; try: a smaller step"):
        search._values_and_jacobian(np.array([-1.0]))
