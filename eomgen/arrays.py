"""Arrays of doubles, and what holds for one number or for many, as all rooms write their types."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = float | Array
Flags = bool | np.bool_ | NDArray[np.bool_]
