"""Ensembles by diffrax: ``vmap`` over adaptive Runge-Kutta methods, compiled by JAX."""

from collections.abc import Callable
from typing import Any

import numpy as np
from problems import DUFFING, END, cheapest, duffing, pendulum, starts
from serve import Prepared, serve


def prepare(task: dict[str, Any]) -> Prepared:
    import diffrax
    import jax
    import jax.numpy as jnp

    first = jnp.asarray(starts(task["problem"], task["samples"]))

    def rates(t: Any, y: Any, _: Any) -> Any:
        return jnp.stack(duffing(t, y, jnp.cos) if task["problem"] == DUFFING else pendulum(y, jnp.sin, jnp.cos))

    def way(solver: Any, tolerance: float) -> tuple[str, Callable[[int], Any]]:
        steps = diffrax.PIDController(rtol=tolerance, atol=tolerance)

        def one(y: Any) -> Any:
            found = diffrax.diffeqsolve(
                diffrax.ODETerm(rates),
                solver,
                0.0,
                END,
                0.01,
                y,
                stepsize_controller=steps,
                max_steps=1_000_000,
                saveat=diffrax.SaveAt(t1=True),
                adjoint=diffrax.ForwardMode(),
            )
            return found.ys[0]

        compiled = jax.jit(jax.vmap(one))
        name = f"{type(solver).__name__}, tolerance {tolerance:.0e}"
        return name, lambda samples: np.asarray(compiled(first[:samples]).block_until_ready())

    tolerances = [task["target"] * 10.0**-k for k in range(1, 6)]
    solvers = (diffrax.Dopri8(), diffrax.Tsit5()) if task["target"] > 1e-8 else (diffrax.Dopri8(),)
    ways = (map(way, [solver] * len(tolerances), tolerances) for solver in solvers)
    note, run = cheapest(ways, np.load(task["reference"]), len(first), task["target"])
    return Prepared(run, len(first), run, ["diffrax", "jax"], note)


if __name__ == "__main__":
    serve(prepare)
