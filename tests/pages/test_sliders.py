"""Sliders and plots of live pages, of a model and a run, without WebAssembly."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.pages import live
from eomgen.products.pages.sliders import _round, sliders_of
from eomgen.products.pages.web_module import _called, page_source
from eomgen.simulation.stepping.stepper import Stepper


@cache
def run() -> tuple[Any, Any]:
    """Return a cart with a stop, a body in space, a filter, an input by formula and others, with parameters."""
    builder = eomgen.SceneBuilder("slides").parameter("load", 2.0, unit="kg", tunable=True)
    builder.parameter("angle", 0.0, unit="rad", tunable=True).parameter("fixed", 3.0)
    builder.input("wave", "0.7*sin(3*t)", unit="N").input("push", unit="N").input("twist", unit="N m")
    builder.input("held", unit="N").input("shift", unit="m").input("plain")
    builder.body("cart", "load").body("drone", 1.0, inertia=[0.1, 0.2, 0.3])
    at_stop = {"lower": -0.2, "upper": 5.0, "stiffness": 1e3}
    start = {"position": 0.1, "velocity": 4.0}
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], initial=start, limits=at_stop)
    builder.joint("air", "free", "base", "drone", initial={"position": [0, 0, 2.0]})
    builder.state("lag", "5*(push - lag)", initial=0.4, unit="N")
    builder.effort("drive", "rail", "wave + push + twist + held + shift + plain + lag + angle")
    builder.output("place", formula=["q.rail", "v.rail"], unit="m").output("speed", formula="v.rail", unit="m/s")
    builder.output("ratio", formula="q.rail/2")
    model = eomgen.build(builder.build(), profile="instant")
    solution = model.simulate(0.1, 1e-2, inputs={"held": 2.5}, method="rk4", error_estimate=False)
    return model, solution


def sliders(kind: str, held: dict[str, float] | None = None, extent: float = 2.0) -> dict[str, Any]:
    model, solution = run()
    p = np.array(list(solution.metadata["parameters"].values()))
    found = sliders_of(model, solution, p, {"held": 2.5} if held is None else held, extent)
    return {item["name"]: item for item in found if item["kind"] == kind}


def ends(item: dict[str, Any]) -> tuple[float, float, float]:
    return item["low"], item["value"], item["high"]


def test_parameters_have_ranges_by_their_values_and_requirements() -> None:
    found = sliders("parameter")
    assert list(found) == ["load", "angle"]
    assert ends(found["load"]) == (0.5, 2.0, 6.0) and ends(found["angle"]) == (-1.0, 0.0, 1.0)
    assert (found["load"]["index"], found["load"]["unit"]) == (0, "kg")


def test_inputs_reach_twice_the_largest_value_or_the_weight() -> None:
    """Weight of 3 kg: 29.43 N; by formulas the value is open."""
    found = sliders("input")
    largest = 2.0 * 0.7 * np.sin(0.3)
    assert found["wave"]["value"] is None and found["wave"]["high"] == _round(largest)
    assert ends(found["push"]) == (-30.0, 0.0, 30.0) and ends(found["held"]) == (-5.0, 2.5, 5.0)
    assert ends(found["twist"]) == (-30.0, 0.0, 30.0)  # a quarter of 29.43 N at 2 m, twice: 29.43
    assert ends(found["shift"]) == (-0.5, 0.0, 0.5) and ends(found["plain"]) == (-1.0, 0.0, 1.0)
    assert [item["index"] for item in found.values()] == list(range(6))
    assert sliders("input", {"wave": 0.3})["wave"]["value"] == 0.3


def test_starts_are_within_stops_and_bodies_are_moved_from_their_place() -> None:
    """Positions by half of the size, turns by 1.5 rad; velocities by those of a fall, 6 rad/s, or twice the value."""
    found, moving = sliders("position"), sliders("velocity")
    turned = [f"air {word} {axis}" for word in ("turned", "moved") for axis in "xyz"]
    assert list(found) == ["rail", *turned] and list(moving) == [
        "rail", *(name.replace("turned", "turning").replace("moved", "moving") for name in turned)
    ]  # fmt: skip
    assert ends(found["rail"]) == (-0.2, 0.1, 1.1) and found["rail"]["place"] == 0
    assert {ends(found[name]) for name in turned[:3]} == {(-1.5, 0.0, 1.5)}
    assert {ends(found[name]) for name in turned[3:]} == {(-1.0, 0.0, 1.0)}
    assert all(found[name]["place"] is None for name in turned) and found[turned[3]]["unit"] == "m"
    assert [found[name]["index"] for name in turned] == list(range(1, 7))
    assert ends(moving["rail"]) == (-10.0, 4.0, 10.0)  # twice 4 m/s, above the fall of 6.26
    assert ends(moving["air turning y"]) == (-7.0, 0.0, 7.0) and ends(moving["air moving z"]) == (-7.0, 0.0, 7.0)
    assert ends(sliders("position", extent=0.3)["rail"]) == (pytest.approx(-0.05), 0.1, 0.25)


def test_states_reach_their_largest_value() -> None:
    _, solution = run()
    (found,) = sliders("state").values()
    assert ends(found) == pytest.approx((-0.7, 0.4, 0.7)) and found["unit"] == "N"  # 1.5 times the start, which decays
    assert float(np.max(np.abs(solution.z))) == 0.4


@pytest.mark.parametrize(
    ("value", "expected"),
    [(1.0, 1.0), (1.01, 1.5), (1.5, 1.5), (1.6, 2.0), (2.1, 3.0), (3.5, 5.0), (5.5, 7.0), (7.5, 10.0), (0.021, 0.03),
     (120.0, 150.0)],
)  # fmt: skip
def test_ends_are_rounded_up(value: float, expected: float) -> None:
    assert _round(value) == pytest.approx(expected, rel=1e-14)
    assert _round(value * (1.0 + 1e-12)) == _round(value)


def test_plots_have_outputs_of_a_unit_together_and_energies_from_the_start() -> None:
    model, solution = run()
    plots = live._plots(model, solution, ["outputs_y", "energy_energy"])
    told = [(plot["title"], plot["unit"], [(c["name"], c["place"]) for c in plot["curves"]]) for plot in plots]
    assert told == [
        ("place", "m", [("place 0", [0]), ("place 1", [1])]),
        ("speed", "m/s", [("speed", [2])]),
        ("ratio", "", [("ratio", [3])]),
        ("energies", "J", [("kinetic", [0]), ("potential", [1]), ("total", [0, 1])]),
    ]
    potential = float(solution.energy["potential"][0])
    assert [curve["minus"] for curve in plots[-1]["curves"]] == [0.0, potential, potential]
    assert live._plots(model, solution, []) == []
    many = [{"name": f"y{k}", "size": 1, "unit": "1"} for k in range(50)]
    library = SimpleNamespace(layout={"outputs": [{"name": "tip", "size": 3, "unit": "m"}, *many]})
    plots = live._plots(SimpleNamespace(library=library), solution, ["outputs_y", "energy_energy"])  # type: ignore[arg-type]
    assert [curve["name"] for curve in plots[0]["curves"]] == ["tip x", "tip y", "tip z"]
    assert [len(plot["curves"]) for plot in plots] == [3, 6, 6, 6, 6, 6, 6, 3] and plots[1]["title"] == "outputs"


def test_the_extent_is_that_of_the_bodies_at_the_start() -> None:
    pose = np.array([[1.0, 0, 0, 0, 1, 2, 3], [1.0, 0, 0, 0, 9, 9, 9]])
    poses = {"a": pose, "b": pose - [0, 0, 0, 0, 3, 0, -4]}
    assert live._extent(SimpleNamespace(poses=poses)) == 5.0  # type: ignore[arg-type]
    for alone in ({}, {"a": pose}, {"a": np.nan * pose, "b": pose}):
        assert live._extent(SimpleNamespace(poses=alone)) == 1.0  # type: ignore[arg-type]


def test_data_of_a_page_are_those_of_the_run() -> None:
    model, solution = run()
    module = live.WebModule(b"code", (("outputs_y", 4), ("base", 0)))
    library = model.stepper("rk4")
    data = live._live_data(model, solution, library, module, {"held": 2.5}, {})
    assert data["parameters"] == list(solution.metadata["parameters"].values())
    assert data["held"] == [None, None, None, 2.5, None, None] and data["bodies"] == 2
    assert (data["q"], data["v"], data["z"]) == (solution.q[0].tolist(), solution.v[0].tolist(), [0.4])
    assert (data["t"], data["step"], data["duration"]) == (0.0, 1e-2, pytest.approx(0.1))
    assert [factor["group"] for factor in data["factors"]] == ["R", "SE3"] and data["base"] is False
    names = [item["name"] for item in library.layout["method"]["settings"]]
    assert data["settings"] == [solution.metadata["settings"][name] for name in names]
    assert data["blocks"] == [["outputs_y", 4], ["base", 0]] and data["method"].endswith("steps of 0.01 s")
    assert data["error"].startswith("The error of the run with the scene's values is not known: ")


def test_blocks_of_a_page_have_the_sizes_of_the_stepper() -> None:
    """Those of the state, of rows and of settings; outputs and energies are of the model's functions."""
    library = run()[0].stepper("rk4")
    text, blocks = page_source(library.layout, left_to_stepper=False)
    sizes, stepper = (
        dict(blocks),
        Stepper(library, run()[1].metadata["settings"] | {"step": 1e-2}, np.array([2.0, 0.0])),
    )
    assert sizes["state"] == len(stepper.state) and sizes["row_of_motion"] == stepper.sizes["row"]
    assert (
        sizes["settings"] == len(library.layout["method"]["settings"]) and sizes["parameters"] == sizes["present"] == 2
    )
    assert (sizes["u"], sizes["held"], sizes["inputs_u"]) == (6, 6, 6) and sizes["happened"] == 0
    assert [sizes[f"start_{name}"] for name in "qvz"] == [8, 7, 1]
    known = {item["name"]: item for item in library.layout["functions"]}
    for name in set(known) & {"outputs", "energy", "poses"}:
        for output in known[name]["outputs"]:
            assert sizes[f"{name}_{output['name']}"] == output["size"]
    assert all(f"{name}" in text for name in sizes)
    called, results = _called(library.layout, {"vdot": slice(3, 5), "q": slice(1, 2), "v": slice(2, 3)})
    assert all(item["number"] == library.index[item["name"]] for item in called)
    (of_inputs,) = (item for item in called if item["name"] == "inputs")
    assert of_inputs["outputs"] == ["inputs_u"] and "inputs_u" not in results
