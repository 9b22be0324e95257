"""Reading of random processes: their covariance, its modes on the window, and the formula that they are."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from eomgen.arrays import Array
from eomgen.errors import Problem, UsageError
from eomgen.formula.curves import Curve
from eomgen.formula.evaluate import curves, evaluate_batch
from eomgen.formula.nodes import Application, Formula, Number, Symbol
from eomgen.random_processes import (
    BEYOND,
    Band,
    Coherence,
    Covariance,
    CovarianceTable,
    DampedCosine,
    Exponential,
    KanaiTajimi,
    Oscillator,
    RoadProfile,
    SpectrumTable,
    SquaredExponential,
    expand,
    expand_jointly,
    nearest_correlation,
    quantile_map,
    standard_normals,
    underlying,
)
from eomgen.random_roads import FASTEST
from eomgen.scene.formula.namespaces import mapped
from eomgen.scene.formula.scope import TRANSLATION
from eomgen.scene.random import schema as written
from eomgen.scene.random.coherence import Coherences, crossed
from eomgen.scene.random.mode_tables import mode_tables
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.values import Values
from eomgen.scene.signals.curves import Curves
from eomgen.scene.signals.schema import Shape
from eomgen.system.random_processes import RandomProcess, variables_of
from eomgen.system.signals import Input, Parameter
from eomgen.text import key_of

#: An eigenvalue of a correlation matrix up to which it is taken for singular.
_SINGULAR = 1e-12
#: How many standard deviations from its mean a process is looked at, and at how many places.
_FARTHEST, _PLACES = 6.0, 1201
#: Quantiles at least.
_FEWEST_QUANTILES = 3


@dataclass(frozen=True)
class _Type:
    """What a type of process takes.

    Attributes
    ----------
    over_time, over_distance : its keys over time, over distance; None where it is not known there
    made : returns the covariance, given the values of the keys and the standard deviation
    deviation : whether the standard deviation is given
    """

    over_time: tuple[str, ...] | None
    over_distance: tuple[str, ...] | None
    made: Callable[..., Covariance]
    deviation: bool = True


_TABLE = ("points",)
TYPES: dict[str, _Type] = {
    "squared_exponential": _Type(("correlation_time",), ("correlation_length",), SquaredExponential),
    "exponential": _Type(("correlation_time",), ("correlation_length",), Exponential),
    "damped_cosine": _Type(("decay", "frequency"), None, DampedCosine),
    "oscillator": _Type(("frequency", "damping"), None, Oscillator),
    "kanai_tajimi": _Type(("frequency", "damping"), None, KanaiTajimi),
    "band": _Type(("band",), None, lambda s, ends: Band(s, *ends)),
    "road": _Type(None, ("road_class",), RoadProfile, deviation=False),
    "covariance": _Type(_TABLE, _TABLE, CovarianceTable, deviation=False),
    "spectrum": _Type(_TABLE, _TABLE, lambda curve: SpectrumTable(curve.x, curve.y), deviation=False),
}
#: Keys that some types take, as they are written.
_KEYS = {
    **dict.fromkeys(("correlation_time", "correlation_length", "decay", "frequency", "damping", "band")),
    "road_class": "class",
    "points": "points or table",
}


class Processes:
    """Reads random processes and notes what is wrong with them.

    Parameters
    ----------
    values : Values
    curves : Curves
        Reads points and tables.
    duration : of runs, s: of windows that do not say theirs
    """

    def __init__(self, values: Values, curves: Curves, duration: float) -> None:
        self.values = values
        self.report = values.report
        self.curves = curves
        self.duration = duration

    def read(self, entries: Mapping[str, written.RandomProcess]) -> tuple[list[Input], list[Parameter]]:
        """Return processes as inputs, and the variables of those that follow no other; what cannot be made is
        reported."""
        lags = {name: lag for name, entry in entries.items() if (lag := self._lag(name, entry, entries)) is not None}
        first_of = {name: self._first(name, entry, entries) for name, entry in entries.items() if name in lags}
        found: dict[str, Input] = {}
        variables: list[Parameter] = []
        for name in entries:
            if first_of.get(name) == name:
                group = [other for other, first in first_of.items() if first == name and entries[other].follows is None]
                behind = [lag for other, lag in lags.items() if entries[other].follows in group]
                ends = max(behind, default=0.0), min(behind, default=0.0)
                for process in self._grouped([name, *(one for one in group if one != name)], entries, ends):
                    variables += _variables(process)
                    found[process.name] = _input(process, entries[process.name])
        for name, entry in entries.items():
            leader = found.get(entry.follows or "")
            if leader is not None and leader.random is not None and name in lags:
                process = replace(
                    leader.random,
                    name=name,
                    lag=lags[name],
                    follows=leader.name,
                    translation=self._translation(name, entry),
                )
                self._check_map(process)
                found[name] = _input(process, entry)
        return [found[name] for name in entries if name in found], variables

    def _first(
        self, name: str, entry: written.RandomProcess, entries: Mapping[str, written.RandomProcess]
    ) -> str | None:
        """Return the process whose covariance a process has: itself, or the one it is correlated with; None where that
        is not known, which is reported, and for one that follows another."""
        key = key_of("random", name)
        if entry.follows is not None:
            return None
        if entry.correlation is None and entry.coherence is None:
            return name
        if entry.correlation is not None and entry.coherence is not None:
            what = "both correlation and coherence say how it goes with others"
            self.report.add(f"{key}.coherence", what, "one of them")
            return None
        how, with_others = ("correlation", "correlated") if entry.coherence is None else ("coherence", "coherent")
        others = list(entry.correlation or entry.coherence or {})
        for other in others:
            if not check_reference(f"{key}.{how}", other, entries, "random process", self.report):
                return None

        def leads(one: written.RandomProcess) -> bool:
            return one.correlation is None and one.coherence is None and one.follows is None

        own = [other for other in others if leads(entries[other])]
        if len(own) != 1 or name in others or any(entries[other].follows is not None for other in others):
            what = "it names one process with a type of its own, and besides only processes that are"
            what += f" {with_others} with it"
            self.report.add(f"{key}.{how}", what, "one of them with a type")
            return None
        for word in written.SHARED if entry.coherence is None else (*written.SHARED, "seed"):
            if getattr(entry, word) != written.RandomProcess.model_fields[word].default:
                self.report.add(
                    f"{key}.{word}", f"{word} is that of {own[0]}, with which it is {with_others}", "without it"
                )
                return None
        return own[0]

    def _grouped(
        self, names: Sequence[str], entries: Mapping[str, written.RandomProcess], lag: tuple[float, float]
    ) -> list[RandomProcess]:
        """Return the first process and those that are correlated or coherent with it; none where none can be made."""
        first, others = names[0], names[1:]
        coherences = None
        if any(entries[name].coherence is not None for name in others):
            mixed = [name for name in others if entries[name].coherence is None]
            if mixed:
                what = f"it is correlated with {first}, with which others are coherent"
                self.report.add(f"{key_of('random', mixed[0])}.correlation", what, "coherence for all of them")
                return []
            coherences = Coherences(self.report).read(names, entries)
            if coherences is None:
                return []
        made = self._leader(first, entries[first], *lag, coherences)
        if not made:
            return []
        if coherences is None:
            return self._group(made[0], names, entries)
        return [
            made[0],
            *(self._coherent(made[0], one, name, entries[name]) for one, name in zip(made[1:], others, strict=True)),
        ]

    def _coherent(
        self, first: RandomProcess, own: RandomProcess, name: str, entry: written.RandomProcess
    ) -> RandomProcess:
        """Return a process with the variables of the first of its group, and modes of its own."""
        scale = self._scale(first, name, entry)
        process = replace(
            own,
            name=name,
            mean=self.values.constant(f"{key_of('random', name)}.mean", entry.mean),
            weights=(scale,) * len(own.modes),
            eigenvalues=tuple(scale**2 * value for value in own.eigenvalues),
            total=scale**2 * own.total,
            translation=self._translation(name, entry),
            coherent_with=tuple(entry.coherence or {}),
        )
        self._check_map(process)
        return process

    def _scale(self, first: RandomProcess, name: str, entry: written.RandomProcess) -> float:
        """Return the standard deviation of a process by that of the first of its group."""
        if entry.standard_deviation is None:
            return 1.0
        key = f"{key_of('random', name)}.standard_deviation"
        scale = self.values.constant(key, entry.standard_deviation) / first.standard_deviation
        if not scale > 0.0:
            self.report.add(key, "the standard deviation is not positive", "standard_deviation = 1")
        return scale

    def _group(
        self, first: RandomProcess, names: Sequence[str], entries: Mapping[str, written.RandomProcess]
    ) -> list[RandomProcess]:
        """Return a process and those that are correlated with it: sums of the variables of all, by Cholesky's factor of
        their correlation matrix."""
        if len(names) == 1:
            return [first]
        matrix = np.eye(len(names))
        for i, name in enumerate(names):
            for other, value in (entries[name].correlation or {}).items():
                j = names.index(other) if other in names else i
                key = f"{key_of('random', name)}.correlation"
                if i != j and matrix[i, j] not in (0.0, value):
                    what = f"its correlation with {other} is {value:.6g} here and {matrix[i, j]:.6g} there"
                    self.report.add(key, what, "one of them")
                    return [first]
                matrix[i, j] = matrix[j, i] = value if i != j else 1.0
        least = float(np.linalg.eigvalsh(matrix)[0])
        if least <= _SINGULAR:
            what = f"no processes have the correlations of {', '.join(names)}: an eigenvalue of their matrix is"
            nearest = nearest_correlation(matrix)
            away = float(np.linalg.norm(nearest - matrix))
            key = f"{key_of('random', names[-1])}.correlation"
            if entries[first.name].covariance_repair is None:
                hint = "coefficients closer to 0, follows for one that is the same, or covariance_repair = "
                what += f" {least:.3g}, not positive; the nearest ones that some have are {away:.2g} away"
                self.report.add(key, what, f'{hint}"nearest" of {first.name}')
                return [first]
            self.values.note([f"{key}: no processes have these; the nearest ones, {away:.2g} away, take their place"])
            matrix = nearest
        factor = np.linalg.cholesky(matrix)
        made = [first]
        for i, name in enumerate(names[1:], 1):
            entry = entries[name]
            scale = self._scale(first, name, entry)
            count, weights = len(first.modes), [scale * float(w) for w in factor[i, : i + 1]]
            used = [(names[j], weight) for j, weight in enumerate(weights) if weight]
            process = replace(
                first,
                name=name,
                mean=self.values.constant(f"{key_of('random', name)}.mean", entry.mean),
                variables=tuple(variable for of, _ in used for variable in variables_of(of, count)),
                weights=tuple(weight for _, weight in used for _ in range(count)),
                modes=first.modes * len(used),
                eigenvalues=tuple(weight**2 * value for _, weight in used for value in first.eigenvalues),
                total=scale**2 * first.total,
                seed=entry.seed,
                translation=self._translation(name, entry),
                correlation=tuple((entry.correlation or {}).items()),
            )
            self._check_map(process)
            made.append(process)
        return made

    def _lag(
        self, name: str, entry: written.RandomProcess, entries: Mapping[str, written.RandomProcess]
    ) -> float | None:
        """Return by how much a process is behind the one that it follows, 0 for one that follows none; None where
        that is not known, which is reported."""
        key = key_of("random", name)
        if entry.follows is None:
            for word in ("offset", "delay"):
                if getattr(entry, word) is not None:
                    self.report.add(f"{key}.{word}", f"{word} is of processes that follow another", 'follows = "NAME"')
                    return None
            return 0.0
        if not check_reference(f"{key}.follows", entry.follows, entries, "random process", self.report):
            return None
        leader = entries[entry.follows]
        if leader.follows is not None:
            what = f"{entry.follows} itself follows {leader.follows}"
            self.report.add(f"{key}.follows", what, f'follows = "{leader.follows}"')
            return None
        for word in written.OWN:
            if getattr(entry, word) != written.RandomProcess.model_fields[word].default:
                self.report.add(f"{key}.{word}", f"{word} is that of {entry.follows}, which it follows", "without it")
                return None
        right, wrong = ("delay", "offset") if leader.speed is None else ("offset", "delay")
        value = getattr(entry, right)
        if getattr(entry, wrong) is not None or value is None:
            over = "time" if leader.speed is None else "distance"
            what = f"it follows a process over {over}, and needs {right} alone"
            self.report.add(key, what, f"{right} = {'0.1' if right == 'delay' else '2.5'}")
            return None
        return self.values.constant(f"{key}.{right}", value)

    def _leader(
        self,
        name: str,
        entry: written.RandomProcess,
        latest: float,
        earliest: float,
        coherences: Sequence[Sequence[Coherence | None]] | None,
    ) -> list[RandomProcess]:
        """Return a process with a covariance of its own, and for each that is coherent with it one with the modes of
        that; none where it cannot be made.

        ``latest``, ``earliest`` : the largest and the smallest lag of processes that follow one of them.
        """
        key = key_of("random", name)
        before = len(self.report.found)
        if entry.type is None:
            self.report.add(key, "a random process needs its type, or what it follows", 'type = "squared_exponential"')
            return []
        speed, duration = self._along(key, entry)
        covariance = self._covariance(key, name, entry, entry.type)
        mean = self.values.constant(f"{key}.mean", entry.mean)
        self._check_extent(key, entry)
        translation = self._translation(name, entry)
        if len(self.report.found) > before or covariance is None:
            return []
        start = min(-latest, 0.0)
        end = duration * (speed or 1.0) + max(-earliest, 0.0)
        repair = entry.covariance_repair is not None
        share = None if entry.modes is not None else written.SHARE if entry.share is None else entry.share
        try:
            if entry.covariance_of == "translated":
                covariance = self._underlying(key, entry, covariance, translation, end - start)
            if coherences is None:
                expansions = [expand(covariance, end - start, share=share, modes=entry.modes, repair=repair)]
            else:
                between = crossed(covariance, coherences, end - start)
                expansions = expand_jointly(between, end - start, share=share, modes=entry.modes, repair=repair)
        except UsageError as error:
            (problem,) = error.problems
            what, hint = problem.what, problem.hint
            if entry.covariance_of == "translated" and what.startswith("the covariance is not positive"):
                what = f"no Gaussian process is translated to this covariance: its own would not be one: {what}"
                hint = "a translation nearer to a straight one, or the covariance of g itself"
            self.report.add(key, what, hint)
            return []
        found = []
        for expansion in expansions:
            modes = mode_tables(name, expansion, start)
            process = RandomProcess(
                name,
                entry.type,
                mean,
                variables_of(name, len(modes)),
                (1.0,) * len(modes),
                modes,
                tuple(float(value) for value in expansion.eigenvalues * expansion.shares),
                expansion.total / len(expansions),
                entry.seed,
                speed,
                translation=translation,
            )
            found.append(process)
        if expansions[0].repaired:
            what = (
                f"the covariance is not positive, and the nearest one that is, {expansions[0].repaired:.2g} of its norm"
            )
            self.values.note([f"{key}: {what} from it, takes its place"])
        self._check_map(found[0])
        return found

    def _translation(self, name: str, entry: written.RandomProcess) -> Formula | None:
        key = key_of("random", name)
        if entry.quantiles is not None:
            if entry.translation is not None:
                self.report.add(f"{key}.quantiles", "both translation and quantiles say what the process is", "one")
                return None
            return self._quantiles(f"{key}.quantiles", name, entry)
        if entry.translation is None:
            return None
        return self.values.formula(f"{key}.translation", entry.translation, TRANSLATION)

    def _quantiles(self, key: str, name: str, entry: written.RandomProcess) -> Formula | None:
        """Return the monotone map of a normal variable of this mean and deviation to one with these quantiles: straight
        beyond the first and the last of them."""
        points = [self.values.constants(f"{key}[{k}]", pair) for k, pair in enumerate(entry.quantiles or ())]
        share, value = np.array(points, dtype=float).reshape(-1, 2).T
        rising = len(share) >= _FEWEST_QUANTILES and np.all(np.diff(share) > 0.0) and np.all(np.diff(value) > 0.0)
        if not rising or share[0] <= 0.0 or share[-1] >= 1.0:
            what = "quantiles are three points or more, probabilities between 0 and 1 and values that both rise"
            self.report.add(key, what, "quantiles = [[0.1, 2.0], [0.5, 3.0], [0.9, 5.0]]")
            return None
        x, y = quantile_map(share, value)
        mean = self.values.constant(f"{key_of('random', name)}.mean", entry.mean)
        written_value = 1.0 if entry.standard_deviation is None else entry.standard_deviation
        deviation = self.values.constant(f"{key_of('random', name)}.standard_deviation", written_value)
        g: Formula = Symbol("gaussian") if mean == 0.0 else Symbol("gaussian") - mean
        return Application(Curve(f"{name} quantiles", x, y), g if deviation == 1.0 else g / deviation)

    def _underlying(
        self,
        key: str,
        entry: written.RandomProcess,
        covariance: Covariance,
        translation: Formula | None,
        window: float,
    ) -> Covariance:
        """Return the covariance of g whose translation has the one that is asked for. Raises UsageError."""
        if translation is None or entry.mean not in (0, 0.0) or entry.standard_deviation not in (None, 1, 1.0):
            what = "covariance_of translated needs a translation or quantiles of a standard normal g"
            raise UsageError(Problem(key, what, "translation = ..., without mean and standard_deviation"))
        formula = translation
        if entry.quantiles is None and curves(formula):
            what = "covariance_of translated knows formulas and quantiles, and the translation has a curve"
            raise UsageError(Problem(key, what, "quantiles"))

        def map_of(g: Array) -> Array:
            if isinstance(formula, Application) and isinstance(formula.curve, Curve):
                return np.asarray(formula.curve(np.clip(g, -BEYOND, BEYOND)))
            value = evaluate_batch(
                formula, lambda symbol: g if symbol.kind == "gaussian" else self.values.parameters[symbol.name]
            )
            return np.asarray(np.broadcast_to(value, np.shape(g)))

        return underlying(covariance, map_of, window)

    def _check_map(self, process: RandomProcess) -> None:
        """Report a translation that has no value where g may be; note one that turns round there."""
        formula = process.translation
        if formula is None or curves(formula):
            return
        away = np.linspace(-_FARTHEST, _FARTHEST, _PLACES)
        g = process.mean + process.standard_deviation * away

        def value_of(symbol: Symbol) -> ArrayLike:
            return g if symbol.kind == "gaussian" else self.values.parameters[symbol.name]

        value = np.broadcast_to(evaluate_batch(formula, value_of), np.shape(g))
        key = f"{key_of('random', process.name)}.translation"
        if not np.all(np.isfinite(value)):
            worst = int(np.argmin(np.isfinite(value)))
            what = f"it has no value at g = {g[worst]:.3g}, {abs(away[worst]):.2g} standard deviations from the mean"
            self.report.add(key, what, "a formula that has one wherever a normal variable may be")
            return
        rises = np.diff(value) > 0.0
        turns = np.flatnonzero(rises[1:] != rises[:-1])
        if len(turns):
            nearest_one = int(turns[np.argmin(np.abs(away[turns + 1]))]) + 1
            what = f"it turns round at g = {g[nearest_one]:.3g}, {abs(away[nearest_one]):.2g} standard deviations"
            self.values.note([f"{key}: {what} from the mean, so it is no map onto a marginal distribution"])

    def _along(self, key: str, entry: written.RandomProcess) -> tuple[float, float]:
        """Return speed, 0 over time, and duration of the window."""
        speed, duration = 0.0, self.duration
        if entry.speed is not None:
            speed = self.values.constant(f"{key}.speed", entry.speed)
            if not 0.0 < speed <= FASTEST:
                what = f"the speed {speed:.6g} m/s is not between 0 and {FASTEST:.0f}"
                self.report.add(f"{key}.speed", what, "a speed such as 20")
        if entry.duration is not None:
            duration = self.values.constant(f"{key}.duration", entry.duration)
            if not duration > 0.0:
                self.report.add(f"{key}.duration", f"the duration {duration:.6g} s is not positive", "15")
        return speed, duration

    def _check_extent(self, key: str, entry: written.RandomProcess) -> None:
        if entry.share is not None and entry.modes is not None:
            self.report.add(f"{key}.modes", "both share and modes say how many modes there are", "one of them")
        if entry.share is not None and not 0.0 < entry.share < 1.0:
            what = f"the share {entry.share:.6g} is not between 0 and 1"
            self.report.add(f"{key}.share", what, "share = 0.99")

    def _covariance(self, key: str, name: str, entry: written.RandomProcess, kind: str) -> Covariance | None:
        row = TYPES[kind]
        over, other = ("time", "distance") if entry.speed is None else ("distance", "time")
        wanted = row.over_time if entry.speed is None else row.over_distance
        if wanted is None:
            self.report.add(
                f"{key}.type", f"{kind} is a process over {other}", "speed = 20" if over == "time" else "no speed"
            )
            return None
        given = {word: getattr(entry, word) for word in _KEYS}
        if entry.table is not None:
            given["points"] = entry.points or ()
        missing = [_KEYS[word] or word for word in wanted if given[word] is None]
        if missing:
            self.report.add(
                key, f"{kind} over {over} needs {' and '.join(missing)}", f"{missing[0].partition(' ')[0]} = ..."
            )
        for word, value in given.items():
            if value is not None and word not in wanted and not missing:
                written_as = _KEYS[word] or word
                what = f"{kind} over {over} takes no {written_as}"
                self.report.add(f"{key}.{written_as.partition(' ')[0]}", what, " and ".join(wanted))
        deviation = []
        if row.deviation:
            written_value = 1.0 if entry.standard_deviation is None else entry.standard_deviation
            value = self.values.constant(f"{key}.standard_deviation", written_value)
            if not value > 0.0:
                what = f"the standard deviation {value:.6g} is not positive"
                self.report.add(f"{key}.standard_deviation", what, "standard_deviation = 1")
            deviation = [value]
        elif entry.standard_deviation is not None:
            what = f"{kind} says the variance itself, and takes no standard deviation"
            self.report.add(f"{key}.standard_deviation", what, "without it")
        if missing:
            return None
        before = len(self.report.found)
        arguments = [self._argument(key, name, entry, word) for word in wanted]
        return None if len(self.report.found) > before else row.made(*deviation, *arguments)

    def _argument(self, key: str, name: str, entry: written.RandomProcess, word: str) -> object:
        """Return the value of a key of a covariance."""
        if word == "road_class":
            return entry.road_class
        if word == "points":
            return self._points(key, name, entry)
        place, value = f"{key}.{word}", getattr(entry, word)
        if word == "band":
            low, high = self.values.constants(place, value)
            if not 0.0 <= low < high:
                what = f"the band from {low:.6g} to {high:.6g} Hz is none"
                self.report.add(place, what, 'band = ["0.5 Hz", "20 Hz"]')
            return low, high
        number = self.values.constant(place, value)
        if not number > 0.0:
            self.report.add(place, f"{word.replace('_', ' ')} {number:.6g} is not positive", f"{word} = 1")
        elif word == "damping" and not number < 1.0:
            self.report.add(place, f"the damping ratio {number:.6g} is not below 1", "damping = 0.6")
        return number

    def _points(self, key: str, name: str, entry: written.RandomProcess) -> Curve:
        """Return the points of a covariance or a spectrum; what is wrong with them is reported."""
        spectrum = entry.type == "spectrum"
        shape = (
            Shape(points=entry.points, table=entry.table, interpolation="linear", outside="hold")
            if spectrum
            else Shape(points=entry.points, table=entry.table, interpolation="quintic", outside="error")
        )
        before = len(self.report.found)
        curve = self.curves.through_points(key, name, shape)
        if len(self.report.found) > before:
            return curve
        place = f"{key}.{'points' if entry.points is not None else 'table'}"
        if curve.start < 0.0:
            what = f"the first {'frequency' if spectrum else 'lag'} {curve.start:.6g} is negative"
            self.report.add(place, what, "the half from 0 on: the other is the same")
        elif curve.start > 0.0 and not spectrum:
            what = f"the first lag is {curve.start:.6g}, so the variance is not known"
            self.report.add(place, what, "a first point at lag 0")
        elif not spectrum and not curve.y[0] > 0.0:
            self.report.add(place, f"the variance {curve.y[0]:.6g}, at lag 0, is not positive", "a larger one")
        if spectrum and np.any(curve.y < 0.0):
            worst = int(np.argmin(curve.y))
            what = f"the density {curve.y[worst]:.6g} at {curve.x[worst]:.6g} is negative"
            self.report.add(place, what, "a one-sided power spectral density")
        elif spectrum and not np.any(curve.y > 0.0):
            self.report.add(place, "the spectrum is zero everywhere", "a positive density somewhere")
        return curve


def _input(process: RandomProcess, entry: written.RandomProcess) -> Input:
    return Input(process.name, _formula(process), entry.unit, entry.description, random=process)


def _variables(process: RandomProcess) -> list[Parameter]:
    """Return the parameters that are the variables of a process."""
    names = process.own_variables
    values = standard_normals(process.seed, len(names), process.name).tolist()
    return [
        Parameter(name, value, True, "1", f"standard normal variable of mode {k} of {process.name}")
        for k, (name, value) in enumerate(zip(names, values, strict=True), 1)
    ]


def _formula(process: RandomProcess) -> Formula:
    """Return a process as a formula of time and its variables."""
    x: Formula = Symbol("time")
    if process.speed:
        x = process.speed * x
    if process.lag:
        x = x - process.lag
    terms = [
        (Symbol("parameter", variable) if weight == 1.0 else weight * Symbol("parameter", variable))
        * Application(mode, x)
        for variable, weight, mode in zip(process.variables, process.weights, process.modes, strict=True)
    ]
    g: Formula = functools.reduce(operator.add, terms, Number(process.mean)) if process.mean else _sum(terms)
    if process.translation is None:
        return g
    return mapped(process.translation, lambda symbol: g if symbol.kind == "gaussian" else symbol)


def _sum(terms: Sequence[Formula]) -> Formula:
    return functools.reduce(operator.add, terms)
