"""Names and units of the signals of a linear model, and their values at the state that it is about."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.analysis.operating_point import OperatingPoint
from eomgen.base.arrays import Array
from eomgen.compiled.coordinates import coordinate_units
from eomgen.linear.freedom import Measures
from eomgen.linear.linearization import Names, Reference
from eomgen.linear.sampled_loop import SampledPart
from eomgen.system.description import component_names

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


def signal_names(model: CompiledModel, components: Sequence[str], measured: Sequence[str]) -> Names:
    """Return all names: of components, measures of motions, states, inputs, disturbances and outputs; units."""
    description = model.description
    outputs = [
        name
        for item in model.library.layout["outputs"]
        for name in component_names("", str(item["name"]), int(item["size"]))
    ]
    return Names(
        tuple(components),
        tuple(measured),
        model.states,
        description.driven,
        description.disturbances,
        tuple(outputs),
        _units(model),
        _units_by_kind(model, measured == components),
    )


def _units(model: CompiledModel) -> dict[str, str]:
    """Return the units of inputs, disturbances, outputs, coordinates and velocities by their names."""
    units = {item.name: item.unit for item in model.description.inputs}
    for item in model.library.layout["outputs"]:
        units |= dict.fromkeys(component_names("", str(item["name"]), int(item["size"])), str(item["unit"]))
    for name, unit in zip(model.v_names, model.v_units, strict=True):
        units |= {name: unit, name.removeprefix("v."): unit.removesuffix("/s")}
    units |= {f"base.acceleration[{k}]": "m/s^2" for k in range(3)}
    return units | {f"base.angular_acceleration[{k}]": "rad/s^2" for k in range(3)}


def _units_by_kind(model: CompiledModel, by_components: bool) -> dict[str, tuple[str, ...]]:
    """Return the units of all signals of the linear model, by kind; empty if they are not known."""
    description = model.description
    velocities = model.v_units
    if not by_components:
        velocities = coordinate_units(description.joints, description.coordinates)[1]
    of_inputs = {item.name: item.unit for item in description.inputs}
    of_base = {name: "rad/s^2" if "angular" in name else "m/s^2" for name in description.base}
    layout = model.library.layout["outputs"]
    return {
        "measured": tuple(unit.removesuffix("/s") for unit in velocities),
        "velocities": tuple(velocities),
        "states": tuple(model.z_units),
        "inputs": tuple(of_inputs[name] for name in description.driven),
        "disturbances": tuple((of_inputs | of_base)[name] for name in description.disturbances),
        "outputs": tuple(str(item["unit"]) for item in layout for _ in range(int(item["size"]))),
    }


def reference_values(
    model: CompiledModel, reference: Reference, operating_point: OperatingPoint, measures: Measures
) -> dict[str, Array]:
    """Return the values of all signals at the reference, by kind; not a number if one is not known.

    Components on groups have no value of their own, and the joints between absolute bodies are not evaluated.
    """
    description = model.description
    coordinates = np.full(len(measures.v), np.nan)
    if measures.factors is model.factors:
        for factor in model.factors:
            if factor.q_size == factor.v_size:
                coordinates[factor.v] = reference.q[factor.q]
    given = dict(zip(model.inputs, reference.u, strict=True))
    outputs = np.zeros(0)
    if "outputs" in model.functions:
        multipliers = {"multipliers": reference.multipliers} if len(reference.multipliers) else {}
        of_state = {"z": reference.z, **multipliers, **operating_point.given}
        outputs = next(iter(model.evaluate("outputs", reference.q, reference.v, reference.a, **of_state).values()))
    return {
        "measured": coordinates,
        "velocities": measures.v,
        "states": reference.z,
        "inputs": np.array([given[name] for name in description.driven]),
        "disturbances": np.array([given.get(name, np.nan) for name in description.disturbances]),
        "outputs": outputs,
    }


def with_held(names: Names, sampled: SampledPart) -> Names:
    """Return names with the sampled states among the inputs, behind the others."""
    held, kept = list(sampled.places), sampled.others

    def moved(by_kind: Mapping[str, Any]) -> dict[str, Any]:
        states = by_kind["states"]
        return {
            **by_kind,
            "states": type(states)([states[k] for k in kept]) if isinstance(states, tuple) else states[kept],
            "inputs": (*by_kind["inputs"], *(states[k] for k in held))
            if isinstance(states, tuple)
            else np.append(by_kind["inputs"], states[held]),
        }

    return replace(
        names,
        states=tuple(names.states[k] for k in kept),
        inputs=(*names.inputs, *sampled.names),
        units={
            **names.units,
            **dict(zip(sampled.names, (names.units_by_kind["states"][k] for k in held), strict=True)),
        },
        units_by_kind=moved(names.units_by_kind),
        references=moved(names.references),
    )


def orientations(model: CompiledModel, q: Array) -> dict[str, tuple[float, ...]]:
    """Return the coordinates of joints on groups by name."""
    return {factor.name: tuple(q[factor.q].tolist()) for factor in model.factors if factor.q_size != factor.v_size}
