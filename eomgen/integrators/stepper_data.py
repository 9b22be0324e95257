"""Stepper data: the data of a method's C templates beyond the model, as ``Program.method``."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from eomgen.errors import ModelError, Problem, UsageError
from eomgen.integrators.events import (
    CONTROLLER_FAILURE,
    STATUSES,
    controller_status,
    event_data,
    event_state,
    jump_data,
    sample_data,
)
from eomgen.integrators.families.family import Family, Field, GroupFunction, Setting, Sizes, velocities
from eomgen.integrators.families.register import check_needs
from eomgen.lie.groups import group_named
from eomgen.lie.kernels import GroupKernel, group_kernel
from eomgen.lie.product import Factor

if TYPE_CHECKING:
    from eomgen.system.system import System

#: Structs within the state of all steppers.
_GROUPS = {
    "statistics": "Counts and largest values since the state was initialized.",
    "conditions": "Inputs and parameters with which the present accelerations were evaluated.",
    "event_state": "Signs of the event functions, counts of events, and values set by their actions.",
}


def method_data(method: Family, system: System, step: float = 1e-3, samples: Any = None) -> dict[str, Any]:
    """Return the data of a method for the C templates of a system's stepper, ``Program.method``, as JSON types.

    Keys common to all families (order, inputs, state, settings, bounds, statuses, rows, events ...), and the family's
    own.

    Parameters
    ----------
    method : Family
    system : System
        Checked for the needs of the method first.
    step : float
        Default step in s; like rho_inf and the tolerances, the step is a setting of the compiled stepper, not a part of
        the code.
    samples : newton.sample_matrices.Samples, optional
        Numbers by which the pivots are chosen; the system's tape at a few states by default.

    Raises
    ------
    ModelError
        The system lacks a quantity that the method needs, or the iteration matrix is singular at the initial state.
    UsageError
        The step is not positive.
    """
    check_needs(method, system.facts)
    if not 0.0 < step < float("inf"):
        fault = f"the step must be a positive number of seconds, not {step!r} [E0358]"
        raise UsageError(Problem("method.step", fault, "1e-3"))
    _check_functions(method, system)
    sizes = Sizes(
        sum(factor.q_size for factor in system.factors) + len(system.angles),
        velocities(system.factors),
        len(system.initial_z),
        sum(item.size for item in system.inputs),
        len(system.parameters),
        len(system.multipliers),
        system.holonomic,
    )
    family_data = method.data(system, step, samples)
    state = _state(method, system, sizes)
    bound = ["step", *(item.name for item in state if item.name in method.parameters)]
    jumps = jump_data(system.discontinuities, method.discontinuity_order, by_differences=method.implicit)
    sampled = method.inputs == "sampled"
    statuses = (
        *method.statuses(sizes.lam > 0, bool(system.angles)),
        *(STATUSES if system.events else ()),
        *controller_status(system.controllers),
    )
    settings = (Setting("step", float(step), "step size of the time grid, s"),)
    rows = {"t": 1, "q": sizes.q, "v": sizes.v, "vdot": sizes.v, "lam": sizes.lam, "z": sizes.z}
    return {
        "family": method.family,
        "title": method.title(sizes.lam > 0),
        "order": method.order,
        "source": method.source,
        "step": float(step),
        "implicit": method.implicit,
        "inputs": method.inputs,
        "dense_output": method.dense_output,
        "state_is_all": method.state_is_all,
        "remembers": sampled and bool(sizes.u or sizes.p or system.sampled),
        "rows_per_step": len(family_data["input_times"]) - 1,
        "rows_text": _rows_text(family_data["input_times"]) if sampled else "the first one constant over the step",
        "renewal": method.renewal,
        "projection": method.projection,
        "own_steps": False,
        "groups": {**_GROUPS, **dict(method.groups)},
        "row_notes": [],
        "lie": _lie_data(system.factors, method.group_functions),
        "turning": list(system.turning),
        "positions": system.positions,
        **({"jumps": jumps} if jumps else {}),
        **(
            {"samples": sample_data(system.sampled, system.controllers, [item.name for item in system.states])}
            if system.sampled
            else {}
        ),
        **({"events": event_data(system.events, system.modes)} if system.events else {}),
        "parameters": list(method.parameters),
        **{name: float(value) for name, value in method.parameters.items()},
        **family_data,
        "hooks": {"row": "", "recorded": "", "end": "", **family_data.get("hooks", {})},
        "row": [[name, size] for name, size in rows.items() if size],
        "settings": [
            dataclasses.asdict(item) | {"whole": list(item.whole or ())}
            for item in (*settings, *method.settings(sizes))
        ],
        "bounds": list(map(dataclasses.asdict, method.bounds(sizes))),
        "choices": dict(method.choices(sizes)),
        "state": list(map(dataclasses.asdict, state)),
        "bound": " or ".join(filter(None, [", ".join(bound[:-1]), bound[-1]])),
        "statuses": list(map(dataclasses.asdict, statuses)),
    }


def _state(method: Family, system: System, sizes: Sizes) -> list[Field]:
    """Return the members of a stepper's state in the order of the C struct. These are common ones, the method's,
    events', counters and statistics; inputs and parameters, with which accelerations were evaluated, are last. Steps
    copy all members before these."""
    beyond = "remainders of counted angles, below the digits of q; initialize clears them"
    counted = (
        Field("steps", "steps of the time grid", 0, "long"),
        Field("newton_iterations", "", 0, "long"),
        Field("factorizations", "", 0, "long"),
        Field("halvings", "halvings of steps that failed", 0, "long"),
        Field("evaluations", "evaluations of the equations of motion", 0, "long"),
        Field("max_residual", "largest residual component, over all steps, at the last iterate that was evaluated"),
        *method.statistics(sizes),
        *(CONTROLLER_FAILURE if system.controllers else ()),
    )
    members = [
        Field("t", "s"),
        Field("q", "", sizes.q),
        Field("v", "", sizes.v),
        Field("vdot", "", sizes.v),
        *([Field("lam", "multipliers: constraint forces are -B^T lam", sizes.lam)] if sizes.lam else []),
        *([Field("z", "internal states", sizes.z), Field("zdot", "", sizes.z)] if sizes.z else []),
        *method.state(sizes),
        *([Field("angle_remainder", beyond, len(system.turning))] if len(system.turning) else []),
        *event_state(system.events, system.modes),
        Field("step", "t = origin + count * step"),
        Field("origin"),
        Field("count", "", 0, "long"),
        *(dataclasses.replace(item, group="statistics") for item in counted),
    ]
    if method.inputs == "sampled":
        formulas = "inputs; not a number: the scene's formula"
        members += [Field("u", formulas, sizes.u, group="conditions")] if sizes.u else []
        members += [Field("p", "", sizes.p, "parameters", "conditions", "parameters")] if sizes.p else []
    return [dataclasses.replace(item, member=item.member or item.name) for item in members]


def _rows_text(input_times: Sequence[float]) -> str:
    """Return the times of a step's rows of inputs in words."""
    known = {0.0: "t", 0.5: "t + step/2", 1.0: "t + step"}
    *first, last = (known.get(share, f"t + {share:g} step") for share in input_times)
    return f"at {', '.join(first)} and {last}"


def _check_functions(method: Family, system: System) -> None:
    needed = method.calls(system) | ({"internal_rate"} if system.facts.internal_states else set())
    missing = sorted(needed - set(system.functions))
    problems = []
    if missing:
        fault = f"{method.family} calls {', '.join(missing)}, which the model was built without [E0359]"
        problems.append(Problem("method", fault, "ask for these terms"))
    if not system.factors:
        fault = "there is nothing to integrate: every joint is fixed [E0360]"
        problems.append(Problem("method", fault, "give a joint a degree of freedom"))
    if problems:
        raise ModelError(problems)


def _lie_data(factors: Sequence[Factor], called: Sequence[GroupFunction]) -> dict[str, Any]:
    """Return the factors of the configuration as data of the templates, and the code of group functions. Keys:
    ``runs``, with neighbouring factors R merged into one, and ``kernels``, the functions `called` of every group."""
    runs: list[dict[str, Any]] = []
    for factor in factors:
        last = runs[-1] if runs else None
        if (
            last is not None
            and factor.group == last["group"] == "R"
            and (last["q"] + last["size"], last["v"] + last["size"]) == (factor.q_start, factor.v_start)
        ):
            last["size"] += factor.v_size
        else:
            runs.append({"group": factor.group, "q": factor.q_start, "v": factor.v_start, "size": factor.v_size})
    groups = [group_named(name) for name in sorted({run["group"] for run in runs} - {"R"})]
    return {
        "runs": runs,
        "kernels": [_kernel_data(group_kernel(name, group)) for group in groups for name in called],
    }


def _kernel_data(kernel: GroupKernel) -> dict[str, Any]:
    return {
        "name": kernel.name,
        "description": kernel.description,
        "inputs": [list(pair) for pair in kernel.inputs],
        "statements": kernel.statements(),
        "results": kernel.results(),
    }
