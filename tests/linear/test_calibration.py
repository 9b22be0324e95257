"""Calibrated gains: published ones, closed forms, the loop that they close, other parameters, constraints, refusals."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.control import Regulator, lqr
from eomgen.formula.evaluate import evaluate
from eomgen.products.linear import calibration
from eomgen.products.linear.control.second_order import Plant, optimal_modal_gains
from eomgen.scene.scene import Scene
from eomgen.system.terms import PURPOSES
from tests.control.plants import first_order
from tests.linear.by_hand import linear_model

EXAMPLE = Path(__file__).parents[2] / "examples" / "active_quarter_car" / "scene.toml"


def scene_of(joints: dict[str, Any], hold: dict[str, Any], calibration: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return a scene without gravity whose controller ``hold`` is calibrated; each joint moves the body of its name."""
    data = {"format": 1, "name": "held", "gravity": [0, 0, 0], "joints": joints, **more}
    return data | {"controllers": {"hold": {"type": "state_feedback", "calibration": calibration, **hold}}}


def slide(child: str, parent: str = "base", **more: Any) -> dict[str, Any]:
    return {"type": "prismatic", "parent": parent, "child": child, "axis": [1, 0, 0], **more}


def hinge(child: str, parent: str = "base", **more: Any) -> dict[str, Any]:
    return {"type": "revolute", "parent": parent, "child": child, "axis": [0, 1, 0], **more}


CART = scene_of(
    {"rail": slide("cart"), "hinge": hinge("pole", "cart", initial={"position": 0.02})},
    {"coordinates": ["hinge", "rail"], "position_references": {"rail": 0}},
    {
        "method": "lqr",
        "position_weights": {"rail": 10, "hinge": 1},
        "velocity_weights": {"rail": 2},
        "effort_weights": 0.1,
    },
    gravity=[0, 0, -9.81],
    parameters={"length": {"value": 0.6, "tunable": True}},
    bodies={
        "cart": {"mass": 2},
        "pole": {"mass": 0.5, "center_of_mass": [0, 0, "length"], "inertia": [0.02, 0.02, 0.001]},
    },
    efforts={"hold": {"joint": "rail", "effort": "hold"}},
    simulation={"method": "rk4"},
)


def model_of(data: dict[str, Any], **options: Any) -> eomgen.Model:
    return eomgen.build(data, profile="instant", **options)


def optimal(M: Any, C: Any, K: Any, position: list[float], velocity: list[float], effort: float) -> Regulator:
    """Return the regulator of M q'' + C q' + K q = u in the first coordinate."""
    M, C, K = np.array(M), np.array(C), np.array(K)
    plant = Plant(M, C, K, np.eye(len(M))[:, :1], [f"q{k}" for k in range(len(M))])
    return lqr(first_order(plant), [*position, *velocity], [effort])


def upright(length: float) -> Regulator:
    """Return the regulator of the cart and its pole about the upright position, by hand: x and angle, gravity 9.81."""
    m, J = 0.5, 0.02
    M = [[2.0 + m, m * length], [m * length, J + m * length**2]]
    K = [[0.0, 0.0], [0.0, -m * 9.81 * length]]
    return optimal(M, np.zeros((2, 2)), K, [10.0, 1.0], [2.0, 0.0], 0.1)


def gains_of(length: float) -> dict[str, float]:
    names = [f"hold_{kind}_gain_{joint}" for kind in ("position", "velocity") for joint in ("rail", "hinge")]
    return dict(zip(names, upright(length).gains[0].tolist(), strict=True))


@pytest.fixture(scope="module")
def cart() -> eomgen.Model:
    return model_of(CART)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("weights", "digits"),
    [
        ("{ travel = 1e3, deflection = 1e4 }", ("8410.5336", "-911.99654", "-2779.8603", "-609.38533")),
        ("{ travel = 1e2, deflection = 1e5 }", ("13600", "-156.36312", "19350.159", "111.26320")),
    ],
)
def test_published_gains(weights: str, digits: tuple[str, ...]) -> None:
    """The quarter car from its scene, a tension for a force that lifts the body: the signs are turned."""
    text = EXAMPLE.read_text().replace("{ travel = 1e3, deflection = 1e4 }", weights)
    assert weights in text
    model = model_of(tomllib.loads(text), terms=["outputs", "forward_dynamics"])
    for signal, printed in zip(("travel", "body", "deflection", "wheel"), digits, strict=True):
        value = model.parameters[f"ride_gain_{signal}"]
        assert abs(value - float(printed)) <= 0.5 * 10.0 ** -len(printed.partition(".")[2]), (signal, value)


@pytest.mark.slow
def test_gains_are_those_of_the_plant_by_hand_for_any_parameters(cart: eomgen.Model) -> None:
    assert {name: cart.parameters[name] for name in gains_of(0.6)} == pytest.approx(gains_of(0.6), rel=1e-9)
    found = cart.calibrate(parameters={"length": 1.1})
    assert {name: found[name] for name in gains_of(1.1)} == pytest.approx(gains_of(1.1), rel=1e-9)
    assert set(found) == set(cart.parameters) - {"length"}
    assert cart.calibrate() == {name: cart.parameters[name] for name in found}
    assert cart.calibrate(parameters={"length": 1.1, **dict.fromkeys(found, 7.0)}) == found
    decay = f"decays at {-max(upright(0.6).eigenvalues.real):.4g} 1/s"
    assert cart.notes == (
        f"controllers.hold: gains by lqr about the equilibrium; the slowest motion of the closed loop {decay}",
    )
    with pytest.raises(eomgen.UsageError, match="lenght"):
        cart.calibrate(parameters={"lenght": 1.0})


def row_data(asked: dict[str, Any]) -> dict[str, Any]:
    """Return two masses in a row, each with a force of the controller."""
    joints = {
        "one": slide("one", stiffness=90, damping=0.3),
        "two": slide("two", "one", stiffness=40, damping=0.2),
    }
    return scene_of(
        joints,
        {"outputs": ["one", "two"], "coordinates": ["one", "two"]},
        asked,
        bodies={"one": {"mass": 1.5}, "two": {"mass": 2.5}},
        efforts={name: {"joint": name, "effort": f"hold_{name}"} for name in ("one", "two")},
    )


@pytest.mark.slow
def test_one_controller_is_calibrated_with_those_before_it_at_work() -> None:
    feedback = {"type": "state_feedback", "coordinates": ["one", "two"]}
    weights = {"method": "lqr", "velocity_weights": {"one": 30}, "effort_weights": 0.1}
    others = {"method": "lqr", "position_weights": {"two": 500}, "effort_weights": 0.01}
    controllers = {"hold": {**feedback, "calibration": weights}, "later": {**feedback, "calibration": others}}
    efforts = {"one": {"joint": "one", "effort": "hold"}, "two": {"joint": "two", "effort": "later"}}
    model = model_of(row_data({}) | {"controllers": controllers, "efforts": efforts})

    def gains(name: str) -> np.ndarray:
        names = [[f"{name}_{kind}_gain_{joint}" for joint in ("one", "two")] for kind in ("position", "velocity")]
        return np.array([[model.parameters[gain] for gain in row] for row in names])

    M, C, K = np.array([[4.0, 2.5], [2.5, 2.5]]), np.diag([0.3, 0.2]), np.diag([90.0, 40.0])
    hold = optimal(M, C, K, [0.0, 0.0], [30.0, 0.0], 0.1).gains
    np.testing.assert_allclose(gains("hold"), np.split(hold[0], 2), rtol=1e-8, atol=1e-8)
    C[0] += hold[0, 2:]
    K[0] += hold[0, :2]
    turned = slice(None, None, -1)  # the second input acts in the second coordinate
    later = optimal(M[turned, turned], C[turned, turned], K[turned, turned], [500.0, 0.0], [0.0, 0.0], 0.01).gains
    np.testing.assert_allclose(gains("later"), np.split(later[0, [1, 0, 3, 2]], 2), rtol=1e-8, atol=1e-8)


@pytest.mark.slow
def test_references_are_where_the_controller_rests() -> None:
    """A hanging load: the spring is stretched, and the controller gives nothing there."""
    model = model_of(
        scene_of(
            {"rope": slide("load", axis=[0, 0, 1], stiffness=200)},
            {"coordinates": ["rope"], "signals": {"above": "2 * q.rope + 1"}},
            {"method": "lqr", "effort_weights": 0.01, "position_weights": {"rope": 100}},
            gravity=[0, 0, -9.81],
            bodies={"load": {"mass": 3}},
            efforts={"hold": {"joint": "rope", "effort": "hold"}},
            outputs={"hold": {"formula": "hold"}},
            simulation={"start": "equilibrium"},
        )
    )
    sag = -3 * 9.81 / 200
    assert model.parameters["hold_position_reference_rope"] == pytest.approx(sag)
    assert model.parameters["hold_reference_above"] == pytest.approx(2 * sag + 1)
    run = model.simulate(1.0, 1e-2)
    assert np.abs(run.outputs["hold"]).max() < 1e-9 and np.abs(run.q - sag).max() < 1e-9


@pytest.mark.slow
def test_a_steady_motion_may_be_where_it_is_calibrated() -> None:
    """A governor's arm that turns at constant speed: at = "initial", with the rate of turning among the signals."""

    def wheel(signals: dict[str, str], **weights: Any) -> eomgen.Model:
        calibration = {
            "method": "lqr",
            "at": "initial",
            "effort_weights": 0.25,
            "velocity_weights": {"axle": 4},
            **weights,
        }
        axle = hinge("wheel", axis=[0, 0, 1], initial={"velocity": 20})
        bodies = {"wheel": {"mass": 1, "inertia": [0.5, 0.5, 0.5]}}
        efforts = {"speed": {"joint": "axle", "effort": "hold"}}
        return model_of(scene_of({"axle": axle}, {"signals": signals}, calibration, bodies=bodies, efforts=efforts))

    with pytest.raises(eomgen.ModelError, match="the mode of axle at 0 Hz, which nothing holds, has zero weight"):
        wheel({"rate": "v.axle"})
    model = wheel({"rate": "v.axle", "angle": "q.axle - 20 * t"}, position_weights={"axle": 1})
    angle, rate = optimal([[0.5]], [[0.0]], [[0.0]], [1.0], [4.0], 0.25).gains[0]
    assert model.parameters["hold_gain_rate"] == pytest.approx(rate, rel=1e-9)
    assert model.parameters["hold_gain_angle"] == pytest.approx(angle, rel=1e-9)
    assert model.parameters["hold_reference_rate"] == 20.0


def mast(modes: list[int]) -> eomgen.Model:
    return model_of(
        scene_of(
            {"foot": {"type": "fixed", "parent": "base", "child": "mast"}},
            {"signals": {f"b{k}{rate}": f"{v}.mast[{k}]" for v, rate in (("q", ""), ("v", "_rate")) for k in (0, 1)}},
            {"method": "pole_placement", "modes": modes, "damping_ratios": 0.3},
            beams={"mast": {"length": 2, "mass_per_length": 1.5, "bending_y": {"modes": 2, "stiffness": 100}}},
            forces={"push": {"body": "mast", "point": [1.2, 0, 0], "force": [0, "hold", 0]}},
        )
    )


@pytest.mark.slow
def test_a_mode_that_is_left_without_damping_is_named() -> None:
    """Spillover shakes the second mode of a cantilever and cannot damp it; without coupling its shape is its
    coordinate."""
    model = mast([1])
    assert model.notes[0].endswith("; the closed loop does not decay: mast[1]")
    first = (1.875104068711961 / 2.0) ** 2 * np.sqrt(100.0 / 1.5)  # of Euler and Bernoulli's cantilever
    values = np.linalg.eigvals(model.linearize().state_space().A)
    assert np.abs(values - first * (-0.3 + 1j * np.sqrt(1.0 - 0.09))).min() < 1e-8 * first
    with pytest.raises(eomgen.ModelError, match="the modes 1, 2 cannot be placed each by itself"):
        mast([1, 2])


@pytest.mark.slow
def test_internal_states_are_part_of_what_is_fed_back() -> None:
    """A cart behind a motor with a lag: gains of the whole state from the Hamiltonian matrix, by hand."""

    def lagging(**calibration: Any) -> eomgen.Model:
        return model_of(
            scene_of(
                {"rail": slide("cart", stiffness=3, damping=0.4)},
                {"coordinates": ["rail"], "signals": {"motor": "motor"}},
                calibration,
                states={"motor": {"rate": "(hold - motor) / 0.2"}},
                bodies={"cart": {"mass": 2}},
                efforts={"hold": {"joint": "rail", "effort": "motor"}},
            )
        )

    A, B = np.array([[0.0, 1.0, 0.0], [-1.5, -0.2, 0.5], [0.0, 0.0, -5.0]]), np.array([[0.0], [0.0], [5.0]])
    _, vectors = np.linalg.eig(np.block([[A, -B @ B.T / 0.1], [-np.diag([40.0, 0.0, 0.5]), -A.T]]))
    values = np.linalg.eigvals(np.block([[A, -B @ B.T / 0.1], [-np.diag([40.0, 0.0, 0.5]), -A.T]]))
    stable = vectors[:, values.real < 0.0]
    P = np.real(stable[3:] @ np.linalg.inv(stable[:3]))
    weights = {"position_weights": {"rail": 40}, "signal_weights": {"motor": 0.5}}
    model = lagging(method="lqr", effort_weights=0.1, **weights)
    names = ("hold_position_gain_rail", "hold_velocity_gain_rail", "hold_gain_motor")
    np.testing.assert_allclose([model.parameters[name] for name in names], (B.T @ P / 0.1)[0], rtol=1e-9)
    assert "equilibrium; the slowest motion of the closed loop decays at" in model.notes[0]
    placed = lagging(method="pole_placement", poles=[[-2, 1], [-2, -1], [-6, 0]])
    G = np.array([[placed.parameters[name] for name in names]])
    np.testing.assert_allclose(np.poly(A - B @ G), np.poly([-2 + 1j, -2 - 1j, -6]).real, rtol=1e-8)


# -- linear models by hand, without a scene that is built --------------------------------------------------------------


def builder_of(M: Any, C: Any, K: Any, joints: tuple[str, ...], B: Any, **changes: Any) -> Any:
    """Return the function that makes a model of an opened scene: linear about rest at q = 0, outputs by formulas."""
    still = np.zeros(len(M))

    def build(opened: Scene, terms: list[str]) -> Any:
        assert terms == [*PURPOSES["linearization"], "outputs"] and not opened.feedback

        def outputs(q: Any, v: Any) -> np.ndarray:
            known = {kind: dict(zip(joints, values, strict=True)) for kind, values in (("q", q), ("v", v))}
            formulas = [formula for output in opened.outputs for formula in output.values]
            return np.array([evaluate(formula, lambda symbol: known[symbol.kind][symbol.name]) for formula in formulas])

        rest, units = outputs(still, still), np.eye(len(M))
        rows = np.array([[outputs(unit, still), outputs(still, unit)] for unit in units]) - rest
        named = {f"y{k}": {"q": rows[:, 0, k], "v": rows[:, 1, k]} for k in range(len(rest))}
        inputs = dict(zip([item.name for item in opened.inputs], np.transpose(B), strict=True))
        linear = linear_model(M, C, K, joints, inputs, outputs=named, **changes)
        return SimpleNamespace(
            equilibrium=lambda **_: SimpleNamespace(base=None, warnings=lambda **_: ["it is in doubt"]),
            linearize=lambda **_: linear,
            evaluate=lambda *_, **__: {"outputs": rest},
        )

    return build


def gains_by_hand(data: dict[str, Any], *plant: Any, **changes: Any) -> tuple[dict[str, float], str]:
    """Return the calibrated parameters of a scene and the note."""
    found, (note,) = calibration.gains(eomgen.load(data), {}, builder_of(*plant, **changes))
    return found, note


def rows_of(found: dict[str, float], kind: str) -> np.ndarray:
    return np.array(
        [[found[f"hold_{row}_{kind}_gain_{column}"] for column in ("one", "two")] for row in ("one", "two")]
    )


def test_gains_of_signals_are_those_of_the_state() -> None:
    """The pole on a cart upright; signals are in another order than coordinates."""
    m, J, length = 0.5, 0.02, 0.6
    M = [[2.0 + m, m * length], [m * length, J + m * length**2]]
    K = [[0.0, 0.0], [0.0, -m * 9.81 * length]]
    found, note = gains_by_hand(CART, M, np.zeros((2, 2)), K, ("rail", "hinge"), [[1.0], [0.0]])
    assert {name: found[name] for name in gains_of(length)} == pytest.approx(gains_of(length), rel=1e-9)
    assert all(found[name] == float(f"{found[name]:.12g}") for name in found)
    decay = f"decays at {-max(upright(length).eigenvalues.real):.4g} 1/s"
    said = f"about the equilibrium; the slowest motion of the closed loop {decay}; it is in doubt"
    assert note == f"controllers.hold: gains by lqr {said}"
    with pytest.raises(eomgen.ModelError, match=r"is not in balance: it accelerates with 2e-06 m/s\^2 or rad/s\^2"):
        gains_by_hand(CART, M, np.zeros((2, 2)), K, ("rail", "hinge"), [[1.0], [0.0]], a=np.array([0.0, -2e-6]))


#: Mass matrix of two masses in a row, of which the second coordinate is relative, and damping by the inertia.
ROW, STIFF = np.array([[4.0, 2.5], [2.5, 2.5]]), np.diag([90.0, 40.0])
DAMPED = 0.08 * ROW


def shapes_of(M: Any, K: Any) -> tuple[np.ndarray, np.ndarray]:
    half = np.linalg.inv(np.linalg.cholesky(M))
    squares, shapes = np.linalg.eigh(half @ K @ half.T)
    return squares, half.T @ shapes


def row_of_masses(asked: dict[str, Any], C: Any = DAMPED) -> tuple[np.ndarray, np.ndarray, np.ndarray, str]:
    """Return G_p, G_v, the eigenvalues of the closed loop and the note."""
    found, note = gains_by_hand(row_data(asked), ROW, C, STIFF, ("one", "two"), np.eye(2))
    G_p, G_v = (rows_of(found, kind) for kind in ("position", "velocity"))
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(ROW, np.hstack([STIFF + G_p, C + G_v]))]])
    return G_p, G_v, np.linalg.eigvals(A), note


def test_modal_gains_of_a_scene_are_those_of_its_modes() -> None:
    G_p, G_v, _, note = row_of_masses({"method": "imsc", "effort_weights": [1e-3, 1e-2]})
    squares, shapes = shapes_of(ROW, STIFF)
    g, h = optimal_modal_gains(np.sqrt(squares), [0.08, 0.08], [1e-3, 1e-2])
    np.testing.assert_allclose(shapes.T @ G_p @ shapes, np.diag(g), rtol=0.0, atol=1e-8 * g.max())
    np.testing.assert_allclose(shapes.T @ G_v @ shapes, np.diag(h), rtol=0.0, atol=1e-8 * h.max())
    assert "hold: gains by imsc about the equilibrium; modes 1, 2, spillover 0; the slowest motion of the" in note


@pytest.mark.parametrize(
    ("asked", "poles"),
    [
        ({"frequencies": [9, "120 rpm"], "damping_ratios": [0.5, 0.1]}, [(9.0, 0.5), (4.0 * np.pi, 0.1)]),
        ({"damping_ratios": 0.3}, [(float(np.sqrt(square)), 0.3) for square in shapes_of(ROW, STIFF)[0]]),
        ({"poles": [[-1, 2], [-1, -2], [-5, 0], [-6, 0]]}, [(5.0**0.5, 0.2**0.5), (5.0, 1.0), (6.0, 1.0)]),
    ],
    ids=["frequencies", "damping", "poles"],
)  # fmt: skip  # a table
def test_placed_gains_of_a_scene_have_the_poles_asked_for(
    asked: dict[str, Any], poles: list[tuple[float, float]]
) -> None:
    *_, values, note = row_of_masses({"method": "pole_placement", **asked})
    for w, zeta in poles:
        assert np.abs(values - w * (-zeta + np.sqrt(complex(zeta**2 - 1.0)))).min() < 1e-8 * w
    slowest = min(w * zeta for w, zeta in poles)
    assert note.endswith(f"the slowest motion of the closed loop decays at {slowest:.4g} 1/s; it is in doubt")
    assert "damping couples" not in note


def test_damping_that_couples_modes_moves_the_placed_ones() -> None:
    *_, values, note = row_of_masses({"method": "pole_placement", "damping_ratios": [0.5, 0.1]}, np.diag([0.3, 12.0]))
    said = re.findall(r"mode (\d) gets (\S+) rad/s with a damping ratio of (\S+), not (\S+) with (\S+?)[,;]", note)
    squares = shapes_of(ROW, STIFF)[0]
    assert note.count("damping couples the modes: ") == 1 and [number for number, *_ in said] == ["1", "2"]
    for number, size, ratio, wanted, asked in said:
        w, zeta = float(size), float(ratio)
        assert float(wanted) == pytest.approx(np.sqrt(squares[int(number) - 1]), rel=1e-3)
        assert float(asked) == [0.5, 0.1][int(number) - 1]
        assert np.abs(values - w * (-zeta + 1j * np.sqrt(1.0 - zeta**2))).min() < 5e-3 * w


@pytest.mark.parametrize(
    ("damping", "said"),
    [
        ([0.4, 3.0], "the slowest motion of the closed loop decays at 0.2 1/s"),
        ([3.0, -0.5], "the closed loop grows at 0.25 1/s: two"),
        ([3.0, 0.0], "the closed loop does not decay: two"),
    ],
)
def test_the_slowest_motion_of_a_loop_is_told(damping: list[float], said: str) -> None:
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.diag([4.0, 90.0]), -np.diag(damping)]])
    assert calibration.slowest_motion(A, ["one", "two"], np.ones(2)) == said


def test_signals_that_do_not_determine_the_feedback_are_refused(rng: np.random.Generator) -> None:
    """Gains of other signals give the same feedback, if the signals determine the state that is fed back."""
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-STIFF, -DAMPED]])
    names = ("one", "two", "v.one", "v.two")
    space: Any = SimpleNamespace(A=A, states=names)
    item: Any = SimpleNamespace(name="hold", labels=("a", "b", "c", "d"))
    G, Y, none = rng.normal(size=(2, 4)), rng.normal(size=(4, 4)), np.zeros((4, 2))
    np.testing.assert_allclose(calibration._by_signals(space, item, G, Y, none) @ Y, G, atol=1e-12)
    G[:, 3] = 0.0  # the last state is not fed back, nor measured
    Y = np.vstack([np.diag([2.0, 0.5, 4.0, 0.0])[:3], [[1.0, 1.0, 0.0, 0.0]]])
    found = calibration._by_signals(space, item, G, Y, none)
    np.testing.assert_allclose(found @ Y, G, atol=1e-12)
    assert calibration._by_signals(space, item, G, np.diag([1.0, 1.0, 1.0, 0.0]), none)[:, 3].tolist() == [0.0, 0.0]
    for lost, name in enumerate(names[:3]):
        left = np.delete(np.eye(4), lost, axis=0)
        said = f"needs {name if '.' in name else f'q.{name}'}, which the coordinates and signals of hold do not"
        with pytest.raises(eomgen.ModelError, match=re.escape(said)):
            calibration._by_signals(space, item, G, left, none[:3])
    direct = none.copy()
    direct[2, 1] = 1e-3
    with pytest.raises(eomgen.ModelError, match="the signal c depends on the controller's output at the same instant"):
        calibration._by_signals(space, item, G, Y, direct)
