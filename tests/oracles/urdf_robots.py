"""Every URDF of example-robot-data against Pinocchio, as the table of ``docs/urdf_robots.md``.

    python -m tests.oracles.urdf_robots             show what differs from the committed table
    python -m tests.oracles.urdf_robots --update    write it

Mimic joints are read from the file a second time here, and Pinocchio's model, in which they move on their own, is
projected.
"""

from __future__ import annotations

import argparse
import difflib
import importlib.metadata
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from eomgen.errors import EomgenError
from eomgen.mechanics.derive import derive
from eomgen.scene.joints.model import Joint
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import value_of
from tests.oracles.pinocchio_oracle import PinocchioOracle, oracle_from_urdf
from tests.oracles.states import random_states

PAGE = Path(__file__).parents[2] / "docs" / "urdf_robots.md"
COMMAND = "python -m tests.oracles.urdf_robots --update"
TOLERANCE = 1e-11
READING = 1e-8  # right angles of few digits are made exact, and lengths of some metres carry that
STATES = 5
_DOUBTS = {
    "not positive semidefinite": "not positive semidefinite", "triangle inequality": "against the triangle inequality",
    "is negative": "with negative mass",
}  # fmt: skip  # a table


def robot_files() -> dict[str, Path]:
    """Return every URDF of the package by its path under ``robots``."""
    files = (
        Path(str(file.locate()))
        for file in importlib.metadata.files("example-robot-data") or ()
        if file.suffix == ".urdf"
    )
    return dict(sorted((path.as_posix().split("/robots/", 1)[1], path) for path in files))


@dataclass(frozen=True)
class Found:
    """What became of one file.

    Attributes
    ----------
    dofs, followers : with a fixed root; those of the root besides them where nothing else can move
    doubts : what is said of inertias that no body can have
    error : largest norm-wise relative error of M and of inverse dynamics, with a fixed and with a free root
    deviation : largest difference between placements and inertias as the two read them
    """

    dofs: int = 0
    followers: int = 0
    refusal: str = ""
    doubts: str = ""
    error: float = 0.0
    deviation: float = 0.0

    @property
    def verdict(self) -> str:
        if self.refusal:
            return f"refused: {self.refusal}"
        agree = self.error <= TOLERANCE and self.deviation <= READING
        return "agrees" if agree else f"**differs** by {self.error:.1e}, as read by {self.deviation:.1e}"


def examine(path: Path) -> Found:
    """Compare one file, its root fixed and free."""
    try:
        pin.buildModelFromUrdf(str(path))
    except ValueError:
        return Found(refusal=f"{_loaded(path, 'fixed')}; Pinocchio refuses it too")
    fixed, free = _loaded(path, "fixed"), _loaded(path, "free")
    if isinstance(free, str):
        return Found(refusal=free)
    found = [_compared(path, fixed, "fixed")] if isinstance(fixed, Scene) else []
    found.append(_compared(path, free, "free"))
    return replace(found[0], error=max(item.error for item in found), deviation=max(item.deviation for item in found))


def _loaded(path: Path, root: str) -> Scene | str:
    """Return the scene, or why it is refused."""
    try:
        return load(path, root=root)
    except EomgenError as error:
        problems = [str(problem) for problem in error.problems]
        first = problems[0].split(": ", 1)[1].split("; try:")[0]
        return first if len(problems) == 1 else f"{first}, and {len(problems) - 1} more"


def _compared(path: Path, scene: Scene, root: str) -> Found:
    system = derive(scene, ["mass", "inverse_dynamics"])
    evaluate = tape_evaluator(system)
    state = random_states(system, STATES, np.random.default_rng(0))
    oracle, q, projection = oracle_of_scene(path, scene, root)
    full = {"q": q(state["q"]), "v": state["v"] @ projection.T, "a": state["a"] @ projection.T}
    damping = np.array([value_of(formula, {}) for joint in _moving(scene) for formula in joint.each(joint.damping)])
    M = projection.T @ oracle.mass(full) @ projection
    tau = (oracle.inverse_dynamics(full) + damping * full["v"]) @ projection
    found = evaluate("inverse_dynamics", state)["tau"]
    error = max(relative_error(evaluate("mass", state)["M"], M, 2), relative_error(found, tau))
    doubts = [(words, sum(mark in note for note in scene.notes)) for mark, words in _DOUBTS.items()]
    listed = [f"{count} {words}" for words, count in doubts if count]
    if np.linalg.eigvalsh(M)[:, 0].min() <= 0.0:
        listed.append("**M is not positive definite**")
    return Found(system.nv, len(projection) - system.nv, "", ", ".join(listed), error, oracle.deviation)


def _moving(scene: Scene) -> list[Joint]:
    return [joint for joint in scene.joints if joint.type != "fixed"]


def oracle_of_scene(path: Path, scene: Scene, root: str) -> tuple[PinocchioOracle, Callable[[Array], Array], Array]:
    """Return Pinocchio's model in which every joint moves on its own, q and the velocity's projection from reduced
    ones."""
    independent = tuple(replace(joint, mimic=None) for joint in scene.joints)
    oracle = oracle_from_urdf(path, replace(scene, joints=independent), root)
    written = _mimics(path, scene)
    starts: dict[str, tuple[int, int]] = {}
    nq = nv = 0
    for joint in _moving(scene):
        if joint.name not in written:
            starts[joint.name] = nq, nv
            nq, nv = nq + joint.kind.q_size, nv + joint.kind.v_size
    rows_q, rows_v, offsets = list[Array](), list[Array](), list[float]()
    for joint in _moving(scene):
        name, multiplier, offset = joint.name, 1.0, 0.0
        while name in written:
            name, factor, shift = written[name]
            multiplier, offset = multiplier * factor, offset + multiplier * shift
        for size, start, count, rows in ((joint.kind.q_size, 0, nq, rows_q), (joint.kind.v_size, 1, nv, rows_v)):
            rows += [multiplier * np.eye(count)[starts[name][start] + k] for k in range(size)]
        offsets += [offset] * joint.kind.q_size
    G, c = np.array(rows_q), np.array(offsets)
    return oracle, lambda q: q @ G.T + c, np.array(rows_v)


def _mimics(path: Path, scene: Scene) -> dict[str, tuple[str, float, float]]:
    """Return leader, multiplier and offset of every moving joint that mimics another, from the file."""
    moving = {joint.name for joint in _moving(scene)}
    found = {}
    for element in ElementTree.parse(path).getroot().iter("joint"):
        mimic = element.find("mimic")
        if mimic is not None and element.get("name") in moving:
            numbers = float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
            found[str(element.get("name"))] = (str(mimic.get("joint")), *numbers)
    return found


HEADING = "## Every robot against Pinocchio\n"
HEAD = f"""{HEADING}
Every URDF of [example-robot-data](https://github.com/Gepetto/example-robot-data), read by eomgen and by Pinocchio.
*Agrees* means that the mass matrix and inverse dynamics at {STATES} random states equal Pinocchio's to 1e-11 of their
norm, with the root fixed and free, and that both read the same placements and inertias. Damping of joints is part of
eomgen's `inverse_dynamics` and not of `pinocchio.rnea`: it is added there. Joints that mimic others are not degrees of
freedom; Pinocchio's model, in which they move on their own, is projected.

Refused files have a joint that no force can move, so that M would be singular, or a broken description. Inertias that
no body can have are taken as the file has them, with a note in `scene.notes`, and refused with `strict`; the table
names files whose M is not positive definite at a state. A moment below zero by less than 1e-6 of the largest counts as
rounding, and the link as one against the triangle inequality.

This table is made by `{COMMAND}`, and a test compares it with the results.

"""
_TABLE = """| file | degrees of freedom | followers | | links with inertias that no body can have |
|---|---:|---:|---|---|
"""


def page(found: dict[str, Found]) -> str:
    """Return the page: what is written by hand as it is, and the table below its heading."""
    by_hand = PAGE.read_text(encoding="utf-8").partition(HEADING)[0]
    count = sum(item.verdict == "agrees" for item in found.values())
    refused = sum(bool(item.refusal) for item in found.values())
    doubtful = sum(bool(item.doubts) for item in found.values())
    rows = []
    for name, item in found.items():
        sizes = f"{item.dofs} | {item.followers or ''}" if not item.refusal else " | "
        rows.append(f"| {name.removesuffix('.urdf')} | {sizes} | {item.verdict} | {item.doubts} |\n")
    summary = (
        f"{len(found)} files: {count} agree, {refused} are refused; {doubtful} of the agreeing ones have such"
        " inertias.\n\n"
    )
    return by_hand + HEAD + summary + _TABLE + "".join(rows)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--update", action="store_true", help="write the page")
    update = parser.parse_args().update
    text = page({name: examine(path) for name, path in robot_files().items()})
    if update:
        PAGE.write_text(text, encoding="utf-8")
        return 0
    difference = list(
        difflib.unified_diff(PAGE.read_text(encoding="utf-8").splitlines(), text.splitlines(), lineterm="")
    )
    sys.stdout.write("\n".join(difference))
    return 1 if difference else 0


if __name__ == "__main__":
    sys.exit(main())
