"""Commands of Hamiltonian systems and of fields on a mesh: ``info``, ``simulate``, and ``eomgen sample``."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.json_text import json_text
from eomgen.base.messages import shown
from eomgen.base.progress import terminal_bar
from eomgen.cli import INTERRUPTED
from eomgen.cli.options import assignments, completed_files, debug_option, folder_option, json_option
from eomgen.cli.printing import building, print_json, print_table, say
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.formula.units.labels import in_label
from eomgen.formula.units.parser import is_quantity
from eomgen.products.fields.documents.tables import Chains

if TYPE_CHECKING:
    from eomgen.integrators.compositions import Composition
    from eomgen.products.fields.documents.document import FieldSystem, Hamiltonian, NamedNumber
    from eomgen.products.fields.hamiltonian.methods import Method
    from eomgen.products.fields.hamiltonian.solution import HamiltonianSolution
    from eomgen.products.fields.sampling import FieldSamples


#: Keys of a coordinate with its momentum in the output of ``info``.
_PAIR = ("name", "momentum", "position", "momentum_value", "unit", "momentum_unit")


def show(document: Hamiltonian, method: str | None, *, as_json: bool) -> None:
    """Print the output of ``info`` for a Hamiltonian system: coordinates, parameters, terms of H, functions with counts
    of operations, and the method called ``method`` (None: the file's). ``as_json`` prints one JSON object instead of
    tables."""
    from eomgen.pipeline.pipeline import derive  # noqa: PLC0415
    from eomgen.products.fields.hamiltonian.methods import method_for  # noqa: PLC0415  # imported when the arguments are fine

    system = derive(document)
    counts = {name: {**dataclasses.asdict(count), "flops": count.flops} for name, count in system.counts.items()}
    data = {
        "system": document.name,
        "description": document.description,
        "coordinates": [
            dict(zip(_PAIR, (q.name, p.name, q.value, p.value, q.unit, p.unit), strict=True))
            for q, p in zip(document.coordinates, document.momenta, strict=True)
        ],
        "parameters": {item.name: item.value for item in document.parameters},
        "definitions": dict(document.definitions),
        "outputs": [item.name for item in document.outputs],
        "notes": list(document.notes),
        "separable": document.separable,
        "terms": Counter(term.dependence for term in document.terms),
        "coupled": document.coupled_terms,
        "functions": counts,
        "method": _method(method_for(document, method)),
    }
    if as_json:
        print_json(data)
        return
    _print_data(data)
    functions = ((name, system.functions[name].description, str(count["flops"])) for name, count in counts.items())
    print_table("functions", ("", "", "operations"), functions, numeric=(2,))


def _print_data(data: Mapping[str, Any]) -> None:
    """Print a table of JSON data, with the name of the system as title; empty entries are left out."""
    title, told = data.get("system") or data["name"], {**data}
    if "memory" in data:
        told["memory"] = f"{data['memory'] / 2**20:.4g} MiB at most"
    rows = [
        (key.replace("_", " "), text)
        for key, value in told.items()
        if key not in ("system", "name", "functions", "message", "files") and (text := _as_text(value))
    ]
    print_table(title, ("", ""), rows)


def _as_text(value: object, mark: str = "\n") -> str:
    """Return a value of JSON data in words: of a list or mapping the first 20 entries alone, sentences separated by
    ``mark``."""
    if isinstance(value, Mapping):
        value = [f"{name} = {text}" for name, entry in value.items() if (text := _as_text(entry, ", "))]
    if not isinstance(value, list):
        return f"{value:.9g}" if isinstance(value, float) else str(value)
    texts = [_as_text(entry, ", ") for entry in value[:20]]
    if more := len(value[20:]):
        texts.append(f"{more} more")
    return (mark if any(" " in text for text in texts) else ", ").join(texts)


def _method(chosen: Method | Composition) -> dict[str, Any]:
    """Return name, order, gradients per step and stability limit of a method as JSON types."""
    return {name: getattr(chosen, name) for name in ("name", "order", "gradients", "stability_limit")}


def run(document: Hamiltonian, folder: str, options: Mapping[str, Any], *, plots: bool, as_json: bool) -> int:
    """Simulate a Hamiltonian system, write solution.npz, solution.csv, summary.json and, with ``plots``, motion.png to
    ``folder``, print a table or JSON, and return the exit code. ``options`` are the options of ``eomgen simulate`` by
    name."""
    from eomgen.base.files import make_folder, write_text  # noqa: PLC0415  # imported when the arguments are fine
    from eomgen.products.fields.front_end import build_hamiltonian  # noqa: PLC0415
    from eomgen.products.fields.hamiltonian.solution import draw, outcome_of  # noqa: PLC0415

    changes = _numbers("--set", options["parameters"], document.parameters)
    starts = _numbers("--initial", options["initial"], document.states)
    target = make_folder(Path(folder))
    with building(document.name):
        model = build_hamiltonian(document, options["method"], options["profile"])
    settings = {name: options[name] for name in ("t_end", "step", "record_every", "tolerance", "error_estimate")}
    solution = model.simulate(initial=starts or None, parameters=changes or None, **settings)
    files = [solution.save(target / "solution.npz"), solution.save(target / "solution.csv")]
    files += draw(solution, target) if plots else []
    files.append(target / "summary.json")
    summary = {**outcome_of(solution), "energy_error": solution.energy_error, "rows": len(solution.t)}
    summary["files"] = [file.name for file in files]
    write_text(files[-1], json_text(summary) + "\n")
    final = {name: float(column[-1]) for name, column in solution.columns().items()}
    if as_json:
        print_json({**summary, "folder": str(target), "final": final})
    else:
        _print_data(_run_data(solution, document) | {"final": final})
    say(f"{solution.message}\nwritten to {target}: {', '.join(file.name for file in files)}")
    return 0 if solution.success else INTERRUPTED if solution.interrupted else NumericalError.exit_code


def _numbers(option: str, texts: Sequence[str], items: Iterable[NamedNumber]) -> dict[str, float]:
    """Return the numbers of texts NAME=VALUE by name; a value with a unit is converted to the unit of the item with
    this name. Raises UsageError, with the name of the option, for a value with a unit if the item has no unit."""
    labels, result = {item.name: item.unit for item in items}, dict[str, float]()
    for name, value in assignments(option, texts).items():
        if isinstance(value, str) and name in labels and not labels[name] and is_quantity(value):
            fault = f"{name} has no unit in the file, so {shown(value)} could be anything [E0707]"
            raise UsageError(Problem(f"{option} {name}={value}", fault, "the number alone"))
        known = labels.get(name, "")
        result[name] = in_label(f"{option} {name}={value}", value, known) if isinstance(value, str) else value
    return result


def _run_data(solution: HamiltonianSolution, document: Hamiltonian) -> dict[str, Any]:
    """Return the table of a run of a Hamiltonian system: method, changed parameters, counts, energies and errors."""
    metadata, total = solution.metadata, solution.energy["total"]
    changed = {
        f"parameter {item.name}": f"{value:.9g}{' ' + item.unit if item.unit else ''}, in the scene {item.value:.9g}"
        for item in document.parameters
        if (value := metadata["parameters"][item.name]) != item.value
    }
    return {
        **{key: metadata[key] for key in ("name", "method", "order", "step")},
        **changed,
        **solution.stats,
        "rows": len(solution.t),
        "H": f"{total[0]:.12g} at the start, {total[-1]:.12g} at the end",
        "largest change of H": f"{solution.energy_error:.3g} of it",
        "errors of steps": str(solution.error_estimate),
    }


def show_fields(system: FieldSystem, method: str | None, *, as_json: bool) -> None:
    """Print the output of ``info`` for a system of fields: mesh, memory, operators, data, energy, and the method called
    ``method`` (None: the file's). No array as large as the mesh is made. ``as_json`` prints one JSON object instead of
    a table."""
    from eomgen.integrators.compositions import composition_named  # noqa: PLC0415
    from eomgen.products.fields.sampling import memory_of  # noqa: PLC0415

    memory = memory_of(system)
    chosen = composition_named(system.sampling.method if method is None else method)
    widths = [length / count for length, count in zip(system.lengths, system.cells, strict=True)]
    low, high = 2.0 * math.pi / max(system.lengths), math.pi / max(widths)
    operators = {item.name: f"{item.kind}{f' after {item.of}' if item.of else ''}" for item in system.operators}
    data = {
        "system": system.name,
        "description": system.description,
        "cells": list(system.cells),
        "lengths": list(system.lengths),
        "memory": memory,
        "wave_numbers": [low, high],
        "operators": operators,
        "data": {item.name: item.kind + (f" {item.file}" if item.file else "") for item in system.data},
        "definitions": dict(system.definitions),
        "energy": system.energy,
        "where": dict(system.where),
        "notes": list(system.notes),
        "fields": list(system.fields),
        "transforms_per_gradient": 2 * len(system.fields),
        "mass": system.mass,
        "sampling": vars(system.sampling),
        "method": _method(chosen),
    }
    if as_json:
        print_json(data)
    else:
        _print_data(data)


def _settings(command: Callable[..., int]) -> Callable[..., int]:
    """Add an option to a command for each setting of chains; without it the file's counts."""
    for name, item in reversed(Chains.model_fields.items()):
        option, text = f"--{name.replace('_', '-')}", f"{item.description}; the file's by default."
        command = click.option(option, type=type(item.default), default=None, help=text)(command)
    return command


@click.command()
@click.argument("file", metavar="FILE", shell_complete=completed_files)
@folder_option
@_settings
@click.option("--mass", default=None, metavar="CHOICE", help="fisher, prior or unit; the file's by default.")
@click.option("--resume", is_flag=True, help="Go on from the checkpoint of the folder, to the same bits.")
@click.option("--plots/--no-plots", default=True, show_default=True, help="Draw slices, power spectra and chains.")
@json_option
@debug_option
def sample(file: str, folder: str, resume: bool, plots: bool, as_json: bool, **options: Any) -> int:
    """Sample the fields of a FILE of kind "hamiltonian" with a [mesh] by Hamiltonian Monte Carlo.

    Writes samples.npz, trajectories.csv, scales.csv, summary.json, pictures, and checkpoint.npz, renewed once a minute.
    Ctrl-C keeps the samples drawn so far; the exit code is then 130, and --resume goes on.
    """
    from eomgen.products.fields.sampling import draw  # noqa: PLC0415
    from eomgen.products.fields.sampling import sample as sampled  # noqa: PLC0415  # imported when the arguments are known to be fine

    chosen = {name: value for name, value in options.items() if value is not None}
    with terminal_bar(file) as bar:
        result = sampled(file, folder=folder, resume=resume, progress=bar, **chosen)
    files = result.save(folder) + (draw(result, folder) if plots else [])
    if as_json:
        print_json({**result.to_dict(), "folder": folder, "files": [path.name for path in files]})
    else:
        _print_samples(result)
    say(f"{result.message}\nwritten to {folder}: {', '.join(path.name for path in files)}")
    return INTERRUPTED if result.interrupted else 0


def _print_samples(samples: FieldSamples) -> None:
    """Print tables of the settings, diagnostics and scales of samples."""
    _print_data(samples.summary())
    heads = ("k", "prior", "truth", "samples", "deviation", "of the mean", "correlation", "R-hat", "autocorrelation")
    scales = [vars(scale).values() for scale in samples.scales()]
    table = [tuple("-" if math.isnan(value) else f"{value:.4g}" for value in values) for values in scales]
    if table:
        print_table("scales: power of a mode", heads, table, numeric=tuple(range(len(heads))))
