"""Files and JSON data of a linear model: modes, matrices, root locus, frequency responses."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.arrays import Array
from eomgen.files import write_arrays, write_table
from eomgen.linear.linearization import Linearization
from eomgen.linear.modes import Modes
from eomgen.linear.root_locus import RootLocus

Complex = NDArray[np.complex128]


def described(lin: Linearization, scene: str) -> dict[str, Any]:
    """Return a linear model as JSON data: what it is about, its names, modes and matrices."""
    reference, modes, space = lin.reference, lin.modes(), lin.state_space()
    second = (
        {name: getattr(lin, name).tolist() for name in ("M0", "C0", "K0", "B0", "E0")} if lin.free.holonomic else None
    )
    return {
        "scene": scene,
        "about": reference.what,
        "t": reference.t,
        "q": reference.q.tolist(),
        "v": reference.v.tolist(),
        "z": reference.z.tolist(),
        "coordinates": list(lin.coordinates),
        "states": list(space.states),
        "inputs": list(space.inputs),
        "disturbances": list(space.disturbances),
        "outputs": list(space.outputs),
        "stability": modes.stability,
        "modes": [_mode(modes, k) for k in range(len(modes))],
        "undamped_frequencies": lin.undamped_frequencies.tolist() if lin.free.holonomic else None,
        "second_order": second,
    }


def _mode(modes: Modes, k: int) -> dict[str, Any]:
    value = complex(modes.eigenvalues[k])
    return {
        "eigenvalue": [value.real, value.imag],
        "frequency": float(modes.frequency[k]),
        "angular_frequency": float(modes.angular_frequency[k]),
        "damping_ratio": float(modes.damping_ratio[k]),
        "oscillating": bool(modes.oscillating[k]),
        "uncertainty": float(modes.uncertainty[k]),
        "shape": {
            name: [x.real, x.imag] for name, x in zip(modes.coordinates, modes.shapes[:, k].tolist(), strict=True)
        },
    }


def write_modes(modes: Modes, path: Path) -> Path:
    """Write modes as a table, one row each; shapes as real and imaginary parts by coordinate."""
    names = ["frequency [Hz]", "damping_ratio", "real [1/s]", "imaginary [rad/s]"]
    names += [f"{name} {part}" for name in modes.coordinates for part in ("real", "imaginary")]
    shapes = np.stack([modes.shapes.real, modes.shapes.imag], axis=1).reshape(2 * len(modes.coordinates), len(modes))
    values = modes.eigenvalues
    write_table(
        path, names, np.stack([modes.frequency, modes.damping_ratio, values.real, values.imag, *shapes], axis=1)
    )
    return path


def write_matrices(lin: Linearization, scene: str, path: Path) -> Path:
    """Write the matrices and their names: M0, C0, K0, B0, E0 if there are any, A, B, E, C, D, F, and the state."""
    space, reference = lin.state_space(), lin.reference
    arrays = {name: getattr(space, name) for name in "ABECDF"}
    if lin.free.holonomic:
        arrays |= {name: getattr(lin, name) for name in ("M0", "C0", "K0", "B0", "E0", "Z0")}
    arrays |= {
        "basis": lin.free.R,
        "q": reference.q,
        "v": reference.v,
        "a": reference.a,
        "z": reference.z,
        "u": reference.u,
    }
    names = {name: list(getattr(space, name)) for name in ("states", "inputs", "disturbances", "outputs")}
    names["coordinates"], names["components"] = list(lin.coordinates), list(lin.names.components)
    write_arrays(path, arrays, {"scene": scene, "about": reference.what, "t": reference.t, "names": names})
    return path


def write_root_locus(locus: RootLocus, path: Path) -> Path:
    """Write roots over a parameter as a table: its values, then real and imaginary parts of each root."""
    names = [locus.parameter]
    names += [
        f"root{k} {part}" for k in range(locus.eigenvalues.shape[1]) for part in ("real [1/s]", "imaginary [rad/s]")
    ]
    parts = np.stack([locus.eigenvalues.real, locus.eigenvalues.imag], axis=2).reshape(len(locus.values), -1)
    write_table(path, names, np.concatenate([locus.values[:, np.newaxis], parts], axis=1))
    return path


def write_responses(frequencies: Array, responses: Mapping[tuple[str, str], Complex], path: Path) -> Path:
    """Write frequency responses as a table: frequencies in Hz, then real and imaginary parts of output over input."""
    names, columns = ["frequency [Hz]"], [frequencies]
    for (of_input, output), values in responses.items():
        names += [f"{output} / {of_input} {part}" for part in ("real", "imaginary")]
        columns += [values.real, values.imag]
    write_table(path, names, np.stack(columns, axis=1))
    return path
