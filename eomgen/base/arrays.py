"""Array types that all rooms share, and predicates that hold for one number or for an array."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Numbers = float | Array
Flags = bool | np.bool_ | NDArray[np.bool_]
