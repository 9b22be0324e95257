"""The study ``savings``: a scene against variants that ask for more, each derived, built in an empty cache and run,
in turns, on one processor."""

from __future__ import annotations

import itertools
import json
import os
import statistics
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.arrays import count_of
from eomgen.base.csv_tables import write_rows
from eomgen.base.data import asdict, dataclass, field, fields, replace
from eomgen.base.files import make_folder, write_text
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.formula.nodes import Formula, Node, Number, Operation, Symbol
from eomgen.pipeline.documents import as_document, load_scene
from eomgen.pipeline.generation import generate
from eomgen.pipeline.methods import method_of, terms_of_step
from eomgen.pipeline.pipeline import build_in, derive
from eomgen.products.studies.defaults import SAVINGS_ROUNDS
from eomgen.products.studies.work_precision.formulations import rebuild
from eomgen.scene.bodies.model import Base
from eomgen.scene.rotations import Rotation
from eomgen.scene.scene import Scene
from eomgen.system.signals import Parameter
from eomgen.system.terms import CLOSED_MATRICES, TERMS
from eomgen.toolchain.profiles import STANDARD_PROFILE

if TYPE_CHECKING:
    from eomgen.pipeline.documents import Described
    from eomgen.pipeline.model import Model


@dataclass(frozen=True)
class Variant:
    """A scene that asks for more, or for less, than the scene of the study.

    Attributes
    ----------
    name, description : of the variant
    scene : None if there is no such scene
    terms : to build; None for the default terms
    start : of runs, if the scene has only the functions that runs call
    problem : reason for which there is no scene, if None
    """

    name: str
    description: str
    scene: Scene | None
    terms: tuple[str, ...] | None = None
    start: str = ""
    problem: str = ""


def variants(scene: Scene, of_step: tuple[str, ...], absolute: Scene | str | None) -> tuple[Variant, ...]:
    """Return the scene as requested, with less, with more of one kind each, and with all additions, as variants.

    Parameters
    ----------
    scene : the scene as requested
    of_step : terms that a step of the method calls
    absolute : the scene in absolute coordinates, or the reason why there is none; None if the scene is in absolute
        coordinates
    """
    made = [
        Variant("as asked", "the scene as it is", scene),
        Variant(
            "a run",
            "only the functions that a run calls, as eomgen simulate builds it",
            scene,
            start=scene.simulation.start,
        ),
        Variant("terms of a step", "only the terms that the stepper calls", scene, of_step),
        Variant("all terms", "every term that the scene can have, with two time derivatives", scene, ALL_TERMS),
    ]
    everything = absolute if isinstance(absolute, Scene) else scene
    for name, (description, change) in _CHANGES.items():
        made.append(Variant(name, description, _with_name(change(scene), name)))
        everything = change(everything)
    description = "absolute coordinates, joints as constraints"
    if isinstance(absolute, Scene):
        made.append(Variant("absolute", description, absolute))
    elif absolute is not None:
        made.append(Variant("absolute", description, None, problem=absolute))
    whole = _with_name(everything, "everything")
    return (*made, Variant("everything", "all of that together, as far as it can be", whole, ALL_TERMS))


#: Every term with at most two time derivatives, each once; second derivations for checks, and derivatives in all
#: arguments, are left out.
ALL_TERMS = tuple(
    name
    for name, term in TERMS.items()
    if term.order <= 2
    and not term.differentiated
    and not name.endswith(("_1", "_closed"))
    and term.source not in CLOSED_MATRICES
)


def _with_name(scene: Scene, name: str) -> Scene:
    """Return a scene whose content contains the name of the variant, so that caches distinguish the variant from the
    scene."""
    return replace(scene, content=scene.content + b"\0" + name.encode())


def _tunable(scene: Scene) -> Scene:
    """Return the scene with all numbers tunable that bodies, joints, force elements and gravity have, except zeros. In
    scenes with beams, parameters stay as they are, and so do numbers of objects that may stand on beams."""
    beams = {body.name for body in scene.bodies if body.beam is not None}
    parameters = [replace(item, tunable=item.tunable or not beams) for item in scene.parameters]

    def change(value: Any) -> Any:
        if not isinstance(value, Number) or value.value == 0.0:  # other formulas stay, and data by name
            return value if isinstance(value, Node | Mapping) else NotImplemented
        name = f"number_{len(parameters)}"
        parameters.append(Parameter(name, value.value, tunable=True))
        return Symbol("parameter", name)

    def fresh(owner: Any, names: Iterable[str]) -> dict[str, Any]:
        return {name: rebuild(getattr(owner, name), change) for name in names}

    bodies = tuple(
        body if body.beam is not None else replace(body, **fresh(body, ("mass", "center_of_mass", "inertia")))
        for body in scene.bodies
    )
    kept = ("mimic", "pitch")  # ratios of coordinates are constants of the tree
    joints = tuple(
        joint
        if joint.parent in beams
        else replace(joint, **fresh(joint, (item.name for item in fields(joint) if item.name not in kept)))
        for joint in scene.joints
    )
    others = fresh(scene, ("gravity",) if beams else ("elements", "gravity"))
    return replace(scene, parameters=tuple(parameters), bodies=bodies, joints=joints, **others)


def _moving_base(scene: Scene) -> Scene:
    """Return the scene with a base that vibrates in all six ways, in addition to the law of the base."""
    base = scene.base or Base()
    time = Symbol("time")
    x, y, z = (Operation("add", (formula, _tremor(time, k + 1.0))) for k, formula in enumerate(base.position))
    rotations = tuple(
        Rotation(axis, _tremor(time, 4.0 + k))
        for k, axis in enumerate(((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    )
    return replace(scene, base=Base((x, y, z), (*base.rotations, *rotations)))


def _tremor(time: Formula, frequency: float) -> Formula:
    # 1e-100 m and rad: too small to change any number of the motion
    return Operation("mul", (Number(1e-100), Operation("sin", (Operation("mul", (Number(frequency), time)),))))


_CHANGES: Mapping[str, tuple[str, Callable[[Scene], Scene]]] = {
    "tunable": ("all numbers of bodies, joints, forces and gravity tunable", _tunable),
    "moving base": ("a base that moves in all six ways, by 1e-100", _moving_base),
}


#: Least and largest number of steps in one timed run.
FEWEST, MOST = 200, 100_000
#: Files of C that are the same for every scene.
_COMMON = ("eomgen_real.h", "main.c")


_INTERRUPTED = "interrupted before it was built"


@dataclass(frozen=True)
class VariantCost:
    """Costs of one variant of a scene.

    Attributes
    ----------
    name, what : name and description of the variant
    operations : additions and multiplications by term; terms that a step calls are in ``step_operations``, too
    step_operations : of one call each of the terms that a step calls
    c_bytes : of the model's C, including the stepper
    build_seconds : from the scene to the loaded library, with an empty cache
    step_seconds : median over the rounds; None for a variant that cannot be run
    observed_seconds : the same with a row recorded at every step, and outputs and energies evaluated there
    step_quartiles, observed_quartiles : first and third quartile of the rounds, of which half lie in between; None for
        a single round
    iterations : Newton iterations per step, None if there are none
    problem : reason if the variant was not derived, built or run to the end
    """

    name: str
    what: str
    operations: dict[str, int] = field(default_factory=dict)
    step_operations: int | None = None
    c_bytes: int | None = None
    build_seconds: float | None = None
    step_seconds: float | None = None
    observed_seconds: float | None = None
    step_quartiles: tuple[float, float] | None = None
    observed_quartiles: tuple[float, float] | None = None
    iterations: float | None = None
    problem: str = ""


#: Quartiles of the costs that are times of rounds.
QUARTILES = {"step_seconds": "step_quartiles", "observed_seconds": "observed_quartiles"}
#: Costs for which a Savings has the ratio to the unchanged scene.
COMPARED = ("step_operations", "c_bytes", "build_seconds", "step_seconds", "observed_seconds")


@dataclass(frozen=True)
class Savings:
    """Costs of a scene as requested, which come first, and of variants.

    Attributes
    ----------
    doubt : str
        Finding on motion that the timed steps do not resolve, as of friction that they pass over; empty without one.
    """

    scene: str
    method: str
    step: float
    costs: tuple[VariantCost, ...]
    doubt: str = ""

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C has ended the builds early."""
        return any(cost.problem == _INTERRUPTED for cost in self.costs)

    def ratio(self, cost: VariantCost, key: str) -> float | None:
        """Return the cost of a variant relative to the unchanged scene.

        Parameters
        ----------
        cost : VariantCost
            Costs of a variant.
        key : str
            ``step_operations``, ``c_bytes``, ``build_seconds``, ``step_seconds`` or ``observed_seconds``.

        Returns
        -------
        float or None
            Cost of the variant over cost of the unchanged scene; None if either is not known, or the unchanged scene's
            is 0. ``step_seconds`` and ``observed_seconds`` of other variants also give None if the intervals between
            the quartiles of rounds overlap, and for a single round, which has no quartiles.
        """
        asked, here = getattr(self.costs[0], key), getattr(cost, key)
        if key in QUARTILES and cost is not self.costs[0]:
            first, varied = (getattr(item, QUARTILES[key]) for item in (self.costs[0], cost))
            if first is None or varied is None or max(first[0], varied[0]) <= min(first[1], varied[1]):  # they overlap
                return None
        return here / asked if asked and here is not None else None

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON types, with the ratios.

        Returns
        -------
        dict
            ``scene``, ``method``, ``step``, ``doubt``, and ``variants``: the ``costs``, each with ``ratios`` by cost.
        """
        rows = [asdict(cost) | {"ratios": {key: self.ratio(cost, key) for key in COMPARED}} for cost in self.costs]
        return {"scene": self.scene, "method": self.method, "step": self.step, "doubt": self.doubt, "variants": rows}

    def write(self, folder: str | Path) -> list[Path]:
        """Write ``savings.csv`` and ``savings.json`` to a folder; existing files are replaced. Raises FileError.

        Parameters
        ----------
        folder : str or Path
            Folder to write to, which is made if missing.

        Returns
        -------
        list of Path
            The written files, in this order.
        """
        target = make_folder(Path(folder))
        table, data = target / "savings.csv", target / "savings.json"
        quartiles = [f"{key}_{part}_quartile" for key in QUARTILES for part in ("first", "third")]
        ratio_names = [f"{key}_ratio" for key in COMPARED]
        rows: list[list[object]] = [["variant", *COMPARED, *quartiles, *ratio_names, "iterations", "problem"]]
        for cost in self.costs:
            values = [getattr(cost, key) for key in COMPARED]
            ratios = [self.ratio(cost, key) for key in COMPARED]
            ends = [end for name in QUARTILES.values() for end in getattr(cost, name) or (None, None)]
            rows.append([cost.name, *values, *ends, *ratios, cost.iterations, cost.problem])
        write_rows(table, rows)
        write_text(data, json.dumps(self.to_dict(), indent=2) + "\n")
        return [table, data]


def savings(
    scene: Described,
    *,
    method: str | None = None,
    rounds: int = SAVINGS_ROUNDS,
    only: Sequence[str] = (),
    profile: str = STANDARD_PROFILE,
    progress: Callable[[int, int, str], None] | None = None,
    **options: Any,
) -> Savings:
    """Measure the costs of a scene as requested, and with additions.

    Variants: the functions of a run alone, the terms of a step alone, all terms, all numbers tunable, a base that moves
    in all six ways, absolute coordinates (unless the scene has these), and all of that. All variants have the same
    motion. Each variant is derived, built in an empty cache, and run at the scene's step; runs of the variants
    alternate, so that other load of the machine affects all variants. A variant that cannot be derived, built or run
    has a ``problem``, and lacks costs.

    Parameters
    ----------
    scene : str, Path, mapping or Scene
        Scene whose costs are compared.
    method : str, optional
        The scene's by default.
    rounds : int
        Pairs of timed runs of each variant, without and with recorded rows, of which the median and the quartiles are
        taken. Runs take about 0.05 s or 200 steps, if longer, and end no later than the scene's.
    only : sequence of str
        Names of variants other than the scene as asked: ``a run``, ``terms of a step``, ``all terms``, ``tunable``,
        ``moving base``, ``absolute``, ``everything``; all by default.
    profile : str
        Profile of the compiler, as in ``build``.
    progress : callable, optional
        Called with variants built, all variants, and the name of the variant before its build.
    **options
        Of ``load``, for paths.

    Returns
    -------
    Savings
        Operations, sizes and times of the scene as asked, which comes first, and of each variant.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C before the unchanged scene is built, or in the first runs; otherwise Ctrl-C ends the builds, or the
        rounds, with the costs so far.
    UsageError
        Unknown variants, fewer than one round, documents that are not scenes.
    EomgenError
        The unchanged scene cannot be derived, built or run.
    """
    document = load_scene(scene, **options) if isinstance(scene, str | os.PathLike) else as_document(scene)[0]
    if not isinstance(document, Scene):
        raise UsageError("variants are made of scenes, and this document is not a scene [E1107]", "a scene file")
    count_of("rounds", rounds)
    chosen = method_of(document, method)
    every = variants(document, terms_of_step(document, chosen), _absolute(scene, document, options))
    names = [variant.name for variant in every[1:]]
    if unknown := [name for name in only if name not in names]:
        raise UsageError(
            Problem("only", f"no variant is called {', '.join(unknown)} [E1109]", f"some of {', '.join(names)}")
        )
    wanted = [every[0], *(variant for variant in every[1:] if not only or variant.name in only)]
    step = document.simulation.step
    with tempfile.TemporaryDirectory(prefix="eomgen-savings-") as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of variants: warnings of the scene come with every build
        build_in(Path(folder) / "cache", document, ["residual"], chosen, profile).finish_compilation()  # shared
        measured: list[tuple[VariantCost, Model | None]] = []
        try:
            for variant in wanted:
                if progress is not None:
                    progress(len(measured), len(wanted), variant.name)
                measured.append(_build_variant(variant, chosen, Path(folder), profile))
        except KeyboardInterrupt:
            if not measured:
                raise
        left = wanted[len(measured) :]
        measured += [(VariantCost(variant.name, variant.description, problem=_INTERRUPTED), None) for variant in left]
        costs = _measure_steps(measured, step, document.simulation.duration, rounds)
        doubt, model = "", measured[0][1]
        if model is not None and not costs[0].problem:
            run = _run(model, step, max(1, int(document.simulation.duration / step)), every=1)
            doubt = next(map(str, run.model.alike()), "")
    if costs[0].problem:
        raise UsageError(
            f"the scene as it is asked cannot be measured: {costs[0].problem} [E1110]", "another method or step"
        )
    return Savings(document.name, chosen, step, tuple(costs), doubt)


def _absolute(described: Described, scene: Scene, options: Mapping[str, Any]) -> Scene | str | None:
    """Return the scene in absolute coordinates, or the reason why there is none, as a text. None if the scene is in
    absolute coordinates already. A scene read again (from `described`, with `options` of ``load``) is checked for
    absolute coordinates; a Scene is checked by the build."""
    if scene.coordinates == "absolute":
        return None
    if isinstance(described, Scene):
        return replace(scene, coordinates="absolute")
    try:
        return load_scene(described, **{**options, "coordinates": "absolute"})
    except EomgenError as error:
        return str(error)


def _build_variant(variant: Variant, method: str, folder: Path, profile: str) -> tuple[VariantCost, Model | None]:
    """Build a variant in a cache within `folder`; return the costs so far and the model. Costs are operations by term,
    bytes of C and build seconds. The model is None, and the costs name the problem, if the variant has no scene or
    cannot be derived or built."""
    cost = VariantCost(variant.name, variant.description)
    if variant.scene is None:
        return replace(cost, problem=variant.problem), None
    terms = None if variant.terms is None else list(variant.terms)
    try:
        began = time.perf_counter()
        model = build_in(folder / "cache", variant.scene, terms, method, profile, start=variant.start)
        seconds = time.perf_counter() - began
        model.finish_compilation()  # no compiler runs during timed steps, or writes to the cache when it is removed
        if variant.start:
            terms = list(model.terms)
        system = derive(variant.scene, terms)
        operations = {name: count.flops for name, count in system.counts.items()}
        files = generate(variant.scene, folder / f"c_{variant.name.replace(' ', '_')}", terms, method)
    except EomgenError as error:
        return replace(cost, problem=str(error)), None
    of_step = [name for name in terms_of_step(variant.scene, method) if name in operations]
    model_files = (file for file in files if file.suffix in (".c", ".h") and file.name not in _COMMON)
    cost = replace(
        cost,
        operations=operations,
        step_operations=sum(operations[name] for name in of_step),
        c_bytes=sum(file.stat().st_size for file in model_files),
        build_seconds=seconds,
    )
    return cost, model


def _measure_steps(
    measured: Sequence[tuple[VariantCost, Model | None]], step: float, duration: float, rounds: int
) -> list[VariantCost]:
    """Return the costs of all variants with the times of a step, from timed runs in turns over some rounds.

    Each run takes about 0.05 s of computation, by the time of a first run: 200 to 100000 steps (`step`, s), but no more
    than fit in `duration` (s). In each round a variant runs once without and once with recorded rows; medians and
    quartiles of the rounds are the costs. A variant without a model is not run; the costs of a failed run name the
    problem. Ctrl-C ends the rounds, of which those so far count; Ctrl-C in the first runs is raised.
    """
    costs, most, steps = [cost for cost, _ in measured], int(duration / step), dict[int, int]()
    times, observed = ([list[float]() for _ in measured] for _ in range(2))
    for k, (cost, model) in enumerate(measured):
        if model is None:
            continue
        try:
            first = _run(model, step, min(FEWEST, max(1, most)))
            problem = "" if first.success else first.message
        except EomgenError as error:
            problem = str(error)
        if problem:
            costs[k] = replace(cost, problem=problem)
            continue
        wanted = 0.05 / max(first.stats["wall_time"] / first.stats["steps"], 1e-9)
        steps[k] = max(1, min(most, MOST, max(FEWEST, int(wanted))))
    with suppress(KeyboardInterrupt):  # the rounds so far have medians, too
        for _, (k, count) in itertools.product(range(rounds), steps.items()):
            run = _run(measured[k][1], step, count)
            if not run.success:
                costs[k] = replace(costs[k], problem=run.message)
            if "newton_iterations" in run.stats:
                costs[k] = replace(costs[k], iterations=run.stats["newton_iterations"] / count)
            times[k].append(run.stats["wall_time"] / count)
            began = time.perf_counter()
            _run(measured[k][1], step, count, every=1)
            observed[k].append((time.perf_counter() - began) / count)
    return [
        replace(
            cost,
            step_seconds=statistics.median(times[k]) if times[k] else None,
            observed_seconds=statistics.median(observed[k]) if observed[k] else None,
            step_quartiles=_quartiles(times[k]),
            observed_quartiles=_quartiles(observed[k]),
        )
        for k, cost in enumerate(costs)
    ]


def _quartiles(seconds: Sequence[float]) -> tuple[float, float] | None:
    if len(seconds) < 2:
        return None
    first, _, third = statistics.quantiles(seconds, n=4, method="inclusive")
    return first, third


def _run(model: Any, step: float, steps: int, every: int | None = None) -> Any:
    return model.simulate(steps * step, step, record_every=steps if every is None else every, error_estimate=False)
