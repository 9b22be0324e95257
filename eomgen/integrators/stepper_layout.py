"""Layout of a stepper's flat arrays (state, samples, settings, statistics), read from ``Program.method``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

#: The stepper's part of the interface of every compiled model; ``templates/c/interface/stepper.c.jinja`` implements it.
STEPPER_CDEF = """\
long eomgen_stepper_size(int what);
int eomgen_initialize(const double *parameters, const double *settings, const double *u_table, double *state,
    double *workspace);
int eomgen_run(const double *parameters, const double *settings, double *state, double *workspace, long steps,
    long record_every, const double *u_table, double *record, long *recorded);
int eomgen_run_inputs(const double *parameters, const double *settings, double *state, double *workspace, long steps,
    const double *u, const double *u_end);
const char *eomgen_status_text(int status);
"""
#: What ``eomgen_run_inputs`` returns, without a step, where an input is not a finite number.
INPUT_NOT_FINITE = -2
#: Meaning of the argument of ``eomgen_stepper_size``; with events, also where their log and its length are in the
#: workspace, and the size of an entry, all in bytes; else -1.
STEPPER_SIZES = ("state", "settings", "row", "rows_per_step", "workspace", "found", "found_count", "event")


def default_settings(data: Mapping[str, Any]) -> dict[str, float]:
    """Return the settings by name, in the order of the flat array, with the values of ``Program.method``."""
    return {item["name"]: float(item["default"]) for item in data["settings"]}


def statistics_kinds(data: Mapping[str, Any]) -> dict[str, str]:
    """Return the C type of each statistic by name: ``long`` for counts, ``real`` for measures."""
    return {item["name"]: item["kind"] for item in data["state"] if item["group"] == "statistics"}


def row_layout(data: Mapping[str, Any]) -> dict[str, slice]:
    """Return the slice of each quantity in a sample: ``t, q, v, vdot``, ``lam`` with constraints, and ``z``."""
    return _layout((name, size) for name, size in data["row"])


def state_layout(data: Mapping[str, Any]) -> dict[str, slice]:
    """Return the slice of each quantity in the flat state: ``t, q, v, vdot, ...``, then the statistics by name.

    ``u`` and ``p`` are the inputs and parameters with which ``vdot`` was evaluated; steps by series have theirs in the
    workspace.
    """
    return _layout((item["name"], max(item["size"], 1)) for item in data["state"])


def _layout(sizes: Iterable[tuple[str, int]]) -> dict[str, slice]:
    layout, start = {}, 0
    for name, size in sizes:
        layout[name] = slice(start, start + size)
        start += size
    return layout
