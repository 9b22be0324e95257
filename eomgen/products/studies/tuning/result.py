"""``Tuned``: the configuration that meets a demand at the least cost, its verification, and its scene file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.base.files import read_file, write_text
from eomgen.base.messages import key_of
from eomgen.errors import FileError, Problem, UsageError
from eomgen.products.studies.tuning.judge import VerificationRun
from eomgen.products.studies.work_precision.axes import Configuration
from eomgen.products.studies.work_precision.result import short_duration
from eomgen.scene.sources.toml import line_index

#: Keys of a scene file on the method of a run, which are removed unless among the new keys.
_OF_METHODS = (
    *("method", "step", "rho_inf", "alpha", "beta", "gamma"),
    *("tolerance", "order", "record_every", "settings", "real"),
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
        text = read_file(path).decode()
    except OSError as error:
        raise FileError(
            Problem(str(path), f"cannot be read: {error.strerror or error} [E0115]", "another path")
        ) from None
    data = tomllib.loads(text)
    kept = {name: value for name, value in data.get("simulation", {}).items() if name not in _OF_METHODS}
    data |= {"simulation": kept | dict(simulation), **({"coordinates": coordinates} if coordinates else {})}
    for name, value in (dict.fromkeys(_OF_METHODS) | dict(simulation)).items():
        text = _with_key(text, "simulation", name, value)
    if coordinates:
        text = _with_key(text, "", "coordinates", coordinates)
    for name, body in data["bodies"].items() if group else ():
        text, body["group"] = _with_key(text, key_of("bodies", name), "group", group), group
    try:
        fits = tomllib.loads(text) == data
    except tomllib.TOMLDecodeError:
        fits = False
    if not fits:
        raise UsageError(
            Problem(str(path), "its [simulation] is written in a way that cannot be changed here [E1121]", hint)
        )
    return text


def _with_key(text: str, section: str, name: str, value: Any) -> str:
    """Return the text of a TOML file in which a key of a section, or, without one, of the file has a value; without the
    key if the value is None. A new key comes last. A value that stays keeps its comment."""
    lines, where = text.rstrip().split("\n"), line_index(text)
    in_place = {key: line for key, line in where.items() if not lines[line - 1].lstrip().startswith("[")}
    number, written = in_place.get(f"{section}.{name}" if section else name), f"{name} = {_value(value)}"
    if number is not None and re.match(rf"\s*{name}\s*=", lines[number - 1]):
        if value is None:
            del lines[number - 1]
        elif lines[number - 1].partition("#")[0].strip() != written:
            lines[number - 1] = written
    elif value is not None:
        lines += ["", f"[{section}]"] if section and section not in where else []
        others = (line for key, line in in_place.items() if key.rpartition(".")[0] == section)
        lines.insert(max(others, default=where.get(section, len(lines))), written)
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{name} = {_value(item)}' for name, item in value.items())} }}"
    return f'"{value}"' if isinstance(value, str) else repr(value)


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
        others = ("configuration", "source", "built")
        return {
            **{name: value for name, value in vars(self).items() if name not in others},
            **self.configuration.to_dict(),
            "met": self.met,
            "why": self.why,
            "own": dict(zip(("settings", "error", "seconds"), self.own, strict=True)),
            "rivals": [vars(rival) for rival in self.rivals],
            "verified": [vars(run) for run in self.verified],
            "written": dict(zip(("error", "seconds"), self.written, strict=True)),
            "spent": {"seconds": self.spent[0], "runs": self.spent[1], "building": self.built},
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
