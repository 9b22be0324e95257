"""Files and JSON data of a linear model: modes, matrices, root locus, Campbell diagram, responses, rides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array, Complex
from eomgen.base.csv_tables import write_table
from eomgen.base.files import write_arrays, write_text
from eomgen.products.linear.campbell_plot import Campbell
from eomgen.products.linear.eigenvalue_loci import RootLocus
from eomgen.products.linear.linearization import Linearization
from eomgen.products.linear.modes import Modes
from eomgen.products.linear.spectra import PowerSpectrum, RideTable
from eomgen.products.linear.state_space import KINDS

#: Matrices of the second order, and numbers of a mode.
_SECOND_ORDER = ("M0", "C0", "K0", "B0", "E0")
_OF_MODES = ("frequency", "undamped_frequency", "damped_frequency", "angular_frequency", "damping_ratio")


def to_json_data(
    lin: Linearization, scene: str, table: RideTable | None = None, diagram: Campbell | None = None
) -> dict[str, Any]:
    """Return a linear model as a dictionary of JSON data: scene, reference, names, stability, modes and matrices M0 to
    E0. ``second_order`` and ``undamped_frequencies`` are None for constraints at velocity level, ``multiblade`` without
    such coordinates. A ride is a list ``ride``, one row for each class and speed: ``class``, ``speed`` in m/s, ``rms``
    by output; a Campbell diagram adds its crossings as ``campbell``."""
    more: dict[str, Any] = {} if table is None else {"ride": _ride(table)}
    if diagram is not None:
        more["campbell"] = [{**vars(item), "mode": diagram.number(item.mode)} for item in diagram.crossings]
    multiblade = None
    if lin.multiblade is not None:
        rotors = {rotor.name: [list(group) for group in rotor.groups] for rotor in lin.multiblade.rotors}
        multiblade = {"rotors": rotors, "variation": lin.multiblade.variation}
    reference, modes, space = lin.reference, lin.modes(), lin.state_space()
    second = {name: getattr(lin, name).tolist() for name in _SECOND_ORDER} if lin.free.holonomic else None
    return {
        "scene": scene,
        "about": reference.what,
        "t": reference.t,
        **{name: getattr(reference, name).tolist() for name in "qvz"},
        "coordinates": list(lin.coordinates),
        **{kind: list(getattr(space, kind)) for kind in KINDS},
        "stability": modes.stability,
        "multiblade": multiblade,
        "modes": [_mode(modes, k) for k in range(len(modes))],
        "undamped_frequencies": lin.undamped_frequencies.tolist() if lin.free.holonomic else None,
        "second_order": second,
        **more,
    }


def _mode(modes: Modes, k: int) -> dict[str, Any]:
    value, shape = complex(modes.eigenvalues[k]), np.stack([modes.shapes[:, k].real, modes.shapes[:, k].imag], axis=1)
    return {
        "eigenvalue": [value.real, value.imag],
        **{name: float(getattr(modes, name)[k]) for name in _OF_MODES},
        "oscillating": bool(modes.oscillating[k]),
        "uncertainty": float(modes.uncertainty[k]),
        "shape": dict(zip(modes.coordinates, shape.tolist(), strict=True)),
    }


def _ride(table: RideTable) -> list[dict[str, Any]]:
    rows = []
    for name, values in zip(table.classes, table.values.tolist(), strict=True):
        for speed, numbers in zip(table.speeds.tolist(), values, strict=True):
            rows.append({"class": name, "speed": speed, "rms": dict(zip(table.outputs, numbers, strict=True))})
    return rows


def _write(columns: Mapping[str, Array], path: Path) -> Path:
    """Write columns by name as a CSV table, and return the path."""
    write_table(path, list(columns), np.stack(list(columns.values()), axis=1))
    return path


def write_modes(modes: Modes, path: Path) -> Path:
    """Write modes as a CSV table, one row each, and return the path; shapes as real and imaginary parts by
    coordinate."""
    columns = {"undamped frequency [Hz]": modes.frequency, "damped frequency [Hz]": modes.damped_frequency}
    columns |= {"damping_ratio": modes.damping_ratio}
    columns |= {"real [1/s]": modes.eigenvalues.real, "imaginary [rad/s]": modes.eigenvalues.imag}
    for name, shape in zip(modes.coordinates, modes.shapes, strict=True):
        columns |= {f"{name} real": shape.real, f"{name} imaginary": shape.imag}
    return _write(columns, path)


def write_matrices(lin: Linearization, scene: str, path: Path) -> Path:
    """Write the matrices and their names as NPZ, and return the path. The arrays are A, B, E, C, D, F, the basis R of
    free motions, q, v, a, z, u of the reference, and, if constraints are holonomic, M0, C0, K0, B0, E0 and Z0."""
    space, reference = lin.state_space(), lin.reference
    arrays = {name: getattr(space, name) for name in "ABECDF"}
    if lin.free.holonomic:
        arrays |= {name: getattr(lin, name) for name in (*_SECOND_ORDER, "Z0")}
    arrays |= {"basis": lin.free.R, **{name: getattr(reference, name) for name in "qvazu"}}
    names = {kind: list(getattr(space, kind)) for kind in KINDS}
    names["coordinates"], names["components"] = list(lin.coordinates), list(lin.names.components)
    write_arrays(path, arrays, {"scene": scene, "about": reference.what, "t": reference.t, "names": names})
    return path


def write_root_locus(locus: RootLocus, path: Path) -> Path:
    """Write roots over a parameter as a table: values of the parameter, then real and imaginary parts of each root."""
    columns = {locus.parameter: locus.values}
    for k, root in enumerate(locus.eigenvalues.T, 1):
        columns |= {f"root{k} real [1/s]": root.real, f"root{k} imaginary [rad/s]": root.imag}
    return _write(columns, path)


def write_campbell(diagram: Campbell, path: Path) -> Path:
    """Write a Campbell diagram as a CSV table, and return the path. Columns are the parameter, then damped frequency
    (Hz), damping ratio and whirl (1, -1, 0) of each mode."""
    columns = {diagram.parameter: diagram.values}
    for k in range(diagram.eigenvalues.shape[1]):
        parts = {"damped frequency [Hz]": diagram.frequencies, "damping_ratio": diagram.damping_ratios}
        parts["whirl"] = diagram.whirl.astype(float)
        columns |= {f"mode{diagram.number(k)} {name}": table[:, k] for name, table in parts.items()}
    return _write(columns, path)


def write_ride(table: RideTable, path: Path) -> Path:
    """Write root mean squares on random roads as a table, one row for each class and speed."""
    write_text(path, "".join(f"{','.join(row)}\n" for row in (table.headings, *table.rows)))
    return path


def write_spectra(spectra: Sequence[PowerSpectrum], path: Path) -> Path:
    """Write spectra as a table: frequencies in Hz, then the density of each quantity."""
    named = {f"{item.name} [{item.unit}]" if item.unit else item.name: item.density for item in spectra}
    return _write({"frequency [Hz]": spectra[0].frequencies, **named}, path)


def write_responses(frequencies: Array, responses: Mapping[tuple[str, str], Complex], path: Path) -> Path:
    """Write frequency responses as a CSV table, and return the path. Columns are frequencies in Hz, then real and
    imaginary parts of output over input for each pair (input, output)."""
    columns = {"frequency [Hz]": frequencies}
    for (of_input, output), values in responses.items():
        columns |= {f"{output} / {of_input} real": values.real, f"{output} / {of_input} imaginary": values.imag}
    return _write(columns, path)
