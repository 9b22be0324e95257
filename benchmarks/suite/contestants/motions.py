"""Motions to an error, each peer by the fastest of its settings: what the scripts of this folder's parent measure.

The result is the error that was reached, in the measure of the script.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from serve import Prepared, serve

Made = tuple[Callable[[], Any], float, list[str], str]


def taylor_series(task: dict[str, Any]) -> Made:
    """``taylor_and_heyoka``: initialization, motion and the state at the end."""
    import eomgen
    from benchmarks import taylor_and_heyoka as script

    case = next(one for one in script.cases() if one.name == task["case"])
    model = eomgen.build(case.scene, method="taylor")
    exact, tolerances = script.reference(case, model), [10.0**-k for k in range(10 if task["quick"] else 5, 15)]
    if task["peer"] == "heyoka":
        found = script.theirs(case, model, exact, tolerances)
    else:
        found = [script.ours(case, model, exact, tolerance) for tolerance in tolerances]
    best = script.fastest(found, task["target"])
    if best is None:
        raise ValueError(f"none reaches {task['target']:g}: {min(one.error for one in found):.1e}")
    return best.run, best.error, [task["peer"]], best.label


def flying_beam(task: dict[str, Any]) -> Made:
    """``beam_peers``: elements and step are chosen."""
    from benchmarks import beam_peers as script

    rows = script.rows_of(task["peer"], script.pairs_of(task["peer"], task["quick"]), 1)
    at = script.limit(rows)
    met = [row for row in rows if script.error(row, at) <= task["target"]]
    if not met:
        raise ValueError(f"no pair of elements and step reaches {task['target']:g} m")
    best = min(met, key=lambda row: row.seconds)
    ways = {"eomgen": script.eomgen_way, "exudyn": script.exudyn_way, "pyelastica": script.elastica_way}
    note = f"{best.elements} elements, step {best.step:.3g} s"
    return ways[task["peer"]](best.elements, best.step), script.error(best, at), [task["peer"]], note


def stiff_rods(task: dict[str, Any]) -> Made:
    """``adaptive_steps``: a tolerance is chosen."""
    from benchmarks import adaptive_steps as script

    ways = {
        "eomgen": [("generalized-alpha", script.own("generalized_alpha_adaptive")), ("rk45", script.own("rk45"))],
        "scipy": [("Radau", script.radau)],
        "exudyn": [],
    }
    if task["peer"] == "exudyn":
        ways["exudyn"] = [("DOPRI5", script.exudyn("DOPRI5", True))]
    found = []
    for name, run in ways[task["peer"]]:
        best = script.best(
            script.measured(name, run, [10.0**-k for k in range(2, 7 if task["quick"] else 11)], 2.0), task["target"]
        )
        if best is not None:
            found.append((best, run, name))
    if not found:
        raise ValueError(f"no tolerance reaches {task['target']:g}")
    best, run, name = min(found, key=lambda one: one[0].seconds)
    return lambda: run(best.setting), best.error, [task["peer"]], f"{name}, tolerance {best.setting:.0e}"


def fast_top(task: dict[str, Any]) -> Made:
    """``multibody_stepping``: the number of steps is chosen; bodies in absolute coordinates on a ball joint."""
    from benchmarks import loops, multibody_peers, tops
    from benchmarks import multibody_stepping as script

    if task["peer"] == "exudyn":
        best: tuple[float, Any, int, float] | None = None
        for method in multibody_peers.TOP_METHODS[3:4] if task["quick"] else multibody_peers.TOP_METHODS:

            def error(steps: int, method: Any = method) -> float:
                try:
                    return float(np.nan_to_num(multibody_peers.exudyn_top(method, steps, 1)[1], nan=np.inf))
                except multibody_peers.NotConvergedError:
                    return float("inf")

            if steps := script.first_that_meets(error, task["target"]):
                seconds, reached = multibody_peers.exudyn_top(method, steps, 1)
                if best is None or seconds < best[0]:
                    best = (seconds, method, steps, reached)
        if best is None:
            raise ValueError("no method reaches the error")
        _, method, steps, reached = best
        return (
            (lambda: multibody_peers.exudyn_top(method, steps, 1)[0]),
            reached,
            ["exudyn"],
            f"{method.name}, {steps} steps",
        )
    runs = [
        (script._own_top(formulation, script.LOOSE, rho_inf, 1), formulation, rho_inf)
        for formulation in tops.FORMULATIONS
        if formulation.group and (formulation is tops.R3XSO3 or not task["quick"])
        for rho_inf in ((0.9,) if task["quick"] else (0.9, 0.8))
    ]
    run, formulation, rho_inf = min((one for one in runs if one[0].steps), key=lambda one: one[0].milliseconds)
    how = {"rho_inf": rho_inf, "settings": script.TOLERANCES[script.LOOSE], "repeats": 1}

    def taken() -> float:
        return loops.timed(formulation.model(), formulation.method, 1.0, run.steps, **how).seconds

    return taken, run.error, ["eomgen"], f"{run.contestant.removeprefix('eomgen ')}, {run.steps} steps"


def contact(task: dict[str, Any]) -> Made:
    """``contact_peers``: method and setting are chosen; each contestant against the finest of its own runs."""
    from benchmarks import contact_peers as script

    runs = script.tried(script.ways_of(task["peer"], task["scene"]), 1e-3 if task["quick"] else 1.0)
    best, error = script.fastest(runs, task["target"])
    note = f"{best.way.name}, {best.setting:g}"
    return lambda: best.way.run(best.setting), error, [script.CONTESTANTS[task["peer"]]], note


WORK = {"contact": contact, "taylor": taylor_series, "beam": flying_beam, "stiff": stiff_rods, "top": fast_top}


def prepare(task: dict[str, Any]) -> Prepared:
    run, error, packages, note = WORK[task["work"]](task)
    taken = run if task["work"] == "top" else None  # the pieces of the top have clocks of their own
    return Prepared(run, 1, lambda: [error], packages, note, taken)


if __name__ == "__main__":
    serve(prepare)
