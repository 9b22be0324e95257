"""All partials of a constrained mechanical system with internal states at one state; absent blocks are empty.

M da + C dv + K dq + Rz dz + J^T dlam = B du + E dw            dzdot = Fq dq + Fv dv + Fz dz + Fu du + Fw dw
J dv + Z dq = 0,  J da + Av dv + Aq dq = 0                      dy = Yq dq + Yv dv + Ya da + Yz dz + Ylam dlam + Yu
du + Yw dw
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from eomgen.base.arrays import Array


@dataclass(frozen=True)
class Partials:
    """Partials at one state; dq is left-trivialised, dv and da are changes of components.

    Attributes
    ----------
    M, C, K : (nv, nv) of the residual in a, v and q, multipliers held
    B, E : (nv, nu) and (nv, nw): forces by inputs u and by disturbances w
    Rz : (nv, nz) of the residual in internal states
    Fq, Fv, Fz, Fu, Fw : (nz, ...) of the rates of internal states
    Yq, Yv, Ya, Yz, Ylam, Yu, Yw : (ny, ...) of outputs
    J : (rows, nv) constraint Jacobian, the ``holonomic`` first rows at position level, the others at velocity level
    Z : (rows, nv) partials of the rows' rates in q
    Aq, Av : (rows, nv) partials of the rows' accelerations in q and v
    """

    M: Array
    C: Array
    K: Array
    B: Array
    E: Array
    Rz: Array
    Fq: Array
    Fv: Array
    Fz: Array
    Fu: Array
    Fw: Array
    Yq: Array
    Yv: Array
    Ya: Array
    Yz: Array
    Ylam: Array
    Yu: Array
    Yw: Array
    J: Array
    Z: Array
    Aq: Array
    Av: Array
    holonomic: int = 0

    @staticmethod
    def of(
        blocks: Mapping[str, Array], inputs: int, disturbances: int, outputs: int = 0, holonomic: int = 0
    ) -> Partials:
        """Return partials from named matrices; M, C and K must be among them."""
        nv = len(blocks["M"])
        rows = len(blocks["J"]) if "J" in blocks else 0
        nz = blocks["Rz"].shape[1] if "Rz" in blocks else 0
        columns = {"q": nv, "v": nv, "a": nv, "z": nz, "u": inputs, "w": disturbances, "lam": rows}
        shapes = {
            "M": (nv, nv),
            "C": (nv, nv),
            "K": (nv, nv),
            "B": (nv, inputs),
            "E": (nv, disturbances),
            "Rz": (nv, nz),
        }
        shapes |= {f"F{letter}": (nz, columns[letter]) for letter in "qvzuw"}
        shapes |= {f"Y{letter}": (outputs, size) for letter, size in columns.items()}
        shapes |= dict.fromkeys(("J", "Z", "Aq", "Av"), (rows, nv))
        partials = {
            name: np.array(blocks.get(name, np.zeros(shape)), dtype=float).reshape(shape)
            for name, shape in shapes.items()
        }
        return Partials(**partials, holonomic=holonomic)
