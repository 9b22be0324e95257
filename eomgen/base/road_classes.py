"""Roughness of the road classes of ISO 8608:2016 (table C.1): geometric mean of G_d(n0) at n0 = 0.1 cycle/m."""

from __future__ import annotations

#: Reference spatial frequency n0, cycle/m.
REFERENCE_FREQUENCY = 0.1
#: G_d(n0) by class, m^3; each class has four times the roughness of the one before.
ROUGHNESS = {name: 16e-6 * 4.0**power for power, name in enumerate("ABCDEFGH")}
#: Spatial frequencies that the standard describes, cycle/m.
FREQUENCY_RANGE = (0.011, 2.83)
