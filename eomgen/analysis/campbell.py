"""Campbell diagrams of a compiled model, over a tunable parameter or over a velocity of a steady motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from eomgen.analysis.linearize import linearize
from eomgen.analysis.root_locus import state_of
from eomgen.analysis.steady_motion import motion_along
from eomgen.analysis.symmetries import KnownSymmetries
from eomgen.compiled.arguments import check_finite, numbers
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.linear.campbell import Campbell
from eomgen.linear.campbell_search import campbell
from eomgen.linear.linearization import Linearization
from eomgen.progress import Progress
from eomgen.progress import shown as shown_progress
from eomgen.text import nearest, shown

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Excitations per turn whose crossings are looked for, if none are given.
ORDERS = (1.0,)
_SPEED = "rad/s"


def campbell_over(
    model: CompiledModel,
    speed: str,
    values: Sequence[float],
    orders: Sequence[float] | None,
    whirl: Sequence[tuple[str, str]],
    velocities: Mapping[str, float],
    coordinates: Mapping[str, ArrayLike],
    progress: Progress | bool | None = None,
    **options: Any,
) -> Campbell:
    """Return the diagram; see ``Model.campbell``."""
    array = numbers("values", values)
    if array.ndim != 1 or len(array) < 2:
        what = f"the shape is {array.shape}, and two values and more are needed"
        raise UsageError(Problem("values", what, "numpy.linspace(0.0, 300.0, 61)"))
    check_finite("values", array)
    if (array[1:] <= array[:-1]).any():
        raise UsageError(Problem("values", "they do not increase", "numpy.linspace(0.0, 300.0, 61)"))
    of_motion = [name.removeprefix("v.") for name in model.v_names]
    turning = {name for name, unit in zip(of_motion, model.v_units, strict=True) if unit == _SPEED}
    is_parameter = speed in model.parameters
    if not is_parameter and speed not in of_motion:
        known = [*model.parameters, *of_motion]
        what = f"there is no tunable parameter or velocity {shown(speed)}"
        raise UsageError(Problem("campbell", what, nearest(speed, known) or f"one of {', '.join(known[:12])}"))
    if is_parameter and (velocities or coordinates):
        what = f"{speed} is a parameter, and velocities and coordinates are of a steady motion"
        raise UsageError(Problem("campbell", what, f"a velocity in place of {speed}, or neither"))
    units = {item.name: item.unit for item in model.description.parameters}
    unit = units.get(speed, "") if is_parameter else _SPEED if speed in turning else "m/s"
    if orders is None:
        orders = ORDERS if unit == _SPEED else ()
    bad = [order for order in orders if not order > 0.0]
    if bad:
        raise UsageError(Problem("orders", f"an order is {bad[0]:.6g}", "positive numbers such as (1, 2)"))
    wrong = [pair for pair in whirl if isinstance(pair, str) or len(pair) != 2]
    if wrong:
        what = f"{shown(wrong[0])} is no pair of deflections"
        raise UsageError(Problem("whirl", what, '[("x", "y")], the second a quarter turn from the first'))
    given = dict(options)
    parameters = given.pop("parameters", None) or {}
    initial, t, u = given.pop("initial", None), given.pop("t", 0.0), given.pop("u", None)
    found_once = KnownSymmetries()

    def linearized(value: float, before: Linearization | None) -> Linearization:
        near = None if before is None or options.get("at") == "initial" else state_of(before)
        if is_parameter:
            changed = {**parameters, speed: value}
            return linearize(model, {}, t, u, parameters=changed, initial=near or initial, **given)
        moving = {**velocities, speed: value}
        first = near is None and found_once.fields is None
        try:
            motion = motion_along(model, found_once, moving, coordinates, near or initial, parameters or None, t, u)
        except NumericalError:
            if first:
                raise
            found_once.forget()
            motion = motion_along(model, found_once, moving, coordinates, initial, parameters or None, t, u)
        return linearize(model, {}, t, u, at=motion, parameters=parameters or None)

    with shown_progress(progress, f"{model.name}: {speed}") as report:
        return campbell(speed, unit, array.tolist(), linearized, orders, whirl, report)
