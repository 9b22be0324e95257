"""Hamiltonian Monte Carlo on a mesh: trajectories by any symplectic composition, accepted by their energy errors.

H = U(xi) + |p|^2_{M^-1}/2. A trajectory draws momenta, then follows drifts (xi by p/M) and kicks (p by the gradient of
U) for about a given time, and its end is taken with the probability min(1, exp(-dH)). Steps are varied, their number is
rounded at random, and which of drift and kick comes first is drawn: from a start that is smoother than samples are,
leapfrogs of one splitting only ever gain energy. All of these are drawn without regard to the state, so the posterior
is kept.

Random numbers of each trajectory of each chain are a stream of their own (Philox), so a sampler that is saved goes on
with the same bits.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.arrays import Array
from eomgen.calls import checked_calls
from eomgen.errors import FileError, NumericalError, Problem, UsageError
from eomgen.fields.diagnostics import autocorrelation_time, split_r_hat
from eomgen.fields.mesh import Complex
from eomgen.fields.posterior import FieldPosterior
from eomgen.files import read_arrays, write_arrays
from eomgen.integrators.compositions import Composition, composition_named

#: Acceptance at which a sampler moves farthest for its gradients, by order of the method: where the error of the energy
#: is normal with a deviation of c step^order, step erfc(deviation/sqrt(8)) has its maximum there.
BEST_ACCEPTANCE = {2: 0.651, 4: 0.797, 6: 0.86, 8: 0.89}
#: The word of the counter of a stream that draws where a chain starts; trajectories have the words from 0 on.
_START = 2**63
#: Trajectories of a warm-up between two estimates of the largest frequency.
_WATCHED = 20
#: Largest number of halvings of the step until a trajectory is accepted.
_HALVINGS = 30

First = Literal["random", "drift", "kick"]


def follow(
    posterior: FieldPosterior,
    method: Composition,
    step: float,
    steps: int,
    spectrum: Complex,
    momenta: Complex,
    inverse_mass: Array | None = None,
) -> None:
    """Move a white field and its momenta in place by steps of a composition."""
    for part, fraction in method.parts(steps):
        if part == "drift":
            posterior.drift(step * fraction, inverse_mass, momenta, spectrum)
        else:
            posterior.add_gradient(-step * fraction, spectrum, momenta)


@dataclass(frozen=True)
class Samples:
    """What chains have drawn, first axes (chains, samples).

    Attributes
    ----------
    accepted : whether the end of a trajectory was taken
    energy_errors : dH of each trajectory; infinite where numbers ended
    potential : U of the samples
    gradients : evaluations of the gradient, of each trajectory
    cells : values of the field that is watched in the cells that are watched, (chains, samples, cells)
    power : mean |amplitude|^2 of it by bins of k, (chains, samples, bins)
    wave_numbers : (bins,)
    mean, deviation : of all samples of it in each cell, shape of the mesh
    steps : size of a step of each chain, before it is varied
    """

    accepted: NDArray[np.bool_]
    energy_errors: Array
    potential: Array
    gradients: NDArray[np.int64]
    cells: Array
    power: Array
    wave_numbers: Array
    mean: Array
    deviation: Array
    steps: Array

    @property
    def acceptance(self) -> float:
        """Part of the trajectories whose ends were taken."""
        return float(np.mean(self.accepted))

    @property
    def mean_energy_error(self) -> float:
        """Mean of dH: not below 0, and half its variance where steps are small."""
        return float(np.mean(self.energy_errors))

    @property
    def mean_weight(self) -> tuple[float, float]:
        """Mean of exp(-dH), and its standard error: 1 at stationarity, whatever the step."""
        weights = np.exp(-np.maximum(self.energy_errors, -700.0)).ravel()
        return float(weights.mean()), float(weights.std(ddof=1) / math.sqrt(weights.size))

    @property
    def expected_acceptance(self) -> float:
        """erfc(sqrt(mean dH)/2): the acceptance that normal errors of this mean give."""
        return math.erfc(math.sqrt(max(self.mean_energy_error, 0.0)) / 2.0)

    @property
    def r_hat(self) -> float:
        """Largest split R-hat of the cells and bins of k that are watched."""
        return float(np.nanmax(np.concatenate([split_r_hat(self.cells), split_r_hat(self.power)])))

    @property
    def autocorrelation(self) -> tuple[float, float]:
        """Integrated autocorrelation times in trajectories: mean of the cells, and of the worst bin of k."""
        return float(np.mean(autocorrelation_time(self.cells))), float(np.nanmax(autocorrelation_time(self.power)))

    @property
    def gradients_per_sample(self) -> tuple[float, float]:
        """Gradients for each independent sample: of the cells, and of the worst bin of k."""
        each = float(np.mean(self.gradients))
        of_cells, worst = self.autocorrelation
        return each * max(of_cells, 1.0), each * max(worst, 1.0)


@dataclass
class _Chain:
    """Where a chain is: its white field, U there, trajectories so far, and the size of its steps."""

    number: int
    spectrum: Complex
    potential: float
    step: float
    trajectories: int = 0


@dataclass(frozen=True)
class _Outcome:
    error: float
    accepted: bool
    gradients: int


@checked_calls()
class Sampler:
    """Chains of Hamiltonian Monte Carlo on the posterior of a field.

    Parameters
    ----------
    posterior : FieldPosterior
    method : str
        A composition: ``minimum_norm2``, ``omf4``, ``suzuki4``, ``leapfrog`` and others.
    step : float
        Size of a step; 0: half of what ``guard`` allows, for ``warm_up`` to change.
    duration : float
        Time of a trajectory; a quarter turn of an oscillator of frequency 1 is 1.57.
    mass : {"fisher", "prior", "unit"}
    first : {"random", "drift", "kick"}
        What trajectories begin with.
    jitter : float
        A step is varied by this part of it up and down.
    guard : float
        Steps are kept below this part of the largest stable one, by the largest frequency where chains start and, in
        a warm-up, where they come; infinite for none.
    chains : int
    start : {"mode", "prior", "zero"}, or spectra of white fields, one for each chain
    seed : int
    watched : cells, as numbers of the flattened mesh, whose values are kept; 64 evenly spread ones by default
    bins : of wave numbers, for power spectra

    Raises
    ------
    UsageError, NumericalError
    """

    def __init__(
        self,
        posterior: FieldPosterior,
        *,
        method: str = "minimum_norm2",
        step: float = 0.0,
        duration: float = 1.5,
        mass: str = "fisher",
        first: First = "random",
        jitter: float = 0.2,
        guard: float = 0.9,
        chains: int = 1,
        start: str | Sequence[Complex] = "mode",
        seed: int = 0,
        watched: ArrayLike | None = None,
        bins: int = 8,
    ) -> None:
        for name, value, fine, bound in (
            ("step", step, 0.0 <= step < math.inf, "0 for a step that is found, or above"),
            ("duration", duration, 0.0 < duration < math.inf, "above 0"),
            ("jitter", jitter, 0.0 <= jitter < 1.0, "from 0 to below 1"),
            ("guard", guard, guard > 0.0, "above 0, as 0.9"),
            ("chains", chains, chains >= 1, "from 1 on"),
            ("seed", seed, seed >= 0, "from 0 on"),
        ):
            if not fine:
                raise UsageError(Problem(f"Sampler: {name}", f"{value:.6g} cannot be", bound))
        if first not in ("random", "drift", "kick"):
            raise UsageError(Problem("Sampler: first", f"{first!r} is neither", '"random", "drift" or "kick"'))
        self.posterior = posterior
        self.first: First = first
        self.duration, self.jitter, self.guard, self.seed, self.bins = duration, jitter, guard, seed, bins
        named = [composition_named(method, "drift"), composition_named(method, "kick")]
        self.methods = named if first == "random" else [named[first == "kick"]]
        self.mass = posterior.mass(mass)
        self._inverse = None if self.mass is None else 1.0 / self.mass
        self._root = None if self.mass is None else np.sqrt(self.mass)
        size = posterior.mesh.size
        self.watched = np.arange(0, size, -(-size // 64)) if watched is None else np.asarray(watched, dtype=int)
        #: The largest angular frequency that has been seen.
        self.frequency = 0.0
        self.chains: list[_Chain] = []
        self._momenta = np.empty(posterior.mesh.half, complex)
        self._moved = np.empty(posterior.mesh.half, complex)
        for number, spectrum in enumerate(self._starts(start, chains)):
            potential = posterior.energy(spectrum)
            if not math.isfinite(potential):
                what = f"U is {potential} where chain {number} starts"
                raise NumericalError(Problem("Sampler: start", what, '"mode"'))
            self.frequency = max(self.frequency, posterior.largest_frequency(spectrum, self.mass))
            self.chains.append(_Chain(number, spectrum, potential, 0.0))
        for chain in self.chains:
            chain.step = min(step or 0.5 * self.largest_step, self.largest_step)

    @property
    def largest_step(self) -> float:
        """The largest step that ``guard`` allows before it is varied."""
        limit = min(method.stability_limit for method in self.methods)
        return self.guard * limit / (self.frequency * (1.0 + self.jitter))

    def warm_up(self, trajectories: int, acceptance: float = 0.0) -> None:
        """Make trajectories that are not kept, and change steps for an acceptance; 0: the best for the method's order.

        Steps are halved until a trajectory is accepted, and then changed less and less. The step that is left is the
        geometric mean of the second half.
        """
        target = acceptance or BEST_ACCEPTANCE.get(self.methods[0].order, 0.9)
        for chain in self.chains:
            kept: list[float] = []
            halvings = 0
            for count in range(trajectories):
                outcome = self._trajectory(chain)
                if outcome.accepted and (count + 1) % _WATCHED == 0:
                    seen = self.posterior.largest_frequency(chain.spectrum, self.mass)
                    self.frequency = max(self.frequency, seen)
                if not kept and not outcome.accepted and halvings < _HALVINGS:
                    halvings += 1
                    chain.step /= 2.0
                    continue
                probability = math.exp(-max(outcome.error, 0.0))
                gain = 1.0 / math.sqrt(1.0 + len(kept))
                chain.step = min(chain.step * math.exp(gain * (probability - target)), self.largest_step)
                kept.append(math.log(chain.step))
            if kept:
                chain.step = min(math.exp(float(np.mean(kept[len(kept) // 2 :]))), self.largest_step)

    def draw(self, samples: int, field: str = "") -> Samples:
        """Return the next samples of all chains, of the first field or of the one that is named.

        Raises
        ------
        UsageError
            No field has the name, or there are none.
        """
        names = list(self.posterior.operators)
        if (field or not names) and field not in names:
            what = f"there is no field {field!r}" if field else "there is no field to watch"
            raise UsageError(Problem("Sampler.draw: field", what, ", ".join(names) or "fields of the posterior"))
        operator = self.posterior.operators[field or names[0]]
        shape = (len(self.chains), samples)
        mesh = self.posterior.mesh
        errors, potential, accepted = np.empty(shape), np.empty(shape), np.empty(shape, bool)
        gradients = np.empty(shape, np.int64)
        cells, power = np.empty((*shape, len(self.watched))), np.empty((*shape, self.bins))
        mean, squares, seen = np.zeros(mesh.cells), np.zeros(mesh.cells), 0
        numbers = np.empty(self.bins)
        for chain in self.chains:
            for place in range(samples):
                at = (chain.number, place)
                outcome = self._trajectory(chain)
                errors[at], accepted[at], gradients[at] = outcome.error, outcome.accepted, outcome.gradients
                potential[at] = chain.potential
                values = operator.apply(chain.spectrum)
                cells[at] = values.ravel()[self.watched]
                numbers, power[at] = mesh.power(mesh.spectrum(values), self.bins)
                seen += 1
                change = values - mean
                mean += change / seen
                squares += change * (values - mean)
        deviation = np.sqrt(squares / max(seen - 1, 1))
        steps = np.array([chain.step for chain in self.chains])
        return Samples(accepted, errors, potential, gradients, cells, power, numbers, mean, deviation, steps)

    def _stream(self, chain: int, word: int) -> np.random.Generator:
        return np.random.Generator(np.random.Philox(key=[self.seed, chain], counter=[0, 0, 0, word]))

    def _trajectory(self, chain: _Chain) -> _Outcome:
        """Move a chain by one trajectory."""
        posterior = self.posterior
        stream = self._stream(chain.number, chain.trajectories)
        chain.trajectories += 1
        uniform = stream.random(4)
        method = self.methods[int(uniform[0] * len(self.methods))]
        step = chain.step * (1.0 + self.jitter * (2.0 * uniform[1] - 1.0))
        steps = max(1, math.floor(self.duration / step + uniform[2]))
        momenta, moved = self._momenta, self._moved
        momenta[...] = posterior.mesh.white(stream)
        if self._root is not None:
            momenta *= self._root
        moved[...] = chain.spectrum
        before = posterior.gradients
        energy = chain.potential + 0.5 * posterior.norm(momenta, self._inverse)
        follow(posterior, method, step, steps, moved, momenta, self._inverse)
        potential = posterior.energy(moved)
        error = potential + 0.5 * posterior.norm(momenta, self._inverse) - energy
        error = error if math.isfinite(error) else math.inf
        accepted = uniform[3] < math.exp(-max(error, 0.0))
        if accepted:
            chain.spectrum[...] = moved
            chain.potential = potential
        return _Outcome(error, accepted, posterior.gradients - before)

    def _starts(self, start: str | Sequence[Complex], chains: int) -> list[Complex]:
        mesh = self.posterior.mesh
        if isinstance(start, str):
            if start == "mode":
                mode = self.posterior.mode().spectrum
                return [mode.copy() for _ in range(chains)]
            if start == "prior":
                return [mesh.white(self._stream(number, _START)) for number in range(chains)]
            if start == "zero":
                return [np.zeros(mesh.half, complex) for _ in range(chains)]
            raise UsageError(Problem("Sampler: start", f"{start!r} is none", '"mode", "prior", "zero" or spectra'))
        made = [np.array(spectrum, complex, order="C") for spectrum in start]
        if len(made) != chains or any(spectrum.shape != mesh.half for spectrum in made):
            what = f"{len(made)} spectra are not {chains} of the shape {mesh.half}"
            raise UsageError(Problem("Sampler: start", what, "mesh.spectrum(field) of a white field for each chain"))
        return made

    # -- files -------------------------------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write where the chains are into an ``.npz`` file, by which another sampler goes on with the same bits.

        Raises
        ------
        FileError
            It cannot be written.
        """
        path = Path(path)
        arrays = {
            "spectra": np.array([chain.spectrum for chain in self.chains]).view(float),
            "potential": np.array([chain.potential for chain in self.chains]),
            "steps": np.array([chain.step for chain in self.chains]),
        }
        counts = [chain.trajectories for chain in self.chains]
        write_arrays(path, arrays, {"seed": self.seed, "frequency": self.frequency, "trajectories": counts})
        return path

    def restore(self, path: str | os.PathLike[str]) -> None:
        """Go on from a file of ``save``, of a sampler of the same posterior with the same arguments.

        Raises
        ------
        FileError, UsageError
            It cannot be read, or is of other chains.
        """
        arrays, metadata = read_arrays(Path(path), "file of chains", "a file of Sampler.save")
        try:
            spectra, potential, steps = (arrays[name] for name in ("spectra", "potential", "steps"))
            seed, frequency, counts = (metadata[name] for name in ("seed", "frequency", "trajectories"))
        except KeyError as error:
            what = f"this is no file of chains: {error.args[0]} is missing"
            raise FileError(Problem(str(path), what, "a file of Sampler.save")) from None
        half = self.posterior.mesh.half
        found = (len(spectra), seed, (*spectra.shape[1:-1], spectra.shape[-1] // 2))
        if found != (len(self.chains), self.seed, half):
            what = f"it has {found[0]} chains of the seed {found[1]} with spectra of {found[2]}"
            hint = f"{len(self.chains)} chains of the seed {self.seed} with spectra of {half}"
            raise UsageError(Problem(str(path), what, hint))
        self.frequency = float(frequency)
        for chain, spectrum, value, step, count in zip(self.chains, spectra, potential, steps, counts, strict=True):
            chain.spectrum = np.ascontiguousarray(spectrum).view(complex)
            chain.potential, chain.step, chain.trajectories = float(value), float(step), int(count)
