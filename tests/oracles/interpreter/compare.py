"""Comparison of eomgen with the interpreter on random scenes.

``python -m tests.oracles.interpreter.compare --scenes 3000`` prints the scenes that disagree.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import json
import math
import os
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import eomgen
from tests.oracles.interpreter.equations import State
from tests.oracles.interpreter.exact_beams import ExactBeam
from tests.oracles.interpreter.generator import scene
from tests.oracles.interpreter.machine import Machine

Array = NDArray[Any]

KINDS = ("tree", "loop", "absolute", "loop", "beam", "hull", "absolute", "exact_beam")
TERMS = ["mass", "inverse_dynamics", "outputs", "energy"]
CONSTRAINED = ["residual", "constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian"]
#: Differences beyond this factor of rounding times the condition of the bordered system are reported.
LIMIT = 1e4
#: By which neighbouring states differ.
NUDGE = 1e-10


def random_state(
    machine: Machine,
    data: Any,
    rng: np.random.Generator,
    kind: str,
    spread: float | None = None,
    t: float | None = None,
) -> State:
    """Return a state near the initial configuration that meets the constraints."""
    q = np.zeros(machine.nq)
    for name, joint in machine.joints.items():
        if "mimic" in joint or name not in machine.q_start or joint["type"] == "fixed":
            continue
        initial, i = joint["initial"], machine.q_start[name]
        if joint["type"] == "free":
            q[i : i + 7] = [*initial["orientation"], *initial["position"]]
        else:
            values = np.atleast_1d(initial["position"])
            q[i : i + len(values)] = values
    t = float(rng.uniform(0, 0.3 if "constraints" in data else 2.0)) if t is None else t
    z = {name: float(rng.uniform(-1, 1)) for name in data.get("states", {})}
    v = rng.uniform(-1.5, 1.5, machine.nv)
    state = State(machine, q, v, t, z)
    if spread is None:
        spread = 0.05 if "constraints" in data else 0.6
    state = State(machine, state.moved(rng.uniform(-spread, spread, machine.nv)), v, t, z)
    return state.onto_constraints()


def condition(state: State) -> float:
    """Condition of the equilibrated bordered system on the rows that are independent."""
    _, B, _, _ = state.rows
    B = B[np.abs(B).max(axis=1, initial=0.0) > 1e-12]
    K = np.block([[state.mass, B.T], [B, np.zeros((len(B), len(B)))]])
    scale = np.sqrt(np.maximum(np.abs(K).max(axis=1), 1e-300))
    values = np.linalg.svd(K / scale[:, None] / scale, compute_uv=False)
    kept = values[values > 1e-12 * values[0]]
    return float(kept[0] / kept[-1])


def absolute_state(state: State, data: Any, model: Any) -> tuple[Array, Array, Array]:
    """Return q, v and a of the bodies' centres of mass from a state in joint coordinates with its accelerations."""
    machine = state.machine
    host, groups = {"base": "base"}, collections.defaultdict(list)
    for joint in machine.joints.values():
        child = joint["child"]
        host[child] = host[joint["parent"]] if joint["type"] == "fixed" else child
        groups[host[child]].append(child)
    bodies = {name: (m, c) for name, m, c, _ in state._bodies()}
    blocks: dict[str, tuple[Array, Array, Array]] = {}
    for name, members in groups.items():
        if name == "base":
            continue
        pose = state.motion.poses[name]
        total = sum(bodies[n][0] for n in members)
        x = sum((bodies[n][0] / total) * state.motion.poses[n].at(bodies[n][1]) for n in members)
        quaternion = np.roll(Rotation.from_matrix(pose.R.value).as_quat(), 1)
        R, omega = pose.R.value, pose.omega
        w, alpha = R.T @ omega.value, R.T @ omega.rate
        u = R.T @ x.rate
        du = R.T @ x.second - np.cross(w, u)
        blocks[name] = (np.r_[quaternion, x.value], np.r_[w, u], np.r_[alpha, du])
        blocks[f"{name}.orientation"] = (quaternion, w, alpha)
        blocks[f"{name}.position"] = (x.value, x.rate, x.second)
    q, v, a = [], [], []
    labels = []
    for label in model.q_names:
        stem = label.removeprefix("q.").partition("[")[0]
        if stem not in labels:
            labels.append(stem)
    for stem in labels:
        if stem in blocks:
            q.extend(blocks[stem][0])
            v.extend(blocks[stem][1])
            a.extend(blocks[stem][2])
        else:  # an angle that is counted over turns
            joint = stem.partition(".")[0]
            number = next(n for n in model.q_names if n.startswith(f"q.{stem}"))
            index = int(number.rpartition("[")[2].rstrip("]")) if "[" in number else 0
            values = [float(c.value) for c in state.motion.coordinates[joint]]
            count = sum(n.startswith(f"q.{stem}") for n in model.q_names)
            q.extend(values[index : index + count] if count == 1 else values[:count])
    return np.array(q), np.array(v), np.array(a)


def exact_beam_disagreements(data: Any, seed: int) -> list[tuple[str, float]]:
    """Compare M and inverse dynamics of a geometrically exact beam at random bent states."""
    rng, worst = np.random.default_rng([seed, 78]), dict[str, float]()
    beam = data["beams"]["rope"]
    model = eomgen.build(data, terms=["mass", "inverse_dynamics"], profile="quick")
    oracle = ExactBeam(beam, np.array(data["gravity"]), beam["group"] == "R3xSO3")
    nodes = beam["elements"] + 1
    for _ in range(3):
        q = np.array(model.initial_q).reshape(nodes, 7)
        turned = Rotation.from_rotvec(np.cumsum(rng.uniform(-0.5, 0.5, (nodes, 3)), axis=0))
        q[:, :4] = np.roll(turned.as_quat(), 1, axis=1)
        q[:, 4:] += 0.2 * oracle.h * rng.normal(size=(nodes, 3))
        v, a = rng.normal(size=(2, nodes, 6))
        found = model.inverse_dynamics(q.ravel(), v.ravel(), a.ravel())
        expected = oracle.inverse_dynamics(q, v, a)
        _keep(worst, "inverse_dynamics", found, expected.ravel(), 1.0)
        _keep(worst, "mass", model.mass(q.ravel()), oracle.mass, 1.0)
    return [(name, value) for name, value in worst.items() if not value < LIMIT]


def disagreements(data: Any, seed: int, kind: str, states: int = 3, built: Any = None) -> list[tuple[str, float]]:
    """Return (quantity, error over rounding times condition) of everything that disagrees.

    ``built``: the scene that eomgen builds, if it is to differ from the one that is interpreted.
    """
    if kind == "exact_beam":
        return exact_beam_disagreements(data, seed)
    machine, rng = Machine(data), np.random.default_rng([seed, 77])
    model = eomgen.build(built or data, terms=_terms(data, kind), profile="quick")
    if not model.multipliers and "forward_dynamics" not in model.terms:  # every row follows from the tree
        model = eomgen.build(data, terms=_terms(data, "tree", constrained=False), profile="quick")
    worst: dict[str, float] = {}
    for _ in range(states):
        start = random_state(machine, data, rng, kind)
        phi, _, w, _ = start.rows
        if np.abs(np.nan_to_num(phi)).max(initial=0.0) > 1e-11 or np.abs(w).max(initial=0.0) > 1e-10:
            continue  # the loop does not close from there
        bound = condition(start)
        if bound > 1e9:
            continue
        if undefined_rotation(start):
            continue
        a = start.accelerations
        state = State(machine, start.q, start.v, start.t, start.z, a)
        size = max(1.0, np.abs(a).max(initial=0.0))
        if kind == "absolute":
            q, v, expected = absolute_state(state, data, model)
        else:
            q, v, expected = state.q, state.v, a
            trial = State(machine, state.q, state.v, state.t, state.z, rng.uniform(-2, 2, machine.nv))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                tau = model.inverse_dynamics(q, v, trial.a, state.t, z=_z(model, state))
            beside = nudged(trial, rng)
            _keep(worst, "mass", model.mass(q), state.mass, 1.0)
            _keep(worst, "inverse_dynamics", tau, trial.inverse_dynamics, 1.0, beside=beside.inverse_dynamics)
        if machine.nv == 0:
            continue
        found = model.forward_dynamics(q, v, state.t, z=_z(model, state))
        if "constraints" in data:
            # Rows that eomgen has kept of redundant ones at the start may be nearly parallel here, though all are not.
            off = NUDGE * rng.uniform(-1, 1, len(q))
            near_found = model.forward_dynamics(q + off, v, state.t, z=_z(model, state))
            bound += float(np.abs(near_found - found).max(initial=0.0)) / size / NUDGE
        beside = nudged(state, rng)
        free = nudged(start, rng).accelerations
        if kind == "absolute":
            free = absolute_state(State(machine, beside.q, beside.v, beside.t, beside.z, free), data, model)[2]
        _keep(worst, "forward_dynamics", found, expected, bound, floor=size, beside=free)
        outputs = model.outputs(q, v, t=state.t, z=_z(model, state), a=found)
        beside = State(machine, beside.q, beside.v, beside.t, beside.z, nudged(start, rng).accelerations)
        near = beside.outputs()
        for name, value in state.outputs().items():
            _keep(worst, f"outputs.{name}", np.ravel(outputs[name]), value, bound, floor=size, beside=near[name])
        if kind == "hull":  # the water's part of energies is not in scene.md
            continue
        energy = model.energy(q, v, a=found, t=state.t, z=_z(model, state))
        _keep(worst, "energy.kinetic", energy["kinetic"], state.kinetic, 1.0)
        _keep(worst, "energy.power", energy["power"], state.power, 1.0, floor=1.0, beside=beside.power)
        if data.get("states"):
            rates = model.internal_rates(q, v, list(state.z.values()), state.t)
            expected, near = (np.array(list(one.internal_rates().values())) for one in (state, beside))
            _keep(worst, "internal_rates", rates, expected, 1.0, floor=1.0, beside=near)
    return [(name, value) for name, value in worst.items() if not value < LIMIT]


def _z(model: Any, state: State) -> Any:
    return list(state.z.values()) if state.z else None


def _terms(data: Any, kind: str, constrained: bool | None = None) -> list[str]:
    if constrained is None:
        constrained = kind == "absolute" or "constraints" in data
    states = ["internal_rate"] if "states" in data else []
    return [*TERMS, *(CONSTRAINED if constrained else ["forward_dynamics"]), *states]


def contradictory(data: Any) -> bool:
    """Return whether the interpreter finds no state near the initial one that meets all rows, as eomgen says."""
    machine = Machine(data)
    start = random_state(machine, data, np.random.default_rng(0), "loop", spread=0.0, t=0.0)
    phi, _, w, _ = start.rows
    return bool(np.abs(np.nan_to_num(phi)).max(initial=0.0) > 1e-9 or np.abs(w).max(initial=0.0) > 1e-9)


def undefined_rotation(state: State) -> bool:
    """Return True if a force reads the rotation vector of a body at half a turn: scene.md leaves its sign open."""
    return any(
        np.linalg.norm(Rotation.from_matrix(state.motion.poses[entry["body"]].R.value).as_rotvec()) > np.pi - 1e-9
        for entry in state.data.get("forces", {}).values()
        if "rotation.here" in str(entry)
    )


def nudged(state: State, rng: np.random.Generator) -> State:
    """Return a state next to another: values there tell how far rounding of q, v and t carries."""
    step = NUDGE * rng.uniform(-1, 1, state.machine.nv)
    moved = state.v + NUDGE * rng.uniform(-1, 1, state.machine.nv)
    return State(state.machine, state.moved(step), moved, state.t + NUDGE, state.z, state.a)


def _keep(
    worst: dict[str, float],
    name: str,
    found: Any,
    expected: Any,
    condition: float,
    floor: float = 0.1,
    beside: Any = None,
) -> None:
    """Keep the largest error over rounding times the condition, and times the growth of small changes of the state."""
    found, expected = np.asarray(found, float), np.asarray(expected, float)
    size = max(float(np.abs(expected).max(initial=0.0)), floor)
    error = float(np.abs(found - expected).max(initial=0.0)) / size
    growth = 0.0 if beside is None else float(np.abs(np.asarray(beside) - expected).max(initial=0.0)) / size / NUDGE
    worst[name] = max(
        worst.get(name, 0.0), error / (2.2e-16 * (condition + growth)) if math.isfinite(error) else math.inf
    )


def outcome_of(seed: int, kind: str) -> tuple[str, list[tuple[str, float]]]:
    """Return ``agrees``, ``disagrees`` or ``refused by both`` for a scene, and its disagreements."""
    data = scene(seed, kind)
    with tempfile.TemporaryDirectory() as cache:
        os.environ["EOMGEN_CACHE"] = cache
        try:
            found = disagreements(data, seed, kind)
        except eomgen.EomgenError as refusal:
            if isinstance(refusal, eomgen.ModelError) and "constraints" in data and contradictory(data):
                return "refused by both", []
            found = [(f"refused: {refusal}", math.inf)]
        except Exception as fault:  # a harness reports every fault of one scene and goes on
            found = [(f"{type(fault).__name__}: {fault}", math.inf)]
    return ("disagrees" if found else "agrees"), found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=30)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS))
    parser.add_argument("--keep", type=Path, help="folder for scenes that disagree")
    options = parser.parse_args()
    counts: collections.Counter[str] = collections.Counter()
    began = time.perf_counter()
    with contextlib.suppress(KeyboardInterrupt):  # counts of the scenes so far
        for seed in range(options.first, options.first + options.scenes):
            kind = options.kinds[seed % len(options.kinds)]
            outcome, found = outcome_of(seed, kind)
            counts[kind, outcome] += 1
            if found:
                print(f"{kind} {seed}: " + "; ".join(f"{name} {value:.3g}" for name, value in found)[:600], flush=True)
                if options.keep:
                    options.keep.mkdir(parents=True, exist_ok=True)
                    (options.keep / f"{kind}_{seed}.json").write_text(json.dumps(scene(seed, kind), indent=1))
    print(dict(counts), f"{time.perf_counter() - began:.0f} s")
    return int(any(outcome == "disagrees" for _, outcome in counts))


if __name__ == "__main__":
    sys.exit(main())
