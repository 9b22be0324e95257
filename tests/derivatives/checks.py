"""What tests of derivatives of runs share: scenes with tunable numbers, oracles by complex steps, and differences."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.integrators.families.register import method_named
from eomgen.lie import product
from eomgen.pipeline.model import Model
from eomgen.products.derivatives.run_sensitivities import Sensitivities
from eomgen.scene.builder import SceneBuilder
from tests.oracles.complex_runs import ComplexRun


def tunable(name: str, gravity: Any = None, coordinates: str = "joint", **values: float) -> SceneBuilder:
    """Return a builder with tunable parameters."""
    builder = SceneBuilder(name, coordinates=coordinates, **({} if gravity is None else {"gravity": gravity}))
    for parameter, value in values.items():
        builder.parameter(parameter, value, tunable=True)
    return builder


def oracle_of(model: Model, scene: Any, method: str, found: Sensitivities, step: float) -> ComplexRun:
    """Return the run in complex numbers, with the start that the run had."""
    begun = found._run.motion.start
    rho = {"rho_inf": model.library.layout["defaults"]["rho_inf"]} if method == "generalized_alpha" else {}
    return ComplexRun(scene, method_named(method, **rho), step, slope=bool(np.any(begun["a"] != begun["vdot"])))


def places_of(model: Model, found: Sensitivities) -> list[tuple[str, int]]:
    """Return the block and the place in it of each direction."""
    names = {"p": list(model.parameters), "q": [f"q{name[1:]}" for name in model.v_names]}
    names |= {"v": list(model.v_names), "z": list(model.z_names)}
    return [(block, known.index(name)) for name in found.by for block, known in names.items() if name in known]


def moved(model: Model, found: Sensitivities, change: Array, inputs: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return ``parameters``, ``initial`` and ``inputs`` of a run that is changed along the directions."""
    parameters = dict(zip(model.parameters, model.parameter_array().tolist(), strict=True))
    start = found._run.motion.start
    state = {name: start[name].copy() for name in ("q", "v", "z") if name in start}
    given = {name: np.array(values, float) for name, values in (inputs or {}).items()}
    increment = np.zeros(model.nv)
    for name, step in zip(found.by, change.tolist(), strict=True):
        if name.startswith("inputs."):
            column, _, row = name.removeprefix("inputs.").rstrip("]").partition("[")
            given[column][int(row) if row else slice(None)] += step
        elif name in parameters:
            parameters[name] += step
        elif name.startswith("z."):
            state["z"][list(model.z_names).index(name)] += step
        elif name.startswith("v."):
            state["v"][list(model.v_names).index(name)] += step
        else:
            increment[list(model.v_names).index(f"v{name[1:]}")] += step
    state["q"] = product.update(model.factors, state["q"], increment)
    return {"parameters": parameters, "initial": state, "inputs": given or None}


def hold_adjoints(found: Sensitivities, table: Array, tolerance: float) -> None:
    """Hold gradients of all outputs at the end to tangents (rows, components, directions)."""
    components = [
        f"final({name}[{k}])" if array.ndim > 1 else f"final({name})"
        for name, array in found.outputs.items()
        for k in range(array.shape[1] if array.ndim > 1 else 1)
    ]
    gradients = found.gradients(components)
    assert np.max(np.abs(gradients - table[-1])) <= tolerance * np.max(np.abs(table[-1]))


def sixth_order(value: Callable[[float], Any], size: float) -> Any:
    """Return the derivative of a function of a number at 0, by differences of order 6."""
    slopes = [(value(k * size) - value(-k * size)) / (2.0 * k * size) for k in (1, 2, 4)]
    return (64.0 * slopes[0] - 20.0 * slopes[1] + slopes[2]) / 45.0
