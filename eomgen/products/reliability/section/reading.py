"""Reading of random processes and their section in a scene: groups that go together, modes on the window as splines,
and processes as inputs whose standard normal variables are parameters."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.base.messages import key_of
from eomgen.base.random_inputs import FASTEST, standard_normals
from eomgen.base.rounding import SUMMED, WRITTEN
from eomgen.errors import UsageError
from eomgen.formula.curves import Curve
from eomgen.formula.nodes import Application, Formula, Number, Symbol
from eomgen.formula.substitution import map_symbols
from eomgen.products.reliability.random_processes.coherence import Coherence, nearest_correlation
from eomgen.products.reliability.random_processes.karhunen_loeve import MOST_MODES, Expansion, expand, expand_jointly
from eomgen.products.reliability.section import schema as written
from eomgen.products.reliability.section.covariances import (
    Covariances,
    Translations,
    cross_covariances,
    read_coherences,
)
from eomgen.scene.formula.scope import Laws
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.values import UNKNOWN, Values
from eomgen.scene.section import Entries, Reading, Section, UnusedEntries, fault_of_variables
from eomgen.scene.signals.curves import Curves
from eomgen.system.signals import Input, NormalSeries, Parameter, variables_of


def mode_tables(name: str, expansion: Expansion, start: float) -> tuple[Curve, ...]:
    """Return the modes of an expansion as splines over x from ``start`` on, the largest eigenvalue first. x is a time
    in s or a distance in m; `name` is the process's, for the names of the curves. Each curve has as many points as its
    error requires, 4096 at most: modes of short waves have small values, and need less relative accuracy."""
    count, points = len(expansion.eigenvalues), 32
    result: dict[int, Curve] = {}
    allowed = max(WRITTEN, 1e-4 * math.sqrt(max(1.0 - float(expansion.variance_shares[-1]), 0.0)))
    highest = 0.0
    while len(result) < count:
        x = np.linspace(0.0, expansion.duration, points + 1)
        between = 0.5 * (x[1:] + x[:-1])
        y, exact = expansion.modes(x), expansion.modes(between)
        highest = max(highest, float(np.max(np.abs(y))))
        last = 2 * points > 4096
        for k in range(count):
            # mode k has about k / 2 waves: fewer points may be on the mode by chance
            if k in result or (points < 8 * (k + 1) // 2 and not last):
                continue
            spline = Curve(f"{name} mode {k + 1}", start + x, y[k], smooth_ends=True)
            error = float(np.max(np.abs(spline(start + between) - exact[k])))
            if last or error <= allowed * highest:
                result[k] = spline
        points *= 2
    return tuple(result[k] for k in range(count))


def input_of(process: NormalSeries, entry: written.RandomProcess) -> Input:
    """Return a process as an input with the formula of the process."""
    return Input(process.name, _formula(process), entry.unit, entry.description, series=process)


def variables_as_parameters(process: NormalSeries) -> list[Parameter]:
    """Return tunable parameters for the standard normal variables that belong to a process; the default values are
    random numbers by the process's seed. Variables shared with another process are left out."""
    names = process.own_variables
    values = standard_normals(process.seed, len(names), process.name).tolist()
    return [
        Parameter(name, value, True, "1", f"standard normal variable of mode {k} of {process.name}", True)
        for k, (name, value) in enumerate(zip(names, values, strict=True), 1)
    ]


def _formula(process: NormalSeries) -> Formula:
    """Return a process as a formula of time and its variables: the mean plus the sum of modes times variables, through
    the translation if there is one. The modes take time times speed, less the lag."""
    x: Formula = Symbol("time")
    if process.speed:
        x = process.speed * x
    if process.lag:
        x = x - process.lag
    terms = [
        (Symbol("parameter", variable) if weight == 1.0 else weight * Symbol("parameter", variable))
        * (Number(float(mode.y[0])) if process.kind == "constant" else Application(mode, x))
        for variable, weight, mode in zip(process.variables, process.weights, process.modes, strict=True)
    ]
    g: Formula = _sum([Number(process.mean), *terms] if process.mean else terms)
    if process.translation is None:
        return g
    return map_symbols(process.translation, lambda symbol: g if symbol.kind == "gaussian" else symbol)


def _sum(terms: Sequence[Formula]) -> Formula:
    """Return the sum of terms, nested such that the depth hardly grows with the number of terms."""
    depth = 257  # formulas are walked recursively
    parts = [functools.reduce(operator.add, terms[k : k + depth]) for k in range(0, len(terms), depth)]
    return parts[0] if len(parts) == 1 else _sum(parts)


def _first_set(entry: written.RandomProcess, words: Sequence[str]) -> str:
    """Return the first of some keys that an entry gives another value than its default; empty for none."""
    fields = written.RandomProcess.model_fields
    return next((word for word in words if getattr(entry, word) != fields[word].default), "")


class Processes:
    """Reader of the random processes of a scene, which reports faults and does not raise them.

    Parameters
    ----------
    values : Values
        Evaluates numbers and formulas of the scene, and has the report of faults.
    curves : Curves
        Reads points and tables.
    duration : float
        Duration of runs, s: the default window of a process.
    """

    def __init__(self, values: Values, curves: Curves, duration: float) -> None:
        self.values = values
        self.report = values.report
        self.duration = duration
        self._covariances, self._translations = Covariances(values, curves), Translations(values)

    def read(self, entries: Mapping[str, written.RandomProcess]) -> tuple[list[Input], list[Parameter]]:
        """Return processes as inputs, in the order of the entries, and the variables of processes as parameters.
        Processes that follow another one have no variables. Processes with a fault are left out, and the fault is
        reported."""
        lags = {name: lag for name, entry in entries.items() if (lag := self._lag(name, entry, entries)) is not None}
        first_of = {name: self._first(name, entry, entries) for name, entry in entries.items() if name in lags}
        result: dict[str, Input] = {}
        variables: list[Parameter] = []
        for name in entries:
            if first_of.get(name) == name:
                group = [
                    member for member, first in first_of.items() if first == name and entries[member].follows is None
                ]
                behind = [lag for follower, lag in lags.items() if entries[follower].follows in group]
                ends = max(behind, default=0.0), min(behind, default=0.0)
                for process in self._related_processes(
                    [name, *(member for member in group if member != name)], entries, ends
                ):
                    variables += variables_as_parameters(process)
                    result[process.name] = input_of(process, entries[process.name])
        self._add_followers(result, lags, entries)
        return [result[name] for name in entries if name in result], variables

    def _add_followers(
        self, result: dict[str, Input], lags: Mapping[str, float], entries: Mapping[str, written.RandomProcess]
    ) -> None:
        """Add to ``result``, in place, the entries that follow a process of the result. Each is a copy of the followed
        process with a separate name, lag (`lags` by name, s or m) and translation. Entries whose lag is unknown are
        left out."""
        for name, entry in entries.items():
            leader = result.get(entry.follows or "")
            if leader is not None and leader.series is not None and name in lags:
                translation = self._translations.read(name, entry)
                changes: dict[str, Any] = {"name": name, "lag": lags[name], "follows": leader.name}
                process = replace(leader.series, translation=translation, **changes)
                self._translations.check(process)
                result[name] = input_of(process, entry)

    def _first(
        self, name: str, entry: written.RandomProcess, entries: Mapping[str, written.RandomProcess]
    ) -> str | None:
        """Return the name of the process that defines the covariance of process `name`: the one with a type that a
        correlated or coherent process refers to, else itself. None for a process that follows another, and for a fault,
        which is reported: correlation and coherence, a reference to itself, to an unknown process or to one that
        follows another, not exactly one process with a type, or a key that the process with the type sets for both."""
        key = key_of("random", name)
        if entry.follows is not None:
            return None
        if entry.correlation is None and entry.coherence is None:
            return name
        if entry.correlation is not None and entry.coherence is not None:
            fault = "both correlation and coherence say how it goes with others [E1008]"
            self.report.add(f"{key}.coherence", fault, "one of them")
            return None
        how, with_others = ("correlation", "correlated") if entry.coherence is None else ("coherence", "coherent")
        others = list(entry.correlation or entry.coherence or {})
        for named in others:
            if named == name:
                fault = f"it is {with_others} with itself [E1010]"
                self.report.add(f"{key}.{how}", fault, f"{how} with another process")
                return None
            if not check_reference(f"{key}.{how}", named, entries, "random process", self.report):
                return None

        def leads(process: written.RandomProcess) -> bool:
            return process.correlation is None and process.coherence is None and process.follows is None

        leaders = [named for named in others if leads(entries[named])]
        if len(leaders) != 1 or any(entries[named].follows is not None for named in others):
            fault = (
                f"it does not name one process with a type of its own, with which all others are {with_others} [E1009]"
            )
            self.report.add(f"{key}.{how}", fault, "one of them with a type")
            return None
        word = _first_set(entry, written.SHARED if entry.coherence is None else (*written.SHARED, "seed"))
        if word:
            fault = f"{word} is set by {leaders[0]}, with which this process is {with_others} [E1011]"
            self.report.add(f"{key}.{word}", fault, "without it")
        return None if word else leaders[0]

    def _related_processes(
        self, names: Sequence[str], entries: Mapping[str, written.RandomProcess], lag: tuple[float, float]
    ) -> list[NormalSeries]:
        """Return the processes of a group in the order of ``names``, the first of which has the type; empty for a
        fault. The others are correlated or coherent with the first. ``lag`` has the largest and the smallest lag of
        processes that follow any of the group, by which the window is extended. A fault is reported."""
        first, others = names[0], names[1:]
        coherences = None
        if any(entries[name].coherence is not None for name in others):
            mixed = [name for name in others if entries[name].coherence is None]
            if mixed:
                fault = f"it is correlated with {first}, with which others are coherent [E1012]"
                self.report.add(f"{key_of('random', mixed[0])}.correlation", fault, "coherence for all of them")
                return []
            coherences = read_coherences(self.values, names, entries)
            if coherences is None:
                return []
        made = self._leader(first, entries[first], *lag, coherences)
        if not made:
            return []
        if coherences is None:
            return self._group(made[0], names, entries)
        for k, name in enumerate(others, 1):  # which share the variables of the first process and have separate modes
            entry, process = entries[name], made[k]
            scale = self._scale(made[0], name, entry)
            made[k] = self._member(
                process,
                name,
                entry,
                weights=(scale,) * len(process.modes),
                eigenvalues=tuple(scale**2 * value for value in process.eigenvalues),
                total=scale**2 * process.total,
                coherent_with=tuple(entry.coherence or {}),
            )
        return made

    def _member(self, template: NormalSeries, name: str, entry: written.RandomProcess, **changes: Any) -> NormalSeries:
        """Return a process of a group, with its own mean and translation, which is checked."""
        mean = self.values.constant(f"{key_of('random', name)}.mean", entry.mean)
        process = replace(template, name=name, mean=mean, translation=self._translations.read(name, entry), **changes)
        self._translations.check(process)
        return process

    def _scale(self, first: NormalSeries, name: str, entry: written.RandomProcess) -> float:
        """Return the standard deviation of a process relative to the first process of its group; 1 if none is given. A
        value that is not positive is reported, and returned all the same."""
        if entry.standard_deviation is None:
            return 1.0
        key = f"{key_of('random', name)}.standard_deviation"
        scale = self.values.constant(key, entry.standard_deviation) / first.standard_deviation
        if not scale > 0.0:
            self.report.add(key, "the standard deviation is not positive [E1013]", "standard_deviation = 1")
        return scale

    def _group(
        self, first: NormalSeries, names: Sequence[str], entries: Mapping[str, written.RandomProcess]
    ) -> list[NormalSeries]:
        """Return a group of correlated processes in the order of ``names``, the first of which is given as ``first``.
        Each is a sum of the group's variables with weights from the Cholesky factor of the correlation matrix. Only the
        first process is returned for a group of one, or if the correlations have a fault, which is reported."""
        matrix = None if len(names) == 1 else self._correlations(first, names, entries)
        if matrix is None:
            return [first]
        factor = np.linalg.cholesky(matrix)
        made = [first]
        for i, name in enumerate(names[1:], 1):
            entry = entries[name]
            scale = self._scale(first, name, entry)
            count, weights = len(first.modes), [scale * float(w) for w in factor[i, : i + 1]]
            used = [(names[j], weight) for j, weight in enumerate(weights) if weight]
            process = self._member(
                first,
                name,
                entry,
                variables=tuple(variable for of, _ in used for variable in variables_of(of, count)),
                weights=tuple(weight for _, weight in used for _ in range(count)),
                modes=first.modes * len(used),
                eigenvalues=tuple(weight**2 * value for _, weight in used for value in first.eigenvalues),
                total=scale**2 * first.total,
                seed=entry.seed,
                correlation=tuple((entry.correlation or {}).items()),
            )
            made.append(process)
        return made

    def _correlations(
        self, first: NormalSeries, names: Sequence[str], entries: Mapping[str, written.RandomProcess]
    ) -> Array | None:
        """Return the correlation matrix of the processes `names`, in this order; None for a fault, which is reported.
        Pairs without a coefficient have 0. If the matrix is not positive definite, the nearest correlation matrix takes
        its place, with a note, if the entry of the first process allows a repair; else this is a fault."""
        matrix = np.eye(len(names))
        for i, name in enumerate(names):
            for partner, value in (entries[name].correlation or {}).items():
                j = names.index(partner) if partner in names else i
                key = f"{key_of('random', name)}.correlation"
                if i != j and matrix[i, j] not in (0.0, value):
                    fault = f"its correlation with {partner} is {value:.6g} here and {matrix[i, j]:.6g} there [E1015]"
                    self.report.add(key, fault, "one of them")
                    return None
                matrix[i, j] = matrix[j, i] = value if i != j else 1.0
        least = float(np.linalg.eigvalsh(matrix)[0])
        if least <= SUMMED:
            nearest = nearest_correlation(matrix)
            away = float(np.linalg.norm(nearest - matrix))
            key = f"{key_of('random', names[-1])}.correlation"
            if entries[first.name].covariance_repair is None:
                hint = "coefficients closer to 0, follows for one that is the same, or covariance_repair = "
                fault = (
                    f"no processes have the correlations of {', '.join(names)}: an eigenvalue of their matrix is"
                    f" {least:.3g}, not positive; the nearest ones that some have are {away:.2g} away [E1014]"
                )
                self.report.add(key, fault, f'{hint}"nearest" of {first.name}')
                return None
            self.values.note([f"{key}: no processes have these; the nearest ones, {away:.2g} away, take their place"])
            matrix = nearest
        return matrix

    def _lag(
        self, name: str, entry: written.RandomProcess, entries: Mapping[str, written.RandomProcess]
    ) -> float | None:
        """Return the lag of a process relative to the process that it follows, in s (delay) or m (offset); 0 for a
        process that follows none. None for a fault, which is reported, as a key that the followed process sets."""
        key = key_of("random", name)
        if entry.follows is None:
            word = _first_set(entry, ("offset", "delay"))
            if word:
                fault = f"{word} belongs to a process that follows another [E1016]"
                self.report.add(f"{key}.{word}", fault, 'follows = "NAME"')
            return None if word else 0.0
        known = [candidate for candidate in entries if candidate != name or candidate == entry.follows] or list(entries)
        if not check_reference(f"{key}.follows", entry.follows, known, "random process", self.report):
            return None
        leader = entries[entry.follows]
        if leader.follows is not None:
            fault = f"{entry.follows} itself follows {leader.follows} [E1017]"
            self.report.add(f"{key}.follows", fault, "a process with a type of its own")
            return None
        if word := _first_set(entry, written.OWN):
            fault = f"{word} is set by {entry.follows}, which this process follows [E1020]"
            self.report.add(f"{key}.{word}", fault, "without it")
            return None
        right, wrong = ("delay", "offset") if leader.speed is None else ("offset", "delay")
        value = getattr(entry, right)
        if getattr(entry, wrong) is not None or value is None:
            over = "time" if leader.speed is None else "distance"
            fault = f"a process that follows a process over {over} needs {right}, and no {wrong} [E1019]"
            self.report.add(key, fault, f"{right} = {'0.1' if right == 'delay' else '2.5'}")
            return None
        return self.values.constant(f"{key}.{right}", value)

    def _leader(
        self,
        name: str,
        entry: written.RandomProcess,
        latest: float,
        earliest: float,
        coherences: Sequence[Sequence[Coherence | None]] | None,
    ) -> list[NormalSeries]:
        """Return a process with its own covariance, then the coherent processes of its group; empty for a fault, which
        is reported. All have the same name, mean and variables and differ in their modes.

        Parameters
        ----------
        latest, earliest : the largest and the smallest lag of processes that follow any process of the group
        coherences : square matrix of the coherences in the group, None for no coherence of a pair; None for one process
        """
        key = key_of("random", name)
        before = len(self.report.noted)
        if entry.type is None:
            fault = "a random process needs its type, or the process that it follows [E1021]"
            self.report.add(key, fault, 'type = "squared_exponential"')
            return []
        speed, duration = self._along(key, entry)
        covariance = self._covariances.read(key, name, entry, entry.type)
        mean = self.values.constant(f"{key}.mean", entry.mean)
        translation = self._translations.read(name, entry)
        if len(self.report.noted) > before or covariance is None:
            return []
        start = min(-latest, 0.0)
        end = duration * (speed or 1.0) + max(-earliest, 0.0)
        repair = entry.covariance_repair is not None
        share = None if entry.modes is not None else written.SHARE if entry.share is None else entry.share
        try:
            if entry.covariance_of == "translated":
                covariance = self._translations.underlying(key, entry, covariance, translation, end - start)
            if coherences is None:
                expansions = [expand(covariance, end - start, share=share, modes=entry.modes, repair=repair)]
            else:
                between = cross_covariances(covariance, coherences, end - start)
                expansions = expand_jointly(between, end - start, share=share, modes=entry.modes, repair=repair)
        except UsageError as error:
            (problem,) = error.problems
            fault, hint = problem.what, problem.hint
            if entry.covariance_of == "translated" and problem.code == "E0973":
                fault = (
                    f"no Gaussian process is translated to this covariance: its own would not be one: {fault} [E1023]"
                )
                hint = "a translation nearer to a straight one, or the covariance of g itself"
            self.report.add(key, fault, hint)
            return []
        result = []
        for expansion in expansions:
            modes = mode_tables(name, expansion, start)
            process = NormalSeries(
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
                covariance=None if coherences is not None or expansion.repaired else covariance.at,
            )
            result.append(process)
        if expansions[0].repaired:
            fault = (
                f"the covariance is not positive, and the nearest one that is, {expansions[0].repaired:.2g} of its"
                f" norm from it, takes its place [E1022]"
            )
            self.values.note([f"{key}: {fault}"])
        self._translations.check(result[0])
        return result

    def _along(self, key: str, entry: written.RandomProcess) -> tuple[float, float]:
        """Return the speed, m/s, and the duration of the window, s, of an entry; the speed is 0 for a process over
        time. Values out of range are reported, and returned all the same; a wrong share, or a share and a number of
        modes, are reported as well."""
        speed, duration = 0.0, self.duration
        if entry.speed is not None:
            speed = self.values.constant(f"{key}.speed", entry.speed)
            if not 0.0 < speed <= FASTEST:
                fault = f"the speed {speed:.6g} m/s is not between 0 and {FASTEST:.0f} [E1024]"
                self.report.add(f"{key}.speed", fault, "a speed such as 20")
        if entry.duration is not None:
            duration = self.values.constant(f"{key}.duration", entry.duration)
            if not duration > 0.0:
                self.report.add(f"{key}.duration", f"the duration {duration:.6g} s is not positive [E1025]", "15")
        if entry.share is not None and entry.modes is not None:
            self.report.add(f"{key}.modes", "both share and modes say how many modes there are [E1026]", "one of them")
        if entry.share is not None and not 0.0 < entry.share < 1.0:
            fault = f"the share {entry.share:.6g} is not between 0 and 1 [E1027]"
            self.report.add(f"{key}.share", fault, "share = 0.99")
        return speed, duration


class _Random(Section):
    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        if name in document.section("random"):
            return fault_of_variables("random process", name, MOST_MODES, document, rows)
        return "", ""

    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"laws": {"random": Laws("random process", {})}}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        entries = reading.document.section("random")
        curves = Curves(reading.values, reading.folder)
        processes = Processes(reading.values, curves, reading.document.simulation.duration)
        inputs, variables = processes.read(entries)
        reading.add_parameters(variables)
        formulas = {item.name: item.formula for item in inputs if item.formula is not None}
        unknown = set(entries) - set(formulas) | reading.refused["random"]
        laws: dict[str, Formula] = reading.tables["laws"]["random"].formulas
        laws |= formulas | dict.fromkeys(unknown, UNKNOWN)
        return {item.name: item for item in inputs}

    def unused(self, reading: Reading) -> UnusedEntries:
        mentioned = reading.values.mentioned
        return UnusedEntries(
            "random process",
            "random processes",
            [
                name
                for name in reading.document.section("random")
                if mentioned.isdisjoint({("input", name), ("parameter", variables_of(name, 1)[0])})
            ],
        )


RANDOM = _Random(
    key="random",
    entry="eomgen.products.reliability.section.schema:RandomProcess",
    scene_field="inputs",
    bare="a random process",
    after=("curves",),
    before=("bodies", "definitions"),
    positional=("type",),
    documentation="""
    Add a stationary random process, which formulas use by its name; its standard normal variables are tunable
    parameters. ``road_class`` is a scene file's ``class``.""",
)
