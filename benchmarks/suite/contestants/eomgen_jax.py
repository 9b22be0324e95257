"""Inverse dynamics of a robot at many states from JAX: one call of a compiled function under ``jit(vmap)``."""

import os
from typing import Any

import numpy as np
from serve import Prepared, serve

from benchmarks.robots import ROBOTS, pinocchio_model, scene


def prepare(task: dict[str, Any]) -> Prepared:
    import jax
    import jax.numpy as jnp

    import eomgen

    os.environ["EOMGEN_LANES"] = task["lanes"]  # ``now``: compiled before anything is timed, not in the background
    jax.config.update("jax_enable_x64", True)
    described = scene(ROBOTS[task["robot"]])
    peer = pinocchio_model(ROBOTS[task["robot"]], described)
    model = eomgen.build(described, terms=["inverse_dynamics"])
    inverse = jax.jit(jax.vmap(eomgen.jax(model).inverse_dynamics))
    states, nq, n = peer.states_of_eomgen(), peer.model.nq, peer.model.nv

    def blocks(of: Any) -> list[Any]:
        return [jnp.asarray(of[:, part]) for part in (slice(nq), slice(nq, nq + n), slice(nq + n, None))]

    few, many = blocks(states), blocks(np.resize(states, (task["batch"], states.shape[1])))

    def run() -> Any:
        return inverse(*many).block_until_ready()

    for _ in range(task["warm"]):
        run()
    note = f"{task['batch']} states a call, lanes {task['lanes']}"
    return Prepared(run, task["batch"], lambda: np.asarray(inverse(*few))[:, peer.v_order], ["eomgen", "jax"], note)


if __name__ == "__main__":
    serve(prepare)
