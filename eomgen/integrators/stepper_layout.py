"""Layout of a stepper's flat arrays (state, samples, settings, statistics), read from ``Program.method``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from eomgen.base.messages import close_names
from eomgen.errors import Problem, UsageError

#: The stepper's part of the interface of every compiled model; ``templates/c/interface/stepper.c.jinja`` implements
#: this part.
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
#: Status of ``eomgen_run_inputs``, without a step, if an input is not a finite number.
INPUT_NOT_FINITE = -2
#: Meaning of the argument of ``eomgen_stepper_size``; with events, also the place of the log and of the log's length in
#: the workspace, and the size of an entry, all in bytes; else -1.
STEPPER_SIZES = ("state", "settings", "row", "rows_per_step", "workspace", "found", "found_count", "event")


def default_settings(data: Mapping[str, Any]) -> dict[str, float]:
    """Return the settings by name, in the order of the flat array, with the values of ``Program.method``."""
    return {item["name"]: float(item["default"]) for item in data["settings"]}


def checked_setting(data: Mapping[str, Any], name: str, value: float) -> float:
    """Return a caller's or a scene's value of the setting `name` as a float, after checks.

    `data` is ``Program.method``.

    Raises
    ------
    UsageError
        The method has no such setting, or the value is negative, 0 if it has to be positive, or not whole if it has to
        be.
    """
    rows = {item["name"]: item for item in data["settings"]}
    names = [key for key in rows if key != "step" and key not in data["parameters"]]
    if name not in names:
        close = close_names(name, names, 1)
        hint = close[0] if close else f"one of {', '.join(names)}" if names else ""
        raise UsageError(Problem("settings", f"{data['family']} has no setting {name!r} [E0361]", hint))
    if value < 0.0:
        raise UsageError(Problem(f"settings.{name}", f"{name} is negative: {value:.9g} [E0362]"))
    if whole := rows[name]["whole"]:
        least, largest = whole
        if not (float(value).is_integer() and least <= value <= largest):
            fault = f"{name} must be {'0 or 1' if largest == 1 else f'a whole number from {least} to {largest}'}"
            hint = f"{rows[name]['default']:.0f}"
            raise UsageError(Problem(f"settings.{name}", f"{fault}, not {value:.9g} [E0363]", hint))
    positive = {"left": name, "relation": ">", "right": 0.0}
    if value == 0.0 and positive in data["bounds"]:
        hint = f"{rows[name]['default']:.9g}, which it is by default"
        raise UsageError(Problem(f"settings.{name}", f"{name} is 0, and has to be above it [E0365]", hint))
    return float(value)


def with_settings(data: Mapping[str, Any], settings: Mapping[str, float]) -> dict[str, Any]:
    """Return ``Program.method`` with other defaults of its settings. Raises UsageError as ``checked_setting``."""
    values = {name: checked_setting(data, name, value) for name, value in settings.items()}
    rows = [{**item, "default": values.get(item["name"], item["default"])} for item in data["settings"]]
    return {**data, "settings": rows}


def statistics_kinds(data: Mapping[str, Any]) -> dict[str, str]:
    """Return the C type of each statistic by name: ``long`` for counts, ``real`` for measures."""
    return {item["name"]: item["kind"] for item in data["state"] if item["group"] == "statistics"}


def row_layout(data: Mapping[str, Any]) -> dict[str, slice]:
    """Return the slice of each quantity in a sample: ``t, q, v, vdot``, ``lam`` with constraints, and ``z``."""
    return _layout((name, size) for name, size in data["row"])


def state_layout(data: Mapping[str, Any]) -> dict[str, slice]:
    """Return the slice of each quantity in the flat state: ``t, q, v, vdot, ...``, then the statistics by name.

    ``u`` and ``p`` are the inputs and parameters with which ``vdot`` was evaluated; steps by series have ``u`` and
    ``p`` in the workspace.
    """
    return _layout((item["name"], max(item["size"], 1)) for item in data["state"])


def _layout(sizes: Iterable[tuple[str, int]]) -> dict[str, slice]:
    layout, start = {}, 0
    for name, size in sizes:
        layout[name] = slice(start, start + size)
        start += size
    return layout
