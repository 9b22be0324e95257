"""Kernels of a pair of waves by SymPy, so that no run imports it: written by
``python -m eomgen.products.waves.second_order.derivation eomgen/products/waves/second_order/derived.py``."""

# fmt: off
from __future__ import annotations

from collections.abc import Mapping

from eomgen.symbolic.kernel import Kernel

KERNELS: Mapping[str, Kernel] = {
    "sum": Kernel(
        (
            ("symbol", "P"), ("number", -1.0), ("symbol", "w_i"), ("symbol", "w_j"), ("add", 2, 3), ("number", 2.0),
            ("pow", 4, 5), ("mul", 1, 6), ("symbol", "kT"), ("symbol", "g"), ("mul", 8, 9), ("add", 7, 10),
            ("pow", 11, 1), ("number", -0.5), ("symbol", "s_i"), ("number", 3.0), ("pow", 2, 15), ("mul", 13, 14, 16),
            ("symbol", "s_j"), ("pow", 3, 15), ("mul", 13, 18, 19), ("symbol", "q"), ("symbol", "lean"),
            ("symbol", "C_i"), ("symbol", "C_j"), ("mul", 1, 22, 23, 24), ("add", 21, 25), ("mul", 1, 2, 3, 26, 4),
            ("add", 17, 20, 27), ("mul", 0, 12, 28), ("pow", 4, 1), ("symbol", "E"), ("mul", 1, 31), ("symbol", "Ch_i"),
            ("symbol", "Ch_j"), ("mul", 22, 33, 34), ("add", 32, 35), ("number", 0.5), ("symbol", "kx_i"),
            ("mul", 37, 38, 2), ("symbol", "kx_j"), ("mul", 37, 40, 3), ("add", 39, 41), ("mul", 1, 36, 42),
            ("symbol", "px"), ("mul", 1, 0, 44, 12, 28), ("add", 43, 45), ("mul", 30, 46), ("symbol", "ky_i"),
            ("mul", 37, 48, 2), ("symbol", "ky_j"), ("mul", 37, 50, 3), ("add", 49, 51), ("mul", 1, 36, 52),
            ("symbol", "py"), ("mul", 1, 0, 54, 12, 28), ("add", 53, 55), ("mul", 30, 56), ("symbol", "Sh_j"),
            ("symbol", "k_j"), ("mul", 33, 58, 59, 3), ("symbol", "Sh_i"), ("symbol", "k_i"), ("mul", 34, 61, 62, 2),
            ("add", 60, 63), ("mul", 37, 22, 64), ("symbol", "lag"), ("symbol", "delta"), ("mul", 67, 3),
            ("symbol", "w"), ("mul", 69, 62), ("add", 68, 70), ("mul", 13, 66, 71), ("symbol", "Pc"),
            ("mul", 73, 12, 28), ("add", 65, 72, 74), ("mul", 30, 75),
        ),
        (29, 47, 57, 76),
    ),
    "difference": Kernel(
        (
            ("symbol", "P"), ("number", -1.0), ("symbol", "w"), ("number", 2.0), ("pow", 2, 3), ("mul", 1, 4),
            ("symbol", "kT"), ("symbol", "g"), ("mul", 6, 7), ("add", 5, 8), ("pow", 9, 1), ("number", -0.5),
            ("symbol", "s_j"), ("symbol", "w_i"), ("pow", 13, 3), ("symbol", "w_j"), ("pow", 15, 3), ("mul", 13, 15),
            ("add", 14, 16, 17), ("mul", 11, 12, 2, 18), ("number", 1.0), ("symbol", "C_i"), ("symbol", "C_j"),
            ("symbol", "lean"), ("mul", 1, 23), ("add", 20, 24), ("mul", 21, 22, 25), ("add", 20, 26),
            ("mul", 1, 2, 13, 15, 27), ("number", 0.5), ("symbol", "dt"), ("number", 3.0), ("pow", 13, 31),
            ("add", 21, 22), ("mul", 29, 30, 21, 22, 32, 33), ("add", 19, 28, 34), ("mul", 0, 10, 35), ("pow", 2, 1),
            ("symbol", "Sh_i"), ("symbol", "Sh_j"), ("mul", 38, 39), ("symbol", "Ch_i"), ("symbol", "Ch_j"),
            ("mul", 41, 42, 25), ("add", 40, 43), ("symbol", "kx_i"), ("mul", 29, 45, 13), ("symbol", "kx_j"),
            ("mul", 29, 47, 15), ("add", 46, 48), ("mul", 1, 44, 49), ("symbol", "px"), ("mul", 1, 0, 51, 10, 35),
            ("add", 50, 52), ("mul", 37, 53), ("symbol", "ky_i"), ("mul", 29, 55, 13), ("symbol", "ky_j"),
            ("mul", 29, 57, 15), ("add", 56, 58), ("mul", 1, 44, 59), ("symbol", "py"), ("mul", 1, 0, 61, 10, 35),
            ("add", 60, 62), ("mul", 37, 63), ("symbol", "Pc"), ("mul", 65, 10, 35), ("mul", 11, 23), ("add", 20, 67),
            ("symbol", "delta"), ("mul", 69, 15), ("symbol", "k_i"), ("mul", 2, 71), ("add", 70, 72), ("mul", 41, 39),
            ("mul", 42, 38), ("add", 74, 75), ("mul", 29, 68, 73, 76), ("symbol", "lag"), ("mul", 29, 71, 13),
            ("symbol", "k_j"), ("mul", 29, 80, 15), ("add", 79, 81), ("mul", 11, 78, 23, 82), ("add", 66, 77, 83),
            ("mul", 37, 84),
        ),
        (36, 54, 64, 85),
    ),
    "degenerate": Kernel(
        (
            ("symbol", "Sh_i"), ("symbol", "Sh_j"), ("mul", 0, 1), ("symbol", "Ch_i"), ("symbol", "Ch_j"),
            ("number", 1.0), ("number", -1.0), ("symbol", "lean"), ("mul", 6, 7), ("add", 5, 8), ("mul", 3, 4, 9),
            ("add", 2, 10), ("number", 0.5), ("symbol", "kx_i"), ("symbol", "w_i"), ("mul", 12, 13, 14),
            ("symbol", "kx_j"), ("symbol", "w_j"), ("mul", 12, 16, 17), ("add", 15, 18), ("mul", 11, 19),
            ("symbol", "ky_i"), ("mul", 12, 21, 14), ("symbol", "ky_j"), ("mul", 12, 23, 17), ("add", 22, 24),
            ("mul", 11, 25), ("symbol", "px"), ("number", -0.25), ("mul", 28, 0, 1), ("mul", 28, 3, 4, 9),
            ("symbol", "P"), ("symbol", "s_i"), ("symbol", "kT"), ("pow", 33, 6), ("symbol", "g"), ("pow", 35, 6),
            ("mul", 12, 31, 32, 14, 17, 34, 36), ("add", 29, 30, 37), ("mul", 27, 38), ("symbol", "py"),
            ("mul", 40, 38), ("number", 0.25), ("symbol", "k_j"), ("mul", 3, 1, 43), ("symbol", "k_i"),
            ("mul", 4, 0, 45), ("add", 44, 46), ("mul", 42, 9, 47), ("mul", 42, 3, 1, 45), ("mul", 42, 4, 0, 43),
            ("number", -0.5), ("symbol", "Pc"), ("mul", 51, 52, 32, 14, 17, 34, 36), ("add", 48, 49, 50, 53),
        ),
        (20, 26, 39, 41, 54),
    ),
}
