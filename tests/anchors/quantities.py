"""Results of rows that are no runs: probabilities, frequencies, loads, rates at a state; by public calls on a scene."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

import eomgen

Array = NDArray[np.float64]


def _model(scene: Path | Mapping[str, Any]) -> eomgen.Model:
    return eomgen.build(scene, profile="quick")


def _refined(scene: Path, factor: int) -> eomgen.Model:
    """Return the model of a scene with more elements in its beams."""
    document = tomllib.loads(scene.read_text(encoding="utf-8"))
    for beam in document["beams"].values():
        beam["elements"] *= factor
    return _model(document)


def probability(
    scene: Path,
    method: str,
    below: Sequence[float] = (),
    above: Sequence[float] = (),
    **options: Any,
) -> Mapping[str, Array]:
    """Return the probability that the output ``g`` is below or above one of the thresholds, by a method."""
    study = eomgen.random_vibration(_model(scene), "g", thresholds=[*below, *above], **options)
    found = study.distributions[method]
    parts = [*found.below[: len(below)], *found.above[len(below) :]]
    return {"probability": np.array([[sum(parts)]])}


def limit_load(
    scene: Path, parameter: str, to: float, order: int, refined: Sequence[int] = (1, 2), max_points: int = 500
) -> Mapping[str, Array]:
    """Return the load at the first limit point and all outputs there, extrapolated from two numbers of elements."""
    found = []
    for factor in refined:
        model = _refined(scene, factor)
        point = model.equilibrium_path(parameter, to, max_points=max_points).critical[0]
        assert point.kind == "limit point"
        found.append({"load": point.value} | dict(point.columns))
    ratio = (refined[1] / refined[0]) ** order
    coarse, fine = found
    names = coarse.keys() & fine.keys()  # nodes differ
    return {name: np.array([[(ratio * fine[name] - coarse[name]) / (ratio - 1.0)]]) for name in names}


def rates(scene: Path, q: Sequence[float] | None = None, v: Sequence[float] | None = None) -> Mapping[str, Array]:
    """Return the accelerations of all joints, ``rates``, and the outputs at a state, by default the initial one."""
    model = _model(scene)
    place = model.initial_q if q is None else np.array(q, float)
    speed = model.initial_v if v is None else np.array(v, float)
    both = model.rhs(0.0, np.concatenate([place, speed, model.initial_z]))
    found = {name: np.reshape(value, (1, -1)) for name, value in model.outputs(place, speed).items()}
    return found | {"rates": both[None, model.nq : model.nq + model.nv]}


def frequencies(
    scene: Path,
    count: int,
    parameters: Mapping[str, float] | None = None,
) -> Mapping[str, Array]:
    """Return the lowest undamped frequencies, Hz, about rest or about rest on a part that turns."""
    found = _model(scene).linearize(parameters=parameters).modes().undamped_frequency
    return {"frequencies": np.sort(found)[None, :count]}


def whirl(scene: Path, speed: float, along: tuple[str, str], count: int) -> Mapping[str, Array]:
    """Return the lowest frequencies, rad/s, that an observer at rest sees of a rotor on a base that turns with it.

    The coordinates ``along`` tell the sense of each mode in axes that turn; extrapolated from two numbers of elements.
    """
    found = []
    for factor in (1, 2):
        modes = _refined(scene, factor).linearize(parameters={"turn": speed}).modes()
        y, z = (modes.shapes[list(modes.coordinates).index(name)] for name in along)
        senses = np.where(np.abs(y + 1j * z) > np.abs(y - 1j * z), 1.0, -1.0)
        found.append(np.sort(np.abs(speed + senses * modes.eigenvalues.imag))[:count])
    return {"frequencies": (4.0 * found[1] - found[0])[None] / 3.0}


def flutter(scene: Path, parameter: str, low: float, high: float) -> Mapping[str, Array]:
    """Return the load at which the two lowest angular frequencies meet, and that frequency."""
    model = _model(scene)

    def squares(load: float) -> Array:
        found = -(model.linearize(parameters={parameter: load}).modes().eigenvalues ** 2)
        return np.asarray(found[np.argsort(found.real)][:2])

    load = optimize.brentq(lambda x: float((np.diff(squares(x))[0] ** 2).real), low, high, xtol=1e-12)
    return {"load": np.array([[load]]), "frequency": np.array([[np.sqrt(squares(load).real.mean())]])}


#: Results by the names that rows of ``runs*.toml`` give.
QUANTITIES: Mapping[str, Callable[..., Mapping[str, Array]]] = {
    "probability": probability,
    "rates": rates,
    "frequencies": frequencies,
    "whirl": whirl,
    "flutter": flutter,
    "limit load": limit_load,
}
