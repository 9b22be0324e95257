"""States of a check: along a short simulated motion, and random around the initial state, on the constraints."""

from __future__ import annotations

import numpy as np

from eomgen.base.data import dataclass
from eomgen.compiled.constraints import accelerations
from eomgen.compiled.coordinates import coordinate_names, reaches
from eomgen.errors import EomgenError, Message, NumericalError
from eomgen.lie.product import update
from eomgen.pipeline.model import Model
from eomgen.products.studies.verification.claims.claim import FEW, Array, Engine, Space, directions
from eomgen.products.studies.work_precision.observation import extent_of
from eomgen.system.system import System

#: Random states are this far from the initial one, in rad and rad/s, and parameters change by this part.
AMPLITUDE = 0.5


@dataclass(frozen=True)
class CheckedStates:
    """Blocks (S, size) with a name for each state, and the omissions."""

    blocks: dict[str, Array]
    names: tuple[str, ...]
    notes: tuple[str, ...]


def draw(
    model: Model, system: System, engine: Engine, count: int, rng: np.random.Generator
) -> tuple[CheckedStates, Space]:
    """Return `count` states for a check, beginning with the initial state, and the space of the states. Half of the
    states are along a short simulated motion, half are random around the motion; states at which the equations are not
    finite are left out, with a note."""
    notes: list[str] = []
    motion, names = _motion(model, max(1, count // 2), notes)
    scales = _scales(model, motion, extent_of(model, model.initial_q))
    completed = [_complete_state(model, state, rng, scales, 0.0 if len(model.multipliers) else 0.3) for state in motion]
    kept = [(name, state) for name, state in zip(names, completed, strict=True) if state is not None]
    outside = [name for name, state in zip(names, completed, strict=True) if state is None]
    if outside:
        notes.append(f"left out: {', '.join(outside)}, where the equations of motion are not finite [W0087]")
    drawn = [_random(model, motion, scales, rng) for _ in range(count - len(motion))]
    kept += [(f"random state {number}", state) for number, state in enumerate(drawn) if state is not None]
    if missing := sum(state is None for state in drawn):
        notes.append(
            f"around the motion {missing} of {len(drawn)} states were not found: no finite or consistent ones [W0088]"
        )
    blocks = {name: np.stack([state[name] for _, state in kept]) for name in kept[0][1]} if kept else {}
    scales["a"] = np.abs(blocks["a"]).max(axis=0) if kept else scales["v"]
    states = CheckedStates(blocks, tuple(name for name, _ in kept), tuple(map(Message, notes)))
    return states, _space(model, system, engine, scales, rng)


def _motion(model: Model, count: int, notes: list[str]) -> tuple[list[dict[str, Array]], list[str]]:
    """Return at most `count` states (q, v, z, t) along a short simulated motion from the initial state, and their
    names. The initial state alone, with a note, if there is no motion."""
    initial = {"q": model.initial_q, "v": model.initial_v, "z": model.initial_z, "t": np.zeros(1)}
    if count == 1:
        return [initial], ["initial state"]
    settings = model.description.simulation
    every = max(1, 60 // (count - 1))
    try:
        end = min(every * (count - 1) * settings.step, settings.duration)
        run = model.simulate(end, record_every=every, error_estimate=False)
    except EomgenError as error:
        notes.append(f"no motion to take states from: {'; '.join(problem.what for problem in error.problems)} [W0089]")
        return [initial], ["initial state"]
    if not run.success:
        notes.append(f"the motion to take states from ended early: {run.message} [W0090]")
    rows = [k for k in range(len(run.t)) if np.isfinite(run.q[k]).all() and np.isfinite(run.v[k]).all()][:count]
    states = [{"q": run.q[k], "v": run.v[k], "z": run.z[k], "t": run.t[k : k + 1]} for k in rows]
    names = ["initial state" if k == 0 else f"t = {run.t[k]:.6g} s" for k in rows]
    return (states, names) if states else ([initial], ["initial state"])


def _scales(model: Model, motion: list[dict[str, Array]], length: float) -> dict[str, Array]:
    """Return the sizes of small changes of ``v`` (nv,) and ``z`` (nz,). They are 1 rad and 1 rad/s, or `length` (m) for
    lengths, a part of the length for beams; the largest value of each internal state in the motion."""
    units = np.ones(model.nv)
    beams = {item.name: item.length for item in model.description.coordinates if item.length}
    for factor in model.factors:
        linear = [k for k in range(factor.v_size) if model.v_units[factor.v_start + k].startswith("m")]
        size = beams.get(factor.name, length)
        units[[factor.v_start + k for k in linear]] = size
        if factor.name in beams:
            units[factor.v] *= 0.05  # theories of beams are for small deflections
    reached = np.max([np.abs(state["z"]) for state in motion], axis=0, initial=0.0)
    return {"v": units, "z": np.where(reached > 0.0, reached, 1.0)}


def _random(
    model: Model, motion: list[dict[str, Array]], scales: dict[str, Array], rng: np.random.Generator
) -> dict[str, Array] | None:
    """Return a random state near a state of the motion, at any time of a run, on the constraints, drawn nearer in
    each of eight trials until all terms are finite; None if none is found."""
    draws = {name: rng.uniform(-1.0, 1.0, model.nv) for name in ("q", "v")} | {"z": rng.uniform(-1.0, 1.0, model.nz)}
    around = motion[int(rng.integers(len(motion)))]
    time = rng.uniform(0.0, model.description.simulation.duration)
    apart = np.where(scales["v"] == 1.0, AMPLITUDE, 0.2 * scales["v"])
    apart = np.minimum(apart, reaches(model.factors, model.description.coordinates))
    for part in 0.5 ** np.arange(8):
        guess = {
            "q": update(model.factors, around["q"], part * apart * draws["q"]),
            "v": around["v"] + part * scales["v"] * draws["v"],
            "z": around["z"] + 0.3 * part * scales["z"] * draws["z"],
            "t": around["t"] + part * (time - around["t"]),
        }
        try:
            if model.multipliers:
                consistent = model.consistent(guess["q"], guess["v"], float(guess["t"][0]))
                guess |= {"q": consistent.q, "v": consistent.v}
        except EomgenError:
            continue
        state = _complete_state(model, guess, rng, scales, part)
        if state is not None:
            return state
    return None


def _complete_state(
    model: Model, state: dict[str, Array], rng: np.random.Generator, scales: dict[str, Array], part: float
) -> dict[str, Array] | None:
    """Return a state with all input blocks of functions, or None if the residual is not finite. Inputs are near the
    values of formulas (`part` scales the distance), accelerations random; with constraints, accelerations and
    multipliers are of the motion. Further rates, weights and directions are random."""
    functions, t = model.functions, float(state["t"][0])
    blocks = {**state, "p": model.parameter_array(), "base": model.base(t), "u": model.input_values(t)}
    blocks["u"] = blocks["u"] + 0.3 * part * np.maximum(np.abs(blocks["u"]), 1.0) * rng.uniform(-1.0, 1.0, model.nu)
    rows = len(model.multipliers)
    blocks["a"], blocks["lam"] = scales["v"] * rng.uniform(-2.0, 2.0, model.nv), rng.uniform(-1.0, 1.0, rows)
    if rows:
        try:
            blocks["a"], blocks["lam"] = accelerations(functions, {**blocks, "t": blocks["t"][0]})
        except NumericalError:
            return None
    block_of = {"j": "v", "s": "v", "u_dot": "u", "u_ddot": "u"}
    sizes = {"v": 2.0 * scales["v"], "u": np.maximum(np.abs(blocks["u"]), 1.0)}
    blocks |= {name: sizes[of] * rng.uniform(-1.0, 1.0, len(sizes[of])) for name, of in block_of.items()}
    if "base_rates" in functions:
        blocks["base_rates"] = functions("base_rates", {"t": blocks["t"][0], "p": blocks["p"]})[0].ravel()
    (residual,) = functions("residual", {**blocks, "t": blocks["t"][0]})
    if not np.isfinite(residual).all():
        return None
    if "weights" in functions.sizes:
        blocks["weights"] = rng.uniform(-1.0, 1.0, functions.sizes["weights"])
    if "second_partials" in functions:
        of_parameters = AMPLITUDE * np.abs(blocks["p"])
        driven = [0.0 if item.given else 1.0 for item in model.description.inputs]  # other inputs are given by laws
        of_motion = (scales["v"], scales["v"], scales["v"], scales["z"], np.ones(rows), of_parameters, driven)
        blocks["direction"] = np.concatenate(of_motion) * rng.uniform(-1.0, 1.0, functions.sizes["direction"])
    there = {name: np.array(array, dtype=float) for name, array in blocks.items() if np.size(array)}
    return there if "base" in functions else {name: array for name, array in there.items() if name != "base"}


def _space(model: Model, system: System, engine: Engine, scales: dict[str, Array], rng: np.random.Generator) -> Space:
    names = {"v": tuple(coordinate_names(model.factors)[1]), "z": tuple(model.z_names), "lam": tuple(model.multipliers)}
    along = {
        "v": directions(names["v"], scales["v"], rng),
        "z": directions(names["z"], scales["z"], rng),
        "lam": directions(names["lam"], np.ones(len(model.multipliers)), rng),
    }
    values = np.abs(model.parameter_array())
    along["p"] = directions(tuple(model.parameters), np.where(values > 0.0, AMPLITUDE * values, 1.0), rng)
    few = directions(names["v"], scales["v"], rng, FEW)
    along["a"] = directions(names["v"], np.maximum(scales["v"], scales["a"]), rng)  # linear: no step is too large
    return Space(system, engine, model.scene, model.description, along | {"q": along["v"]}, few, names)
