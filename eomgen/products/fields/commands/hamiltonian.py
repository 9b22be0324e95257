"""Output of ``info`` and ``simulate`` for a Hamiltonian system."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.text import counted, json_text, shown
from eomgen.cli import INTERRUPTED
from eomgen.cli.options import assignments
from eomgen.cli.printing import building, print_json, say
from eomgen.cli.tables import print_table
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.formula.units.labels import in_label
from eomgen.formula.units.parser import is_quantity

if TYPE_CHECKING:
    from eomgen.products.fields.documents.document import Hamiltonian
    from eomgen.products.fields.hamiltonian.solution import HamiltonianSolution

#: Kinds of the steps that are not compositions of drifts and kicks.
_KINDS = {"COLLOCATION": "implicit", "EXPLICIT": "explicit, not symplectic", "PAIR": "steps by a tolerance"}
#: Options of runs that these systems have; other options of ``simulate`` are refused.
_TAKEN = ("t_end", "step", "method", "record_every", "profile", "parameters", "initial", "error_estimate", "tolerance")


def show(document: Hamiltonian, method: str | None, *, as_json: bool) -> None:
    """Print the output of ``info`` for a system: its state, the parts of H, functions and method."""
    from eomgen.pipeline.pipeline import derive  # noqa: PLC0415
    from eomgen.products.fields.hamiltonian.methods import method_for  # noqa: PLC0415  # imported when the arguments are fine

    system = derive(document)
    chosen = method_for(document, method)
    counts = {name: {**dataclasses.asdict(count), "flops": count.flops} for name, count in system.counts.items()}
    parts: dict[str, int] = {}
    for term in document.terms:
        parts[term.dependence] = parts.get(term.dependence, 0) + 1
    coupled = list(dict.fromkeys(term.name for term in document.terms if term.dependence == "coupled"))
    gradients = len(chosen.fractions) // 2 if chosen.composed else 0
    if as_json:
        print_json(
            {
                "system": document.name,
                "description": document.description,
                "coordinates": [
                    {name: value for name, value in vars(item).items() if not name.endswith("_formula")}
                    for item in document.coordinates
                ],
                "parameters": {item.name: item.value for item in document.parameters},
                "outputs": [item.name for item in document.outputs],
                "separable": document.separable,
                "terms": parts,
                "coupled": coupled,
                "functions": counts,
                "method": {
                    "name": chosen.name,
                    "order": chosen.order,
                    "gradients": gradients,
                    "stability_limit": chosen.stability_limit,
                },
            }
        )
        return
    names = [item.name for item in document.coordinates]
    shown = ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
    rows = [("coordinates", f"{len(names)}: {shown}")]
    rows += [("parameters", ", ".join(f"{item.name} = {item.value:.6g}" for item in document.parameters[:8]))]
    rows += [("terms of H", ", ".join(f"{count} {name}" for name, count in parts.items()))]
    rows += [("separable", "yes: T(p) + V(q)" if document.separable else f"no, by {', '.join(coupled[:4])}")]
    steps = f"{counted(gradients, 'evaluation')} of forces a step" if gradients else _KINDS[chosen.kind]
    limit = f", stable up to step x frequency = {chosen.stability_limit:.4g}" if chosen.stability_limit else ""
    rows += [("method", f"{chosen.name}, order {chosen.order}, {steps}{limit}")]
    print_table(document.name, ("", ""), [row for row in rows if row[1]])
    functions = ((name, system.functions[name].description, str(count["flops"])) for name, count in counts.items())
    print_table("functions", ("", "", "operations"), functions, numeric=(2,))


def run(document: Hamiltonian, folder: str, options: Mapping[str, Any], *, plots: bool, as_json: bool) -> int:
    """Simulate a system, write solution.npz, solution.csv, summary.json and motion.png, and return the exit code."""
    from eomgen.base.files import make_folder, write_text  # noqa: PLC0415  # imported when the arguments are fine
    from eomgen.pipeline.file_kinds import given_options  # noqa: PLC0415
    from eomgen.products.fields.front_end import build_hamiltonian  # noqa: PLC0415

    if given := given_options({name: value for name, value in options.items() if name not in _TAKEN}):
        option = f"--{given[0].replace('_', '-')}"
        fault = f"this option is of mechanical scenes, and {document.name} is a Hamiltonian system"
        raise UsageError(Problem(option, fault, "leave it out"))
    coordinates = document.coordinates
    labels = {item.name: item.unit for item in document.parameters}
    changes = _numbers("--set", options["parameters"], labels)
    labels = {item.name: item.unit for item in coordinates} | {
        item.momentum: item.momentum_unit for item in coordinates
    }
    starts = _numbers("--initial", options["initial"], labels)
    target = make_folder(Path(folder))
    with building(document.name):
        model = build_hamiltonian(document, options["method"], options["profile"])
    solution = model.simulate(
        options["t_end"],
        options["step"],
        initial=starts or None,
        parameters=changes or None,
        record_every=options["record_every"],
        tolerance=options["tolerance"],
        error_estimate=options["error_estimate"],
    )
    files = [solution.save(target / "solution.npz"), solution.save(target / "solution.csv")]
    if plots:
        from eomgen.products.fields.hamiltonian.plots import draw  # noqa: PLC0415  # matplotlib comes with it

        files += draw(solution, target)
    files.append(target / "summary.json")
    summary = {
        "success": solution.success,
        "message": solution.message,
        "stats": dict(solution.stats),
        **solution.metadata,
        "energy_error": solution.energy_error,
        "error_estimate": solution.error_estimate.summary(),
        "rows": len(solution.t),
        "files": [file.name for file in files],
    }
    write_text(files[-1], json_text(summary) + "\n")
    if as_json:
        final = {name: float(column[-1]) for name, column in solution.columns().items()}
        print_json({**summary, "folder": str(target), "final": final})
    else:
        _print(solution, document)
    say(f"{solution.message}\nwritten to {target}: {', '.join(file.name for file in files)}")
    if solution.success:
        return 0
    return INTERRUPTED if solution.message.startswith("interrupted") else NumericalError.exit_code


def _numbers(option: str, given: Sequence[str], labels: Mapping[str, str]) -> dict[str, float]:
    """Return numbers by name, texts with a unit in the unit of the label. Raises UsageError if there is no label."""
    result: dict[str, float] = {}
    for name, value in assignments(option, given).items():
        if isinstance(value, str) and name in labels and not labels[name] and is_quantity(value):
            fault = f"{name} has no unit in the file, so {shown(value)} could be anything"
            raise UsageError(Problem(f"{option} {name}={value}", fault, "the number alone"))
        known = labels.get(name, "")
        result[name] = in_label(f"{option} {name}={value}", value, known) if isinstance(value, str) else value
    return result


def _print(solution: HamiltonianSolution, document: Hamiltonian) -> None:
    stats, metadata, total = solution.stats, solution.metadata, solution.energy["total"]
    rows = [
        ("method", f"{metadata['method']}, order {metadata['order']}, step {metadata['step']:.6g}"),
        ("end", f"t = {solution.t[-1]:.9g}, {counted(len(solution.t), 'row')}"),
        *_changed(metadata["parameters"], document),
        ("steps", str(stats["steps"])),
        ("gradients", str(stats["gradients"])),
        ("time of computation", f"{stats['wall_time']:.3g} s"),
        ("H", f"{total[0]:.12g} at the start, {total[-1]:.12g} at the end"),
        ("largest change of H", f"{solution.energy_error:.3g} of it"),
        ("errors of steps", str(solution.error_estimate)),
    ]
    names, units = metadata["names"], metadata["units"]
    for name, unit, value in [*zip(names["q"], units["q"], solution.q[-1], strict=True)][:8]:
        rows.append((f"{name} at the end", f"{value:.9g}{' ' + unit if unit else ''}"))
    if len(names["q"]) > 8:
        rows.append(("...", f"{len(names['q']) - 8} more in solution.csv"))
    print_table(metadata["name"], ("", ""), rows)


def _changed(values: Mapping[str, float], document: Hamiltonian) -> list[tuple[str, str]]:
    """Return a row for each parameter whose value in a run is another than in the file."""
    return [
        (f"parameter {item.name}", f"{value:.9g}{' ' + item.unit if item.unit else ''}, in the scene {item.value:.9g}")
        for item in document.parameters
        if (value := values[item.name]) != item.value
    ]
