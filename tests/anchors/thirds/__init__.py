"""Third solutions of runs: the same machine from equations written for it, to judge which program is off."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from tests.anchors.thirds.drive_trains import FRICTION
from tests.anchors.thirds.flights_and_mechanisms import RUNS
from tests.anchors.thirds.freecad_bodies import FREECAD
from tests.anchors.thirds.frequencies import FREQUENCIES
from tests.anchors.thirds.impacts import IMPACTS
from tests.anchors.thirds.linkages import LINKAGES
from tests.anchors.thirds.modelica_models import MODELICA
from tests.anchors.thirds.modelica_motions import MOTIONS
from tests.anchors.thirds.quantities import QUANTITIES
from tests.anchors.thirds.rods_and_orbits import RODS_AND_ORBITS

__all__ = ["THIRDS"]

#: Third solutions by the names that rows of ``runs*.toml`` give.
THIRDS: Mapping[str, Callable[[NDArray[np.float64]], Mapping[str, NDArray[np.float64]]]] = {
    **RODS_AND_ORBITS,
    **MODELICA,
    **MOTIONS,
    **FRICTION,
    **FREECAD,
    **RUNS,
    **FREQUENCIES,
    **IMPACTS,
    **QUANTITIES,
    **LINKAGES,
}
