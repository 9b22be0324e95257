"""Many runs of one model: samples of varied quantities, run side by side, reduced as they come."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, contextmanager, nullcontext
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, count_of
from eomgen.base.calls import with_options_of
from eomgen.base.files import make_folder
from eomgen.base.locks import sole_use
from eomgen.base.messages import counted, nearest
from eomgen.base.messages import shown as quoted
from eomgen.base.products import LateRow, import_target, rows_of
from eomgen.base.progress import Progress, Reporter, duration, show_progress
from eomgen.base.threads import thread_count
from eomgen.base.version import __version__
from eomgen.compiled.model import CompiledModel
from eomgen.errors import FileError, Problem, UsageError
from eomgen.products.ensembles.cluster import PART, connect_cluster
from eomgen.products.ensembles.designs import (
    DESIGNS,
    OTHER_DESIGNS,
    Design,
    grid_design,
    note_on_balance,
    random_design,
)
from eomgen.products.ensembles.discretisation import EnsembleJudgement
from eomgen.products.ensembles.distributions import Distribution
from eomgen.products.ensembles.ensemble import Ensemble
from eomgen.products.ensembles.journal import BlockJournal
from eomgen.products.ensembles.samples import SampleBlock, SampleRunner, event_counts
from eomgen.products.ensembles.side_by_side import CommonRunData
from eomgen.products.ensembles.statistics import Reduction
from eomgen.products.ensembles.variations import (
    LAWS,
    Variation,
    VariedOptions,
    read_table,
    read_varied,
    starts_of_several_turns,
    with_scenes_laws,
)
from eomgen.results.solution import Solution
from eomgen.simulation.option_types import EnsembleOptions
from eomgen.simulation.simulate import simulate
from eomgen.simulation.stepping.states import starts_at_equilibrium
from eomgen.simulation.stepping.time_grid import row_times

#: Seconds between two writings of the reduced results, and of work from which on a plan is announced.
_SELDOM = 10.0
#: Data of a run in the description of an ensemble.
_DESCRIBED = ("method", "settings", "t_start", "t_end", "record_every", "parameters", "start")
#: Files that solutions of samples are kept as.
_KEPT_AS = ("npz", "parquet")


@with_options_of(simulate, EnsembleOptions.__annotations__)
def simulate_many(
    model: CompiledModel,
    t_end: float | str | None = None,
    step: float | str | None = None,
    *,
    vary: Mapping[str, str | Distribution] | None = None,
    table: Mapping[str, ArrayLike] | None = None,
    samples: int = 256,
    design: str = "",
    seed: int = 0,
    columns: Sequence[str] | None = None,
    points: int = 301,
    keep: Sequence[int] = (),
    keep_as: str = "npz",
    folder: str | os.PathLike[str] | None = None,
    resume: bool = False,
    workers: int | None = None,
    cluster: object = None,
    device: str = "cpu",
    progress: Progress | bool | None = None,
    error_estimate: bool = True,
    **options: Unpack[EnsembleOptions],
) -> Ensemble:
    """Run samples of varied quantities, reduced as they come: statistics over time, extremes of each sample.

    All other quantities and options are as in ``simulate``. A failed sample is kept with reason and values, and enters
    no statistics. The numbers have the same bits with any number of workers, and after any interruption; sample k of
    ``monte_carlo``, ``sobol`` and ``halton`` is the same in a larger ensemble. With a folder, memory does not grow with
    the number of samples, except for reading ``values`` and ``results`` back.

    Parameters
    ----------
    t_end, step : float or str, optional
        As of ``simulate``, s.
    vary : mapping
        Name -> distribution: tunable parameters, inputs (constant over a run), ``seed.road`` and ``scale.road`` of
        the law that the scene gives an input, ``q.hinge``, ``v.hinge`` and internal states of the initial state.
        Distributions as texts with numbers in the scene's units or with units of their own: ``normal(mean,
        deviation)``, ``truncated_normal(mean, deviation, low, high)``, ``lognormal(mean, deviation)`` of the number
        itself, ``uniform(low, high)``, ``loguniform(low, high)``, ``triangular(low, mode, high)``,
        ``exponential(mean)``, ``weibull(scale, shape)``, ``gumbel(location, scale)``, ``integers(low, high)``; a
        deviation may be a percentage of the mean. Lists: ``values(1, 2, 4)``, ``linspace(low, high, count)``,
        ``logspace(low, high, count)``.
    table : mapping or DataFrame
        Name -> column (samples,), in place of ``vary`` and a design.
    samples : int
        Number of samples of a random design; ``saltelli`` takes (2 + varied quantities) times as many.
    design : str
        ``monte_carlo`` (the default), ``latin_hypercube``, ``sobol``, ``halton``, ``saltelli`` for Sobol' indices,
        or ``grid`` (the default of lists): all combinations of lists.
    seed : int
        Of the design.
    columns : sequence of str
        Outputs or other columns to be reduced; all outputs by default, or coordinates in a scene without outputs.
        ``Solution.columns()`` returns the names; ``event.NAME`` counts events until each time, and ``t.final`` is the
        end of a run that an event stops.
    points : int
        Largest number of times with statistics.
    keep : sequence of int
        Numbers of samples whose solutions are written to the folder, ``runs``.
    keep_as : str
        File format of kept solutions: ``npz``, or ``parquet`` for columns only.
    folder : path
        Folder for samples and statistics, written as they come.
    resume : bool
        Go on with the samples of the folder.
    workers : int
        Threads, or processes of the cluster ``dask``; one for each processor by default.
    cluster : str, path or object
        Dask's, to run samples on, with the same bits: ``dask`` for processes of this machine, the address or the file
        of a scheduler, or a ``distributed.Client`` or cluster object.
    device : str
        ``cpu``, or ``gpu`` for NVIDIA's cards: samples run and are reduced on the card, with the bits of runs in the
        profile ``reproducible``; means and deviations are summed in another order, and differ by rounding. Not for
        controllers in Python, nor with ``cluster``.
    progress : callable or True
        As of ``simulate``, called with samples.
    error_estimate : bool
        As of ``simulate``, of examined samples.
    method : str, optional
        As of ``simulate``.
    rho_inf, alpha, beta, gamma, order, tolerance : float, optional
        As of ``simulate``.
    initial, parameters, inputs, controllers : mapping, optional
        As of ``simulate``.
    record_every : int, optional
        As of ``simulate``.
    t_start : float, optional
        As of ``simulate``, s.
    settings : mapping, optional
        As of ``simulate``.
    start : str, optional
        As of ``simulate``.

    Returns
    -------
    Ensemble
        Statistics of the columns over time, extremes and failures of the samples.

    Raises
    ------
    UsageError
        Anything that is wrong before the first sample, by name; of a cluster also later.
    FileError
        The folder holds another ensemble, or the same without ``resume``; a cluster is lost.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> ensemble = model.simulate_many(0.1, 1e-3, vary={"m2": "normal(0.6, 5%)"}, samples=8, columns=["energy"])
    >>> ensemble.done
    8
    """
    _check_options(options, folder, resume=resume)
    runner = _runner_on(device, cluster)
    samples, points = count_of("samples", samples), max(count_of("points", points), 2)
    items, drawn = _make_design(model, vary, table, samples, design, seed)
    if not model.library.lacking:
        model.finish_compilation()  # many runs take longer than a compiler, and all have the bits of one library
    # laws of varied inputs are functions here too: a method without such inputs reports this before the first sample
    pilot = simulate(model, t_end, step, **with_scenes_laws(model, items, options), error_estimate=error_estimate)
    if pilot.interrupted:
        raise KeyboardInterrupt
    options = _with_largest_step(options, pilot)
    looked_at = _columns([*pilot.columns(), *event_counts(model, pilot)], columns)
    times = row_times(pilot.metadata, model.library.real)
    thinned = np.unique(np.linspace(0, len(times) - 1, min(points, len(times))).astype(int))
    target = None if folder is None else Path(folder)
    kept = _kept_samples(keep, drawn.samples, keep_as, target)
    work_of_one = int(pilot.stats.get("evaluations", 0)) * max(1, model.nv + model.nz)
    alike = CommonRunData.of(model, pilot)
    block = runner.block_size(
        drawn.samples,
        work_of_one,
        len(looked_at) * len(thinned),
        _numbers_of_inputs(items, options, alike.grid.steps * model.nu),
    )
    runs = None if target is None or not kept else target / "runs"
    varied = VariedOptions(model, items, options, _rest(model, items, options, pilot))
    work = runner(model, drawn, varied, (t_end, step), looked_at, times, thinned, alike, kept, keep_as, runs)
    work.prepare(block)  # a device that is not there, or refuses the scene or its memory, leaves no folder
    described = _description(work, pilot, vary, table, seed, block)
    threads = thread_count() if workers is None else count_of("workers", workers)
    with (
        nullcontext() if cluster is None else connect_cluster(cluster, workers) as machines,
        nullcontext() if target is None else _alone(target),
        nullcontext() if progress is None else show_progress(progress, model.name) as reported,
    ):
        journal = BlockJournal(target, described, resume=resume)
        if runs is not None:
            make_folder(runs)
        began = time.perf_counter()
        journal.mend(work.block)
        work.save_those_before(journal.done)
        reduction = journal.reduction or Reduction(len(looked_at), len(thinned), block)
        left = (journal.done, drawn.samples)
        if machines is None:
            first = 1 if varied.rest else max(1, int(PART / max(float(pilot.stats["wall_time"]), 1e-9)))
            announce = reported.announce if isinstance(reported, Reporter) else None
            came = _on_threads(work, threads, *left, min(first, block), block, announce)
        else:
            came = machines.blocks(work, *left)
        with closing(came) as blocks:
            interrupted = _reduce(blocks, journal, reduction, drawn.samples, reported)
    how, notes = (work.how, ()) if machines is None else ("; ".join(sorted(machines.how)), machines.notes)
    units = pilot.units()
    return Ensemble(
        scene=model.name,
        design=drawn.name,
        seed=seed,
        varied=tuple(item.name for item in items),
        columns=tuple(looked_at),
        units={column: units.get(column, "") for column in looked_at} | {item.name: item.unit for item in items},
        t=times[thinned],
        asked=drawn.samples,
        done=journal.done,
        interrupted=interrupted,
        seconds=time.perf_counter() - began,
        reduction=reduction.whole(),
        journal=journal,
        method=str(pilot.metadata["method"]),
        how=how,
        judgement=EnsembleJudgement(
            work,
            pilot,
            estimates=error_estimate,
            interrupted=interrupted,
            notes=(note_on_balance(drawn.name, samples), *starts_of_several_turns(items, vary)),
            last=(*journal.notes, *notes),
        ),
    )


def _runner_on(device: str, cluster: object) -> type[SampleRunner]:
    """Return the class that runs samples on a device. Raises UsageError for an unknown one, and with a cluster."""
    rows = {row.key: row.target for row in rows_of("eomgen.ensemble_devices", LateRow)}
    if device == "cpu":
        return SampleRunner
    if device not in rows:
        raise UsageError(
            Problem("device", f"there is no device {quoted(str(device))} [E2301]", nearest(str(device), ["cpu", *rows]))
        )
    if cluster is not None:
        fault = "samples run on the device of this machine, and a cluster is given too [E2302]"
        raise UsageError(Problem("device", fault, "the device, or the cluster, alone"))
    return cast("type[SampleRunner]", import_target(rows[device]))


def _numbers_of_inputs(items: Sequence[Variation], options: Mapping[str, Any], most: int) -> int:
    """Return ``most``, or 0 if inputs do not change with time by laws of the caller or of each sample."""
    return most if options.get("inputs") or any(item.block in LAWS for item in items) else 0


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Keep other ensembles out of a folder, which is made, for the body of the context. Raises FileError if another
    ensemble uses the folder."""
    with sole_use(make_folder(folder)) as alone:
        if not alone:
            fault = "another ensemble is writing to it [E0674]"
            raise FileError(Problem(str(folder), fault, "another folder, or this one when that has ended"))
        yield


def _reduce(
    blocks: Iterator[SampleBlock], journal: BlockJournal, reduction: Reduction, total: int, report: Progress | None
) -> bool:
    """Add blocks of samples to the reduction and the journal one by one; return whether Ctrl-C ended this before
    `total` samples. The journal is written every ten seconds, at the end and after an error; `report` is called with
    the numbers of finished and of all samples."""
    written, interrupted = time.monotonic(), False
    reducer = ThreadPoolExecutor(1)  # Ctrl-C ends the main thread's work, and a block is reduced whole or not at all

    def take(block: SampleBlock) -> None:
        if block.reduced is None:
            reduction.add(block.rows)
        else:
            reduction.merge(block.reduced)
        journal.keep(block)

    try:
        for block in blocks:
            reducer.submit(take, block).result()
            if time.monotonic() - written > _SELDOM:
                reducer.submit(journal.write, reduction).result()
                written = time.monotonic()
            if report is not None:
                report(journal.done, total)
    except KeyboardInterrupt:
        interrupted = True
    finally:
        reducer.shutdown(wait=True)
        journal.write(reduction)
    return interrupted and journal.done < total


def _on_threads(
    work: SampleRunner,
    workers: int,
    first: int,
    total: int,
    begin_with: int,
    most: int,
    announce: Callable[[str], None] | None,
) -> Generator[SampleBlock]:
    """Yield blocks of samples in order, from sample ``first`` to before ``total``; threads, as many as ``workers``,
    work ahead. Blocks have ``begin_with`` samples before a time is known, and ``most`` samples at most; ``announce`` is
    called with the plan as soon as its duration is known. After any end, running blocks are stopped."""
    pool = ThreadPoolExecutor(workers, thread_name_prefix="eomgen-ensemble")
    whole = work.device != "cpu"  # a device has threads of its own, and reduces blocks of one size
    workers, begin_with = (1, most) if whole else (workers, begin_with)
    waiting: list[Future[tuple[SampleBlock | None, float]]] = []
    sent, size = first, begin_with

    def run(begin: int, count: int) -> tuple[SampleBlock | None, float]:
        then = time.perf_counter()
        return work.block(begin, count), (time.perf_counter() - then) / count

    try:
        _ = work.lanes  # which compiles the code of runs side by side once
        began = time.perf_counter()
        while True:
            while len(waiting) < 2 * workers and sent < total:
                count = min(size, total - sent)
                waiting.append(pool.submit(run, sent, count))
                sent += count
            if not waiting:
                return
            finished, each = waiting.pop(0).result()
            if finished is None:
                continue
            size = most if whole else max(1, min(most, int(PART / max(each, 1e-9))))
            done, taken = finished.first + len(finished.values), time.perf_counter() - began
            if announce is not None and taken >= PART:
                if (seconds := each * (total - done) / workers) > _SELDOM:  # the first samples are dearer
                    threads = counted(workers, "thread")
                    announce(f"{total - first} samples {work.how}, by {threads}: about {duration(seconds)} more")
                announce = None
            yield finished
    finally:
        work.stop.set()
        pool.shutdown(wait=True, cancel_futures=True)


def _rest(
    model: CompiledModel, items: Sequence[Variation], options: Mapping[str, Any], pilot: Solution
) -> dict[str, Any]:
    """Return options with which samples look for static equilibrium near the equilibrium of the run without variations.
    Empty for starts that are not at equilibrium, and if initial states vary, near which samples look for theirs."""
    of_scene = str(model.library.layout["defaults"]["start"])
    varies = any(item.block in ("q", "v", "z") for item in items)
    if varies or not starts_at_equilibrium(options.get("start"), options.get("initial") is not None, of_scene):
        return {}
    state = {"q": pilot.q[0], "v": pilot.v[0]} | ({"z": pilot.z[0]} if model.nz else {})
    return {"start": "equilibrium", "initial": state}


def _make_design(
    model: CompiledModel,
    vary: Mapping[str, str | Distribution] | None,
    table: Mapping[str, ArrayLike] | None,
    samples: int,
    design: str,
    seed: int,
) -> tuple[list[Variation], Design]:
    """Return the varied quantities and the design of their samples. Raises UsageError."""
    count_of("seed", seed, 0)
    if table is not None:
        if vary or design:
            excess = "vary" if vary else "design"
            fault = f"a table says the values of all samples, and {excess} is given too [E0676]"
            raise UsageError(Problem(excess, fault, f"the table, or {excess}, alone"))
        items, rows = read_table(model, table)
        return items, Design("table", len(rows), lambda first, count: rows[first : first + count])
    if isinstance(vary, Mapping | None) and not vary:
        hint = 'vary={"mass": "normal(1, 0.1)"}, or table={"mass": [...]}'
        raise UsageError(Problem("vary", "nothing varies: all samples would be the same [E0652]", hint))
    items, distributions = read_varied(model, vary)
    if not design:
        design = "grid" if all(item.levels for item in distributions) else "monte_carlo"
    if design == "grid":
        return items, grid_design([item.name for item in items], distributions)
    if design not in DESIGNS:
        hint = nearest(design, [*DESIGNS, *OTHER_DESIGNS])
        raise UsageError(Problem("design", f"there is no design {quoted(design)} [E0677]", hint))
    return items, random_design(design, distributions, samples, seed)


def _columns(known: Sequence[str], wanted: Sequence[str] | None) -> list[str]:
    """Return the names of the columns to record among ``known`` ones; by default all outputs, else 12 coordinates. An
    output's name stands for all its components. Raises UsageError for unknown names and for none."""
    if wanted is None:
        outputs = [name for name in known if name.startswith("output.")]
        return outputs or [name for name in known if name.startswith("q.")][:12]
    if isinstance(wanted, str):
        wanted = [wanted]
    result = []
    for name in wanted:
        of_output = [column for column in known if column == f"output.{name}" or column.startswith(f"output.{name}[")]
        if name not in known and not of_output:
            hint = nearest(str(name), [*known, *(column.removeprefix("output.") for column in known)])
            raise UsageError(Problem("columns", f"there is no column {quoted(str(name))} [E0669]", hint))
        result += [name] if name in known else of_output
    if not result:
        raise UsageError(Problem("columns", "no column is looked at [E0678]", "one of model.simulate(...).columns()"))
    return list(dict.fromkeys(result))


def _kept_samples(keep: Sequence[int], samples: int, keep_as: str, target: Path | None) -> frozenset[int]:
    """Return the numbers of samples whose solutions are kept. Raises UsageError for numbers beyond `samples`, without a
    folder, and for files of an unknown or missing kind."""
    result = set()
    for number in keep if isinstance(keep, Iterable) else [keep]:
        if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number < samples:
            fault = f"{number!r} is not the number of a sample [E0679]"
            raise UsageError(Problem("keep", fault, f"0 to {samples - 1}"))
        result.add(int(number))
    if result and target is None:
        fault = "solutions of samples are kept in a folder, and none is given [E0680]"
        raise UsageError(Problem("keep", fault, "folder=..."))
    if keep_as not in _KEPT_AS:
        hint = " or ".join(_KEPT_AS)
        raise UsageError(Problem("keep_as", f"solutions are not kept as {quoted(str(keep_as))} [E0681]", hint))
    if keep_as == "parquet" and find_spec("pyarrow") is None:
        fault = "Parquet files are written by the package pyarrow, which is not installed [E0682]"
        raise UsageError(Problem("keep_as", fault, "pip install 'eomgen[parquet]', or npz"))
    return frozenset(result)


def _with_largest_step(options: EnsembleOptions, pilot: Solution) -> EnsembleOptions:
    """Return the options of all samples, with the largest step of the run without variations."""
    if "largest_step" not in pilot.metadata["settings"]:
        return options
    settings = {**(options.get("settings") or {}), "largest_step": pilot.metadata["settings"]["largest_step"]}
    return {**options, "settings": settings}


def _check_options(options: Mapping[str, Any], folder: str | os.PathLike[str] | None, *, resume: bool) -> None:
    """Raise UsageError for ``resume`` without a folder, and for checkpoints, which samples do not write."""
    if resume and folder is None:
        raise UsageError(Problem("resume", "there is no folder to go on with [E0683]", "folder=..., of an ensemble"))
    for name in ("checkpoint", "checkpoint_every"):
        if options.get(name) is not None:
            fault = "samples write no checkpoints of their own [E0684]"
            raise UsageError(Problem(name, fault, "folder=..., and resume=True, for the finished samples"))


def _digest(arrays: Sequence[Array]) -> str:
    """Return the identity of arrays, to the bit."""
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()


def _description(
    work: SampleRunner,
    pilot: Solution,
    vary: Mapping[str, str | Distribution] | None,
    table: Mapping[str, ArrayLike] | None,
    seed: int,
    block: int,
) -> dict[str, Any]:
    """Return all that the numbers of samples depend on, as JSON data: a folder with another description is refused.
    Inputs, a table and the motion without variations are included as digests."""
    data, model, design, options = pilot.metadata, work.model, work.design, work.options
    how = {name: item.text if isinstance(item, Distribution) else item for name, item in (vary or {}).items()}
    digest = "" if table is None else _digest([design.values(0, design.samples)])
    return {
        "scene": model.name,
        "fingerprint": model.library.layout.get("fingerprint", ""),
        **{name: data[name] for name in _DESCRIBED},
        "inputs": _digest(list(pilot.inputs.values())),
        "controllers": sorted(options.common.get("controllers") or ()),
        "motion without variations": _digest([pilot.t, pilot.q, pilot.v]),
        "design": design.name,
        "samples": design.samples,
        "seed": seed,
        "vary": how or [item.name for item in options.items],
        "table": digest,
        "columns": list(work.columns),
        "times": work.times[work.thinned].tolist(),
        "block": block,
        "version": __version__,
        **({} if work.device == "cpu" else {"device": work.device}),
    }
