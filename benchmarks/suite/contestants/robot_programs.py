"""A function of a robot as a compiled program that calls it in a loop: eomgen's scalar C, or Pinocchio's C++."""

import subprocess
import tempfile
from pathlib import Path
from typing import Any

from serve import Prepared, serve

from benchmarks import contestants
from benchmarks.robots import ROBOTS, pinocchio_model, scene


def prepare(task: dict[str, Any]) -> Prepared:
    robot, function, shelf = ROBOTS[task["robot"]], task["function"], Path(task["shelf"])
    described = scene(robot)
    peer = pinocchio_model(robot, described)
    folder = Path(tempfile.mkdtemp())
    states, model = folder / "states", folder / "model"
    if task["peer"] == contestants.EOMGEN:
        peer.states_of_eomgen().tofile(states)
        found = [one for one in contestants.of_eomgen(described, peer, states, shelf, [function]) if one.flags == "O3"]
    else:
        if lacking := contestants.missing_for_cpp():
            raise ModuleNotFoundError(lacking)
        peer.states.tofile(states)
        model.write_text(peer.text, encoding="utf-8")
        found = list(contestants.of_pinocchio(model, states, shelf, [function]))

    def nanoseconds(one: contestants.Contestant) -> float:
        said = subprocess.run(one.timing(15), capture_output=True, text=True, check=True).stdout
        return float(said.split()[0])

    best = min(found, key=nanoseconds)
    packages = ["eomgen"] if task["peer"] == contestants.EOMGEN else ["pin"]
    note = ", ".join(filter(None, [best.variant, "one call a state"]))
    return Prepared(
        lambda: None, 1, lambda: best.results(folder / "results"), packages, note, lambda: 1e-9 * nanoseconds(best)
    )


if __name__ == "__main__":
    serve(prepare)
