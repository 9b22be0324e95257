"""Register of verbs: jobs with their command on the command line and their methods of ``Model``.

A row names functions and commands as ``module:name``; they are imported on first use. Signature and docstring of a
method are the function's own. Other distributions add rows by entry points of the group ``eomgen.verbs``, named after
the verb; they are read if a name is unknown, and for lists of all names.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint
from typing import Any

from eomgen.base.extensions import broken, extensions, loaded
from eomgen.base.text import shown
from eomgen.errors import UsageError

#: The group of entry points under which a distribution gives its verbs, each a ``Verb``.
GROUP = "eomgen.verbs"
_TARGET = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*")


@dataclass(frozen=True)
class Verb:
    """Command and methods of one job.

    Parameters
    ----------
    name : str
        Its name on the command line.
    summary : str
        Its line in the list of commands.
    command : str
        ``module:name`` of its ``click.Command``, which returns an exit code; empty for a job of Python alone.
    methods : tuple of str
        ``module:function`` of methods of ``Model``, each attached under the function's name. The function takes the
        model as its first argument, ``model``.
    """

    name: str
    summary: str = ""
    command: str = ""
    methods: tuple[str, ...] = ()
    #: Entry point of a row of another distribution, set by the register.
    entry: EntryPoint | None = field(default=None, compare=False, repr=False)

    def imported(self, target: str, kind: Callable[[object], bool], wanted: str) -> Any:
        """Return the object that a target of this row names.

        Parameters
        ----------
        target : str
            ``command`` or one of ``methods``.
        kind : callable
            Whether an object is of the kind that is needed.
        wanted : str
            This kind, for the message.

        Raises
        ------
        UsageError
            The target of another distribution's row does not load, or is of another kind; names the distribution.
        """
        module, _, name = target.partition(":")
        try:
            value = getattr(import_module(module), name)
        except Exception as error:  # modules of other distributions may raise anything
            if self.entry is None:
                raise
            raise broken(self.entry, f"names {target}, which does not load: {type(error).__name__}: {error}") from error
        if self.entry is not None and not kind(value):
            raise broken(self.entry, f"names {target}, which is no {wanted}")
        return value


Verb.__module__ = "eomgen.verbs"  # the name from which other distributions import it

BUILT_IN: tuple[Verb, ...] = (
    Verb("info", "Degrees of freedom, kept and dropped terms, operation counts.", "eomgen.cli.info:info"),
    Verb("generate", "Write the model and its stepper as a folder of C.", "eomgen.cli.generate:generate"),
    Verb(
        "savings",
        "Costs of a scene with the terms that it needs, and with more.",
        "eomgen.products.studies.commands.savings:savings",
    ),
    Verb(
        "check",
        "Hold every closed form against differences and complex steps.",
        "eomgen.products.studies.commands.check:check",
    ),
    Verb(
        "equilibrium",
        "Find the equilibrium of a scene.",
        "eomgen.cli.equilibrium:equilibrium",
        (
            "eomgen.analysis.equilibrium:equilibrium",
            "eomgen.analysis.path_following:equilibrium_path",
            "eomgen.analysis.buckling:buckling_loads",
        ),
    ),
    Verb(
        "linearize",
        "Modes, stability and responses of the linear model.",
        "eomgen.cli.linearize:linearize",
        (
            "eomgen.analysis.linearize:linearize",
            "eomgen.analysis.root_locus:root_locus",
            "eomgen.analysis.campbell:campbell",
            "eomgen.analysis.road_excitation:road_excitation",
        ),
    ),
    Verb(
        "simulate",
        "Integrate, and save the solution with plots.",
        "eomgen.cli.simulate:simulate",
        (
            "eomgen.simulation.simulate:simulate",
            "eomgen.simulation.start:start",
            "eomgen.simulation.resume:resume",
            "eomgen.simulation.run_model:attach",
        ),
    ),
    Verb(
        "ensemble",
        "Run many samples of a varied scene: statistics and sensitivities.",
        "eomgen.products.ensembles.command:ensemble",
        ("eomgen.products.ensembles.simulate_many:simulate_many",),
    ),
    Verb(
        "random",
        "Distribution of an output under random processes, and its tails.",
        "eomgen.products.reliability.command:random",
    ),
    Verb(
        "identify",
        "Unknown parameters of a scene from measured runs, with intervals.",
        "eomgen.products.studies.commands.identify:identify",
    ),
    Verb(
        "sample",
        "Sample fields on a mesh from their posterior, by Hamiltonian Monte Carlo.",
        "eomgen.products.fields.command:sample",
    ),
    Verb("animate", "Write the motion as one HTML page in three dimensions.", "eomgen.cli.animate:animate"),
    Verb(
        "tradeoff",
        "Measure speed against accuracy: methods, formulations, steps.",
        "eomgen.products.studies.commands.tradeoff:tradeoff",
    ),
    Verb(
        "tune",
        "Find the cheapest settings that meet a demand on the error.",
        "eomgen.products.studies.commands.tune:tune",
    ),
    Verb(
        "extremes",
        "Runs under extreme conditions: their failures and warnings.",
        "eomgen.products.studies.commands.extremes:extremes",
    ),
    Verb("schema", "Print the JSON Schema of scene files.", "eomgen.cli.schema:schema"),
    Verb("doctor", "Examine the machine: compiler, headers, cache, packages.", "eomgen.cli.doctor:doctor"),
    Verb("steady_motion", methods=("eomgen.analysis.steady_motion:steady_motion",)),
    Verb("base_parameters", methods=("eomgen.analysis.base_parameters:base_parameters",)),
    Verb("sensitivities", methods=("eomgen.products.derivatives.linearise:sensitivities",)),
)


def methods_of(verbs: tuple[Verb, ...]) -> Iterator[tuple[str, Verb, str]]:
    """Yield name, verb and target of each method of ``Model``."""
    for verb in verbs:
        for target in verb.methods:
            yield target.partition(":")[2], verb, target


#: Names of the methods of ``Model`` that eomgen's own verbs give.
METHODS: frozenset[str] = frozenset(name for name, _, _ in methods_of(BUILT_IN))


@dataclass(frozen=True)
class Others:
    """Verbs of other distributions.

    Attributes
    ----------
    verbs : mapping
        Rows by name, in alphabetical order.
    methods : mapping
        Name of a method of ``Model`` -> its verb and target.
    faults : mapping
        Name of an entry point that cannot be used -> error that names its distribution.
    """

    verbs: Mapping[str, Verb]
    methods: Mapping[str, tuple[Verb, str]]
    faults: Mapping[str, UsageError]


@cache
def others() -> Others:
    """Return the verbs of installed distributions; an entry point that cannot be used is among the faults."""
    verbs: dict[str, Verb] = {}
    methods: dict[str, tuple[Verb, str]] = {}
    faults: dict[str, UsageError] = {}
    own = {verb.name for verb in BUILT_IN}
    for entry in extensions(GROUP):
        try:
            verb = _checked(entry, {*own, *verbs}, {*METHODS, *methods})
        except UsageError as error:
            faults[entry.name] = error
        else:
            verbs[verb.name] = verb
            methods |= {name: (verb, target) for name, _, target in methods_of((verb,))}
    return Others(verbs, methods, faults)


def _checked(entry: EntryPoint, names: set[str], methods: set[str]) -> Verb:
    """Return the row of an entry point. Raises UsageError naming its distribution."""
    row = loaded(entry, Verb)
    if row.name != entry.name:
        raise broken(entry, f"has the row of another verb, {shown(row.name)}")
    for target in (*filter(None, (row.command,)), *row.methods):
        if not _TARGET.fullmatch(target):
            raise broken(entry, f"names {shown(target)}, which is no module:name")
    own = [name for name, _, _ in methods_of((row,))]
    taken = [*({row.name} & names), *(name for name in own if name in methods)]
    if taken:
        raise broken(entry, f"takes the name {taken[0]}, which there is")
    return Verb(row.name, row.summary, row.command, row.methods, entry)
