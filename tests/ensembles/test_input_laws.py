"""Seeds of roads and factors of inputs that vary, against scenes that say the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from tests.ensembles.carts import CART

#: A cart that three inputs push: two wheels in one track, the second with a formula besides, and a law without a road.
INPUTS = """
[inputs.push]
road = {{ class = "D", speed = 10, seed = {seed}, harmonics = 8 }}
[inputs.rear]
road = {{ class = "D", speed = 10, seed = {seed}, harmonics = 8, offset = 2.5 }}
formula = "{factor} * sin(3 * t)"
[inputs.wind]
formula = "{factor} * (2 + cos(t))"
[inputs.own]
unit = "N"
[parameters.pusher]
value = 1
[curves.load]
points = [[-200, 0], [0, 0.1], [100, 0.3], [200, 0.2]]
[curves.track]
road = {{ class = "C" }}
"""


def scene(folder: Path, seed: int, factor: float = 1.0) -> eomgen.Scene:
    path = folder / "cart.toml"
    text = CART.replace('[inputs.push]\nunit = "N"\n', INPUTS.format(seed=seed, factor=factor))
    text = text.replace(
        'effort = "push"', 'effort = "100 * push + 50 * rear + wind + own + track(q.rail) + load(q.rail)"'
    )
    path.write_text(text, encoding="utf-8")
    return eomgen.load(path)


@pytest.fixture(scope="module")
def cart(tmp_path_factory: pytest.TempPathFactory) -> eomgen.Model:
    return eomgen.build(scene(tmp_path_factory.mktemp("cart"), 3))


@pytest.mark.long
@pytest.mark.slow
def test_wheels_of_a_track_follow_its_seed(cart: eomgen.Model, tmp_path: Path) -> None:
    """As scenes with these seeds; generalized-alpha takes functions in its steps otherwise than compiled formulas."""
    for method, off in (("rk4", 1e-12), (None, 1e-4)):
        found = cart.simulate_many(vary={"seed.push": "values(3, 4)"}, method=method).results["output.place.final"]
        same = cart.simulate(error_estimate=False, method=method).outputs["place"][-1]
        other = eomgen.build(scene(tmp_path, 4)).simulate(error_estimate=False, method=method).outputs["place"][-1]
        np.testing.assert_allclose(found, [same, other], rtol=off)
        assert abs(other - same) > 1e-3 * abs(same)


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
        ({"vary": {"seed.psh": VALUES}}, "there is no input 'psh'; try: seed.push or seed.rear"),
        ({"vary": {"scale.push": VALUES}, "inputs": {"push": 1.0}}, "the input push is given or varies itself, so the"),
        ({"vary": {"pusher": VALUES}}, "vary pusher: the parameter pusher is fixed in the code; try: pusher = { value"),
    ],
)
def test_what_cannot_vary_is_told_before_the_first_sample(
    cart: eomgen.Model, options: dict[str, object], said: str
) -> None:
    with pytest.raises(UsageError) as caught:
        cart.simulate_many(**options)
    assert said in str(caught.value)
