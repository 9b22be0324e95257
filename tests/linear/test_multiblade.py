"""Multiblade coordinates against the characteristic equation of ground resonance, Floquet multipliers of the periodic
model, and the transformation written out."""

from __future__ import annotations

import json
import math
import warnings
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.polynomial import Polynomial
from scipy.optimize import linear_sum_assignment

import eomgen
from eomgen.cli import main
from eomgen.errors import EomgenError
from eomgen.products.linear.multiblade import Basis, Rotor
from tests.models.toml_text import toml_text

SUPPORT, BLADE, INERTIA, ARM, HINGE, STIFFNESS, LAG = 10.0, 1.0, 0.05, 1.0, 0.15, 120.0, 2.0
GROUP = ("lag_1", "lag_2", "lag_3")


def scene_of(count: int, *, wake: bool = False) -> dict[str, Any]:
    """Return a rotor with blades on lag hinges about z, on a support that moves sideways; with ``wake`` moments on the
    hinges follow the lag with a delay, and inputs act on the hinges."""
    scene: dict[str, Any] = {
        "format": 1, "name": f"rotor_{count}", "gravity": [0, 0, 0],
        "parameters": {
            name: {"value": value, "unit": unit, "tunable": True}
            for name, value, unit in (
                ("speed", 3.0, "rad/s"), ("along_x", STIFFNESS, "N/m"), ("along_y", STIFFNESS, "N/m"),
                ("damping", 0.3, "N s/m"), ("lag_damping", 0.05, "N m s/rad"), ("uneven", 0.0, "N m/rad"),
            )
        },
        "bodies": {"carrier": {"mass": 0}, "support": {"mass": SUPPORT}, "hub": {"mass": 0}},
        "joints": {
            "x": {"type": "prismatic", "parent": "base", "child": "carrier", "axis": [1, 0, 0],
                  "stiffness": "along_x", "damping": "damping"},
            "y": {"type": "prismatic", "parent": "carrier", "child": "support", "axis": [0, 1, 0],
                  "stiffness": "along_y", "damping": "damping"},
            "shaft": {"type": "revolute", "parent": "support", "child": "hub", "axis": [0, 0, 1],
                      "drive": "speed * t"},
        },
    }  # fmt: skip  # tables
    for k in range(1, count + 1):
        angle = 2.0 * math.pi * (k - 1) / count
        inertia = [0.6 * INERTIA, INERTIA, INERTIA]
        scene["bodies"][f"blade_{k}"] = {"mass": BLADE, "center_of_mass": [ARM, 0, 0], "inertia": inertia}
        scene["joints"][f"lag_{k}"] = {
            "type": "revolute", "parent": "hub", "child": f"blade_{k}", "axis": [0, 0, 1],
            "position": [HINGE * math.cos(angle), HINGE * math.sin(angle), 0.0],
            "rotation": [{"axis": [0, 0, 1], "angle": angle}],
            "stiffness": LAG if k > 1 else f"{LAG} + uneven", "damping": "lag_damping",
        }  # fmt: skip  # a table
        if wake:
            scene.setdefault("inputs", {})[f"moment_{k}"] = {"unit": "N m"}
            scene.setdefault("states", {})[f"wake_{k}"] = {"rate": f"(q.lag_{k} - wake_{k}) / 0.4"}
            effort = {"joint": f"lag_{k}", "effort": f"moment_{k} - 0.8 * wake_{k}"}
            scene.setdefault("efforts", {})[f"wake_{k}"] = effort
    return scene


@cache
def rotor(count: int = 3, *, wake: bool = False) -> eomgen.Model:
    return eomgen.build(scene_of(count, wake=wake), profile="instant")


def blades(count: int, name: str = "lag") -> tuple[str, ...]:
    return tuple(f"{name}_{k}" for k in range(1, count + 1))


def ground_resonance(count: int, speed: float, damping: float = 0.3, lag_damping: float = 0.05) -> Any:
    """Return eigenvalues of forward and backward motions, as of an observer on an isotropic support.

    With z = x + i y of the hub and eta = (2 / N) sum over blades of lag exp(i psi_k), Lagrange's equations of small
    motions are, for N > 2 (Coleman and Feingold 1958, NACA Report 1351),

        (M + N m) z'' + c z' + K z + i (N / 2) S eta'' = 0
        I (eta'' - 2 i W eta' - W^2 eta) + d (eta' - i W eta) + (k + W^2 e S) eta - i S z'' = 0
    """
    mass, inertia, moment = SUPPORT + count * BLADE, INERTIA + BLADE * ARM**2, BLADE * ARM
    w = Polynomial([0.0, 1.0])  # exp(i w t)
    hub = STIFFNESS + 1j * damping * w - mass * w**2
    lag = LAG + speed**2 * HINGE * moment + 1j * lag_damping * (w - speed) - inertia * (w - speed) ** 2
    return 1j * (hub * lag - count / 2.0 * moment**2 * w**4).roots()


def distance(first: Any, second: Any) -> float:
    """Return the largest distance of complex numbers from their partners."""
    off = np.abs(np.asarray(first)[:, np.newaxis] - np.asarray(second))
    return float(np.max(off[linear_sum_assignment(off)]))


@pytest.mark.parametrize(("count", "speed"), [(3, 1.0), (3, 5.0), (4, 3.0), (5, 8.0)])
def test_the_eigenvalues_are_roots_of_the_equation_of_ground_resonance(count: int, speed: float) -> None:
    lin = rotor(count).linearize(at="steady", parameters={"speed": speed}, multiblade={"shaft": blades(count)})
    expected = ground_resonance(count, speed)
    eigenvalues = np.linalg.eigvals(lin.state_space().A)
    assert max(np.min(np.abs(eigenvalues - value)) for value in expected) < 1e-12
    assert lin.modes().stability == ("unstable" if speed == 5.0 else "stable")
    assert lin.multiblade is not None and lin.multiblade.variation < 1e-12
    own = ["cosine2", "sine2"] if count == 5 else ["differential"] if count == 4 else []
    assert lin.coordinates == ("x", "y", *(f"lag.{kind}" for kind in ("collective", "cosine", "sine", *own)))
    # the hub does not feel them: the oscillation of a single blade, as an observer who turns and one who stands see it
    inertia = INERTIA + BLADE * ARM**2
    alone = -0.025 / inertia + 1j * math.sqrt((LAG + speed**2 * HINGE * BLADE) / inertia - (0.025 / inertia) ** 2)
    shifts = [0.0, 2.0 * speed, -2.0 * speed] if count == 5 else [0.0]
    assert max(np.min(np.abs(eigenvalues - alone - 1j * shift)) for shift in shifts) < 1e-12


@pytest.mark.slow
@pytest.mark.long_cases("3-True-60.0")
@pytest.mark.parametrize(("count", "wake", "along_y"), [(3, True, 60.0), (4, False, 90.0)])
def test_the_multipliers_of_the_periodic_model_belong_to_the_eigenvalues(
    count: int, wake: bool, along_y: float
) -> None:
    """On a support that is stiffer along x; with internal states of the blades, too."""
    model, given = rotor(count, wake=wake), {"along_y": along_y, "speed": 2.6}
    groups = [blades(count), *([blades(count, "wake"), blades(count, "moment")] if wake else [])]
    inputs = dict.fromkeys(blades(count, "moment"), 0.0) if wake else None
    lin = model.linearize(parameters=given, multiblade={"shaft": groups}, u=inputs)
    period = 2.0 * math.pi / 2.6
    periodic = model.floquet(period, parameters=given, tolerance=1e-10, inputs=inputs)
    assert distance(np.exp(np.linalg.eigvals(lin.state_space().A) * period), periodic.multipliers) < 1e-9


def test_the_matrices_are_the_transformed_matrices_of_the_second_order() -> None:
    model, given = rotor(), {"along_y": 60.0, "speed": 2.6}
    with pytest.warns(RuntimeWarning, match="holds at this instant only; try: multiblade for three or more"):
        fixed = model.linearize(parameters=given)
    lin = model.linearize(parameters=given, multiblade={"shaft": [GROUP]})
    psi = 2.0 * math.pi * np.arange(3) / 3.0
    X, X1, X2 = np.eye(5), np.zeros((5, 5)), np.zeros((5, 5))
    X[2:, 2:] = np.array([np.ones(3), np.cos(psi), np.sin(psi)]).T
    X1[2:, 2:] = 2.6 * np.array([np.zeros(3), -np.sin(psi), np.cos(psi)]).T
    X2[2:, 2:] = 2.6**2 * np.array([np.zeros(3), -np.cos(psi), -np.sin(psi)]).T
    assert fixed.coordinates == ("x", "y", *GROUP)
    np.testing.assert_allclose(lin.M0, X.T @ fixed.M0 @ X, atol=1e-13)
    np.testing.assert_allclose(lin.C0, X.T @ (fixed.C0 @ X + 2.0 * fixed.M0 @ X1), atol=1e-13)
    np.testing.assert_allclose(lin.K0, X.T @ (fixed.K0 @ X + fixed.C0 @ X1 + fixed.M0 @ X2), atol=1e-12)
    later = model.linearize(parameters=given, t=0.41, multiblade={"shaft": GROUP})
    for name in ("M0", "C0", "K0"):
        np.testing.assert_allclose(getattr(later, name), getattr(lin, name), atol=1e-11)


@pytest.mark.slow
def test_a_cyclic_moment_moves_the_support_as_the_equations_say() -> None:
    """Inputs of blades are cosine and sine inputs; by the equations of ``ground_resonance`` with moments."""
    model, given = rotor(wake=True), {"speed": 2.6}
    groups = [GROUP, blades(3, "wake"), blades(3, "moment")]
    u = dict.fromkeys(blades(3, "moment"), 0.0)
    lin = model.linearize(parameters=given, multiblade={"shaft": groups}, u=u)
    space = lin.state_space()
    assert space.inputs == ("moment.collective", "moment.cosine", "moment.sine")
    assert space.states[-3:] == ("z.wake.collective", "z.wake.cosine", "z.wake.sine")
    for w in (1.9, -1.9):
        mass, inertia, moment = SUPPORT + 3.0 * BLADE, INERTIA + BLADE * ARM**2, BLADE * ARM
        lag = LAG + 2.6**2 * HINGE * moment + 1j * 0.05 * (w - 2.6) - inertia * (w - 2.6) ** 2
        lag += 0.8 / (1.0 + 0.4j * (w - 2.6))
        system = np.array([[STIFFNESS + 0.3j * w - mass * w**2, -1.5j * moment * w**2], [1j * moment * w**2, lag]])
        z, _ = np.linalg.solve(system, [0.0, 1.0])
        # a moment of cos w t and sin w t on the cosine and the sine coordinate turns with w
        of_cosine, of_sine = (lin.frequency_response(abs(w), f"moment.{kind}", "x") for kind in ("cosine", "sine"))
        x = of_cosine - 1j * math.copysign(1.0, w) * of_sine
        assert x == pytest.approx(z if w > 0.0 else np.conj(z), abs=1e-13)


@pytest.mark.slow
def test_signals_of_single_blades_in_no_group_are_named() -> None:
    """Signals of the support and signals in groups are the same at all azimuths; a diagram needs no signals."""
    scene = scene_of(3)
    scene["inputs"] = {"push": {"unit": "N"}, **{name: {"unit": "N m"} for name in blades(3, "moment")}}
    scene["efforts"] = {f"pull_{k}": {"joint": f"lag_{k}", "effort": f"moment_{k}"} for k in (1, 2, 3)}
    scene["efforts"]["push"] = {"joint": "x", "effort": "push"}
    scene["outputs"] = {"tip_2": {"formula": "q.lag_2"}, "sway": {"formula": "q.x + 2 * q.y"}}
    model, u = eomgen.build(scene, profile="instant"), dict.fromkeys(("push", *blades(3, "moment")), 0.0)
    text = (
        r"the output tip_2 and the inputs moment_1, moment_2, moment_3 in no group of multiblade hold at one azimuth of"
        r" shaft, since their rows of the linear model turn; try: equal signals of all blades as a group"
    )
    with pytest.warns(RuntimeWarning, match=text):
        model.linearize(multiblade={"shaft": GROUP}, u=u)
    with pytest.warns(RuntimeWarning, match="^the output tip_2 in no group"):
        model.linearize(multiblade={"shaft": [GROUP, blades(3, "moment")]}, u=u)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.campbell("speed", [1.0, 1.5], u=u, multiblade={"shaft": [GROUP]})


@pytest.mark.slow
def test_a_campbell_diagram_has_the_frequencies_of_an_observer_and_the_sense_of_whirl() -> None:
    model = rotor()
    diagram = model.campbell("speed", np.linspace(0.5, 4.0, 4), orders=(1,), multiblade={"shaft": [GROUP]})
    shares, senses = [], []  # (n, modes): circular part of the motion, and sense, by the polynomial
    for speed, eigenvalues in zip(diagram.values, diagram.eigenvalues, strict=True):
        roots = ground_resonance(3, speed)
        w = roots / 1j
        mass, moment = SUPPORT + 3.0 * BLADE, 1.5 * BLADE * ARM
        of_blades = np.abs(STIFFNESS + 0.3j * w - mass * w**2) / np.abs(moment * w**2)
        ratio = of_blades**2 * 1.5 * (INERTIA + BLADE * ARM**2) / mass
        off = np.abs(np.stack([eigenvalues[:, np.newaxis] - roots, eigenvalues.conj()[:, np.newaxis] - roots]))
        turning = np.min(off, axis=(0, 2)) < 1e-9  # the collective mode is none of the polynomial
        assert np.sum(turning) == 4
        nearest = np.argmin(np.min(off, axis=0), axis=1)
        shares.append(np.where(turning, (ratio / (1.0 + ratio))[nearest], 0.0))
        forward = np.min(off[0], axis=1) < np.min(off[1], axis=1)
        senses.append(np.where(forward, 1, -1) * turning)
    # the sense belongs to a mode at all speeds or at none: the support has no sense of its own
    expected = np.where(np.mean(shares, axis=0) > 0.1, senses, 0)
    np.testing.assert_array_equal(diagram.whirl, expected)
    assert np.sum(np.any(expected, axis=0)) == np.sum(np.all(expected, axis=0)) == 3
    assert np.min(np.max(shares, axis=0)[1:]) < 0.1 < np.max(np.min(shares, axis=0))
    assert diagram.crossings
    for crossing in diagram.crossings:
        assert crossing.frequency == pytest.approx(crossing.order * crossing.speed, rel=1e-10)
    (axis,) = diagram.plot(Figure().subplots())
    assert {line.get_label() for line in axis.get_lines()} >= {"forward", "backward"}


def refusal(groups: Any, **given: Any) -> str:
    with pytest.raises(EomgenError) as caught, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rotor().linearize(multiblade=groups, **given)
    return str(caught.value)


@pytest.mark.parametrize(
    ("groups", "text"),
    [
        ([GROUP], "is not a mapping of rotors to blades; try: {\"spin\": [(\"flap_1\", \"flap_2\", \"flap_3\")]}"),
        ({"shaft": [GROUP, "lag_1"]}, "'lag_1'] is not a list of blades"),
        ({"shaft": GROUP[:2]}, "multiblade: lag_1, lag_2 are 2 blades, and multiblade coordinates need"),
        ({"shaft": ("lag_1", "lag_2", "lag_4")}, "there is no coordinate, state, input or output 'lag_4'; try: lag_"),
        ({"shaft": ("lag_1", "lag_2", "lag_2")}, "multiblade: 'lag_2' is named twice; try: each name once"),
        ({"shft": GROUP}, "'shft' is not the angle of a joint by which a rotor turns; try: shaft"),
        ({"shaft": GROUP[::-1]}, "the blades are named against the order of their azimuths"),
    ],
)  # fmt: skip  # a table
def test_what_cannot_be_multiblade_coordinates(groups: Any, text: str) -> None:
    assert text in refusal(groups)


def test_a_model_that_changes_with_the_azimuth_in_any_coordinates_is_refused() -> None:
    said = refusal({"shaft": GROUP}, parameters={"uneven": 0.02})
    assert "model error: multiblade: the linear model changes with the azimuth in multiblade" in said
    assert said.endswith(
        "; try: all coordinates of all blades, if these are equal; or model.floquet(2.0944), in Python"
    )
    said = refusal({"shaft": GROUP}, at="initial", initial={"lag_1": 0.1})
    assert "velocities of the initial state change, and multiblade coordinates need a steady motion; try: at=" in said


@pytest.mark.slow
def test_the_command_has_blades_by_rotor(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    scene = scene_of(3)
    del scene["joints"]["shaft"]["drive"], scene["parameters"]["speed"]
    for name in ("damping", "lag_damping"):
        scene["parameters"][name]["value"] = 0.0
    Path("rotor.toml").write_text(toml_text(scene), encoding="utf-8")
    asked = ["linearize", "rotor.toml", "--at", "steady", "--velocity", "shaft=3"]
    own = ["--multiblade", "shaft: lag_1, lag_2, lag_3"]
    assert main([*asked, *own, "--campbell", "shaft=1:4:4", "--json", "--out", "out"]) == 0
    shown = capsys.readouterr()
    data = json.loads(shown.out)
    assert data["multiblade"]["rotors"] == {"shaft": [list(GROUP)]} and data["multiblade"]["variation"] < 1e-12
    assert data["coordinates"][3:] == ["lag.collective", "lag.cosine", "lag.sine"]
    assert "\nin multiblade coordinates about shaft at 3 rad/s, over azimuths constant but for " in shown.err
    expected = np.abs(ground_resonance(3, 3.0, 0.0, 0.0).imag)
    found = [mode["angular_frequency"] for mode in data["modes"]]
    assert max(np.min(np.abs(np.array(found) - value)) for value in expected) < 1e-9
    assert data["campbell"] and (Path("out") / "campbell.png").is_file()
    assert main([*asked, *own]) == 0
    assert "lag.cosine" in capsys.readouterr().out
    assert main(["linearize", "rotor.toml", "--at", "0.1", *own]) == 2
    assert "need a steady motion, and --at names a time of a run; try: --at steady" in capsys.readouterr().err


# -- the transformation ------------------------------------------------------------------------------------------------


def test_blades_of_unlike_parts_are_refused() -> None:
    rotor_of = [Rotor("spin", 1.0, 0.0, (("a", "b", "c"),))]
    for names, said in (
        (["a[0]", "a[1]", "b[0]", "b[1]", "c[0]"], r"there is a\[1\], and no c\[1\]"),
        (["a[0]", "b[0]", "b[1]", "c[0]"], r"there is b\[1\], and no a\[1\]"),
    ):
        with pytest.raises(EomgenError, match=said):
            Basis.of(names, rotor_of)
