"""Laws derived by SymPy, so that no build imports it: written by
``python -m eomgen.mechanics.laws.derivation eomgen/mechanics/laws/derived.py``."""

# fmt: off
from __future__ import annotations

from collections.abc import Mapping

from eomgen.symbolic.kernel import Kernel

LAWS: Mapping[str, Kernel] = {
    "rotation_of_quaternion": Kernel(
        (
            ("number", 1.0), ("number", 2.0), ("number", -1.0), ("symbol", "y"), ("pow", 3, 1), ("mul", 2, 4),
            ("symbol", "z"), ("pow", 6, 1), ("mul", 2, 7), ("add", 5, 8), ("mul", 1, 9), ("add", 0, 10),
            ("symbol", "x"), ("mul", 12, 3), ("symbol", "w"), ("mul", 2, 14, 6), ("add", 13, 15), ("mul", 1, 16),
            ("mul", 14, 3), ("mul", 12, 6), ("add", 18, 19), ("mul", 1, 20), ("mul", 14, 6), ("add", 22, 13),
            ("mul", 1, 23), ("pow", 12, 1), ("mul", 2, 25), ("add", 26, 8), ("mul", 1, 27), ("add", 0, 28),
            ("mul", 3, 6), ("mul", 2, 14, 12), ("add", 30, 31), ("mul", 1, 32), ("mul", 2, 14, 3), ("add", 19, 34),
            ("mul", 1, 35), ("mul", 14, 12), ("add", 37, 30), ("mul", 1, 38), ("add", 26, 5), ("mul", 1, 40),
            ("add", 0, 41),
        ),
        (11, 17, 21, 24, 29, 33, 36, 39, 42),
    ),
    "virtual_work_of_rigid_body": Kernel(
        (
            ("symbol", "A2"), ("symbol", "d1"), ("mul", 0, 1), ("symbol", "S01"), ("symbol", "U20"), ("mul", 3, 4),
            ("symbol", "S11"), ("symbol", "U21"), ("mul", 6, 7), ("symbol", "S12"), ("symbol", "U22"), ("number", -1.0),
            ("symbol", "U11"), ("mul", 11, 12), ("add", 10, 13), ("mul", 9, 14), ("symbol", "A1"), ("symbol", "d2"),
            ("mul", 11, 16, 17), ("symbol", "S02"), ("symbol", "U10"), ("mul", 11, 19, 20), ("symbol", "S22"),
            ("symbol", "U12"), ("mul", 11, 22, 23), ("add", 2, 5, 8, 15, 18, 21, 24), ("symbol", "A0"), ("mul", 26, 17),
            ("symbol", "U00"), ("mul", 11, 10), ("add", 28, 29), ("mul", 19, 30), ("symbol", "U01"), ("mul", 9, 32),
            ("symbol", "U02"), ("mul", 22, 34), ("symbol", "d0"), ("mul", 11, 0, 36), ("symbol", "S00"),
            ("mul", 11, 38, 4), ("mul", 11, 3, 7), ("add", 27, 31, 33, 35, 37, 39, 40), ("mul", 16, 36),
            ("mul", 38, 20), ("mul", 11, 28), ("add", 12, 44), ("mul", 3, 45), ("mul", 19, 23), ("mul", 11, 26, 1),
            ("mul", 11, 6, 32), ("mul", 11, 9, 34), ("add", 42, 43, 46, 47, 48, 49, 50), ("symbol", "m"),
            ("mul", 26, 52), ("mul", 28, 36), ("mul", 32, 1), ("mul", 34, 17), ("add", 53, 54, 55, 56), ("mul", 16, 52),
            ("mul", 20, 36), ("mul", 12, 1), ("mul", 23, 17), ("add", 58, 59, 60, 61), ("mul", 0, 52), ("mul", 4, 36),
            ("mul", 7, 1), ("mul", 10, 17), ("add", 63, 64, 65, 66),
        ),
        (25, 41, 51, 57, 62, 67),
    ),
    "regressor_of_rigid_body": Kernel(
        (
            ("symbol", "A0"), ("symbol", "l0"), ("mul", 0, 1), ("symbol", "A1"), ("symbol", "l1"), ("mul", 3, 4),
            ("symbol", "A2"), ("symbol", "l2"), ("mul", 6, 7), ("add", 2, 5, 8), ("symbol", "w2"), ("mul", 3, 10),
            ("symbol", "C00"), ("mul", 12, 1), ("symbol", "C01"), ("symbol", "r2"), ("add", 14, 15), ("mul", 4, 16),
            ("symbol", "C02"), ("number", -1.0), ("symbol", "r1"), ("mul", 19, 20), ("add", 18, 21), ("mul", 7, 22),
            ("symbol", "w1"), ("mul", 19, 6, 24), ("add", 11, 13, 17, 23, 25), ("symbol", "w0"), ("mul", 6, 27),
            ("symbol", "C11"), ("mul", 29, 4), ("mul", 19, 15), ("add", 14, 31), ("mul", 1, 32), ("symbol", "C12"),
            ("symbol", "r0"), ("add", 34, 35), ("mul", 7, 36), ("mul", 19, 0, 10), ("add", 28, 30, 33, 37, 38),
            ("mul", 0, 24), ("symbol", "C22"), ("mul", 41, 7), ("add", 18, 20), ("mul", 1, 43), ("mul", 19, 35),
            ("add", 34, 45), ("mul", 4, 46), ("mul", 19, 3, 27), ("add", 40, 42, 44, 47, 48), ("mul", 18, 24),
            ("mul", 35, 27), ("mul", 19, 14, 10), ("add", 50, 51, 52), ("mul", 14, 10), ("mul", 20, 24),
            ("mul", 19, 34, 27), ("add", 54, 55, 56), ("mul", 34, 27), ("mul", 15, 10), ("mul", 19, 18, 24),
            ("add", 58, 59, 60), ("mul", 19, 18), ("add", 20, 62), ("mul", 27, 63), ("mul", 24, 36), ("mul", 19, 29),
            ("add", 12, 66), ("mul", 10, 67), ("add", 64, 65, 68), ("mul", 27, 16), ("mul", 19, 12), ("add", 41, 71),
            ("mul", 24, 72), ("mul", 19, 34), ("add", 35, 74), ("mul", 10, 75), ("add", 70, 73, 76), ("mul", 19, 41),
            ("add", 29, 78), ("mul", 27, 79), ("mul", 19, 14), ("add", 15, 81), ("mul", 24, 82), ("mul", 10, 43),
            ("add", 80, 83, 84),
        ),
        (9, 26, 39, 49, 53, 57, 61, 69, 77, 85),
    ),
    "kinetic_energy_of_rigid_body": Kernel(
        (
            ("symbol", "S00"), ("number", 0.5), ("symbol", "w1"), ("number", 2.0), ("pow", 2, 3), ("mul", 1, 4),
            ("symbol", "w2"), ("pow", 6, 3), ("mul", 1, 7), ("add", 5, 8), ("mul", 0, 9), ("symbol", "S11"),
            ("symbol", "w0"), ("pow", 12, 3), ("mul", 1, 13), ("add", 14, 8), ("mul", 11, 15), ("symbol", "S22"),
            ("add", 14, 5), ("mul", 17, 18), ("symbol", "d0"), ("symbol", "v1"), ("mul", 21, 6), ("number", -1.0),
            ("symbol", "v2"), ("mul", 23, 24, 2), ("add", 22, 25), ("mul", 20, 26), ("symbol", "d1"), ("mul", 24, 12),
            ("symbol", "v0"), ("mul", 23, 30, 6), ("add", 29, 31), ("mul", 28, 32), ("symbol", "d2"), ("mul", 30, 2),
            ("mul", 23, 21, 12), ("add", 35, 36), ("mul", 34, 37), ("symbol", "m"), ("pow", 30, 3), ("mul", 1, 40),
            ("pow", 21, 3), ("mul", 1, 42), ("pow", 24, 3), ("mul", 1, 44), ("add", 41, 43, 45), ("mul", 39, 46),
            ("symbol", "S01"), ("mul", 23, 48, 12, 2), ("symbol", "S02"), ("mul", 23, 50, 12, 6), ("symbol", "S12"),
            ("mul", 23, 52, 2, 6), ("add", 10, 16, 19, 27, 33, 38, 47, 49, 51, 53),
        ),
        (54,),
    ),
    "virtual_work_of_relative_motion": Kernel(
        (
            ("number", 2.0), ("symbol", "w0"), ("symbol", "v1s1"), ("symbol", "v2s2"), ("add", 2, 3), ("mul", 1, 4),
            ("number", -1.0), ("symbol", "v0s1"), ("symbol", "w1"), ("mul", 6, 7, 8), ("symbol", "v0s2"),
            ("symbol", "w2"), ("mul", 6, 10, 11), ("add", 5, 9, 12), ("mul", 0, 13), ("symbol", "r2s1"),
            ("symbol", "r1s2"), ("mul", 6, 16), ("add", 15, 17), ("add", 14, 18), ("symbol", "v0s0"), ("add", 20, 3),
            ("mul", 8, 21), ("symbol", "v1s0"), ("mul", 6, 23, 1), ("symbol", "v1s2"), ("mul", 6, 25, 11),
            ("add", 22, 24, 26), ("mul", 0, 27), ("symbol", "r0s2"), ("symbol", "r2s0"), ("mul", 6, 30),
            ("add", 29, 31), ("add", 28, 32), ("add", 20, 2), ("mul", 11, 34), ("symbol", "v2s0"), ("mul", 6, 36, 1),
            ("symbol", "v2s1"), ("mul", 6, 38, 8), ("add", 35, 37, 39), ("mul", 0, 40), ("symbol", "r1s0"),
            ("symbol", "r0s1"), ("mul", 6, 43), ("add", 42, 44), ("add", 41, 45), ("symbol", "v2"), ("mul", 47, 8),
            ("symbol", "v1"), ("mul", 6, 49, 11), ("add", 48, 50), ("mul", 0, 51), ("symbol", "r0"), ("add", 52, 53),
            ("symbol", "v0"), ("mul", 55, 11), ("mul", 6, 47, 1), ("add", 56, 57), ("mul", 0, 58), ("symbol", "r1"),
            ("add", 59, 60), ("mul", 49, 1), ("mul", 6, 55, 8), ("add", 62, 63), ("mul", 0, 64), ("symbol", "r2"),
            ("add", 65, 66),
        ),
        (19, 33, 46, 54, 61, 67),
    ),
    "virtual_work_along_elastic_coordinate": Kernel(
        (
            ("number", 2.0), ("symbol", "w0"), ("symbol", "f2v1"), ("number", -1.0), ("symbol", "f1v2"), ("mul", 3, 4),
            ("add", 2, 5), ("mul", 1, 6), ("symbol", "w1"), ("symbol", "f0v2"), ("symbol", "f2v0"), ("mul", 3, 10),
            ("add", 9, 11), ("mul", 8, 12), ("symbol", "w2"), ("symbol", "f1v0"), ("symbol", "f0v1"), ("mul", 3, 16),
            ("add", 15, 17), ("mul", 14, 18), ("add", 7, 13, 19), ("mul", 0, 20), ("symbol", "f0r0"),
            ("symbol", "f1r1"), ("symbol", "f2r2"), ("symbol", "A0"), ("symbol", "f0"), ("mul", 25, 26),
            ("symbol", "A1"), ("symbol", "f1"), ("mul", 28, 29), ("symbol", "A2"), ("symbol", "f2"), ("mul", 31, 32),
            ("symbol", "U00"), ("symbol", "f0s0"), ("mul", 34, 35), ("symbol", "U01"), ("symbol", "f0s1"),
            ("mul", 37, 38), ("symbol", "U02"), ("symbol", "f0s2"), ("mul", 40, 41), ("symbol", "U10"),
            ("symbol", "f1s0"), ("mul", 43, 44), ("symbol", "U11"), ("symbol", "f1s1"), ("mul", 46, 47),
            ("symbol", "U12"), ("symbol", "f1s2"), ("mul", 49, 50), ("symbol", "U20"), ("symbol", "f2s0"),
            ("mul", 52, 53), ("symbol", "U21"), ("symbol", "f2s1"), ("mul", 55, 56), ("symbol", "U22"),
            ("symbol", "f2s2"), ("mul", 58, 59), ("add", 22, 23, 24, 27, 30, 33, 36, 39, 42, 45, 48, 51, 54, 57, 60),
            ("add", 21, 61),
        ),
        (62,),
    ),
    "kinetic_energy_of_relative_motion": Kernel(
        (
            ("number", 0.5), ("symbol", "v0v0"), ("mul", 0, 1), ("symbol", "v1v1"), ("mul", 0, 3), ("symbol", "v2v2"),
            ("mul", 0, 5), ("symbol", "u0"), ("symbol", "v0"), ("mul", 7, 8), ("symbol", "u1"), ("symbol", "v1"),
            ("mul", 10, 11), ("symbol", "u2"), ("symbol", "v2"), ("mul", 13, 14), ("symbol", "v0s2"), ("symbol", "w1"),
            ("mul", 16, 17), ("symbol", "v1s0"), ("symbol", "w2"), ("mul", 19, 20), ("symbol", "v2s1"),
            ("symbol", "w0"), ("mul", 22, 23), ("number", -1.0), ("symbol", "v0s1"), ("mul", 25, 26, 20),
            ("symbol", "v1s2"), ("mul", 25, 28, 23), ("symbol", "v2s0"), ("mul", 25, 30, 17),
            ("add", 2, 4, 6, 9, 12, 15, 18, 21, 24, 27, 29, 31),
        ),
        (32,),
    ),
    "onset_of_contact": Kernel(
        (
            ("number", -1.0), ("symbol", "u"), ("number", 2.0), ("pow", 1, 2), ("number", -3.0), ("mul", 2, 1),
            ("add", 4, 5), ("mul", 0, 3, 6), ("number", -0.05), ("number", 4.0), ("pow", 1, 9), ("number", -15.0),
            ("number", 8.0), ("mul", 12, 1), ("add", 11, 13), ("mul", 8, 10, 14),
        ),
        (7, 15),
    ),
}
