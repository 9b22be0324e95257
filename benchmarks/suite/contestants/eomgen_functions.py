"""A function of a robot at many states: one call from Python."""

import os
from typing import Any

import numpy as np
from serve import Prepared, serve

from benchmarks.robots import ROBOTS, driven, pinocchio_model, scene


def prepare(task: dict[str, Any]) -> Prepared:
    import eomgen

    os.environ["EOMGEN_LANES"] = task["lanes"]  # ``now``: compiled before anything is timed, not in the background
    described, function = scene(ROBOTS[task["robot"]]), task["function"]
    peer = pinocchio_model(ROBOTS[task["robot"]], described)
    forward = function == "forward_dynamics"
    if forward:
        described = driven(described)
    model = eomgen.build(described, terms=[function], method="rk4" if forward else None)
    states, nq, n = peer.states_of_eomgen(), peer.model.nq, peer.model.nv
    rows = np.resize(states, (task["batch"], states.shape[1]))

    def blocks(of: Any) -> dict[str, Any]:
        cut = {"q": of[:, :nq], "v": of[:, nq : nq + n], "a": of[:, nq + n :], "u": of[:, nq + n :]}
        return {name: np.ascontiguousarray(cut[name]) for name in model.functions.inputs(function)}

    many = blocks(rows)

    def results() -> Any:
        found = model.functions(function, blocks(states))
        order = peer.v_order
        if function in ("inverse_dynamics", "forward_dynamics"):
            return found[0][:, order]
        return np.concatenate([M[:, order][:, :, order].reshape(len(states), -1) for M in found], axis=1)

    def run() -> Any:
        return model.functions(function, many)

    for _ in range(task["warm"]):
        run()
    threads = os.environ["EOMGEN_THREADS"]
    note = f"{len(rows)} states a call, {threads} thread{'s' if threads != '1' else ''}, lanes {task['lanes']}"
    return Prepared(run, len(rows), results, ["eomgen"], note)


if __name__ == "__main__":
    serve(prepare)
