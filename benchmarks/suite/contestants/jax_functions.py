"""Inverse dynamics of many states at once by JAX's libraries: frax or adam, each under ``jit(vmap)``."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import flat_robot
import numpy as np
from serve import Prepared, serve


def frax_inverse(links: Any, gravity: Any) -> Callable[[Any, Any, Any], Any]:
    import jax.numpy as jnp
    from frax import Robot

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
        file.write_text(flat_robot.urdf(links), encoding="utf-8")
        robot = Robot(str(file), joint_ordering=[f"joint{k + 1}" for k in range(len(links))])
    rising = jnp.concatenate([-jnp.asarray(gravity), jnp.zeros(3)])  # as if the base were accelerated upwards
    return lambda q, v, a: robot.rnea(q, v, a, rising, None)


def adam_inverse(links: Any, gravity: Any) -> Callable[[Any, Any, Any], Any]:
    import jax.numpy as jnp
    from adam.jax import KinDynComputations

    names = [f"joint{k + 1}" for k in range(len(links))]
    found = KinDynComputations(flat_robot.urdf(links), names, gravity=jnp.array([*gravity, 0.0, 0.0, 0.0]))
    place, rest = jnp.eye(4), jnp.zeros(6)
    return lambda q, v, a: found.mass_matrix(place, q)[6:, 6:] @ a + found.bias_force(place, q, rest, v)[6:]


PEERS = {"frax": frax_inverse, "adam-robotics": adam_inverse}


def prepare(task: dict[str, Any]) -> Prepared:
    import jax
    import jax.numpy as jnp

    links, states = flat_robot.read(task["model"]), np.load(task["states"])
    inverse = jax.jit(jax.vmap(PEERS[task["peer"]](links, task["gravity"])))
    n = len(links)
    rows = np.resize(states, (task["batch"], 3 * n))
    blocks = [jnp.asarray(rows[:, n * k : n * (k + 1)]) for k in range(3)]
    few = [jnp.asarray(states[:, n * k : n * (k + 1)]) for k in range(3)]

    def run() -> Any:
        return inverse(*blocks).block_until_ready()

    run()
    return Prepared(run, len(rows), lambda: inverse(*few), [task["peer"], "jax"], f"{len(rows)} states a call")


if __name__ == "__main__":
    serve(prepare)
