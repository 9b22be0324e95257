"""Words of ``eomgen linearize`` and ``eomgen equilibrium``: options as they are read, and tables of modes, of matrices
that are given here."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.products.linear import command as linearize
from eomgen.products.linear.campbell_plot import Campbell, Crossing
from eomgen.products.linear.command import CampbellRequest
from eomgen.products.linear.modes import Modes, modes, table_row
from eomgen.products.linear.spectra import RideTable
from eomgen.products.statics import command
from tests.linear.by_hand import linear_model


def of(A: list[list[float]], names: tuple[str, ...] = ("x", "y"), at_rest: bool = True, t: float = 0.5) -> Any:
    """Return a linear model with the first states as coordinates."""
    matrix = np.array(A)
    found = modes(matrix, np.eye(len(names), len(matrix)), names, np.ones(len(names)))
    a = np.zeros(2) if at_rest else np.array([0.0, 1.1e-9])
    return SimpleNamespace(modes=lambda: found, reference=SimpleNamespace(what="equilibrium", t=t, a=a))


#: x oscillates with 3 rad/s and decays with 0.2 1/s; y decays alone.
DECAYS = [[0.0, 0.0, 1.0], [0.0, -5.0, 0.0], [-9.0, 0.0, -0.4]]


def test_the_table_of_modes_has_frequencies_in_hertz_and_shapes(capsys: pytest.CaptureFixture[str]) -> None:
    linearize._print(cast(Any, of(DECAYS)), "rig")
    shown = capsys.readouterr()
    lines = [line.split() for line in shown.out.splitlines()]
    assert shown.out.splitlines()[0].rstrip() == "rig about the equilibrium at t = 0.5 s"
    damped = math.sqrt(9.0 - 0.04)
    assert lines[2] == f"1 {3.0 / (2.0 * math.pi):.9g} {0.2 / 3.0:.6g} -0.2 ± {damped:.9g}j x 1".split()
    assert lines[3] == ["2", "1", "-5", "y", "1"]
    assert shown.err == ""


def test_modes_beyond_forty_are_counted(capsys: pytest.CaptureFixture[str]) -> None:
    size = 45
    A = np.diag(-np.arange(1.0, size + 1.0))
    A[-2:, -2:] = [[-0.1, 200.0], [-200.0, -0.1]]
    linearize._print(cast(Any, of(A.tolist(), tuple(f"q{k}" for k in range(size)))), "rig")
    shown = capsys.readouterr()
    assert len(shown.out.splitlines()) == 42
    assert shown.err == "4 more with --json: 0 that oscillate, 4 that do not\n"


@pytest.mark.parametrize(("ratio", "text"), [(0.99e-9, "0"), (-0.99e-9, "0"), (1.1e-9, "1.1e-09"), (0.25, "0.25")])
def test_damping_below_a_billionth_is_none(ratio: float, text: str) -> None:
    assert table_row(shown([1.0], -ratio, ratio), 0)[2] == text


@pytest.mark.parametrize(("real", "text"), [(-0.049, "0"), (0.049, "0"), (-0.051, "-0.051"), (-2.0, "-2")])
def test_real_parts_within_the_uncertainty_are_zero(real: float, text: str) -> None:
    assert table_row(shown([3.0], real), 0)[3] == f"{text} ± 3j"
    assert table_row(shown([0.0], real), 0)[3] == text


@pytest.mark.parametrize(
    ("A", "at_rest", "said"),
    [
        (DECAYS, True, "stable: every mode decays, the slowest with e^(-0.2 t)"),
        (DECAYS, False, "stable, frozen at t = 0.5 s in a state that accelerates: every mode decays, the slowest with"),
        ([[-1.0, 0.0], [0.0, 0.3]], True, "unstable: mode 1 grows with e^(0.3 t)"),
        ([[-0.1, 0.0], [0.0, 0.3]], True, "unstable: mode 2 grows with e^(0.3 t)"),
        ([[0.0, 1.0], [-4.0, 0.0]], True, "neither stable nor unstable: 1 mode without decay or growth"),
        ([[0.0, 0.0], [0.0, 0.0]], True, "neither stable nor unstable: 2 modes without decay or growth"),
    ],
)
def test_stability_in_words(A: list[list[float]], at_rest: bool, said: str) -> None:
    assert linearize._stability_text(cast(Any, of(A, at_rest=at_rest))).startswith(said)


def campbell(orders: str | None = None, whirl: tuple[str, ...] = (), modes: str | None = None) -> Any:
    return CampbellRequest.read(" c = 1:2:3", orders, whirl, modes, None)


def test_words_of_options_are_read() -> None:
    assert campbell(modes="1, 4").modes == (1, 4) and campbell().modes is None
    assert campbell("1P, 2p").orders == (1.0, 2.0) and campbell("1P").letter == "P" and campbell("1x,3").letter == "x"
    read = campbell(whirl=(" x : y ",))
    assert (read.speed, read.values, read.whirl) == ("c", [1.0, 1.5, 2.0], [("x", "y")])
    assert linearize._state("2.5") == 2.5 and linearize._state("steady") == "steady" and linearize._state(None) is None
    name, values = linearize._sweep("c=1:100:3:log")
    assert name == "c" and values == pytest.approx([1.0, 10.0, 100.0])
    assert len(linearize._sweep("c=0:1:10000")[1]) == 10_000 and linearize._sweep("c=0:1:2")[1] == [0.0, 1.0]
    assert linearize._band("0.1:50") == (0.1, 50.0) and linearize._band(None) is None
    assert linearize._band("0:5", from_zero=True) == (0.0, 5.0)
    assert command._range(" load = 0:10") == ("load", 0.0, 10.0)
    assert command._preload("load=2.5") == ("load", 2.5) and command._preload("load") == ("load", 0.0)
    outputs = {"body": None, "seat": "Wk"}
    wanted = {"outputs": outputs, "classes": ["A", "C"], "speeds": (10.0,), "band": (0.5, 80.0)}
    assert linearize._ride(("body", "seat:Wk"), "A, C", "10", (0.5, 80.0)) == wanted
    assert linearize._ride((), None, None, None) is None
    assert linearize._blades(()) is None
    found = linearize._blades((" spin : a_1, a_2", "spin:b_1,b_2", "tail: c"))
    assert found == {"spin": [("a_1", "a_2"), ("b_1", "b_2")], "tail": [("c",)]}


#: Texts of which the catalogue of bad inputs has none, or one of several causes.
NUMBERS, FIRST = "a parameter, two finite values without units, and", "two positive frequencies in Hz are needed"


@pytest.mark.parametrize(
    ("read", "text"),
    [
        (lambda: campbell(modes="2,0"), "--modes 2,0: numbers of modes from 1 on are needed; try: --modes 1,2,4"),
        (lambda: linearize._sweep("c=1:2:10001"), f"--root-locus c=1:2:10001: {NUMBERS}"),
        (lambda: linearize._sweep("c=1:inf:3"), f"--root-locus c=1:inf:3: {NUMBERS}"),
        (lambda: linearize._sweep("c=1:0:3:log"), "c=1:0:3:log: values in equal ratios must be positive"),
        (lambda: linearize._band("-1:50", from_zero=True), "--band -1:50: two frequencies in Hz from 0 on are needed"),
        *((lambda band=band: linearize._band(band), f"--band {band}: {FIRST}") for band in ("0:50", "2:2", "1:inf")),
        *(
            (lambda text=text: linearize._blades((text,)), f"--multiblade {text}: a rotor and its blades are needed")
            for text in ("a_1,a_2", ":a_1,a_2", "spin:a_1,,a_3")
        ),
        (lambda: command._range("=0:1"), "--path =0:1: a name and two numbers are needed; try: --path load=0:10"),
        (lambda: command._preload("load=a"), "--buckling load=a: 'a' is not a number; try: --buckling load=0"),
    ],
)  # fmt: skip  # a table
def test_words_that_cannot_be_read(read: Callable[[], object], text: str) -> None:
    with pytest.raises(UsageError, match=re.escape(text)):
        read()


# -- files and tables --------------------------------------------------------------------------------------------------

#: Oscillations over a speed; the second mode crosses the first order at 4 rad/s.
DIAGRAM = Campbell(
    "spin", "rad/s", np.array([1.0, 5.0]), np.array([[2j, 4j], [2j, 4j]]), np.zeros((2, 2), int), (1.0,),
    (Crossing(1.0, 4.0, 4.0, 1, "forward"),), ("marginal",) * 2,
)  # fmt: skip  # a table
TABLE = RideTable(("place",), ("m",), ("A", "B"), np.array([10.0]), np.array([[[0.5]], [[1.0]]]), ("",))


def test_rides_and_crossings_are_printed_behind_the_modes(capsys: pytest.CaptureFixture[str]) -> None:
    linearize._print_tables(TABLE, DIAGRAM)
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["A", "10", "0.5"] in lines and ["B", "10", "1"] in lines
    assert ["1", "4", f"{120.0 / math.pi:.9g}", f"{2.0 / math.pi:.9g}", "2", "forward"] in lines
    for unit, shown_unit in (("", "not given"), ("N/m", "N/m")):
        linearize._print_tables(None, replace(DIAGRAM, orders=(), unit=unit, parameter="k"))
        shown = capsys.readouterr()
        assert shown.out == "" and shown.err == f"no orders: k is not a speed of rotation (unit {shown_unit})\n"


def test_ctrl_c_in_a_diagram_or_a_locus_is_told_with_what_there_is() -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    request: Any = object.__new__(linearize._Request)
    request.velocities, request.held, request.inputs, request.multiblade = {"tail": 2.0, "spin": 1.0}, {}, {}, None
    request.parameters, request.initial, request.time, request.at = {"c": 1.0}, {}, 0.5, "steady"
    request.asked, request.band = CampbellRequest.read("spin=1:5:3", None, (), None, None), None
    calls = list[dict[str, Any]]()
    request.model = SimpleNamespace(name="rig", parameters={"c": 1.0})
    request.model.campbell = lambda *_, **given: calls.append(given) or replace(DIAGRAM, interrupted=True)
    said = "interrupted: the Campbell diagram has 2 of 3 values of spin and 1 crossing"
    assert request.campbell("reference") == said and request.diagram.interrupted
    assert calls[0] == {
        "parameters": {"c": 1.0}, "initial": None, "t": 0.5, "velocities": {"tail": 2.0}, "coordinates": {}, "u": None,
        "multiblade": None, "reference": "reference", "orders": None, "whirl": [], "progress": True,
    }  # fmt: skip  # a table
    request.model.campbell = interrupted
    assert request.campbell(None) == "interrupted before there was a Campbell diagram"
    request.linearize, request.sweep = interrupted, ("c", [1.0, 2.0, 3.0])
    assert request.roots() == "interrupted before there was a root locus" and request.locus is None
    at = {c: linear_model(1.0, c, 4.0, ["x"]) for c in (1.0, 2.0)}
    request.linearize = lambda given, _: at.get(given["c"]) or interrupted()
    assert request.roots() == "interrupted: the root locus has 2 of 3 values of c"
    assert request.locus.values.tolist() == [1.0, 2.0]


def test_views_have_the_modes_of_the_table() -> None:
    numbered = replace(DIAGRAM, numbers=(3, 5))
    for modes_asked, columns in (("5", (1,)), ("5,3", (1, 0)), (None, None)):
        view = cast(Any, campbell("1P", modes=modes_asked)).view(numbered, (0.0, 2.0))
        assert (view.modes, view.frequencies, view.letter) == (columns, (0.0, 2.0), "P")
    assert campbell(modes="4,3").view(numbered, None).modes == (0,)  # with a note
    with pytest.raises(UsageError, match="there is no mode 1 or 4 that oscillates in the diagram; try: some of 3, 5"):
        campbell(modes="1,4").view(numbered, None)


# -- modes of matrices -------------------------------------------------------------------------------------------------


def test_modes_of_inner_states_have_shapes_of_their_own() -> None:
    found = modes(np.diag([-1.0, -3.0]), np.eye(1, 2), ("x",), np.ones(1))
    assert found.eigenvalues.tolist() == [-1.0, -3.0] and found.damping_ratio.tolist() == [1.0, 1.0]
    assert np.abs(found.shapes).tolist() == [[1.0, 0.0]] and np.abs(found.state_shapes).tolist() == [
        [1.0, 0.0],
        [0.0, 1.0],
    ]
    grows = modes(np.diag([2.0, 0.0]), np.eye(1, 2), ("x",), np.ones(1))
    assert grows.damping_ratio.tolist() == [0.0, -1.0] and grows.stability == "unstable"
    assert not grows.oscillating.any() and grows.band == pytest.approx((0.2 / (2.0 * math.pi), 20.0 / (2.0 * math.pi)))
    none = modes(np.zeros((0, 0)), np.zeros((1, 0)), ("x",), np.array([-4.0]))
    assert (len(none), none.band, none.stability, none.weights.tolist()) == (0, (0.01, 100.0), "stable", [2.0])
    assert repr(none) == "<Modes: 0, stable>"


def shown(frequencies: list[float], decay: float = -0.1, ratio: float = 0.1) -> Modes:
    values = np.array([decay + 1j * w for w in frequencies])
    size, empty = np.abs(values), np.zeros((1, len(values)), complex)
    unsure = np.full(len(values), 0.05)
    return Modes(values, size, size / (2.0 * math.pi), ratio + 0.0 * size, unsure, empty, empty, ("x",), np.ones(1))


def test_modes_at_a_prompt_are_six_frequencies() -> None:
    assert repr(shown([2.0 * math.pi] * 6)) == f"<Modes: 6, stable: {', '.join(['1'] * 6)} Hz undamped>"
    assert repr(shown([2.0 * math.pi] * 7)).endswith("1, ... Hz undamped>")
    assert shown([0.05]).oscillating.tolist() == [False] and shown([0.0501]).oscillating.tolist() == [True]
    assert [shown([1.0], decay).stability for decay in (-0.05, -0.0501, 0.05, 0.0501)] == [
        "marginal", "stable", "marginal", "unstable",
    ]  # fmt: skip  # two lines


def test_coordinates_of_little_energy_are_not_named() -> None:
    base = shown([1.0])
    made = Modes(**{
        **{name: getattr(base, name) for name in ("eigenvalues", "angular_frequency", "frequency", "damping_ratio")},
        "uncertainty": base.uncertainty, "state_shapes": base.state_shapes, "coordinates": ("a", "b", "c", "d", "e"),
        "shapes": np.array([[0.05], [1.0], [0.6j], [0.0501], [0.3]]), "weights": np.ones(5),
    })  # fmt: skip  # four lines
    assert made.dominant(0) == [("b", 1.0), ("c", 0.6j), ("e", 0.3)]
    assert [name for name, _ in made.dominant(0, 5)] == ["b", "c", "e", "d"]


def test_the_coordinates_of_a_mode_beyond_the_last_are_refused() -> None:
    for number in (2, -1):
        with pytest.raises(UsageError, match=f"there is no mode {number}; try: numbers from 0 to 1"):
            shown([1.0, 2.0]).dominant(number)
