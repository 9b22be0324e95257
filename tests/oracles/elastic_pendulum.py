"""The elastic pendulum in space of `exudyn_beams.Pendulum`: positions that EXUDYN's beams converge to.

Made by `python -m tests.oracles.exudyn_beams` with EXUDYN 1.13.6: 16 and 32 elements, 0.25 ms steps, extrapolated;
good to 2e-4 m.
"""

from tests.anchors import anchor

TIMES = (0.5, 1.0, 1.5, 2.0)  # s
MIDDLE = (
    (0.71063, 0.45208, -0.53909),
    (-0.20554, 0.03202, -0.97812),
    (-0.28372, -0.58100, -0.76284),
    (0.56748, -0.45116, -0.68877),
)
TIP = (
    (1.42257, 0.90925, -1.07214),
    tuple(anchor("elastic_pendulum").reference[:3]),
    (-0.57744, -1.16714, -1.51793),
    tuple(anchor("elastic_pendulum").reference[3:]),
)
