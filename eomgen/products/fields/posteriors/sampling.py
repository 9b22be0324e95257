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
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_calls
from eomgen.base.data import dataclass, field
from eomgen.base.files import read_arrays, write_arrays
from eomgen.errors import FileError, NumericalError, Problem, UsageError
from eomgen.integrators.compositions import Composition, composition_named
from eomgen.products.fields.documents.document import MOST_SEED, check_step_count
from eomgen.products.fields.posteriors.mesh import Complex
from eomgen.products.fields.posteriors.operators import LinearOperator
from eomgen.products.fields.posteriors.posterior import BOUNDED, FieldPosterior
from eomgen.products.fields.posteriors.record import Outcome, Record, Samples

#: Acceptance at which a sampler moves farthest per gradient, by order of the method: if the error of the energy is
#: normal with a deviation of c step^order, step erfc(deviation/sqrt(8)) is largest there.
BEST_ACCEPTANCE = {2: 0.651, 4: 0.797, 6: 0.86, 8: 0.89}

First = Literal["random", "drift", "kick"]
#: Drifts and kicks in order: name, and fraction of a step.
Parts = Iterable[tuple[str, float]]
#: Asked between gradients whether to stop.
Stop = Callable[[], bool]
#: Called for each trajectory with the chain, the end of the trajectory, and U at the chain's place.
Seen = Callable[[int, Outcome, float], None]


def follow(
    posterior: FieldPosterior,
    method: Composition,
    step: float,
    steps: int,
    spectrum: Complex,
    momenta: Complex,
    inverse_mass: Array | None = None,
    stop: Stop | None = None,
) -> bool:
    """Move a white field and its momenta in place by steps of a composition.

    Gradients are in the ``precision`` of the posterior; numbers that are no longer finite do not end the motion.

    Parameters
    ----------
    posterior : FieldPosterior
        The distribution.
    method : Composition
        Drifts and kicks of a step.
    step : float
        Size of a step.
    steps : int
        Number of steps.
    spectrum, momenta : complex ndarray
        Half spectra, changed in place; complex128 and contiguous in C order.
    inverse_mass : ndarray, optional
        One over the masses by wave number, shape ``mesh.half``; 1 if not given.
    stop : callable, optional
        Called before each drift and kick; the motion ends there if it returns true.

    Returns
    -------
    bool
        Whether the end was reached; False if ``stop`` ended the motion.
    """
    return _follow(posterior, method.parts(steps), step, spectrum, momenta, inverse_mass, stop)


def _follow(
    posterior: FieldPosterior,
    parts: Parts,
    step: float,
    spectrum: Complex,
    momenta: Complex,
    inverse_mass: Array | None,
    stop: Stop | None,
) -> bool:
    """Move a white field and momenta in place along drifts and kicks, each a name and a fraction of ``step``; return
    False if ``stop`` returned true between two of them."""
    for part, fraction in parts:
        if stop is not None and stop():
            return False
        if part == "drift":
            posterior.drift(step * fraction, inverse_mass, momenta, spectrum)
        else:
            posterior.add_gradient(-step * fraction, spectrum, momenta)
    return True


@dataclass
class _Chain:
    """State of a chain: white field, potential U there, number of trajectories, and step size.

    Attributes
    ----------
    warmed, halvings, tried : of the warm-up: trajectories so far, halvings of the step, logarithms of step sizes
    known : whether the gradient at the field has been evaluated
    slope : this gradient; None also if the state is from a file
    """

    number: int
    spectrum: Complex
    potential: float
    step: float
    trajectories: int = 0
    warmed: int = 0
    halvings: int = 0
    tried: list[float] = field(default_factory=list)
    known: bool = False
    slope: Complex | None = None


@checked_calls()
class Sampler:
    """Chains of Hamiltonian Monte Carlo on the posterior of a field.

    Parameters
    ----------
    posterior : FieldPosterior
        The distribution.
    method : str
        A composition: ``minimum_norm2``, ``omf4``, ``suzuki4``, ``leapfrog`` and others.
    step : float
        Size of a step; 0: half of the size allowed by ``guard``, for ``warm_up`` to change.
    duration : float
        Time of a trajectory; a quarter turn of an oscillator of frequency 1 is 1.57.
    mass : {"fisher", "prior", "unit"}
        As of ``FieldPosterior.mass``.
    first : {"random", "drift", "kick"}
        First part of trajectories.
    jitter : float
        Relative amplitude of the random variation of a step.
    guard : float
        Steps are kept below this part of the largest stable step, by the largest frequency at the start of chains and,
        in a warm-up, at the chains' states, from above 0 to 1; infinite for no limit.
    chains : int
        Number of chains.
    start : {"mode", "prior", "zero"}, or spectra of white fields, one for each chain
        None: nowhere, until ``restore``.
    seed : int
        Of all random numbers.
    watched : ndarray of int, optional
        Cells whose values are kept, as numbers of the flattened mesh; by default 64 evenly spread cells.
    bins : int, optional
        Number of bins of wave numbers, for power spectra.

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
        start: str | Sequence[Complex] | None = "mode",
        seed: int = 0,
        watched: ArrayLike | None = None,
        bins: int = 8,
    ) -> None:
        """Check the settings, and start the chains with their step sizes. Raises UsageError, and NumericalError for a
        start at which U is not finite."""
        for name, value, fine, bound in (
            ("step", step, 0.0 <= step < math.inf, "0 for a step that is found, or above"),
            ("duration", duration, 0.0 < duration < math.inf, "above 0"),
            ("jitter", jitter, 0.0 <= jitter < 1.0, "from 0 to below 1"),
            ("guard", guard, 0.0 < guard <= 1.0 or guard == math.inf, "above 0 to 1, as 0.9, or inf for none"),
            ("chains", chains, chains >= 1, "from 1 on"),
            ("seed", seed, 0 <= seed <= MOST_SEED, f"from 0 to {MOST_SEED}"),
        ):
            if not fine:
                raise UsageError(Problem(f"Sampler: {name}", f"{value:.6g} is invalid [E0819]", bound))
        if first not in ("random", "drift", "kick"):
            raise UsageError(Problem("Sampler: first", f"{first!r} is neither [E0820]", '"random", "drift" or "kick"'))
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
        self._slope: Complex | None = None
        if start is None:
            self.chains = [_Chain(k, np.zeros(posterior.mesh.half, complex), 0.0, 0.0) for k in range(chains)]
            return
        for number, spectrum in enumerate(self._starts(start, chains)):
            potential = posterior.energy(spectrum)
            if not math.isfinite(potential):
                fault = f"U is {potential} at the start of chain {number} [E0826]"
                raise NumericalError(Problem("Sampler: start", fault, '"mode"'))
            if not number or not isinstance(start, str) or start == "prior":  # else all start in one place
                self.frequency = max(self.frequency, posterior.largest_frequency(spectrum, self.mass))
            self.chains.append(_Chain(number, spectrum, potential, 0.0))
        for chain in self.chains:
            chain.step = min(step or 0.5 * self.largest_step, self.largest_step)
            check_step_count("Sampler: step, guard and duration", duration, chain.step)

    @property
    def largest_step(self) -> float:
        """The largest step allowed by ``guard`` before jitter."""
        limit = min(method.stability_limit for method in self.methods)
        return self.guard * limit / (self.frequency * (1.0 + self.jitter))

    def warm_up(
        self,
        trajectories: int,
        acceptance: float = 0.0,
        *,
        adapt: bool = True,
        goes_on: bool = False,
        stop: Stop | None = None,
        seen: Seen | None = None,
    ) -> bool:
        """Make trajectories that are not kept, and change steps for an acceptance; 0: the best for the method's order.

        The step of each chain is halved, at most 30 times, until a trajectory is accepted, and then changed less and
        less, up to ``largest_step``. The step that is left is the geometric mean of the second half of these steps. The
        chains move on, and ``frequency`` may grow, also without ``adapt``.

        Parameters
        ----------
        trajectories : int
            Of each chain.
        acceptance : float, optional
            Wanted share of accepted trajectories; 0: the best for the method's order.
        adapt : bool
            Whether steps are changed.
        goes_on : bool
            Whether a warm-up that was stopped goes on; ``trajectories`` is then the number of the whole warm-up.
        stop, seen : callables
            ``stop`` is called before most drifts and kicks and returns whether to stop; ``seen`` is called after each
            trajectory with the number of the chain, the end (an ``Outcome``), and U at the chain's place.

        Returns
        -------
        bool
            Whether the warm-up is complete; False if ``stop`` ended it, with the unfinished trajectory given up.

        Raises
        ------
        NumericalError
            U has no lower bound, or second derivatives are not finite at a chain's place.
        """
        target = acceptance or BEST_ACCEPTANCE.get(self.methods[0].order, 0.9)
        if not goes_on:
            for chain in self.chains:
                chain.warmed, chain.halvings, chain.tried = 0, 0, []
        for count in range(trajectories):
            for chain in self.chains:
                if chain.warmed > count:
                    continue
                outcome = self._trajectory(chain, stop)
                if outcome is None:
                    return False
                chain.warmed += 1
                if outcome.accepted and chain.warmed % 20 == 0:
                    frequency = self.posterior.largest_frequency(chain.spectrum, self.mass)
                    self.frequency = max(self.frequency, frequency)
                if adapt:
                    self._adapt(chain, outcome, target)
                if seen is not None:
                    seen(chain.number, outcome, chain.potential)
        for chain in self.chains:
            if kept := chain.tried:
                chain.step = min(math.exp(float(np.mean(kept[len(kept) // 2 :]))), self.largest_step)
            chain.tried = []
        return True

    def _adapt(self, chain: _Chain, outcome: Outcome, target: float) -> None:
        """Change a chain's step in place after a trajectory of a warm-up: halve the step until a trajectory is
        accepted, then by ever smaller amounts towards the acceptance ``target``; at most ``largest_step``."""
        if not chain.tried and not outcome.accepted and chain.halvings < 30:
            chain.halvings += 1
            chain.step /= 2.0
            return
        probability = math.exp(-max(outcome.error, 0.0))
        gain = 1.0 / math.sqrt(1.0 + len(chain.tried))
        chain.step = min(chain.step * math.exp(gain * (probability - target)), self.largest_step)
        chain.tried.append(math.log(chain.step))

    def draw(self, samples: int, field: str = "") -> Samples:
        """Return the next samples of all chains, of the first field or of the named field. The chains move on.

        Parameters
        ----------
        samples : int
            Samples of each chain: trajectories, of which rejected ones repeat the sample before.
        field : str, optional
            Name of the watched field; the first by default.

        Returns
        -------
        Samples
            With first axes (chains, samples).

        Raises
        ------
        UsageError
            No field has the name, or there are none.
        NumericalError
            U has no lower bound.
        """
        record = self.record(samples)
        self.fill(record, field)
        return record.samples(self.steps)

    def record(self, samples: int) -> Record:
        """Return an empty record of ``samples`` samples of each chain.

        Parameters
        ----------
        samples : int
            Samples of each chain.

        Returns
        -------
        Record
            Empty.
        """
        return Record(self.posterior.mesh, len(self.chains), samples, self.watched, self.bins)

    @property
    def steps(self) -> Array:
        """Step size of each chain, before jitter."""
        return np.array([chain.step for chain in self.chains])

    def fill(self, record: Record, field: str = "", *, stop: Stop | None = None, seen: Seen | None = None) -> bool:
        """Draw samples until a record is full, one sample of each chain in turn, after the samples already there.

        Parameters
        ----------
        record : Record
            Of ``record``; filled in place. Earlier samples are not checked to be of the same field.
        field : str, optional
            Name of the watched field; the first by default.
        stop, seen : callable, optional
            As of ``warm_up``: ``stop()`` is called before most drifts and kicks and ends the work if true; ``seen`` is
            called after each sample with the number of the chain, its ``Outcome``, and U of the sample.

        Returns
        -------
        bool
            Whether the record is full; False if ``stop`` ended the work, with the unfinished trajectory given up.

        Raises
        ------
        UsageError
            No field has the name, or there are no fields.
        NumericalError
            U has no lower bound.
        """
        posterior = self.posterior
        names = list(posterior.operators)
        if (field or not names) and field not in names:
            fault = f"there is no field {field!r} [E0827]" if field else "there is no field to watch [E0827]"
            raise UsageError(Problem("Sampler.draw: field", fault, ", ".join(names) or "fields of the posterior"))
        name = field or names[0]
        operator: LinearOperator = posterior.operators[name]
        for sample in range(record.size):
            for chain in self.chains:
                if record.counts[chain.number] > sample:
                    continue
                outcome = self._trajectory(chain, stop)
                if outcome is None:
                    return False
                values = posterior.value(name, chain.spectrum)
                amplitudes = operator.filtered(chain.spectrum) if operator.mask is None else None
                record.add(chain.number, outcome, chain.potential, values, amplitudes)
                if seen is not None:
                    seen(chain.number, outcome, chain.potential)
        return True

    def _stream(self, chain: int, word: int) -> np.random.Generator:
        return np.random.Generator(np.random.Philox(key=[self.seed, chain], counter=[0, 0, 0, word]))

    def _trajectory(self, chain: _Chain, stop: Stop | None = None) -> Outcome | None:
        """Move a chain by one trajectory, accepted or not, and return the end; None, without a move, if stopped. Raises
        NumericalError for a U without a lower bound."""
        posterior = self.posterior
        stream = self._stream(chain.number, chain.trajectories)
        uniform = stream.random(4)
        method = self.methods[int(uniform[0] * len(self.methods))]
        step = chain.step * (1.0 + self.jitter * (2.0 * uniform[1] - 1.0))
        steps = max(1, math.floor(self.duration / step + uniform[2]))
        momenta, moved = self._momenta, self._moved
        posterior.white(stream, momenta)
        if self._root is not None:
            momenta *= self._root
        moved[...] = chain.spectrum
        if chain.known and chain.slope is None:  # known from a file, and counted there
            chain.slope = posterior.gradient(chain.spectrum)
        before = posterior.gradients
        energy = chain.potential + 0.5 * posterior.norm(momenta, self._inverse)
        potential: float | None = None
        if method.first == "kick":
            potential = self._from_slope(chain, method.parts(steps), step, stop)
        elif _follow(posterior, method.parts(steps), step, moved, momenta, self._inverse, stop):
            potential = posterior.energy(moved)
        if potential is None:
            return None
        chain.trajectories += 1
        error = potential + 0.5 * posterior.norm(momenta, self._inverse) - energy
        error = error if math.isfinite(error) else math.inf
        accepted = uniform[3] < math.exp(-max(error, 0.0))
        if accepted and potential < -1e50:  # without a lower bound there is no distribution, and chains fall for ever
            fault = f"chain {chain.number} has come down to U = {potential:.3g}: the energy of a cell has no lower"
            raise NumericalError(Problem("Sampler", f"{fault} bound [E0828]", BOUNDED))
        if accepted:
            chain.spectrum[...] = moved
            chain.potential = potential
            chain.known = method.first == "kick"
            if chain.known:
                chain.slope, self._slope = self._slope, chain.slope
        return Outcome(error, accepted, posterior.gradients - before)

    def _from_slope(self, chain: _Chain, parts: Parts, step: float, stop: Stop | None) -> float | None:
        """Follow drifts and kicks that begin and end with a kick from ``_moved`` and ``_momenta``, in place, and return
        U at the end; None if stopped. The first kick takes the gradient of the chain's last trajectory of this kind,
        and the last kick the cells of the evaluation of U."""
        posterior, momenta, moved = self.posterior, self._momenta, self._moved
        (_, first), *between, (_, last) = parts
        if chain.slope is None:
            chain.slope = np.empty_like(moved)
        if self._slope is None:
            self._slope = np.empty_like(moved)
        if not chain.known:
            posterior.energy_and_gradient(chain.spectrum, chain.slope)
        posterior.add(-step * first, chain.slope, momenta)
        if not _follow(posterior, between, step, moved, momenta, self._inverse, stop):
            return None
        chain.known = True
        potential = posterior.energy_and_gradient(moved, self._slope)
        posterior.add(-step * last, self._slope, momenta)
        return potential

    def _starts(self, start: str | Sequence[Complex], chains: int) -> list[Complex]:
        """Return the white field, as a half spectrum, with which each chain starts. Raises UsageError for an unknown
        word, or spectra of another number or shape."""
        mesh = self.posterior.mesh
        if isinstance(start, str):
            if start == "mode":
                mode = self.posterior.mode().spectrum
                return [mode.copy() for _ in range(chains)]
            if start == "prior":
                # trajectories have the words of a counter from 0 on
                return [mesh.white(self._stream(number, 2**63)) for number in range(chains)]
            if start == "zero":
                return [np.zeros(mesh.half, complex) for _ in range(chains)]
            fault = f"{start!r} is not a start [E0829]"
            raise UsageError(Problem("Sampler: start", fault, '"mode", "prior", "zero" or spectra'))
        made = [np.array(spectrum, complex, order="C") for spectrum in start]
        if len(made) != chains or any(spectrum.shape != mesh.half for spectrum in made):
            fault = f"{len(made)} spectra are not {chains} of the shape {mesh.half} [E0830]"
            raise UsageError(Problem("Sampler: start", fault, "mesh.spectrum(field) of a white field for each chain"))
        return made

    # -- files -------------------------------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the states of the chains into an ``.npz`` file, by which another sampler goes on with the same bits.

        Parameters
        ----------
        path : str or Path
            File to write, ``.npz`` (no ending is added); an existing file is replaced. Contents: ``state``, without
            samples and without the arguments of the sampler other than the seed.

        Returns
        -------
        Path
            The written file.

        Raises
        ------
        FileError
            The file cannot be written.
        """
        path = Path(path)
        write_arrays(path, *self.state())
        return path

    def state(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Return the states of the chains, as arrays and as JSON data.

        Returns
        -------
        arrays : dict
            Copies by name: ``spectra`` of white fields, doubles in place of complex numbers, (chains, ..., 2 n) for a
            last axis of n; ``potential`` and ``steps``, (chains,).
        metadata : dict
            JSON data: ``seed``, ``frequency``, and lists over chains: ``trajectories`` (number), ``warm_up``
            (trajectories in it, halvings, logarithms of steps), ``slopes`` (whether the gradient is known). The
            lists of logarithms are the chains' own, not copies, and grow in a warm-up that goes on.
        """
        arrays = {
            "spectra": np.array([chain.spectrum for chain in self.chains]).view(float),
            "potential": np.array([chain.potential for chain in self.chains]),
            "steps": self.steps,
        }
        metadata = {
            "seed": self.seed,
            "frequency": self.frequency,
            "trajectories": [chain.trajectories for chain in self.chains],
            "warm_up": [[chain.warmed, chain.halvings, chain.tried] for chain in self.chains],
            "slopes": [chain.known for chain in self.chains],
        }
        return arrays, metadata

    def restore(self, path: str | os.PathLike[str]) -> None:
        """Go on from a file of ``save``, of a sampler of the same posterior with the same arguments.

        Step sizes and ``frequency`` are then as in the file. Number of chains, seed and shape of the spectra are
        compared, and no other property.

        Parameters
        ----------
        path : str or Path
            File of ``save``.

        Raises
        ------
        FileError
            The file cannot be read, or is not a file of ``save``.
        UsageError
            The file has another number of chains, another seed or another shape of spectra.
        """
        arrays, metadata = read_arrays(Path(path), "file of chains", "a file of Sampler.save")
        self.take(arrays, metadata, str(path))

    def take(self, arrays: Mapping[str, Array], metadata: Mapping[str, Any], where: str) -> None:
        """Continue from ``state`` of a sampler of the same posterior with the same arguments, which is not checked.

        Step sizes and ``frequency`` are then as in the state.

        Parameters
        ----------
        arrays, metadata : mapping
            Of ``state``. The sampler keeps ``spectra`` and the lists of logarithms without a copy: as chains move, the
            array changes, and a warm-up that goes on appends to the lists.
        where : str
            Origin of the state, for messages.

        Raises
        ------
        FileError
            A name is missing in the state.
        UsageError
            A state with another number of chains, another seed or another shape of spectra.
        """
        try:
            spectra, potential, steps = (arrays[name] for name in ("spectra", "potential", "steps"))
            seed, frequency, counts = (metadata[name] for name in ("seed", "frequency", "trajectories"))
            warm_ups, has_slope = metadata["warm_up"], metadata["slopes"]
        except KeyError as error:
            fault = f"this is not a file of chains: {error.args[0]} is missing [E0832]"
            raise FileError(Problem(where, fault, "a file of Sampler.save")) from None
        half = self.posterior.mesh.half
        recorded = (len(spectra), seed, (*spectra.shape[1:-1], spectra.shape[-1] // 2))
        if recorded != (len(self.chains), self.seed, half):
            fault = f"it has {recorded[0]} chains of the seed {recorded[1]} with spectra of {recorded[2]} [E0831]"
            hint = f"{len(self.chains)} chains of the seed {self.seed} with spectra of {half}"
            raise UsageError(Problem(where, fault, hint))
        self.frequency = float(frequency)
        for number, chain in enumerate(self.chains):
            chain.spectrum = np.ascontiguousarray(spectra[number]).view(complex)
            chain.potential, chain.step = float(potential[number]), float(steps[number])
            chain.trajectories = int(counts[number])
            chain.warmed, chain.halvings, chain.tried = warm_ups[number]
            chain.known, chain.slope = bool(has_slope[number]), None
