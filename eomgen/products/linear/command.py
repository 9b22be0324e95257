"""``eomgen linearize``: modes and stability of the linear model, its matrices, root locus, Campbell diagram,
frequency responses, rides on random roads."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from eomgen.base.data import dataclass
from eomgen.base.json_text import json_text
from eomgen.base.messages import counted
from eomgen.base.products import objects_of
from eomgen.base.progress import waiting
from eomgen.base.rounding import COMPUTED
from eomgen.cli import INTERRUPTED
from eomgen.cli.options import (
    any_kind_option,
    assignments,
    debug_option,
    initial_option,
    input_option,
    json_option,
    optional_folder,
    profile_option,
    scene_options,
    set_option,
    time_option,
)
from eomgen.cli.printing import building, print_json, print_table, say, say_note
from eomgen.cli.running import read_scene
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model
    from eomgen.products.linear.campbell_plot import Campbell, CampbellView
    from eomgen.products.linear.eigenvalue_loci import RootLocus
    from eomgen.products.linear.linearization import Linearization
    from eomgen.products.linear.modes import Modes
    from eomgen.products.linear.spectra import PowerSpectrum, RideTable


Read = TypeVar("Read")


def _read(option: str, text: str, reader: Callable[[str], Read], fault: str, example: str) -> Read:
    """Return the value that `reader` returns for the text of an option. Raises UsageError with a fault and an example
    if it raises ValueError."""
    try:
        return reader(text)
    except ValueError:
        raise UsageError(Problem(f"{option} {text}", fault, example)) from None


def _positive(text: str, number: Callable[[str], Any] = float) -> tuple[Any, ...]:
    """Return the positive, finite numbers between the commas of a text, each read by `number`; raises ValueError."""
    numbers = tuple(map(number, text.split(",")))
    if not all(0.0 < value < math.inf for value in numbers):
        raise ValueError
    return numbers


def _pair(text: str) -> tuple[str, str]:
    """Return the texts before and after a colon, stripped; raises ValueError if one is empty."""
    first, _, second = (part.strip() for part in text.partition(":"))
    if not (first and second):
        raise ValueError
    return first, second


def _check_absent(fault: str, example: str, **options: object) -> None:
    """Raise UsageError if one of some options is given."""
    for name, value in options.items():
        if value:
            raise UsageError(Problem(f"--{name.replace('_', '-')}", fault, example))


@dataclass(frozen=True)
class CampbellRequest:
    """Options ``--campbell``, ``--orders``, ``--whirl``, ``--modes`` and ``--speed-unit`` of the command, as values.
    `speed` is the name of the parameter or velocity with its `values`, `orders` multiples of the speed (None for the
    default), `whirl` pairs of deflections."""

    speed: str
    values: list[float]
    orders: tuple[float, ...] | None
    #: Letter of the orders: ``x`` or ``P``.
    letter: str
    whirl: list[tuple[str, str]]
    #: Numbers of the table of modes.
    modes: tuple[int, ...] | None
    speed_unit: str | None

    @classmethod
    def read(
        cls, sweep: str | None, orders: str | None, whirl: tuple[str, ...], modes: str | None, speed_unit: str | None
    ) -> CampbellRequest | None:
        """Return the options of a Campbell diagram read from their texts; None without ``--campbell``. Raises
        UsageError for unreadable options, and options of the diagram without ``--campbell``."""
        if sweep is None:
            diagram_options = {"orders": orders, "whirl": whirl, "modes": modes, "speed_unit": speed_unit}
            _check_absent("it belongs to a Campbell diagram [E0166]", "--campbell spin=0:300:31", **diagram_options)
            return None
        multiples, numbers = None, None
        if orders is not None:
            fault, example = "positive numbers are needed [E0169]", "--orders 1,2"
            plain = lambda text: _positive(text, lambda part: float(part.strip().rstrip("xXpP")))  # noqa: E731
            multiples = _read("--orders", orders, plain, fault, example)
        if modes is not None:
            fault, example = "numbers of modes from 1 on are needed [E0170]", "--modes 1,2,4"
            numbers = _read("--modes", modes, lambda text: _positive(text, int), fault, example)
        pairs = [_read("--whirl", text, _pair, "two deflections are needed [E0167]", "--whirl x:y") for text in whirl]
        letter = "P" if "p" in (orders or "").lower() else "x"
        speed, values = _sweep(sweep, "--campbell")
        if not values[0] < values[-1]:
            option = f"--campbell {sweep}: values"
            raise UsageError(Problem(option, "they do not increase [E0047]", "the smallest first"))
        return cls(speed, values, multiples, letter, pairs, numbers, speed_unit)

    def view(self, diagram: Campbell, band: tuple[float, float] | None) -> CampbellView:
        """Return the view of the diagram to draw, with the `band` of frequencies (Hz), modes, speed unit and letter of
        orders. Numbers of modes that do not oscillate are left out with a printed note; UsageError if none of them
        oscillates."""
        from eomgen.products.linear.campbell_plot import CampbellView  # noqa: PLC0415

        columns = {diagram.number(mode): mode for mode in range(diagram.eigenvalues.shape[1])}
        missing = " or ".join(str(number) for number in self.modes or () if number not in columns)
        modes = None if self.modes is None else tuple(columns[number] for number in self.modes if number in columns)
        if missing and not modes:
            fault = f"there is no mode {missing} that oscillates in the diagram [E0168]"
            raise UsageError(Problem("--modes", fault, f"some of {', '.join(map(str, sorted(columns)))}"))
        if missing:
            say_note(f"--modes: no mode {missing} oscillates in the diagram, so the picture is without [W0017]")
        view = CampbellView(band, modes, None, self.speed_unit, self.letter)
        view.check(diagram)
        return view


def _ride(
    rides: tuple[str, ...], classes: str | None, speeds: str | None, band: tuple[float, float] | None
) -> dict[str, Any] | None:
    """Return the arguments of ``Linearization.ride_table`` read from their texts; None without ``--ride``. Raises
    UsageError for unreadable speeds, and ``--classes`` or ``--speeds`` without ``--ride``."""
    if not rides:
        fault, example = "it belongs to a ride [E0171]", "--ride body_acceleration"
        _check_absent(fault, example, classes=classes is not None, speeds=speeds is not None)
        return None
    outputs: dict[str, str | None] = {}
    for text in rides:
        name, colon, weighting = text.rpartition(":")
        outputs[(name if colon else text).strip()] = weighting if colon else None
    wanted: tuple[float, ...] = ()
    if speeds is not None:
        fault, example = "positive speeds in m/s are needed [E0174]", "--speeds 10,20,30"
        wanted = _read("--speeds", speeds, _positive, fault, example)
    of_road = [] if classes is None else [part.strip() for part in classes.split(",")]
    return {"outputs": outputs, "classes": of_road, "speeds": wanted, "band": band}


@click.command()
@click.option("--at", metavar="STATE", help="equilibrium, steady, initial, or a time of a run in s.")
@time_option
@any_kind_option
@click.option(
    "--velocity", "velocities", multiple=True, metavar="NAME=VALUE", help="Of a steady motion; may be repeated."
)
@click.option("--coordinate", "held", multiple=True, metavar="NAME=VALUE", help="Of a steady motion; may be repeated.")
@set_option
@initial_option
@input_option
@optional_folder("Write modes, matrices and figures to this folder, too.")
@click.option("--root-locus", metavar="NAME=FROM:TO:N", help="Roots over a parameter; N:log for equal ratios.")
@click.option(
    "--response", "responses", multiple=True, metavar="INPUT:OUTPUT", help="A frequency response; may be repeated."
)
@click.option("--band", metavar="FROM:TO", help="Of frequency responses, rides and drawn Campbell diagrams, in Hz.")
@click.option(
    "--ride", "rides", multiple=True, metavar="OUTPUT[:Wk]", help="Rms on the scene's random roads; may be repeated."
)
@click.option(
    "--campbell", "diagram", metavar="NAME=FROM:TO:N", help="Damped frequencies over a speed, critical speeds."
)
@click.option("--orders", metavar="N,N,...", help="Of a Campbell diagram, multiples of the speed: 1,2 or 1P,2P.")
@click.option("--whirl", multiple=True, metavar="X:Y", help="Deflections whose orbits show the sense; may be repeated.")
@click.option(
    "--multiblade", multiple=True, metavar="ROTOR:NAME,NAME,...", help="Equal blades by azimuth; may be repeated."
)
@click.option("--modes", metavar="N,N,...", help="Of the picture of a Campbell diagram, numbered as the table.")
@click.option("--speed-unit", type=click.Choice(["rad/s", "rpm", "Hz"]), help="Of the picture of a Campbell diagram.")
@click.option("--classes", metavar="A,B,...", help="Road classes of rides; else the scene's road.")
@click.option("--speeds", metavar="V,V,...", help="Speeds of rides in m/s; else the scene's.")
@profile_option
@scene_options
@json_option
@debug_option
def linearize(scene: str, folder: str | None, as_json: bool, **options: Any) -> int:
    """Print the modes of a SCENE's linear model, by default about its equilibrium, and whether it is stable."""
    request = _Request(scene, options)
    with waiting(f"{request.model.name}: linear model"):
        lin = request.linearize({}, None)
    for pair in request.pairs:
        lin.frequency_response([], *pair)
    if folder is None and (request.sweep or request.pairs):
        fault = "there is no folder to draw roots or responses to [E0175]"
        raise UsageError(Problem("eomgen linearize", fault, "--out DIR"))
    # imported when the arguments are known to be fine
    from eomgen.products.linear import files as linear_files  # noqa: PLC0415

    request.ride(lin)
    ends = request.campbell(lin)
    data = linear_files.to_json_data(lin, request.model.name, request.table, request.diagram)
    files = []
    if folder is not None:
        ends = ends or request.roots()
        files = request.write(lin, data, Path(folder))
    if as_json:
        print_json({**data, "files": [file.name for file in files]})
    else:
        _print(lin, request.model.name)
        _print_tables(request.table, request.diagram)
    written = f"written to {folder}: {', '.join(file.name for file in files)}" if files else ""
    say("\n".join(filter(None, (_stability_text(lin), str(lin.multiblade or ""), written))))
    if ends:
        say(ends)
        return INTERRUPTED
    return 0


class _Request:
    """The compiled model of a scene, the operating point and options of its linear models, read from the command line,
    and the results that are asked for."""

    #: Ride and its spectra, Campbell diagram and its view, roots; None and empty if not asked for.
    table: RideTable | None = None
    spectra: Sequence[PowerSpectrum] = ()
    diagram: Campbell | None = None
    view: CampbellView | None = None
    locus: RootLocus | None = None

    def __init__(self, path: str, options: dict[str, Any]) -> None:
        """Read the scene and build its model, for as many linear models as the sweep and the Campbell diagram have
        values. Takes its own options out of `options`. Raises UsageError for options that do not go together."""
        from eomgen.pipeline import pipeline  # noqa: PLC0415

        self.sweep = None if (text := options.pop("root_locus")) is None else _sweep(text)
        drawn_alone = options["diagram"] is not None and not (options["responses"] or options["rides"])
        self.band = _band(options.pop("band"), from_zero=drawn_alone)
        fault, example = "an input and an output are needed [E0186]", "--response road:body_acceleration"
        self.pairs = [_read("--response", text, _pair, fault, example) for text in options.pop("responses")]
        self.rides = _ride(options.pop("rides"), options.pop("classes"), options.pop("speeds"), self.band)
        words = ("diagram", "orders", "whirl", "modes", "speed_unit")
        self.asked = CampbellRequest.read(*(options.pop(name) for name in words))
        self.at, self.time = _state(options.pop("at")), options.pop("time")
        self.any_kind = options.pop("any_kind")
        self.multiblade = _blades(options.pop("multiblade"))
        self.velocities = assignments("--velocity", options.pop("velocities"))
        self.held = assignments("--coordinate", options.pop("held"))
        if (self.velocities or self.held) and self.at != "steady":
            option = "--velocity" if self.velocities else "--coordinate"
            raise UsageError(Problem(option, "it belongs to a steady motion [E0176]", "--at steady"))
        described = read_scene(path, options)
        self.parameters, self.inputs, self.initial = options["parameters"], options["inputs"], options["initial"]
        points = 1 + (len(self.sweep[1]) if self.sweep else 0) + (len(self.asked.values) if self.asked else 0)
        with building(described.name):
            profile = options.pop("profile")
            self.model: Model = (
                pipeline.build_for_rest(described, profile, points=points)
                if self.at in (None, "equilibrium")
                else pipeline.build(described, real="double", profile=profile)
            )

    def linearize(self, changes: dict[str, float], before: Linearization | None) -> Linearization:
        """Return the linear model at the requested state, with `changes` of tunable parameters by name. The search for
        an equilibrium begins at the state of the model `before`, if there is one. A requested time of a run is
        simulated first. Raises UsageError for multiblade coordinates at a time of a run."""
        parameters = {**self.parameters, **changes}
        if isinstance(self.at, float):
            if self.multiblade is not None:
                fault = "multiblade coordinates need a steady motion, and --at names a time of a run [E0177]"
                raise UsageError(Problem("--multiblade", fault, "--at steady"))
            options = {"parameters": parameters, "initial": self.initial, "inputs": self.inputs or None}
            return self.model.simulate(self.at, error_estimate=False, **options).linearize(self.at)
        from eomgen.products.linear.analyses.parameter_sweeps import state_of  # noqa: PLC0415

        initial: Any = self.initial
        if before is not None and self.at != "initial":
            initial = state_of(before) or initial
        options = {"parameters": parameters, "u": self.inputs or None}
        if self.velocities or self.held:
            # checked there
            result = self.model.steady_motion(self.velocities, self.held, initial, t=self.time, **options)  # type: ignore[arg-type]
            return self.model.linearize(at=result, multiblade=self.multiblade, **options)
        options |= {"t": self.time, "multiblade": self.multiblade}
        return self.model.linearize(at=self.at, initial=initial, any_kind=self.any_kind, **options)

    def ride(self, lin: Linearization) -> None:
        """Set the table of the ride that is asked for on the scene's random roads, and the spectra of its outputs."""
        if self.rides is None:
            return
        from eomgen.products.linear.spectra import MeasuredRoad  # noqa: PLC0415

        excitation = self.model.road_excitation()
        if self.rides["classes"] and isinstance(excitation.road, MeasuredRoad):
            fault = "the road of the scene is a measured one, which has a spectrum of its own, and no class [E2187]"
            raise UsageError(Problem(f"--classes {','.join(self.rides['classes'])}", fault, "without --classes"))
        self.table = lin.ride_table(excitation, **self.rides)
        self.spectra = [lin.psd(name, excitation) for name in self.table.outputs]

    def campbell(self, lin: Linearization) -> str:
        """Set the Campbell diagram that is asked for and its view, and return a line that reports Ctrl-C, empty without
        an interruption: then the diagram holds the values computed so far, or is None. The modes of the linear model
        `lin` number the modes of the diagram."""
        wanted = self.asked
        if wanted is None:
            return ""
        options: dict[str, Any] = {"parameters": self.parameters, "initial": self.initial or None, "t": self.time}
        motion = {name: value for name, value in self.velocities.items() if name != wanted.speed}
        options |= {"at": self.at} if wanted.speed in self.model.parameters else {}
        options |= {"velocities": motion, "coordinates": self.held, "u": self.inputs or None}
        options |= {"multiblade": self.multiblade, "reference": lin}
        options |= {"orders": wanted.orders, "whirl": wanted.whirl, "progress": True}
        try:
            self.diagram = result = self.model.campbell(wanted.speed, wanted.values, **options)
        except KeyboardInterrupt:
            return "interrupted before there was a Campbell diagram"
        self.view = wanted.view(result, self.band)
        values = f"{len(result.values)} of {len(wanted.values)} values of {wanted.speed}"
        cut = f"interrupted: the Campbell diagram has {values} and {counted(len(result.crossings), 'crossing')}"
        return cut if result.interrupted else ""

    def roots(self) -> str:
        """Set the root locus that is asked for, and return a line that reports Ctrl-C, empty without an interruption:
        then the locus holds the values computed so far, or is None."""
        from eomgen.base.progress import show_progress  # noqa: PLC0415
        from eomgen.products.linear.eigenvalue_loci import root_locus  # noqa: PLC0415

        if self.sweep is None:
            return ""
        parameter, values = self.sweep
        try:
            with show_progress(True, f"{self.model.name}: roots over {parameter}") as report:
                of_value = lambda value, last: self.linearize({parameter: value}, last)  # noqa: E731
                self.locus = locus = root_locus(parameter, values, of_value, report)
        except KeyboardInterrupt:
            return "interrupted before there was a root locus"
        counted_values = f"{len(locus.values)} of {len(values)} values of {parameter}"
        return f"interrupted: the root locus has {counted_values}" if locus.interrupted else ""

    def write(self, lin: Linearization, data: dict[str, Any], folder: Path) -> list[Path]:
        """Write modes (JSON, CSV), matrices (NPZ), all results and their figures to a folder, and return the paths of
        the files. Everything is computed before the first file is made; `data` is the content of modes.json."""
        import numpy as np  # noqa: PLC0415

        from eomgen.base.files import make_folder, write_text  # noqa: PLC0415
        from eomgen.products.linear import files as linear_files  # noqa: PLC0415
        from eomgen.products.linear import plots  # noqa: PLC0415
        from eomgen.products.linear.campbell_plot import draw_campbell  # noqa: PLC0415
        from eomgen.products.linear.eigenvalue_loci import draw_root_locus  # noqa: PLC0415
        from eomgen.products.linear.modes import draw_modes  # noqa: PLC0415

        name, modes, locus = self.model.name, lin.modes(), self.locus
        frequencies = np.geomspace(*(self.band or modes.band), 600) if self.pairs else np.zeros(0)
        responses = {pair: lin.frequency_response(2.0 * math.pi * frequencies, *pair) for pair in self.pairs}
        make_folder(folder)
        write_text(folder / "modes.json", json_text(data) + "\n")
        files = [folder / "modes.json", linear_files.write_modes(modes, folder / "modes.csv")]
        files.append(linear_files.write_matrices(lin, name, folder / "matrices.npz"))
        if len(modes):
            files.append(draw_modes(modes, name, folder / "modes.png"))
        if np.any(modes.oscillating) and (self.model.description.exact_beams or self.model.library.layout["axes"]):
            files += self._shapes(lin, modes, folder / "mode_shapes.png")
        if locus is not None:
            units = {item.name: item.unit for item in self.model.scene.parameters}
            files.append(linear_files.write_root_locus(locus, folder / "root_locus.csv"))
            files.append(draw_root_locus(locus, units.get(locus.parameter, ""), name, folder / "root_locus.png"))
        if responses:
            files.append(linear_files.write_responses(frequencies, responses, folder / "responses.csv"))
            files.append(plots.draw_responses(frequencies, responses, lin.names.units, name, folder / "responses.png"))
        if self.diagram is not None and self.view is not None:
            files.append(linear_files.write_campbell(self.diagram, folder / "campbell.csv"))
            files.append(draw_campbell(self.diagram, name, folder / "campbell.png", self.view))
        if self.table is not None:
            files.append(linear_files.write_ride(self.table, folder / "ride.csv"))
            files.append(linear_files.write_spectra(self.spectra, folder / "spectra.csv"))
            files.append(plots.draw_spectra(self.spectra, name, folder / "spectra.png"))
        return files

    def _shapes(self, lin: Linearization, modes: Modes, path: Path) -> list[Path]:
        """Draw the shapes of the oscillating modes with the registered ``eomgen.mode_figures``; return the paths of the
        files."""
        import numpy as np  # noqa: PLC0415

        shown = np.flatnonzero(modes.oscillating)
        titles = [f"mode {k + 1}: {modes.frequency[k]:.4g} Hz undamped" for k in shown]
        p = self.model.parameter_array(self.parameters)
        shapes = modes.shapes[:, shown].real
        if lin.multiblade is not None:
            shapes = lin.multiblade.components @ shapes
        figures = objects_of("eomgen.mode_figures")
        return [draw(self.model, lin.reference.q, lin.reference.t, p, shapes, titles, path) for draw in figures]


def _print_tables(table: RideTable | None, diagram: Campbell | None) -> None:
    """Print the root mean squares on random roads, and the crossings of a Campbell diagram with orders; without output
    for None."""
    if table is not None:
        numeric = tuple(range(1, len(table.headings)))
        print_table("root mean squares on random roads", table.headings, table.rows, numeric=numeric)
    if diagram is not None:
        from eomgen.products.linear.campbell_plot import numbering  # noqa: PLC0415

        if not diagram.orders:
            say(f"no orders: {diagram.parameter} is not a speed of rotation (unit {diagram.unit or 'not given'})")
            return
        words = f"crossings with orders; modes: {numbering(diagram)}"
        print_table(words, diagram.headings, diagram.rows, numeric=(0, 1, 2, 3, 4))


def _print(lin: Linearization, name: str) -> None:
    """Print a table of at most 40 modes of a linear model: frequency, damping ratio, eigenvalue, largest
    coordinates. Oscillating modes come first; a line counts the modes that are not shown. `name` is the model's name
    in the heading."""
    from eomgen.products.linear.modes import HEADINGS, oscillating_first, table_row  # noqa: PLC0415

    modes, most = lin.modes(), 40
    order = oscillating_first(modes, most)
    about = f"{name} about the {lin.reference.what} at t = {lin.reference.t:.6g} s"
    print_table(about, HEADINGS, [table_row(modes, k) for k in order[:most]], numeric=(0, 1, 2, 3))
    if hidden := order[most:]:
        oscillate = sum(bool(modes.oscillating[k]) for k in hidden)
        say(f"{len(hidden)} more with --json: {oscillate} that oscillate, {len(hidden) - oscillate} that do not")


def _blades(texts: Sequence[str]) -> dict[str, list[tuple[str, ...]]] | None:
    """Return the groups of equal coordinates by name of their rotor, from texts ``ROTOR:NAME,NAME,...``. None without
    texts. Raises UsageError for a text without a rotor or with an empty name."""
    groups: dict[str, list[tuple[str, ...]]] = {}
    for text in texts:
        rotor, colon, names = text.partition(":")
        group = tuple(name.strip() for name in names.split(","))
        if not colon or not rotor.strip() or not all(group):
            fault = "a rotor and its blades are needed [E0178]"
            raise UsageError(Problem(f"--multiblade {text}", fault, "--multiblade spin:flap_1,flap_2,flap_3"))
        groups.setdefault(rotor.strip(), []).append(group)
    return groups or None


def _stability_text(lin: Linearization) -> str:
    """Return a sentence that says whether a linear model is stable, with the rate of the slowest or the growing
    mode."""
    import numpy as np  # noqa: PLC0415

    modes = lin.modes()
    if not len(modes.eigenvalues):
        return "no mode: drives and constraints determine the whole motion"
    # steady motions and equilibria keep the linear model, states that accelerate leave the point of linearization
    accelerating = np.any(np.abs(lin.reference.a) > COMPUTED)
    frozen = f", frozen at t = {lin.reference.t:.6g} s in a state that accelerates" if accelerating else ""
    match modes.stability:
        case "stable":
            slowest = -float(max(modes.eigenvalues.real))
            return f"stable{frozen}: every mode decays, the slowest with e^(-{slowest:.4g} t)"
        case "unstable":
            k = int(modes.eigenvalues.real.argmax())
            return f"unstable{frozen}: mode {k + 1} grows with e^({modes.eigenvalues[k].real:.4g} t)"
        case _:
            count = int(sum(abs(modes.eigenvalues.real) <= modes.uncertainty))
            return f"neither stable nor unstable{frozen}: {counted(count, 'mode')} without decay or growth"


def _state(text: str | None) -> str | float | None:
    """Return ``--at``: None, ``equilibrium``, ``steady`` or ``initial`` unchanged, or else a positive time in s. Raises
    UsageError for any other text."""
    if text is None or text in ("equilibrium", "steady", "initial"):
        return text
    fault = "this is neither a state nor a positive time [E0179]"
    return float(_read("--at", text, _positive, fault, "--at equilibrium, --at steady, --at initial, or --at 2.5")[0])


def _sweep(text: str, option: str = "--root-locus") -> tuple[str, list[float]]:
    """Return the name and the values of ``NAME=FROM:TO:N`` or ``NAME=FROM:TO:N:log``. Values are evenly spaced, or have
    equal ratios with ``log``. Raises UsageError for unreadable texts, values with units, fewer than 2 or more than
    10000 values, and ratios of values that are not positive; `option` serves messages."""

    def read(text: str) -> tuple[str, list[float]]:
        name, _, rest = text.partition("=")
        parts = rest.split(":")
        logarithmic = len(parts) == 4 and parts[3] == "log"
        if not name.strip() or not (len(parts) == 3 or logarithmic):
            raise ValueError
        first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
        if not (math.isfinite(first) and math.isfinite(last)) or not 2 <= count <= 10_000:
            raise ValueError
        steps = [k / (count - 1) for k in range(count)]
        if not logarithmic:
            return name.strip(), [first + (last - first) * s for s in steps]
        if not (first > 0.0 and last > 0.0):
            fault = "values in equal ratios must be positive [E0184]"
            raise UsageError(Problem(f"{option} {text}", fault, "values without :log"))
        return name.strip(), [first * (last / first) ** s for s in steps]

    fault = "a parameter, two finite values without units, and their number from 2 to 10000 are needed [E0181]"
    return _read(option, text, read, fault, f"{option} damping=10:1000:40, or damping=10:1000:40:log")


def _band(text: str | None, *, from_zero: bool = False) -> tuple[float, float] | None:
    """Return the lower and the upper frequency of ``--band FROM:TO`` in Hz; None without a text. The lower one may be
    zero if `from_zero` (the picture of a Campbell diagram alone). Raises UsageError otherwise."""
    if text is None:
        return None

    def read(text: str) -> tuple[float, float]:
        low, high = (float(part) for part in text.split(":"))
        if not (low > 0.0 or (from_zero and low == 0.0)) or not low < high < math.inf:
            raise ValueError
        return low, high

    least = "frequencies in Hz from 0 on" if from_zero else "positive frequencies in Hz"
    fault = f"two {least} are needed, the lower first [E0187]"
    return _read("--band", text, read, fault, "--band 0:5" if from_zero else "--band 0.1:50")
