"""Double pendulums by MuJoCo's MJX: ``vmap`` over a fixed number of RK4 steps, compiled by JAX."""

from collections.abc import Callable
from typing import Any

import numpy as np
from problems import END, GRAVITY, cheapest, starts
from serve import Prepared, serve

ROD = f'<inertial pos="0 0 -0.5" mass="1" diaginertia="{1.0 / 12.0} {1.0 / 12.0} 1e-3"/>'
HINGE = '<joint type="hinge" axis="0 1 0"/>'
TEXT = (
    '<mujoco><option timestep="{step!r}" integrator="RK4" gravity="0 0 {gravity}" jacobian="dense">'
    '<flag contact="disable" constraint="disable"/></option><worldbody>'
    f'<body>{HINGE}{ROD}<body pos="0 0 -1">{HINGE}{ROD}</body></body></worldbody></mujoco>'
)


def prepare(task: dict[str, Any]) -> Prepared:
    import jax
    import jax.numpy as jnp
    import mujoco
    from mujoco import mjx

    first = starts(task["problem"], task["samples"])
    q = jnp.asarray(np.stack([first[:, 0], first[:, 1] - first[:, 0]], axis=1))
    v = jnp.asarray(np.stack([first[:, 2], first[:, 3] - first[:, 2]], axis=1))

    def way(steps: int) -> tuple[str, Callable[[int], Any]]:
        model = mjx.put_model(mujoco.MjModel.from_xml_string(TEXT.format(step=END / steps, gravity=-GRAVITY)))
        still = mjx.make_data(model)

        def one(q: Any, v: Any) -> Any:
            end = jax.lax.fori_loop(0, steps, lambda _, d: mjx.step(model, d), still.replace(qpos=q, qvel=v))
            return jnp.concatenate([jnp.cumsum(end.qpos), jnp.cumsum(end.qvel)])

        compiled = jax.jit(jax.vmap(one))
        return f"RK4, {steps} steps", lambda samples: np.asarray(compiled(q[:samples], v[:samples]).block_until_ready())

    steps = [round(100 * 2 ** (k / 2)) for k in task["halvings"]]
    note, run = cheapest([map(way, steps)], np.load(task["reference"]), len(first), task["target"])
    return Prepared(run, len(first), run, ["mujoco-mjx", "jax"], f"{note}, {len(first)} trajectories")


if __name__ == "__main__":
    serve(prepare)
