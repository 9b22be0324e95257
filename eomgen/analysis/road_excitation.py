"""The random roads of a scene as an excitation of its linear models."""

from __future__ import annotations

from typing import TYPE_CHECKING

from eomgen.errors import Problem, UsageError
from eomgen.spectra import Road, RoadExcitation
from eomgen.text import listed

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


def road_excitation(model: CompiledModel, road: Road | None, speed: float | None) -> RoadExcitation:
    """Return the roads that the inputs of a scene are; see ``Model.road_excitation``."""
    under = {item.name: item.road for item in model.description.inputs if item.road is not None}
    if not under:
        what = "no input of the scene is a random road"
        hint = '[inputs] front = { road = { class = "C", speed = 20 } }, or eomgen.spectra.RoadExcitation by hand'
        raise UsageError(Problem("road_excitation", what, hint))
    classes = {item.road_class for item in under.values()}
    speeds = {item.speed for item in under.values()}
    if road is None and len(classes) > 1:
        what = f"the roads of the scene are of the classes {listed(sorted(classes))}"
        raise UsageError(Problem("road_excitation", what, 'one of them: road=eomgen.spectra.Road("C")'))
    if speed is None and len(speeds) > 1:
        what = f"the wheels of the scene have the speeds {listed(f'{value:.6g}' for value in sorted(speeds))} m/s"
        raise UsageError(Problem("road_excitation", what, "one of them: speed=20.0"))
    tracks = {seed: float(k) for k, seed in enumerate(dict.fromkeys(item.seed for item in under.values()))}
    return RoadExcitation(
        Road(classes.pop()) if road is None else road,
        speeds.pop() if speed is None else speed,
        {name: item.offset for name, item in under.items()},
        {name: tracks[item.seed] for name, item in under.items()},
        "independent",
    )
