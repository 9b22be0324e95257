"""``Tuned``: the configuration that meets a demand at the least cost, its verification, and its scene file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.base.files import read_file, write_text
from eomgen.errors import FileError, Problem, UsageError
from eomgen.products.studies.tuning.judge import VerificationRun
from eomgen.products.studies.work_precision.axes import Configuration
from eomgen.products.studies.work_precision.result import short_duration

_SECTION = re.compile(r"^\s*\[([^\[\]]+)\]\s*(#.*)?$")
_BODY = re.compile(r"^bodies\.([A-Za-z0-9_-]+)$")
#: Keys of a scene file on the method of a run, which are removed unless among the new keys.
_OF_METHODS = (
    "method",
    "step",
    "rho_inf",
    "alpha",
    "beta",
    "gamma",
    "tolerance",
    "order",
    "record_every",
    "settings",
    "real",
)


def with_settings(path: Path | None, simulation: Mapping[str, Any], coordinates: str, group: str) -> str:
    """Return the text of a TOML scene file with other settings of ``[simulation]``, coordinates and groups of bodies.

    Comments of the file are kept. Empty `coordinates` or `group` leave these unchanged.

    Raises
    ------
    UsageError
        There is no such file, or its syntax is not supported here: the settings are in the message.
    FileError
        The file cannot be read.
    """
    keys = ", ".join(f"{name} = {_value(value)}" for name, value in simulation.items())
    hint = f"[simulation] {keys}" + (f", and coordinates = {_value(coordinates)}" if coordinates else "")
    if path is None or path.suffix.lower() != ".toml":
        raise UsageError(
            Problem(str(path or "scene"), "settings can be written into .toml scene files only [E1120]", hint)
        )
    try:
        lines = read_file(path).decode().split("\n")
    except OSError as error:
        raise FileError(
            Problem(str(path), f"cannot be read: {error.strerror or error} [E0115]", "another path")
        ) from None
    lines = _with_section(lines, "simulation", simulation, _OF_METHODS)
    if coordinates:
        lines = _with_key(lines, "", "coordinates", coordinates)
    if group:
        for section in [match[1].strip() for line in lines if (match := _SECTION.match(line))]:
            if _BODY.match(section):
                lines = _with_key(lines, section, "group", group)
    text = "\n".join(lines)
    if not _holds(text, simulation, coordinates):
        raise UsageError(
            Problem(str(path), "its [simulation] is written in a way that cannot be changed here [E1121]", hint)
        )
    return text


def _span(lines: list[str], section: str) -> tuple[int, int] | None:
    """Return the numbers of the first line of a section, after its header, and of the line after the section; None
    without it. The empty name is for the lines before the first header."""
    headers = [number for number, line in enumerate(lines) if re.match(r"^\s*\[", line)]
    if not section:
        return 0, headers[0] if headers else len(lines)
    for number in headers:
        match = _SECTION.match(lines[number])
        if match and match[1].strip() == section:
            return number + 1, next((header for header in headers if header > number), len(lines))
    return None


def _with_section(lines: list[str], section: str, values: Mapping[str, Any], known: tuple[str, ...]) -> list[str]:
    span = _span(lines, section)
    if span is None:
        section_lines = [f"[{section}]", *(f"{name} = {_value(value)}" for name, value in values.items())]
        return [*lines, *([""] if lines and lines[-1] else []), *section_lines, ""]
    for name in known:
        if name not in values:
            begin, end = _span(lines, section) or span
            lines = [line for n, line in enumerate(lines) if not (begin <= n < end and _is_key(line, name))]
    for name, value in values.items():
        lines = _with_key(lines, section, name, value)
    return lines


def _with_key(lines: list[str], section: str, name: str, value: Any) -> list[str]:
    begin, end = _span(lines, section) or (0, 0)
    for number in range(begin, end):
        if _is_key(lines[number], name):
            written = f"{name} = {_value(value)}"
            comment = re.search(r"\s+#[^\"']*$", lines[number])
            if comment and lines[number][: comment.start()].strip() == written:  # may be false for another value
                written += comment[0]
            return [*lines[:number], written, *lines[number + 1 :]]
    last = max((n for n in range(begin, end) if lines[n].strip()), default=begin - 1)
    return [*lines[: last + 1], f"{name} = {_value(value)}", *lines[last + 1 :]]


def _is_key(line: str, name: str) -> bool:
    return re.match(rf"^\s*{re.escape(name)}\s*=", line) is not None


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{name} = {_value(item)}' for name, item in value.items())} }}"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _holds(text: str, simulation: Mapping[str, Any], coordinates: str) -> bool:
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return False
    section = data.get("simulation", {})
    set_ = all(section.get(name) == value for name, value in simulation.items())
    return set_ and (not coordinates or data.get("coordinates") == coordinates)


@dataclass(frozen=True)
class RacedMethod:
    """Another method in the race, at the demand: measured, or expected if the method was given up."""

    label: str
    seconds: float
    measured: bool


@dataclass(frozen=True)
class Tuned:
    """Result of ``eomgen.tune``.

    Attributes
    ----------
    scene : name of the scene
    quantity, measure, demand : the demand
    configuration : the configuration that meets the demand at the least cost
    kind, value : ``step`` in s, or ``tolerance``
    error : measured on the scene's own run
    seconds : processor's time of stepping that run, median; without outputs, energies and the error estimate
    span : s, of the run
    steps : of the method in that run
    rivals : cheapest first
    next_digit : how many times dearer a tenth of the error is expected to be
    own : the scene's settings, with error and seconds; infinite if the run fails
    said : warnings of the scene's run with these settings and an error estimate
    verified : runs that were not used for tuning
    simulation : keys of the scene's section of that name
    written : error and seconds of the settings written by ``save``: of the configuration above
    coordinates, group : for the scene, if different from the scene's; empty otherwise
    machine : description of the machine
    spent : the processor's seconds of computation, builds not counted; and runs of the race
    built : seconds of building
    left_out : configurations that did not race, and the reasons
    source : the scene's file, None if there is none
    simplified : in words, if a scene of less fidelity than the described one suffices; empty otherwise
    """

    scene: str
    quantity: str
    measure: str
    demand: float
    configuration: Configuration
    kind: str
    value: float
    error: float
    seconds: float
    span: float
    steps: float
    rivals: tuple[RacedMethod, ...]
    next_digit: float
    own: tuple[str, float, float]
    said: str
    verified: tuple[VerificationRun, ...]
    simulation: Mapping[str, Any]
    written: tuple[float, float]
    coordinates: str
    group: str
    machine: Mapping[str, str]
    spent: tuple[float, int]
    built: float
    left_out: Mapping[str, str] = field(default_factory=dict)
    source: Path | None = None
    simplified: str = ""

    @property
    def label(self) -> str:
        unit = " s" if self.kind == "step" else ""
        return f"{self.configuration.label}, {self.kind} {self.value:.4g}{unit}"

    @property
    def met(self) -> bool:
        """Whether all verification runs meet the demand; true without such runs, if none has a reference."""
        return all(run.error <= self.demand for run in self.verified)

    @property
    def why(self) -> str:
        """One line: the time in which the scene's own run meets the demand, the cheapest rival, the cost of one digit
        more, and the machine; and whether verification runs miss the demand, or none has a reference."""
        time = short_duration(self.seconds)
        parts = [f"{self.label} meets {self.demand:g} in {time} for {self.span:.4g} s of motion"]
        if not self.met:
            parts.append(f"verification runs miss it, by an error of {max(run.error for run in self.verified):.2g}")
        elif not self.verified:
            parts.append("no other run has a reference to verify it")
        if self.rivals:
            first = self.rivals[0]
            how = "takes" if first.measured else "would take"
            parts.append(f"{first.label} {how} {first.seconds / self.seconds:.3g} x")
        if self.next_digit > 0.0:
            parts.append(f"one digit more costs {self.next_digit:.3g} x")
        return f"{'; '.join(parts)}; measured on {self.machine['processor']}, {self.machine['compiler']}"

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON data: the attributes without ``source``, with ``met`` and ``why``.

        Returns
        -------
        dict
            By the names of the attributes, with the attributes of ``configuration`` at the same level. Tuples of
            numbers are dicts: ``own`` (``settings``, ``error``, ``seconds``), ``written`` (``error``, ``seconds``) and
            ``spent`` (``seconds``, ``runs``, and ``built`` as ``building``). Numbers of ``own`` and ``verified`` may be
            infinite.
        """
        demand = ("scene", "quantity", "measure", "demand", "met")
        run = ("kind", "value", "error", "seconds", "span", "steps", "why", "next_digit")
        return {
            **{name: getattr(self, name) for name in demand},
            **self.configuration.to_dict(),
            **{name: getattr(self, name) for name in run},
            "own": {"settings": self.own[0], "error": self.own[1], "seconds": self.own[2]},
            "said": self.said,
            "rivals": [vars(rival) for rival in self.rivals],
            "verified": [vars(run) for run in self.verified],
            "simulation": dict(self.simulation),
            "written": {"error": self.written[0], "seconds": self.written[1]},
            **{name: getattr(self, name) for name in ("coordinates", "group", "simplified")},
            "machine": dict(self.machine),
            "spent": {"seconds": self.spent[0], "runs": self.spent[1], "building": self.built},
            "left_out": dict(self.left_out),
        }

    def save(self, path: str | Path) -> Path:
        """Write the scene's file with these settings; comments stay, except on lines whose values change.

        Keys of ``[simulation]`` change, and ``coordinates`` and ``group`` of bodies if different; ``t_end``,
        ``parameters`` and ``inputs`` of ``tune`` are not written.

        Parameters
        ----------
        path : path
            ``.toml`` file that is written. An existing file is replaced, also the file of the scene.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        UsageError
            The scene is from no ``.toml`` file, or settings cannot be inserted into its syntax; the scene is one of
            less fidelity.
        FileError
            The scene's file cannot be read, or ``path`` cannot be written.
        """
        if self.simplified:
            fault = f"the chosen scene has less fidelity, {self.simplified}, which is not written into files [E1122]"
            raise UsageError(Problem(str(path), fault, "fewer modes, order or stiffening in [beams]; or other axes"))
        text = with_settings(self.source, self.simulation, self.coordinates, self.group)
        write_text(Path(path), text)
        return Path(path)
