"""Laws of inputs with other seeds and factors, of a scene that is read and not compiled."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.base.random_inputs import road_harmonics, standard_normals
from eomgen.errors import UsageError
from eomgen.formula.evaluate import evaluate_batch
from eomgen.products.ensembles import variations
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from tests.models import library

ROAD = {"class": "D", "speed": 10, "seed": 3, "harmonics": 8}
TIMES = np.linspace(0.0, 2.0, 150)  # more than are summed together


def scene() -> Scene:
    inputs = {
        "push": {"road": ROAD},
        "rear": {"road": ROAD | {"offset": 2.5}, "formula": "gain * sin(3 * t)"},
        "left": {"road": ROAD | {"seed": 4}},
        "wind": {"formula": "gain * (2 + cos(t))"},
        "own": {"unit": "N"},
    }
    process = {"type": "exponential", "correlation_time": 1.0, "modes": 3, "duration": 1.0}
    parameters = {"gain": {"value": 0.5, "tunable": True}, "pusher": {"value": 1}}
    curves = {"load": {"points": [[-200, 0], [0, 0.1], [100, 0.3]]}, "track": {"road": {"class": "C"}}}
    more = {"inputs": inputs, "random": {"gust": process}, "parameters": parameters, "curves": curves}
    return from_data(library.scene("oscillator", **more))


def model_of(description: Scene) -> Any:
    """Return a model that has the laws alone, by the formulas of the scene and by sums of harmonics."""

    def value(item: Any, t: Array, p: Array) -> Array:
        total = sum(size * np.cos(w * t + phase) for size, w, phase in item.harmonics) + 0.0 * t
        if item.formula is not None:
            places = {parameter.name: k for k, parameter in enumerate(description.parameters)}
            total = total + evaluate_batch(
                item.formula,
                lambda symbol: p[places[symbol.name]] if symbol.kind == "parameter" else t,
                along_motion=True,
            )
        return np.asarray(total)

    def input_values(t: Array, *, parameters: Array) -> Array:
        return np.stack([value(item, t, parameters) for item in description.inputs], axis=-1)

    own = np.array([item.value for item in description.parameters], dtype=float)
    return SimpleNamespace(
        description=description, scene=description, parameters=("gain",), input_units={}, states=(), z_units=(),
        q_names=("q.slide",), q_units=("m",), v_names=("v.slide",), v_units=("m/s",),
        evaluator=SimpleNamespace(parameter_units={}, fixed_parameters=("pusher",)),
        inputs=[item.name for item in description.inputs],
        input_values=input_values,
        parameter_array=lambda given: own if given is None else given,
    )  # fmt: skip


def road(seed: int, offset: float) -> Array:
    waves = road_harmonics("D", 10.0, seed=seed, offset=offset, harmonics=8)
    return np.asarray(sum(size * np.cos(w * TIMES + phase) for size, w, phase in waves))


def test_seeds_and_factors_make_the_laws_of_scenes_that_say_so() -> None:
    model = model_of(scene())
    p = model.parameter_array(None) * 3.0
    gain = p[[item.name for item in model.description.parameters].index("gain")]
    laws = variations.laws_of(model, p, {"seed.push": 7.0}, {"scale.rear": 2.0, "scale.wind": 0.25})
    assert list(laws) == ["push", "rear", "wind"]  # both wheels of the track
    np.testing.assert_allclose(laws["push"].over(TIMES), road(7, 0.0), rtol=0, atol=1e-15)
    both = 2.0 * (road(7, 2.5) + gain * np.sin(3.0 * TIMES))
    np.testing.assert_allclose(laws["rear"].over(TIMES), both, rtol=0, atol=1e-14)
    np.testing.assert_allclose(laws["wind"].over(TIMES), 0.25 * gain * (2.0 + np.cos(TIMES)), rtol=1e-14)
    (alone,) = variations.laws_of(model, p, {}, {"scale.left": -1.0}).values()
    np.testing.assert_allclose(alone.over(TIMES), -road(4, 0.0), rtol=0, atol=1e-15)


def test_the_scenes_own_laws_are_functions_where_they_vary() -> None:
    model = model_of(scene())
    items = [variations.Variation("seed.left", "seed", 2, ""), variations.Variation("scale.wind", "scale", 3, "")]
    given = {"inputs": {"push": 1.0}, "method": "rk4"}
    options = variations.with_scenes_laws(model, items, given)
    assert options["method"] == "rk4" and set(options["inputs"]) == {"push", "left", "wind"}
    for name in ("left", "wind"):
        own = model.input_values(TIMES, parameters=model.parameter_array(None))[:, model.inputs.index(name)]
        np.testing.assert_allclose(options["inputs"][name].over(TIMES), own, rtol=0, atol=1e-15)
    assert variations.with_scenes_laws(model, [], given) is given


def test_seeds_of_processes_draw_their_variables() -> None:
    model = model_of(scene())
    gust = model.inputs.index("gust")
    drawn = variations.variables_of_seed(model, gust, 9.0)
    assert drawn == dict(zip(("gust_z1", "gust_z2", "gust_z3"), standard_normals(9, 3, "gust"), strict=True))
    assert variations.variables_of_seed(model, 0, 9.0) == {}
    assert variations.laws_that_vary(model) == [
        "seed.push", "seed.rear", "seed.left", "seed.gust",
        "scale.push", "scale.rear", "scale.left", "scale.wind", "scale.gust",
    ]  # fmt: skip


@pytest.mark.parametrize("count", [1, 63, 64, 65, 150])
def test_sums_of_harmonics_have_the_same_bits_for_any_number_of_times(count: int) -> None:
    waves = np.array(road_harmonics("C", 5.0, harmonics=11))
    np.testing.assert_array_equal(variations._sum(waves, TIMES[:count]), variations._sum(waves, TIMES)[:count])


VALUES = "values(1, 2)"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"vary": {"seed.push": "uniform(0, 9)"}}, "a seed is a whole number from 0 on, and uniform(0, 9)"),
        ({"table": {"seed.push": [1.0, 1.5]}}, "a seed is a whole number from 0 on, and the column has others"),
        ({"vary": {"seed.push": VALUES, "seed.rear": VALUES}}, "runs in the same track as the wheel of seed.push, and"),
        ({"vary": {"seed.wind": VALUES}}, "the input wind is neither a random road nor a random process, so it has no"),
        ({"vary": {"seed.track": VALUES}}, "track is a curve, whose numbers are fixed in the code; try: a random"),
        ({"vary": {"scale.load": VALUES}}, "try: a tunable parameter as factor in formulas, factor * load(...)"),
        ({"vary": {"scale.own": VALUES}}, "the scene gives the input own no law that could be multiplied; try: own"),
        ({"vary": {"seed.psh": VALUES}}, "there is no input 'psh'; try: seed.push or seed.rear or seed.left"),
        ({"vary": {"scale.push": VALUES}, "inputs": {"push": 1.0}}, "the input push is given or varies itself, so the"),
        ({"vary": {"pusher": VALUES}}, "vary pusher: the parameter pusher is fixed in the code; try: pusher = { value"),
    ],
)
def test_what_cannot_vary_is_refused(options: dict[str, Any], said: str) -> None:
    model = model_of(scene())
    with pytest.raises(UsageError) as caught:
        items, _ = (
            variations.read_varied(model, options["vary"])
            if "vary" in options
            else variations.read_table(model, options["table"])
        )
        variations.with_scenes_laws(model, items, options)
    assert said in str(caught.value)
