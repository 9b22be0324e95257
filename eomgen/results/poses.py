"""Poses of the bodies of a run by name, with the scenery of a picture that products add."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults, UnknownName
from eomgen.base.products import objects_of
from eomgen.errors import Problem
from eomgen.results.dense_output import BATCH
from eomgen.system.description import BASE

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


class PosesAndScenery(NamedTuple):
    """Poses and scenery of a run: pose of each body (nt, 7), and the data of a picture, which are empty if no
    product adds any."""

    poses: Mapping[str, Array]
    scenery: Mapping[str, Any]


class BodyPoses(NamedResults[Array]):
    """Poses of bodies by name, which distinguish points from bodies.

    Parameters
    ----------
    poses, scenery : of ``PosesAndScenery``
    """

    def __init__(self, poses: Mapping[str, Array], scenery: Mapping[str, Any]) -> None:
        super().__init__("pose", poses)
        self.points = [item["name"] for item in scenery.get("points", ())]

    def __missing__(self, name: object) -> Array:
        if name in self.points:
            hint = f'outputs["{name}"] of the solution, with {name} = {{ position = "{name}" }} among the outputs'
            raise UnknownName(Problem("", f"{name} is a point, and only bodies have poses [E1284]", hint))
        return super().__missing__(name)


def poses_and_scenery(
    model: CompiledModel, t: Array, q: Array, p: Array, inputs: Callable[[Array], Mapping[str, Array]] | None = None
) -> PosesAndScenery:
    """Return the poses of all bodies by name, (nt, 7), and of the base if the base moves, with data of a picture. `t`
    (nt,) are in s, `q` is (nt, nq), `p` (np,) or (nt, np). The data are added by products, whose functions stand in the
    register ``eomgen.scenery``. The term ``poses`` is compiled if missing in the model.

    Parameters
    ----------
    inputs : callable, optional
        From times (nt,) to the inputs there, which move roads; without it such roads are left out.
    """
    parts = [slice(start, start + BATCH) for start in range(0, len(t), BATCH)]
    model = model.having(("poses",))
    pose = np.concatenate([model.evaluate("poses", q[part], t=t[part], parameters=p)["pose"] for part in parts])
    poses = {name: pose[:, index] for index, name in enumerate(model.bodies)}
    if "base" in model.functions:
        poses[BASE] = np.concatenate([model.base(t[part], parameters=p)[:, :7] for part in parts])
    items = (item for add in objects_of("eomgen.scenery") for item in add(model, poses, t, p, inputs).items())
    return PosesAndScenery(poses, dict(items))
