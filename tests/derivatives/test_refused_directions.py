"""Names and runs without derivatives are refused by their codes, of models without a compiled library."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from eomgen.errors import UsageError
from eomgen.integrators.families.register import method_named
from eomgen.products.derivatives import linearise

INPUTS = [SimpleNamespace(name="push", given=False), SimpleNamespace(name="road", given=True)]
OUTPUTS = [{"name": "tip", "size": 2}, {"name": "angle", "size": 1}]
MODEL: Any = SimpleNamespace(
    parameters={"mass": 1.0, "k": 2.0}, v_names=["v.a", "v.b"], z_names=["z.lag"], nz=1,
    evaluator=SimpleNamespace(fixed_parameters=["length"]), description=SimpleNamespace(inputs=INPUTS),
    library=SimpleNamespace(layout={"outputs": OUTPUTS, "sampled": []}),
)  # fmt: skip
BARE: Any = SimpleNamespace(
    description=SimpleNamespace(inputs=[]), library=SimpleNamespace(layout={"outputs": []}), parameters={},
    v_names=["v.a"], z_names=[],
)  # fmt: skip
SAMPLED = {"state": 0, "controller": -1, "quantum": None}


def layout(**more: Any) -> dict[str, Any]:
    return {"method": {}, "sampled": [], "states": [{"name": "held"}], "sizes": {"holonomic": 0}, **more}


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (lambda: linearise._outputs(BARE, None), "E0600"),
        (lambda: linearise._outputs(MODEL, []), "E1431"),
        (lambda: linearise._names([], ["mass"], ["q.a"], ["v.a"]), "E0592"),
        (lambda: linearise._directions(BARE, None, [], 3), "E0593"),
        (lambda: linearise._directions(MODEL, ["mass", "mass"], [], 3), "E0589"),
        (lambda: linearise._samples(MODEL, ["inputs.push[x]"], [], 3), "E0594"),
        (lambda: linearise._samples(BARE, ["inputs.push"], [], 3), "E0595"),
        (lambda: linearise._samples(MODEL, ["inputs.road"], [], 3), "E0596"),
        (lambda: linearise._samples(MODEL, ["inputs.push[4]"], [], 3), "E0597"),
        (lambda: linearise._check_jumps(layout(sampled=[SAMPLED]), method_named("rk4")), "E0607"),
        (lambda: linearise._check_jumps(layout(sampled=[{**SAMPLED, "controller": 0}]), method_named("hht")), "E0608"),
        (lambda: linearise._check_jumps(layout(sampled=[{**SAMPLED, "quantum": 0.1}]), method_named("hht")), "E0609"),
        (lambda: linearise._linear_step(MODEL, "rk45", method_named("rk45")), "E0616"),
        (lambda: linearise._linear_step(MODEL, "hht", method_named("hht")), "E0619"),
        (lambda: linearise._linear_step(MODEL, "tdg2", method_named("tdg2")), "E0620"),
        (lambda: linearise.newton_settings(MODEL, "auto"), "E0615"),
    ],
)
def test_faults_have_their_codes(call: Callable[[], Any], code: str) -> None:
    with pytest.raises(UsageError) as caught:
        call()
    assert [problem.code for problem in caught.value.problems] == [code]


def test_directions_are_parameters_then_the_state_then_samples_of_inputs() -> None:
    by = ["z.lag", "inputs.push[1]", "v.b", "k", "q.a", "inputs.road", "inputs.push[:]"]
    with pytest.raises(UsageError):
        linearise._directions(MODEL, by, ["road"], 2)  # a row twice
    names, columns = linearise._directions(MODEL, by[:-1], ["road"], 2)
    assert names == ("k", "q.a", "v.b", "z.lag", "inputs.push[1]", "inputs.road")
    assert columns.columns == {"p": [1], "q": [0], "v": [1], "z": [0]} and columns.samples == [(0, 1), (1, -1)]
    rows = linearise._samples(MODEL, ["inputs.push[:]", "inputs.push[2]"], [], 2)
    assert rows == [(f"inputs.push[{k}]", (0, k)) for k in (0, 1, 2, 2)]
    assert linearise._outputs(MODEL, None) == {"tip": [0, 1], "angle": [2]}
    assert linearise._outputs(MODEL, ["angle"]) == {"angle": [2]}
    assert linearise._names(None, ["mass", "k"], ["q.a"], ["v.a"]) == ["mass", "k"]
