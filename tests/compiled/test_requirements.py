"""Values of parameters that the scene refuses are refused by every call that takes parameters; arrays of a model stay
its own."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from functools import cache
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen import UsageError

REFUSED = " (bodies.arm.mass): the mass -1 is negative at mass = -1; try: a positive number of kg"
TERMS = [
    "mass", "coupling", "force", "inverse_dynamics", "forward_dynamics", "residual", "partials", "poses", "twists",
    "outputs", "energy", "rates", "forward_rates", "coriolis", "mass_rates", "coupling_rates", "force_rates",
    "jacobians",
]  # fmt: skip  # names


def scene() -> eomgen.Scene:
    builder = eomgen.SceneBuilder("arm").parameter("mass", 1.0, tunable=True, unit="kg").input("push")
    builder.body("arm", "mass", center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.02])
    builder.joint("hinge", "revolute", "base", "arm", axis=[0, 1, 0], damping=0.1, initial={"position": 0.3})
    return builder.effort("push", "hinge", "push").output("angle", formula="q.hinge").build()


@cache
def model() -> eomgen.Model:
    return eomgen.build(scene(), TERMS, profile="quick")


#: What calls need beside parameters, by the names of their arguments.
_GIVEN: dict[str, Any] = {
    "q": [0.1], "v": [0.2], "a": [0.3], "j": [0.0], "s": [0.0], "t": 0.0, "y": [0.1, 0.2], "body": "arm",
    "frame": "arm", "dq": [0.1], "r": [0.0, 0.0, 0.0], "term": "mass", "parameter": "mass", "values": [-1.0, -0.5],
    "to": 2.0, "speed": "hinge", "period": 1.0, "weights": [1.0],
}  # fmt: skip  # names and values
#: The same of some calls alone.
_OF_TERM = {"term": "inverse_dynamics", "v": [0.2], "a": [0.3]}
_GIVEN_TO: dict[str, dict[str, Any]] = {"derivatives": _OF_TERM, "hessian": _OF_TERM}
#: What a call says instead whose subject the model has not.
ABSENT = ("is not in this model", "the model has no geometrically exact beam")


def calls() -> Iterator[str]:
    """Yield every public method of a model that takes parameters."""
    for name, method in inspect.getmembers(eomgen.Model, inspect.isfunction):
        if (
            not name.startswith("_")
            and "parameters" in inspect.signature(method).parameters
            and name not in ("parameter_array", "resume", "simulate_many")
        ):
            yield name


@pytest.mark.parametrize("name", list(calls()))
def test_every_call_that_takes_parameters_refuses_them(name: str) -> None:
    method = getattr(model(), name)
    needed = [
        key
        for key, item in inspect.signature(method).parameters.items()
        if item.default is inspect.Parameter.empty and item.kind is not inspect.Parameter.VAR_KEYWORD
    ]
    by_name: list[Any] = [{"mass": -1.0}]
    for parameters in (
        by_name if name in ("root_locus", "calibrate", "campbell") else [*by_name, [-1.0], [[1.0], [-1.0]]]
    ):
        with pytest.raises(UsageError) as caught:
            method(**{**{key: _GIVEN[key] for key in needed}, **_GIVEN_TO.get(name, {})}, parameters=parameters)
        said = str(caught.value)
        one_set_only = np.ndim(parameters) == 2 and "one set of parameters" in said
        assert said.endswith(REFUSED) or one_set_only or any(text in said for text in ABSENT), name


def _resumed(model: eomgen.Model, parameters: dict[str, float]) -> eomgen.Solution:
    with TemporaryDirectory() as folder:
        model.simulate(0.1, checkpoint=f"{folder}/run.npz", parameters={"mass": 2.0})
        return model.resume(f"{folder}/run.npz", 0.2, parameters=parameters)


@pytest.mark.slow_cases("<lambda>2", "<lambda>0")
@pytest.mark.parametrize(
    "run",
    [
        lambda m, p: m.simulate(0.1, parameters=p),
        lambda m, p: m.parameter_array(p),
        lambda m, p: m.simulate_many(0.1, table={"push": [0.1, 0.2]}, parameters=p),
        _resumed,
    ],
)
def test_runs_refuse_them_too(run: Any) -> None:
    with pytest.raises(UsageError) as caught:
        run(model(), {"mass": -1.0})
    assert str(caught.value).startswith("usage error: test_requirements.py:") and str(caught.value).endswith(REFUSED)
    assert run(model(), {"mass": 2.0}) is not None


def test_arrays_of_a_model_are_its_own() -> None:
    """What a model hands out of itself cannot be written to: a run would start there."""
    for array in (model().initial_q, model().initial_v, model().initial_z, model().parameter_array()):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 7.0
    changed = model().initial_q.copy()
    changed[0] = 7.0
    assert model().simulate(0.01).q[0].tolist() == [0.3]
