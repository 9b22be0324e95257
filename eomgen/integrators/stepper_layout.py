"""What a stepper's state, rows, settings and statistics hold, in order: C and Python agree on it here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from eomgen.integrators.families.generalized_alpha import GENERALIZED_ALPHA, INDEX_3, SPATIAL
from eomgen.integrators.families.hermite import HERMITE
from eomgen.integrators.families.partitioned import PARTITIONED
from eomgen.integrators.families.runge_kutta import RKMK
from eomgen.integrators.families.taylor import TAYLOR

#: The stepper's part of the interface of every compiled model; ``templates/c/interface/stepper.c.jinja`` implements it.
STEPPER_CDEF = """\
long eomgen_stepper_size(int what);
int eomgen_initialize(const double *parameters, const double *settings, const double *u_table, double *state, double *workspace);
int eomgen_run(const double *parameters, const double *settings, double *state, double *workspace, long steps, long record_every,
    const double *u_table, double *record, long *recorded);
const char *eomgen_status_text(int status);
"""
#: Meaning of the argument of ``eomgen_stepper_size``.
STEPPER_SIZES = ("state", "settings", "row", "rows_per_step", "workspace")
_SETTINGS = {
    GENERALIZED_ALPHA: ("rtol", "atol", "max_iterations", "max_halvings", "reuse"),
    RKMK: (),
    PARTITIONED: (),
    TAYLOR: (),
    HERMITE: (),
}
#: Methods that call the functions of the recurrence of Taylor coefficients.
SERIES_FAMILIES = (TAYLOR, HERMITE)
_STATISTICS = ("steps", "newton_iterations", "factorizations", "halvings", "evaluations", "max_residual")
_CONSTRAINT_STATISTICS = ("max_constraint", "max_constraint_velocity", "max_eta", "max_rounding", "pivot_ratio")
_TAYLOR_STATISTICS = ("expansions", "rejections")
_PARTITION_STATISTICS = ("partitions", "max_constraint", "max_constraint_velocity", "max_pivot_ratio", "singular_passages")


def default_settings(data: Mapping[str, Any]) -> dict[str, float]:
    """Return the settings by name, in the order of the flat array, with the values of ``Program.method``."""
    known = {**data, "reuse": 1, "perturb": 1}
    perturbed = ("perturb",) if data.get("form") == INDEX_3 and data["unknowns"]["holonomic"] else ()
    return {name: float(known[name]) for name in ("step", *data.get("parameters", ()), *_SETTINGS[data["family"]], *perturbed)}


def statistics_names(data: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what the stepper counts and measures; those whose names begin with ``max_``, and ``pivot_ratio``, are no counts."""
    if data["family"] == PARTITIONED:
        return (*_STATISTICS, *_PARTITION_STATISTICS)
    if data["family"] == TAYLOR:
        return (*_STATISTICS, *_TAYLOR_STATISTICS)
    constrained = data["family"] == GENERALIZED_ALPHA and data["unknowns"]["lam"]
    return (*_STATISTICS, *(_CONSTRAINT_STATISTICS if constrained else ()))


def row_layout(data: Mapping[str, Any], nq: int, nv: int, nz: int = 0) -> dict[str, slice]:
    """Return where each quantity is in a row of the record: ``t, q, v, vdot``, ``lam`` of constrained systems, and ``z``."""
    return _layout({"t": 1, "q": nq, "v": nv, "vdot": nv} | _multiplier_sizes(data, "lam") | _state_sizes(nz, "z"))


def state_layout(data: Mapping[str, Any], nq: int, nv: int, nz: int = 0, nu: int = 0, np: int = 0) -> dict[str, slice]:
    """Return where each quantity is in the flat state: ``t, q, v, vdot, ...``, then the statistics by name.

    ``u`` and ``p`` are the inputs and parameters with which ``vdot`` was evaluated; steps by series have theirs in the workspace.
    """
    sizes: dict[str, int] = {"t": 1, "q": nq, "v": nv, "vdot": nv}
    if data["family"] == GENERALIZED_ALPHA:
        lam = _multiplier_sizes(data, "lam")
        eta = _multiplier_sizes(data, "eta")
        sizes |= lam | {"a": nv} | eta | ({"inverse_inertia": nv} if eta else {}) | {"a_before": 2 * nv}
        sizes |= {"mean_before": 3 * nv} if data["variant"] == SPATIAL else {}
        sizes |= {f"{name}_before": 2 * size for name, size in lam.items()}
        sizes |= _state_sizes(nz, "z", "zdot", "z_rate") | _state_sizes(2 * nz, "z_rate_before")
        sizes |= dict.fromkeys(("history", "predictor_order", *data["parameters"]), 1)
    if data["family"] == PARTITIONED:
        sizes |= _multiplier_sizes(data, "lam") | {"dependent": data["unknowns"]["lam"]}
        sizes |= {"largest_regularity": 1, "regular_t": 2, "regular_vdot": 2 * nv, "regular_history": 1, "singularity_near": 1}
    if data["family"] != GENERALIZED_ALPHA:
        sizes |= _state_sizes(nz, "z", "zdot")
    sizes |= {"angle_remainder": len(data["turning"])} if data["turning"] else {}
    if data["family"] not in SERIES_FAMILIES:
        sizes |= ({"u": nu} if nu else {}) | ({"p": np} if np else {})
    sizes |= dict.fromkeys(("step", "origin", "count", *statistics_names(data)), 1)
    return _layout(sizes)


def _multiplier_sizes(data: Mapping[str, Any], name: str) -> dict[str, int]:
    size = data["unknowns"][name] if "unknowns" in data else 0
    return {name: size} if size else {}


def _state_sizes(size: int, *names: str) -> dict[str, int]:
    return dict.fromkeys(names, size) if size else {}


def _layout(sizes: Mapping[str, int]) -> dict[str, slice]:
    layout, start = {}, 0
    for name, size in sizes.items():
        layout[name] = slice(start, start + size)
        start += size
    return layout
