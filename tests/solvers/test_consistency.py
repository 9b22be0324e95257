"""Messages on constraints that cannot be met together."""

from __future__ import annotations

import numpy as np

from eomgen.solvers.consistency import _lengths


def test_strains_of_beams_that_do_not_stretch_are_told_by_their_sum() -> None:
    names = [f"{beam}: no stretch of element {k}" for beam in ("rope", "cord", "tight") for k in (1, 2)]
    names.append("pin: x")
    left = np.array([0.3, 0.2, -0.1, -0.4, 1e-15, 0.0, 3.0])
    (longer, shorter) = _lengths(names, left, np.full(7, 1e-9))
    assert longer[0] == "the beam rope would have to be longer by more than 0.5 m, and it does not stretch"
    assert shorter[0] == "the beam cord would have to be shorter by more than 0.5 m, and it does not stretch"
    assert longer[1].startswith("a longer beam") and shorter[1].startswith("an initial shape that is bent")
