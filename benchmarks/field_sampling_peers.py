"""Hamiltonian Monte Carlo of blackjax beside `eomgen.fields`, on the same posterior of a density field.

    python -m venv .bench/blackjax && .bench/blackjax/bin/pip install blackjax
    python -m benchmarks.field_sampling_peers [--cells 32] [--samples 600] [--python .bench/blackjax/bin/python]

Lognormal density, Poisson counts of 0.04 in a cell, on the processor, in double precision or, as JAX has it by default,
in single precision (here that of gradients), with transforms by SciPy or by FFTW (``--transforms``). blackjax moves
the white field over the cells with a mass of 1, compiled by XLA, with its leapfrog ("velocity_verlet"), its minimum
norm scheme of two gradients ("mclachlan") and its scheme of five ("omelyan"); here are others, with the mass of Fisher.
Chains begin at the truth, trajectories last 1.5 with steps that vary by a fifth; a step is the best of those that are
tried, by gradients for each independent sample. Compared are gradients for each second of processor time, by pairs that
are taken in turn, and gradients for each independent sample of cells and of the worst of eight bins of k. Both keep the
gradient at the end of a trajectory that ends with a kick.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.threads import THREADS_VARIABLE
from eomgen.fields import FieldPosterior, Sampler, autocorrelation_time
from tests.fields.density import counted

#: Cells whose values are kept: one in so many.
EVERY = 109
BINS = 8
DURATION = 1.5
#: Steps that are tried on 32^3 cells; on others they go with the number of cells to the power -1/4 or -1/8.
STEPS: dict[str, tuple[int, tuple[float, ...]]] = {
    "leapfrog": (2, (0.11, 0.15, 0.2)),
    "suzuki4": (4, (0.6, 0.75, 0.9)),
    "minimum_norm2": (2, (0.6, 0.75, 0.85)),
    "omf4": (4, (1.0, 1.25, 1.5)),
}
PEERS: dict[str, tuple[int, int, tuple[float, ...]]] = {
    "velocity_verlet": (1, 2, (0.09, 0.12, 0.15)),
    "mclachlan": (2, 2, (0.5, 0.65, 0.75)),
    "omelyan": (5, 4, (0.8, 1.0, 1.25)),
}

PEER = """
import json, os, sys, time
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
import jax, jax.numpy as jnp, numpy as np
jax.config.update("jax_enable_x64", sys.argv[2] == "double")
import blackjax
from blackjax.mcmc import integrators
stored = np.load(sys.argv[1])
symbol, counts, truth = (jnp.asarray(stored[name]) for name in ("symbol", "counts", "truth"))
shift, every, cells = float(stored["shift"]), int(stored["every"]), counts.shape

def logdensity(x):
    s = jnp.fft.irfftn(symbol * jnp.fft.rfftn(x, norm="ortho"), cells, norm="ortho")
    return -0.5 * jnp.sum(x**2) - jnp.sum(jnp.exp(s + shift) - counts * (s + shift))

gradient = jax.jit(jax.value_and_grad(logdensity))
gradient(truth)[1].block_until_ready()
print(json.dumps({"blackjax": blackjax.__version__, "jax": jax.__version__,
                  "energy": -float(gradient(truth)[0])}), flush=True)
for line in sys.stdin:
    asked = json.loads(line)
    if asked["do"] == "time":
        began = time.process_time()
        for _ in range(asked["count"]):
            gradient(truth)[1].block_until_ready()
        print(json.dumps({"seconds": (time.process_time() - began) / asked["count"]}), flush=True)
        continue
    if asked["do"] == "gradient":
        np.save(asked["file"], np.asarray(gradient(truth)[1]))
        print(json.dumps({}), flush=True)
        continue
    step, duration, count = asked["step"], asked["duration"], asked["samples"]
    kernel = blackjax.hmc.build_kernel(getattr(integrators, asked["scheme"]))
    mass = jnp.ones(truth.size)

    flat = lambda x: logdensity(x.reshape(cells))
    @jax.jit
    def sample(state, key):
        one, two, three = jax.random.split(key, 3)
        size = step * (1.0 + 0.2 * jax.random.uniform(one, minval=-1.0, maxval=1.0))
        steps = jnp.maximum(1, jnp.floor(duration / size + jax.random.uniform(two))).astype(int)
        state, told = kernel(three, state, flat, size, mass, steps)
        return state, (told.acceptance_rate, steps, state.position[::every],
                       jnp.fft.rfftn(state.position.reshape(cells), norm="ortho"))
    state = blackjax.hmc.init(truth.ravel(), flat)
    key = jax.random.key(asked["seed"])
    rates, steps, watched, power = [], [], [], []
    number = stored["number"]
    weights = stored["weights"]
    began = time.process_time()
    for place in range(count):
        key, own = jax.random.split(key)
        state, (rate, made, values, spectrum) = sample(state, own)
        field = np.asarray(symbol) * np.asarray(spectrum)
        rates.append(float(rate)); steps.append(int(made))
        watched.append(np.fft.irfftn(field, cells, (0, 1, 2), norm="ortho").ravel()[::every])
        power.append(np.bincount(number.ravel(), (weights * np.abs(field) ** 2).ravel(), number.max() + 1)[1:])
    np.savez(asked["file"], rates=rates, steps=steps, watched=watched, power=power)
    print(json.dumps({"seconds": time.process_time() - began}), flush=True)
"""


class Peer:
    """blackjax in a process of its own, which is asked by lines of JSON."""

    def __init__(
        self, python: str, precision: str, posterior: FieldPosterior, truth: Any, mean: float, folder: Path
    ) -> None:
        mesh, operator = posterior.mesh, posterior.operators["s"]
        nyquist = np.pi * mesh.cells[0] / mesh.lengths[0]
        number = np.ceil(mesh.wave_numbers / nyquist * BINS - 1e-12).astype(int)
        number[number > BINS] = 0
        np.savez(
            folder / "posterior.npz", symbol=operator.symbol, counts=posterior.data["counts"], truth=mesh.field(truth),
            shift=np.log(mean) - operator.variance / 2, every=EVERY, number=number,
            weights=np.broadcast_to(mesh.weights, mesh.half),
        )  # fmt: skip
        script = folder / "peer.py"
        script.write_text(PEER, encoding="utf-8")
        self.folder = folder
        self.process = subprocess.Popen(
            [python, str(script), str(folder / "posterior.npz"), precision],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": ""},
        )  # fmt: skip
        self.about = self.told()

    def told(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit("blackjax ended without an answer; see above, and the head of this file")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def ask(self, **question: Any) -> dict[str, Any]:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(question) + "\n")
        self.process.stdin.flush()
        return self.told()


def seconds_of_gradients(posterior: FieldPosterior, truth: Any, peer: Peer, pairs: int) -> tuple[float, float]:
    """Return medians of the processor time of a gradient here and there, taken in turn."""
    slope = np.zeros(posterior.mesh.half, complex)

    def here(count: int) -> float:
        began = time.process_time()
        for _ in range(count):
            posterior.add_gradient(1e-9, truth, slope)
        return (time.process_time() - began) / count

    here(3)
    count = max(1, round(0.1 / here(3)))
    found = [(here(count), float(peer.ask(do="time", count=count)["seconds"])) for _ in range(pairs)]
    return statistics.median(one for one, _ in found), statistics.median(two for _, two in found)


def per_sample(each: float, cells: Array, power: Array) -> tuple[float, float]:
    """Return gradients for each independent sample, of cells and of the worst bin."""
    return (
        each * max(float(np.mean(autocorrelation_time(cells[None]))), 1.0),
        each * max(float(np.max(autocorrelation_time(power[None]))), 1.0),
    )


def best(
    name: str, order: int, steps: tuple[float, ...], cells: int, run: Callable[[float], Any]
) -> tuple[float, float]:
    """Print what each step gives, and return the least gradients for each independent sample of cells and of scales."""
    found = []
    for step in steps:
        size = step * (32.0 / cells) ** (3.0 / (2 * order))
        acceptance, each, values = run(size)
        of_cells, worst = per_sample(each, *values)
        print(f"  {name:16s} step {size:.3f}: acceptance {acceptance:.3f}, {each:.1f} gradients, for each independent"
              f" sample {of_cells:.1f} (cells), {worst:.1f} (worst scale)", flush=True)  # fmt: skip
        found.append((of_cells, worst))
    return min(one for one, _ in found), min(two for _, two in found)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--cells", type=int, default=32)
    arguments.add_argument("--samples", type=int, default=600)
    arguments.add_argument("--pairs", type=int, default=11)
    arguments.add_argument("--mean", type=float, default=0.04)
    arguments.add_argument("--transforms", default="scipy")
    arguments.add_argument("--precision", default="double")
    arguments.add_argument("--python", default=".bench/blackjax/bin/python")
    given = arguments.parse_args()
    os.environ[THREADS_VARIABLE] = "1"
    made, truth = counted(given.cells, given.mean)
    posterior = FieldPosterior(
        made.mesh, made.energy_of_cell, made.operators, made.data, transforms=given.transforms,
        precision=given.precision,
    )  # fmt: skip
    rounding = 1e-10 if given.precision == "double" else 1e-4
    watched = np.arange(0, posterior.mesh.size, EVERY)
    with tempfile.TemporaryDirectory() as folder:
        peer = Peer(given.python, given.precision, posterior, truth, given.mean, Path(folder))
        how = f"{given.transforms}, {given.precision} precision"
        print(f"{given.cells}^3 cells, {how}, load {os.getloadavg()[0]:.1f}; {peer.about}")
        assert abs(peer.about["energy"] / posterior.energy(truth) - 1.0) < rounding
        peer.ask(do="gradient", file=f"{folder}/gradient.npy")
        theirs = posterior.mesh.spectrum(-np.load(f"{folder}/gradient.npy"))
        assert np.abs(theirs - posterior.gradient(truth)).max() < rounding
        own, other = seconds_of_gradients(posterior, truth, peer, given.pairs)
        print(
            f"a gradient: {own * 1e3:.2f} ms here, {other * 1e3:.2f} ms of blackjax; ratio of rates {other / own:.2f}"
        )

        def here(method: str) -> Callable[[float], Any]:
            def run(step: float) -> Any:
                sampler = Sampler(
                    posterior, method=method, step=step, start=[truth], seed=3, watched=watched, bins=BINS,
                    duration=DURATION, guard=float("inf"),
                )  # fmt: skip
                samples = sampler.draw(given.samples)
                return samples.acceptance, float(np.mean(samples.gradients)), (samples.cells[0], samples.power[0])

            return run

        def there(scheme: str, gradients: int) -> Callable[[float], Any]:
            def run(step: float) -> Any:
                file = f"{folder}/{scheme}.npz"
                peer.ask(
                    do="sample", scheme=scheme, step=step, duration=DURATION, samples=given.samples, seed=3, file=file
                )
                with np.load(file) as stored:
                    each = gradients * float(np.mean(stored["steps"]))
                    return float(np.mean(stored["rates"])), each, (stored["watched"], stored["power"])

            return run

        ours = {name: best(name, order, steps, given.cells, here(name)) for name, (order, steps) in STEPS.items()}
        peers = {
            name: best(name, order, steps, given.cells, there(name, gradients))
            for name, (gradients, order, steps) in PEERS.items()
        }
        for place, what in enumerate(("cells", "worst scale")):
            name, least = min(((name, values[place]) for name, values in ours.items()), key=lambda item: item[1])
            for scheme, values in peers.items():
                told = f"{name} {least:.1f}, {scheme} {values[place]:.1f}; ratio {least / values[place]:.2f}"
                print(f"gradients for each independent sample, {what}: {told}")
        peer.process.terminate()


if __name__ == "__main__":
    main()
