"""Register of verbs: jobs with their command on the command line and their methods of ``Model`` and ``Solution``.

A row names functions and commands as ``module:name``, imported on first use. Signature and docstring of a
method are the function's own. Products add rows of the group ``eomgen.verbs``, and other distributions entry points of
this group, named after the verb; entry points are read if a name is unknown, and for lists of all names.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass, field, replace, without_garbage_collection
from eomgen.base.extensions import broken, extensions, load_row
from eomgen.base.messages import shown
from eomgen.base.products import import_target, insert, rows_of
from eomgen.errors import UsageError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

#: The group of entry points under which a distribution gives verbs, each a ``Verb``.
GROUP = "eomgen.verbs"
#: Classes that get methods of verbs, with the attribute of a row that names them.
OWNERS = {"Model": "methods", "Solution": "solution_methods"}
_TARGET = r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*"


@dataclass(frozen=True)
class Verb:
    """Command and methods of one job.

    Parameters
    ----------
    name : str
        Name of the verb on the command line.
    summary : str
        Line of the verb in the list of commands.
    command : str
        ``module:name`` of the ``click.Command``, which returns an exit code; empty for a job of Python alone.
    methods : tuple of str
        ``module:function`` of methods of ``Model``, each attached under the function's name. The function takes the
        model as its first argument, ``model``.
    behind : str
        Name of the verb before this verb in lists; at the end if there is none of this name.
    heading : str
        Heading under which the list of commands has the verb.
    takes_scene : bool
        Whether the command takes a scene.
    solution_methods : tuple of str
        ``module:function`` of methods of ``Solution``, likewise; the first argument is the solution, ``solution``.
    parts : mapping
        Verb of the core -> ``module:class`` of the options and output that this row adds to the verb's command, a
        ``RestPart`` or ``RunPart`` of ``eomgen.cli.parts``; of eomgen's own rows.
    first_step : str
        Words of a command line for lists of first steps, after ``simulate pendulum/scene.toml --out pendulum/out``.
    entry : EntryPoint, optional
        Entry point of the row, of another distribution.
    """

    name: str
    summary: str = ""
    command: str = ""
    methods: tuple[str, ...] = ()
    behind: str = ""
    heading: str = "More"
    takes_scene: bool = True
    solution_methods: tuple[str, ...] = ()
    parts: Mapping[str, str] = field(default_factory=dict)
    first_step: str = ""
    #: Entry point of a row of another distribution, set by the register.
    entry: EntryPoint | None = field(default=None, compare=False, repr=False)

    def imported(self, target: str, kind: Callable[[object], bool], wanted: str) -> Any:
        """Return the object that a target of this row names.

        Parameters
        ----------
        target : str
            ``module:name``: the value of ``command``, or an item of ``methods`` or ``solution_methods``.
        kind : callable
            Returns for an object whether it is of the kind that is needed; called for rows of other distributions
            alone.
        wanted : str
            This kind, for the message.

        Returns
        -------
        object
            The object that the target names.

        Raises
        ------
        UsageError
            The target of another distribution's row does not load, or is of another kind; names the distribution. For a
            row without ``entry``, an error of the import passes unchanged.
        """
        try:
            with without_garbage_collection():
                value = import_target(target)
        except Exception as error:  # modules of other distributions may raise anything
            if self.entry is None:
                raise
            raise broken(self.entry, f"names {target}, which does not load: {type(error).__name__}: {error}") from error
        if self.entry is not None and not kind(value):
            raise broken(self.entry, f"names {target}, which is not a {wanted}")
        return value


Verb.__module__ = "eomgen.verbs"  # the name from which other distributions import it

_BUILD = "Build and run"
_HOUSEKEEPING: Mapping[str, Any] = {"takes_scene": False, "heading": "Housekeeping"}
CORE: tuple[Verb, ...] = (
    Verb(
        "new",
        "Make a folder with a first scene, or with an example.",
        "eomgen.cli.first_steps:new",
        takes_scene=False,
        heading=_BUILD,
    ),
    Verb(
        "examples",
        "List the examples, or copy one.",
        "eomgen.cli.first_steps:examples",
        takes_scene=False,
        heading=_BUILD,
    ),
    Verb(
        "info", "Degrees of freedom, kept and dropped terms, operation counts.", "eomgen.cli.info:info", heading=_BUILD
    ),
    Verb(
        "generate",
        "Write the model and its stepper as a folder of C.",
        "eomgen.cli.generate:generate",
        heading="Import and export",
    ),
    Verb(
        "equilibrium",
        "Find the equilibrium of a scene.",
        "eomgen.cli.equilibrium:equilibrium",
        ("eomgen.compiled.rest.equilibrium:equilibrium",),
        heading=_BUILD,
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
        heading=_BUILD,
    ),
    Verb("plot", "Draw a stored solution, over time or over another column.", "eomgen.cli.plot:plot", heading=_BUILD),
    Verb("schema", "Print the JSON Schema of scene files.", "eomgen.cli.schema:schema", **_HOUSEKEEPING),
    Verb("migrate", "Write the present names of keys into scene files.", "eomgen.cli.schema:migrate", **_HOUSEKEEPING),
    Verb(
        "doctor",
        "Examine the machine: compiler, headers, cache, packages.",
        "eomgen.cli.doctor:doctor",
        **_HOUSEKEEPING,
    ),
    Verb(
        "explain", "Explain a message by its code, or search messages.", "eomgen.cli.explain:explain", **_HOUSEKEEPING
    ),
    Verb("cite", "Print BibTeX of eomgen and of the papers of a method.", "eomgen.cli.cite:cite", **_HOUSEKEEPING),
    Verb(
        "completion",
        "Print the script by which a shell completes words.",
        "eomgen.cli.first_steps:completion",
        **_HOUSEKEEPING,
    ),
    Verb("save", methods=("eomgen.compiled.saving:save",)),
    Verb("base_parameters", methods=("eomgen.compiled.base_parameters:base_parameters",)),
    Verb(
        "derivatives",
        methods=(
            "eomgen.compiled.argument_derivatives:sparsity",
            "eomgen.compiled.argument_derivatives:derivatives",
            "eomgen.compiled.argument_derivatives:hessian",
        ),
    ),
)


def methods_of(verbs: tuple[Verb, ...], owner: str = "Model") -> Iterator[tuple[str, Verb, str]]:
    """Return name, verb and target of each method of a class, ``Model`` or ``Solution``."""
    return ((target.partition(":")[2], verb, target) for verb in verbs for target in getattr(verb, OWNERS[owner]))


@cache
def own() -> tuple[Verb, ...]:
    """Return the verbs of the core and of the installed products, in the order of lists."""
    return insert(CORE, rows_of(GROUP, Verb), lambda verb: verb.name, lambda verb: verb.behind)


@cache
def methods(owner: str = "Model") -> frozenset[str]:
    """Return the names of the methods of a class, ``Model`` or ``Solution``, that eomgen's own verbs give."""
    return frozenset(name for name, _, _ in methods_of(own(), owner))


@dataclass(frozen=True)
class ExternalVerbs:
    """Verbs of other distributions.

    Attributes
    ----------
    verbs : mapping
        Rows by name, in alphabetical order.
    methods : mapping
        Class and name of a method -> verb and target of the method.
    faults : mapping
        Name of an entry point that cannot be used -> error that names the distribution.
    """

    verbs: Mapping[str, Verb]
    methods: Mapping[tuple[str, str], tuple[Verb, str]]
    faults: Mapping[str, UsageError]


@cache
def others() -> ExternalVerbs:
    """Return the verbs of installed distributions; an entry point that cannot be used is among the faults."""
    verbs: dict[str, Verb] = {}
    faults: dict[str, UsageError] = {}
    for entry in extensions(GROUP):
        try:
            verb = _check_verb(entry, (*own(), *verbs.values()))
        except UsageError as error:
            faults[entry.name] = error
        else:
            verbs[verb.name] = verb
    return ExternalVerbs(verbs, _by_class(tuple(verbs.values())), faults)


def _by_class(verbs: tuple[Verb, ...]) -> dict[tuple[str, str], tuple[Verb, str]]:
    """Return verb and target of each method by class and name."""
    return {(owner, name): (verb, target) for owner in OWNERS for name, verb, target in methods_of(verbs, owner)}


def _check_verb(entry: EntryPoint, known: tuple[Verb, ...]) -> Verb:
    """Return the row of an entry point, with the entry point in ``entry``. Raises UsageError with the name of the
    distribution for a row of another verb, wrong targets, and names that verbs in ``known`` have."""
    row = load_row(entry, Verb)
    if row.name != entry.name:
        raise broken(entry, f"has the row of another verb, {shown(row.name)}")
    for target in (*filter(None, (row.command,)), *row.methods, *row.solution_methods):
        if not re.fullmatch(_TARGET, target):
            raise broken(entry, f"names {shown(target)}, which is not module:name")
    taken = [row.name] if row.name in {verb.name for verb in known} else []
    taken += [name for owner, name in _by_class((row,)) if (owner, name) in _by_class(known)]
    if taken:
        raise broken(entry, f"takes the name {taken[0]}, which there is")
    return replace(row, entry=entry)
