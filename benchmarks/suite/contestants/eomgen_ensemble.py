"""Ensembles by ``model.simulate_many``, by the method that meets the error first."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from problems import DUFFING, END, GRAVITY, cheapest, starts
from serve import Prepared, serve

TOLERANCES = [10.0**-k for k in range(4, 15)]
STEPS = [round(100 * 2 ** (k / 2)) for k in range(20)]


def scene(problem: str) -> Any:
    """Return the scene: rods on hinges, or a slide with the force of the oscillator."""
    import eomgen

    builder = eomgen.SceneBuilder(problem.replace(" ", "_"), gravity=[0, 0, -GRAVITY])
    if problem == DUFFING:
        builder.body("mass", 1.0)
        builder.joint("slide", "prismatic", "base", "mass", axis=[1, 0, 0])
        force = "q.slide - q.slide**3 - 0.3 * v.slide + 0.5 * cos(1.2 * t)"
        builder.effort("spring", "slide", force)
        return builder.simulation(step=0.01, duration=END).build()
    for k in range(2):
        builder.body(f"rod{k}", 1.0, center_of_mass=[0, 0, -0.5], inertia=[1 / 12, 1 / 12, 1e-3])
        parent, position = (f"rod{k - 1}", [0, 0, -1]) if k else ("base", [0, 0, 0])
        builder.joint(f"hinge{k}", "revolute", parent, f"rod{k}", axis=[0, 1, 0], position=position)
    return builder.simulation(step=0.01, duration=END).build()


def prepare(task: dict[str, Any]) -> Prepared:
    import eomgen

    described, first = scene(task["problem"]), starts(task["problem"], task["samples"])
    if task["problem"] == DUFFING:
        names = ["q.slide", "v.slide"]
        own, back = first, np.eye(2)
    else:
        names = ["q.hinge0", "q.hinge1", "v.hinge0", "v.hinge1"]
        back = np.kron(np.eye(2), [[1.0, 0.0], [1.0, 1.0]])  # angles between links to angles from the vertical
        own = np.linalg.solve(back, first.T).T

    def way(model: Any, method: str, step: float, **options: Any) -> tuple[str, Callable[[int], Any]]:
        def run(samples: int) -> Any:
            table = dict(zip(names, own[:samples].T, strict=True))
            found = model.simulate_many(
                END, step, table=table, method=method, columns=names, points=2, workers=task["workers"], **options
            )
            if found.failed:
                raise RuntimeError(f"{len(found.failed)} samples failed")
            return np.stack([found.results[f"{name}.final"] for name in names], axis=1) @ back.T

        told = f"tolerance {options['tolerance']:.0e}" if options else f"{round(END / step)} steps"
        return f"{method}, {told}", run

    def settings(method: str) -> Iterator[tuple[str, Callable[[int], Any]]]:
        model = eomgen.build(described, method=method)
        if method == "rk4":
            return (way(model, method, END / steps) for steps in STEPS)
        return (way(model, method, END, tolerance=tolerance) for tolerance in TOLERANCES)

    ways = map(settings, task["methods"])
    note, run = cheapest(ways, np.load(task["reference"]), len(first), task["target"])
    return Prepared(run, len(first), run, ["eomgen"], note)


if __name__ == "__main__":
    serve(prepare)
