"""The key ``follow`` of the base, which then goes with the surface of waves."""

from __future__ import annotations

from eomgen.base.data import replace
from eomgen.base.messages import shown
from eomgen.formula.nodes import Operation, Vector, quantity_of
from eomgen.products.waves.formula.fields import ELEVATION, SLOPE, WaveField
from eomgen.scene.bodies.model import Base
from eomgen.scene.reading.key_metadata import AddedKey, Table, key, optional
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.values import Values
from eomgen.scene.rotations import Rotation


class SurfaceFollowing(Table):
    """How the base goes with the surface of the water."""

    waves: str = key("waves whose surface the base follows", refers="waves", kind="wave")
    tilt: bool = key("true: z of the base is normal to the surface; false: the base only goes up and down", True)


def read_follow(entry: SurfaceFollowing, base: Base, values: Values) -> Base:
    """Return the base with the elevation of the waves added to the position and, with ``tilt``, rotations by their
    slope before other rotations; the base unchanged for unknown waves, which are reported."""
    known, name = values.names.entries.get("waves", {}), entry.waves
    values.mentioned.add(("waves", name))
    if not check_reference("base.follow.waves", name, known, "wave", values.report):
        return base
    position, tilt = _afloat(known[name], base.position)
    if not entry.tilt:
        return replace(base, position=position)
    return replace(base, position=position, rotations=(*tilt, *base.rotations), added_by=("follow",) * len(tilt))


def _afloat(waves: WaveField, position: Vector) -> tuple[Vector, tuple[Rotation, Rotation]]:
    """Return the position in scene axes of a place whose z counts from the surface, and the two rotations that make z
    normal to the surface there: about y and then about x, so that x stays above the direction of x."""
    x, y, z = position
    along, across = (quantity_of(SLOPE, waves, (x, y), component) for component in range(2))
    pitch = -Operation("atan", (along,))
    roll = Operation("atan", (across * Operation("cos", (pitch,)),))
    tilt = Rotation((0.0, 1.0, 0.0), pitch), Rotation((1.0, 0.0, 0.0), roll)
    return (x, y, z + waves.level + quantity_of(ELEVATION, waves, (x, y))), tilt


def _example(value: object) -> str:
    name = shown(value)[1:-1] if isinstance(value, str) else "NAME"
    return f'follow = {{ waves = "{name}" }}'


FOLLOW = AddedKey(
    "base",
    "follow",
    SurfaceFollowing | None,
    optional("go with the surface of waves, as a small boat does"),
    read_follow,
    _example,
    {"waves": '"sea"'},
)
