"""The regressor of an arm's inverse dynamics in C: eomgen beside Pinocchio's computeJointTorqueRegressor, on one core.

    python -m benchmarks.regressor [--robots panda ur5] [--rounds 9] [--quick]

Both read the same URDF file and have 10 columns for each body; eomgen gives tau0 beside them, of which these robots
have nothing. Numbers are held against Pinocchio's wheel before any is timed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.contestants import (
    CPP,
    EOMGEN,
    Contestant,
    call_of_eomgen,
    missing_compiler,
    missing_for_cpp,
    missing_package,
    of_pinocchio,
)
from benchmarks.measure import figure, interleaved, machine, pin_to_core, table
from benchmarks.programs import FLAGS, default_folder, timing_program
from benchmarks.robot_dynamics import error_of
from benchmarks.robots import ROBOTS, Array, PinocchioModel, Robot, pinocchio_model, scene
from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.target import generate_files
from eomgen.mechanics.derive import derive

FUNCTION, TOLERANCE = "regressor", 1e-11
#: Robots whose joints have one coordinate each, so that columns of bodies follow those of velocities.
ARMS = ("panda", "ur5")
#: Places of Pinocchio's columns of a body, with inertia as xx, xy, yy, xz, yz, zz, among ours: xx, yy, zz, xy, xz, yz.
_COLUMNS = (0, 1, 2, 3, 4, 7, 5, 8, 9, 6)


def of_eomgen(robot: Robot, peer: PinocchioModel, states: Path, shelf: Path) -> list[Contestant]:
    """Return eomgen's function with each set of flags."""
    system = derive(scene(robot), [FUNCTION])
    program = to_program(system, functions=[FUNCTION])
    files = generate_files(program)
    sources = {file: text for file, text in files.items() if file.endswith((".c", ".h")) and file != "main.c"}
    call = call_of_eomgen(program.prefix, program.functions[0], system.nq, system.nv)
    found = []
    for label, flags in FLAGS.items():
        built = timing_program(shelf, sources, call, flags)
        command, operations = (str(built.file("run")),), system.counts[FUNCTION].flops
        found.append(Contestant(EOMGEN, FUNCTION, "", label, command, states, _full(peer), operations, built.seconds))
    return found


def _full(peer: PinocchioModel) -> Callable[[Array], Array]:
    """Return what brings rows Y, tau0 to Pinocchio's order of rows and columns."""
    order, n = peer.v_order, peer.model.nv
    columns = [10 * int(body) + place for body in order for place in _COLUMNS]
    return lambda rows: rows[:, : 10 * n * n].reshape(len(rows), n, -1)[:, order][:, :, columns].reshape(len(rows), -1)


def reference(peer: PinocchioModel) -> Array:
    """Return Pinocchio's regressor at every state, row by row."""
    import pinocchio as pin  # type: ignore[import-untyped]  # noqa: PLC0415  # a peer, which may be missing

    model, data = peer.model, peer.model.createData()
    parts = np.split(peer.states, [model.nq, model.nq + model.nv], axis=1)
    found = [pin.computeJointTorqueRegressor(model, data, *map(np.copy, row)) for row in zip(*parts, strict=True)]
    return np.array([Y.ravel() for Y in found])


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--robots", nargs="+", choices=ARMS, default=["panda"])
    parser.add_argument("--rounds", type=int, default=9, help="turns in which every contestant runs once")
    parser.add_argument("--batches", type=int, default=21, help="batches of 2 ms in each turn")
    parser.add_argument("--core", type=int, help="the core to stay on (the last one by default)")
    parser.add_argument("--work", type=Path, default=default_folder(), help="where compiled programs are kept")
    parser.add_argument("--quick", action="store_true", help="check eomgen's numbers and time nothing")
    given = parser.parse_args(words)
    lacking = missing_package("example-robot-data") or missing_package("pin") or missing_compiler("gcc")
    if lacking:
        print(f"nothing can be measured: {lacking}", file=sys.stderr)
        return 1
    rows, wrong = [], False
    for name in given.robots:
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            peer = pinocchio_model(ROBOTS[name], scene(ROBOTS[name]))
            model, states, own = (folder / file for file in ("model", "states", "own"))
            model.write_text(peer.text, encoding="utf-8")
            peer.states.tofile(states)
            peer.states_of_eomgen().tofile(own)
            contestants = of_eomgen(ROBOTS[name], peer, own, given.work)
            if not given.quick and missing_for_cpp() is None:
                contestants += of_pinocchio(model, states, given.work, [FUNCTION])
            expected = reference(peer)
            errors = [error_of(one.results(folder / "results"), expected) for one in contestants]
            wrong |= max(errors) > TOLERANCE
            if given.quick or wrong:
                for one, error in zip(contestants, errors, strict=True):
                    print(f"{name} {one.peer} {one.flags}: {'right' if error <= TOLERANCE else 'WRONG'}, {error:.1e}")
                continue
            pin_to_core(given.core)
            timings = interleaved([one.timing(given.batches) for one in contestants], given.rounds)
            peers = [t.median for one, t in zip(contestants, timings, strict=True) if one.peer == CPP]
            for one, error, timing in zip(contestants, errors, timings, strict=True):
                ratio = f"{timing.median / peers[0]:.2f}" if peers else "-"
                spread = f"{figure(timing.median)} ±{50 * timing.spread:.0f}%"
                operations = "-" if one.operations is None else str(one.operations)
                rows.append([name, one.peer, one.flags, spread, ratio, operations, f"{error:.0e}"])
    if rows:
        print(f"{machine()}\nns per call: median of {given.rounds} turns, ± half the range of the turns\n")
        print(table(["robot", "", "flags", "ns", "to C++", "operations", "error"], rows))
        lacking = missing_for_cpp()
        if lacking:
            print(f"missing: {CPP}: {lacking}")
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
