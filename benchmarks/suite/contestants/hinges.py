"""Ten rods on hinges that start along x and fall for 0.5 s, by RK4: eomgen, MuJoCo or EXUDYN.

The result is the distance of the tip, m, from where MuJoCo's and EXUDYN's fine runs agree that it is.
"""

from typing import Any

import numpy as np
from serve import Prepared, serve

from benchmarks import chains, loops, multibody_peers

LINKS, END = 10, 0.5


def prepare(task: dict[str, Any]) -> Prepared:
    steps = task["steps"]
    if task["peer"] == "eomgen":
        import eomgen

        model = eomgen.build(chains.scene("joint", "hinge", LINKS), method="rk4")
        stepper = loops.stepper_of(model, "rk4", END / steps, 0.8, {})
        record = np.empty((2, stepper.sizes["row"]))

        def own() -> None:
            status = stepper.initialize(0.0, model.initial_q, model.initial_v, None)
            if status := status or stepper.run(steps, steps + 1, None, record)[0]:
                raise RuntimeError(stepper.status_text(status))

        def error() -> Any:
            q = stepper.row[stepper.row_places["q"]]
            tip = model.point(f"rod{LINKS - 1}", [chains.LENGTH, 0, 0], q).position
            return [np.linalg.norm(tip - chains.tip_at_the_end(LINKS))]

        own()
        return Prepared(own, steps, error, ["eomgen"])
    run = multibody_peers.mujoco_chain if task["peer"] == "mujoco" else multibody_peers.exudyn_chain
    how: Any = "RK4" if task["peer"] == "mujoco" else multibody_peers.CHAIN_METHODS[-1]

    def peer() -> tuple[float, float]:
        return run(how, LINKS, END, steps, 1)

    return Prepared(peer, steps, lambda: [peer()[1]], [task["peer"]], taken=lambda: peer()[0])


if __name__ == "__main__":
    serve(prepare)
