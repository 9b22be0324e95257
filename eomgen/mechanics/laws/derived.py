"""Laws derived by SymPy, so that no build imports it: written by
``python -m eomgen.mechanics.laws.derivation eomgen/mechanics/laws/derived.py``."""

# fmt: off
from __future__ import annotations

from collections.abc import Mapping

from eomgen.symbolic.kernel import Kernel

LAWS: Mapping[str, Kernel] = {
    "rotation_of_quaternion": Kernel(
        """1.0, 2.0, -1.0, y, pow 3 1, mul 2 4, z, pow 6 1, mul 2 7, add 5 8, mul 1 9, add 0 10, x, mul 12 3, w, mul
        2 14 6, add 13 15, mul 1 16, mul 14 3, mul 12 6, add 18 19, mul 1 20, mul 14 6, add 22 13, mul 1 23, pow 12
        1, mul 2 25, add 26 8, mul 1 27, add 0 28, mul 3 6, mul 2 14 12, add 30 31, mul 1 32, mul 2 14 3, add 19 34,
        mul 1 35, mul 14 12, add 37 30, mul 1 38, add 26 5, mul 1 40, add 0 41""",
        (11, 17, 21, 24, 29, 33, 36, 39, 42),
    ),
    "virtual_work_of_rigid_body": Kernel(
        """A2, d1, mul 0 1, S01, U20, mul 3 4, S11, U21, mul 6 7, S12, U22, -1.0, U11, mul 11 12, add 10 13, mul 9
        14, A1, d2, mul 11 16 17, S02, U10, mul 11 19 20, S22, U12, mul 11 22 23, add 2 5 8 15 18 21 24, A0, mul 26
        17, U00, mul 11 10, add 28 29, mul 19 30, U01, mul 9 32, U02, mul 22 34, d0, mul 11 0 36, S00, mul 11 38 4,
        mul 11 3 7, add 27 31 33 35 37 39 40, mul 16 36, mul 38 20, mul 11 28, add 12 44, mul 3 45, mul 19 23, mul
        11 26 1, mul 11 6 32, mul 11 9 34, add 42 43 46 47 48 49 50, m, mul 26 52, mul 28 36, mul 32 1, mul 34 17,
        add 53 54 55 56, mul 16 52, mul 20 36, mul 12 1, mul 23 17, add 58 59 60 61, mul 0 52, mul 4 36, mul 7 1,
        mul 10 17, add 63 64 65 66""",
        (25, 41, 51, 57, 62, 67),
    ),
    "regressor_of_rigid_body": Kernel(
        """A0, l0, mul 0 1, A1, l1, mul 3 4, A2, l2, mul 6 7, add 2 5 8, w2, mul 3 10, C00, mul 12 1, C01, r2, add
        14 15, mul 4 16, C02, -1.0, r1, mul 19 20, add 18 21, mul 7 22, w1, mul 19 6 24, add 11 13 17 23 25, w0, mul
        6 27, C11, mul 29 4, mul 19 15, add 14 31, mul 1 32, C12, r0, add 34 35, mul 7 36, mul 19 0 10, add 28 30 33
        37 38, mul 0 24, C22, mul 41 7, add 18 20, mul 1 43, mul 19 35, add 34 45, mul 4 46, mul 19 3 27, add 40 42
        44 47 48, mul 18 24, mul 35 27, mul 19 14 10, add 50 51 52, mul 14 10, mul 20 24, mul 19 34 27, add 54 55
        56, mul 34 27, mul 15 10, mul 19 18 24, add 58 59 60, mul 19 18, add 20 62, mul 27 63, mul 24 36, mul 19 29,
        add 12 66, mul 10 67, add 64 65 68, mul 27 16, mul 19 12, add 41 71, mul 24 72, mul 19 34, add 35 74, mul 10
        75, add 70 73 76, mul 19 41, add 29 78, mul 27 79, mul 19 14, add 15 81, mul 24 82, mul 10 43, add 80 83 84""",
        (9, 26, 39, 49, 53, 57, 61, 69, 77, 85),
    ),
    "kinetic_energy_of_rigid_body": Kernel(
        """S00, 0.5, w1, 2.0, pow 2 3, mul 1 4, w2, pow 6 3, mul 1 7, add 5 8, mul 0 9, S11, w0, pow 12 3, mul 1 13,
        add 14 8, mul 11 15, S22, add 14 5, mul 17 18, d0, v1, mul 21 6, -1.0, v2, mul 23 24 2, add 22 25, mul 20
        26, d1, mul 24 12, v0, mul 23 30 6, add 29 31, mul 28 32, d2, mul 30 2, mul 23 21 12, add 35 36, mul 34 37,
        m, pow 30 3, mul 1 40, pow 21 3, mul 1 42, pow 24 3, mul 1 44, add 41 43 45, mul 39 46, S01, mul 23 48 12 2,
        S02, mul 23 50 12 6, S12, mul 23 52 2 6, add 10 16 19 27 33 38 47 49 51 53""",
        (54,),
    ),
    "virtual_work_of_relative_motion": Kernel(
        """2.0, w0, v1s1, v2s2, add 2 3, mul 1 4, -1.0, v0s1, w1, mul 6 7 8, v0s2, w2, mul 6 10 11, add 5 9 12, mul
        0 13, r2s1, r1s2, mul 6 16, add 15 17, add 14 18, v0s0, add 20 3, mul 8 21, v1s0, mul 6 23 1, v1s2, mul 6 25
        11, add 22 24 26, mul 0 27, r0s2, r2s0, mul 6 30, add 29 31, add 28 32, add 20 2, mul 11 34, v2s0, mul 6 36
        1, v2s1, mul 6 38 8, add 35 37 39, mul 0 40, r1s0, r0s1, mul 6 43, add 42 44, add 41 45, v2, mul 47 8, v1,
        mul 6 49 11, add 48 50, mul 0 51, r0, add 52 53, v0, mul 55 11, mul 6 47 1, add 56 57, mul 0 58, r1, add 59
        60, mul 49 1, mul 6 55 8, add 62 63, mul 0 64, r2, add 65 66""",
        (19, 33, 46, 54, 61, 67),
    ),
    "virtual_work_along_elastic_coordinate": Kernel(
        """2.0, w0, f2v1, -1.0, f1v2, mul 3 4, add 2 5, mul 1 6, w1, f0v2, f2v0, mul 3 10, add 9 11, mul 8 12, w2,
        f1v0, f0v1, mul 3 16, add 15 17, mul 14 18, add 7 13 19, mul 0 20, f0r0, f1r1, f2r2, A0, f0, mul 25 26, A1,
        f1, mul 28 29, A2, f2, mul 31 32, U00, f0s0, mul 34 35, U01, f0s1, mul 37 38, U02, f0s2, mul 40 41, U10,
        f1s0, mul 43 44, U11, f1s1, mul 46 47, U12, f1s2, mul 49 50, U20, f2s0, mul 52 53, U21, f2s1, mul 55 56,
        U22, f2s2, mul 58 59, add 22 23 24 27 30 33 36 39 42 45 48 51 54 57 60, add 21 61""",
        (62,),
    ),
    "kinetic_energy_of_relative_motion": Kernel(
        """0.5, v0v0, mul 0 1, v1v1, mul 0 3, v2v2, mul 0 5, u0, v0, mul 7 8, u1, v1, mul 10 11, u2, v2, mul 13 14,
        v0s2, w1, mul 16 17, v1s0, w2, mul 19 20, v2s1, w0, mul 22 23, -1.0, v0s1, mul 25 26 20, v1s2, mul 25 28 23,
        v2s0, mul 25 30 17, add 2 4 6 9 12 15 18 21 24 27 29 31""",
        (32,),
    ),
    "onset_of_contact": Kernel(
        """-1.0, u, 2.0, pow 1 2, -3.0, mul 2 1, add 4 5, mul 0 3 6, -0.05, 4.0, pow 1 9, -15.0, 8.0, mul 12 1, add
        11 13, mul 8 10 14""",
        (7, 15),
    ),
}
