"""``eomgen generate``: the self-contained folder of C code."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from eomgen.base.messages import counted, listed
from eomgen.cli.info import OPERATIONS
from eomgen.cli.options import (
    assignments,
    check_assigned,
    completed_methods,
    debug_option,
    folder_option,
    in_units,
    json_option,
    scene_options,
    set_option,
    terms_option,
)
from eomgen.cli.printing import print_json, print_table, say
from eomgen.cli.running import say_notes, stand_in
from eomgen.errors import Problem, UsageError
from eomgen.scene.sources.register import takes

if TYPE_CHECKING:
    from eomgen.scene.scene import Scene


def _machines(context: click.Context, parameter: click.Parameter, start: str) -> list[str]:
    """Return the names of machines that begin so."""
    from eomgen.toolchain.cross import TARGETS  # noqa: PLC0415  # in a shell's completion only

    return [name for name in TARGETS if name.startswith(start)]


@click.command()
@folder_option
@terms_option
@click.option(
    "--target", "targets", multiple=True, default=["c"], help="The language; a wrong name gets a list of all."
)
@click.option("--method", shell_complete=completed_methods, help="Whose stepper is written; the scene's by default.")
@click.option(
    "--real", type=click.Choice(["double", "float"]), help="Number type of the compile command; the scene's by default."
)
@click.option(
    "--only", type=click.Choice(["controller"]), help="The controller of the scene alone: signals in, commands out."
)
@click.option("--uniform", is_flag=True, help="All functions and steps with one signature, too, for every model.")
@click.option(
    "--for",
    "machines",
    multiple=True,
    metavar="MACHINE",
    shell_complete=_machines,
    help="Make a program or an object for this machine, too: aarch64-linux, riscv64-linux, x86_64-linux,"
    " x86_64-windows, arm64-macos, wasm32 or cortex-m4; may be repeated. Needs eomgen[compiler].",
)
@set_option
@scene_options
@json_option
@debug_option
def generate(
    scene: str,
    folder: str,
    terms: list[str] | None,
    method: str | None,
    targets: Sequence[str],
    real: str | None,
    only: str | None,
    uniform: bool,
    machines: Sequence[str],
    parameters: Sequence[str],
    as_json: bool,
    **reading: Any,
) -> None:
    """Write the model of a SCENE and its stepper as a folder of C that needs only a C99 compiler.

    The files serve all number types: eomgen_real is double without a macro, float with -DEOMGEN_REAL_FLOAT; functions
    without the stepper also take -DEOMGEN_REAL_COMPLEX (complex steps) and -DEOMGEN_REAL_LANES (several states at once,
    -DEG_LANES=4, 8 or 16). --set NAME=VALUE makes values the defaults of the C. manifest.json has the command that
    compiles the folder, and names and units of parameters, inputs, states and outputs.
    """
    from eomgen.pipeline import documents, generation  # noqa: PLC0415  # SymPy comes with it
    from eomgen.pipeline.front_end import other_document  # noqa: PLC0415

    if len(targets) > 1:
        raise UsageError(Problem("--target", f"{listed(targets)} have a folder each [E2250]", "a call for each"))
    (target,) = targets
    _check_machines(machines, target)
    other = other_document(scene, reading)
    described = documents.load_scene(scene, **reading) if other is None else other[1]
    values: Mapping[str, float | str] = assignments("--set", parameters)
    if other is None:
        say_notes(described)
        check_assigned(described, values, {}, robot=takes(Path(scene), "tunable"))
        values = in_units("--set", values, described.parameters)
    files = generation.generate(
        described, folder, terms, method, target=target, real=real, parameters=values, only=only, uniform=uniform
    )
    if machines:
        whole = only is None and target == "c" and other is None
        step = _work_of_step(described, method) if whole else {}
        _print_machines(Path(folder), machines, step, [str(file) for file in files], as_json=as_json)
    elif as_json:
        print_json([str(file) for file in files])
    else:
        click.echo("\n".join(map(str, files)))
    stepped = any(file.name.endswith("_step.c") for file in files) and other is None
    steps = stand_in(described, method) if stepped else ""
    say(f"{counted(len(files), 'file')}{steps}; README.md there says how to compile them")


def _check_machines(machines: Sequence[str], target: str) -> None:
    """Raise UsageError for an unknown machine, or for a language that is not C, unless the language is named as the
    machine; ToolchainError without zig."""
    if not machines:
        return
    from eomgen.toolchain.cross import cross_target, zig  # noqa: PLC0415  # few folders are for other machines

    for name in machines:
        cross_target(name)
    if target not in ("c", *machines):
        raise UsageError(Problem("--for", f"programs are made of C, not of {target} [E0165]", "--target c"))
    zig()


def _work_of_step(scene: Scene, method: str | None) -> dict[str, Any]:
    """Return the operations per step of a method, or per call of each function without a count of steps."""
    from eomgen.pipeline.methods import method_of  # noqa: PLC0415
    from eomgen.pipeline.step_operations import operations_of_calls, operations_of_step  # noqa: PLC0415

    name = method_of(scene, method)
    try:
        return operations_of_step(scene, name)
    except UsageError:
        return operations_of_calls(scene, name)


def _print_machines(
    folder: Path, machines: Sequence[str], step: Mapping[str, Any], files: Sequence[str], *, as_json: bool
) -> None:
    """Make the files for other machines, and print their sizes and the work of a step."""
    from eomgen.toolchain.cross import cross_build, cross_target  # noqa: PLC0415  # few folders are for other machines

    made = [cross_build(folder, name) for name in dict.fromkeys(machines)]
    if as_json:
        print_json(
            {"files": files, "machines": [item._asdict() | {"file": str(item.file)} for item in made], "step": step}
        )
        return
    rows = [
        (item.target, item.file.name, item.size, item.code, item.stack, " ".join(cross_target(item.target).runner))
        for item in made
    ]
    header = ("machine", "file", "bytes", "code of the model", "deepest stack", "runs elsewhere by")
    print_table("Files for other machines, bytes", header, rows, numeric=(2, 3, 4))
    if "total" in step:
        total = step["total"]
        each = ", ".join(f"{total[key]} {key}" for key in OPERATIONS)
        say(f"a step of {step['method']}: {each}, the same in every step")
    elif step:
        calls = [f"{part['function']} {sum(part[key] for key in OPERATIONS)}" for part in step["parts"]]
        say(f"operations of each function that steps of {step['method']} call: {', '.join(calls)}")
