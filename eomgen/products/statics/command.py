"""Load paths and buckling loads of ``eomgen equilibrium``, by the options ``--path`` and ``--buckling``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.json_text import json_text
from eomgen.base.progress import waiting
from eomgen.cli import INTERRUPTED
from eomgen.cli.parts import AddedOption, RestPart
from eomgen.cli.printing import print_json, print_table, say
from eomgen.errors import NumericalError, Problem, UsageError

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model
    from eomgen.products.statics.equilibrium_path import EquilibriumPath
    from eomgen.products.statics.path_following import BucklingLoads


class LoadPaths(RestPart):
    """``--path``, ``--over`` and ``--buckling`` of ``eomgen equilibrium``, with ``--plot`` and ``--out``."""

    OPTIONS = (
        AddedOption(
            "--path",
            "along",
            behind="--out",
            metavar="NAME=FROM:TO",
            help="Follow equilibria while a parameter goes to a value.",
        ),
        AddedOption(
            "--over",
            behind="--path",
            multiple=True,
            metavar="COLUMN",
            help="Column to draw the parameter over; may be repeated.",
        ),
        AddedOption("--buckling", behind="--all", metavar="NAME[=AT]", help="Linear buckling loads about a preload."),
    )

    def __init__(self, options: Mapping[str, Any]) -> None:
        """Read and check the options of load paths and buckling loads. Raises UsageError."""
        along, buckling, figure = options["along"], options["buckling"], options.get("figure")
        self.over, self.out, self.answers = options["over"], options["path"], along is not None or buckling is not None
        self.figure: str | None = figure
        if along is None and self.over:
            raise UsageError(Problem("--over", "it belongs to a path [E0150]", "--path load=0:10"))
        if along is None and buckling is not None and figure:
            fault = "it belongs to a path, or to an equilibrium alone [E0153]"
            raise UsageError(Problem("--plot", fault, "--path load=0:10"))
        if along is not None and buckling is not None:
            raise UsageError(Problem("--buckling", "it is asked for together with --path [E0155]", "one of them"))
        endings = (".csv", ".json") if along is not None else (".json",)
        if self.answers and self.out is not None and Path(self.out).suffix not in endings:
            results = "a path is" if along is not None else "buckling loads are"
            fault = f"{results} written as {' or '.join(endings)} [E0151]"
            raise UsageError(Problem(f"--out {self.out}", fault, f"--out result{endings[0]}"))
        self.along = None if along is None else _range(along)
        self.buckling = None if buckling is None else _preload(buckling)

    def answer(self, model: Model, arguments: Mapping[str, Any], as_json: bool) -> int:
        """Print and write the requested path or buckling loads of a model, and return the exit code; 0 if neither is
        requested. ``arguments`` are for the model's methods. Raises NumericalError if a path does not arrive, after it
        is written."""
        arguments = {**arguments, "initial": arguments["initial"] or None}
        if self.buckling is not None:
            with waiting(f"{model.name}: buckling loads"):
                result = model.buckling_loads(*self.buckling, **arguments)
            return self._buckling(result, model, as_json)
        if self.along is None:
            return 0
        name, start, to = self.along
        path = model.equilibrium_path(name, to, start, progress=True, **arguments)
        for column in self.over:
            path.column(column)
        files = [] if self.out is None else [path.save(self.out)]
        if self.figure is not None:
            path.plot(self.over, path=self.figure)
            files.append(Path(self.figure))
        if as_json:
            print_json({"scene": model.name, **path.to_dict()})
        else:
            self._table(path, model.name)
        say(f"{len(path.values)} equilibria; {path.message}{_written(files)}")
        if path.interrupted:
            return INTERRUPTED
        if not path.success:
            hint = "the part of the path that was found, a smaller range, or more elements"
            raise NumericalError(Problem("equilibrium --path", path.message, hint))
        return 0

    def _table(self, path: EquilibriumPath, name: str) -> None:
        shown = self.over or (path.largest_column,)
        rows = []
        for item in path.critical:
            of_columns = (f"{item.columns.get(column, item.value):.6g}" for column in shown)
            rows.append((item.kind, f"{item.value:.9g}", *of_columns, item.components[0]))
        if rows:
            heading = ("critical point", path.parameter, *shown, "along")
            print_table(f"{name}: critical points", heading, rows, numeric=range(1, 2 + len(shown)))
        ends = [
            (which, f"{path.values[row]:.9g}", *(f"{path.column(column)[row]:.6g}" for column in shown))
            for which, row in (("first", 0), ("last", -1))
        ]
        print_table(f"{name}: path", ("equilibrium", path.parameter, *shown), ends, numeric=range(1, 2 + len(shown)))

    def _buckling(self, loads: BucklingLoads, model: Model, as_json: bool) -> int:
        """Print buckling loads, write them to a file if one is named, and return the exit code."""
        data = {
            "scene": model.name,
            "parameter": loads.parameter,
            "unit": loads.unit,
            "at": loads.at,
            "values": loads.values.tolist(),
            "reversed": list(loads.reversed),
            "modes": [dict(zip(model.v_names, mode, strict=True)) for mode in loads.modes.T.tolist()],
        }
        if self.out is not None:
            from eomgen.base.files import write_text  # noqa: PLC0415  # for files only

            write_text(Path(self.out), json_text(data) + "\n")
        if as_json:
            print_json(data)
        else:
            rows = [
                (f"{value:.9g}", "reversed" if turned else "", ", ".join(names[:3]))
                for value, turned, names in zip(loads.values.tolist(), loads.reversed, loads.components, strict=True)
            ]
            heading = (f"{loads.parameter}{f', {loads.unit}' if loads.unit else ''}", "load", "largest displacements")
            title = f"{model.name}: linear buckling about {loads.parameter} = {loads.at:.6g}"
            print_table(title, heading, rows, numeric=(0,))
        say(f"{len(loads.values)} buckling loads{_written([Path(self.out)] if self.out else [])}")
        return 0


def _written(files: list[Path]) -> str:
    return f"\nwritten to {', '.join(map(str, files))}" if files else ""


def _range(text: str) -> tuple[str, float, float]:
    name, equals, ends = text.partition("=")
    first, colon, last = ends.partition(":")
    try:
        if not (equals and colon and name.strip()):
            raise ValueError
        return name.strip(), float(first), float(last)
    except ValueError:
        fault = "a name and two numbers are needed [E0156]"
        raise UsageError(Problem(f"--path {text}", fault, "--path load=0:10")) from None


def _preload(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    try:
        return name.strip(), float(value) if equals else 0.0
    except ValueError:
        hint = f"--buckling {name}=0"
        raise UsageError(Problem(f"--buckling {text}", f"{value!r} is not a number [E0123]", hint)) from None
