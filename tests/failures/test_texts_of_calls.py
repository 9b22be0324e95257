"""Texts of refused calls from Python, at the border of what is taken, and calls on the other side of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.base import journal
from eomgen.base.csv_tables import _cells
from eomgen.cli import options
from eomgen.codegen import folder
from eomgen.codegen.targets.c.naming import check_identifier
from eomgen.compiled import arguments, base_parameters
from eomgen.compiled.bodies import operational_inertia
from eomgen.control import OutputFeedback, kalman, lqr
from eomgen.errors import EomgenError
from eomgen.formula.units.parser import UnitError, read_unit
from eomgen.integrators.stepper_layout import checked_setting
from eomgen.products.ensembles import command, designs, simulate_many, statistics, variations
from eomgen.products.ensembles.distributions import read_distribution
from eomgen.products.fields.posteriors.mesh import Mesh
from eomgen.products.fields.posteriors.sampling import Sampler
from eomgen.products.linear import command as linearize
from eomgen.products.linear.augmentation import delay_line, shaping_filter
from eomgen.products.linear.control.riccati_equation import without_cross_terms
from eomgen.products.linear.control.second_order import optimal_modal_gains, placed_modal_gains
from eomgen.products.linear.control.stationary import stationary_covariance
from eomgen.products.linear.sampling import seconds
from eomgen.products.linear.spectra import InputSpectrum, MeasuredRoad
from eomgen.products.linear.state_space import StateSpace
from eomgen.products.pictures import section_loads
from eomgen.products.pictures.command import RestPicture
from eomgen.products.statics import steady_motion
from eomgen.products.statics.command import LoadPaths
from eomgen.products.studies.identification import measurements, study
from eomgen.products.studies.work_precision.running import tuning_grid
from eomgen.products.waves.sea_states.components import discretized, divided, wave_number
from eomgen.products.waves.sea_states.spectra import Jonswap, PiersonMoskowitz, SpectrumTable, Spreading
from eomgen.products.waves.second_order import Sea
from eomgen.products.waves.second_order.profiles import multiples
from eomgen.products.waves.second_order.radar import Radar
from eomgen.products.waves.second_order.stepping import Ramp
from eomgen.results import dense_output
from eomgen.results.events import Events
from eomgen.simulation import checkpoint, run_model
from eomgen.simulation.stepping import controllers
from eomgen.simulation.stepping.time_grid import time_grid


def rest_options(**given: object) -> dict[str, Any]:
    """Return options of ``eomgen equilibrium``."""
    return {"along": None, "over": (), "figure": None, "buckling": None, "path": None, **given}


def oscillator(feedthrough: float = 0.0) -> StateSpace:
    A, B = np.array([[0.0, 1.0], [-4.0, -0.4]]), np.array([[0.0], [1.0]])
    D = np.array([[feedthrough]])
    return StateSpace(
        A, B, np.zeros((2, 1)) + B, np.array([[1.0, 0.0]]), D, np.zeros((1, 1)),
        states=("x", "v"), inputs=("u",), disturbances=("w",), outputs=("y",),
    )  # fmt: skip  # two lines


LAW, SEEN = lqr(oscillator(), {"x": 1.0}, {"u": 1.0}), kalman(oscillator(), {"w": 1.0}, {"y": 1.0})
SETTINGS = {
    "family": "rk4",
    "parameters": {},
    "settings": [
        {"name": "reuse", "default": 1, "whole": [0, 1]},
        {"name": "max_halvings", "default": 10, "whole": [0, 30]},
        {"name": "rtol", "default": 1e-6, "whole": None},
        {"name": "tolerance", "default": 1e-5, "whole": None},
    ],
    "bounds": [{"left": "tolerance", "relation": ">", "right": 0.0}],
}
RADAR = Radar(100.0, 0.4)


#: Calls, and the texts that they are refused with.
REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "combinations": (
        lambda: base_parameters._check(np.array([[1.0, 1.0 + 2e-6]]) * 1e3, (0,), np.array([[1.0, 1.0]])),
        "base_parameters: combinations that hold at some random motions do not hold at others; try: another seed",
    ),
    "drives": (
        lambda: steady_motion.check_drives(
            cast(Any, SimpleNamespace(v_names=("v.hinge",), v_units=("rad/s",))), {"hinge": 2.0}, np.array([2.001])
        ),
        "velocity hinge: it is driven at 2 rad/s, and 2.001 rad/s is given; try: a tunable parameter in the law,"
        ' drive = "w*t", and the value as that parameter\'s; or no drive',
    ),
    "csv": (
        lambda: _cells("a.csv:3", '1,"2"3', ","),
        "a.csv:3: this is not a CSV file: ',' expected after '\"'; try: plain cells between delimiters",
    ),
    "over without path": (
        lambda: LoadPaths(rest_options(over=("x",))),
        "--over: it belongs to a path; try: --path load=0:10",
    ),
    "buckling and figure": (
        lambda: LoadPaths(rest_options(figure="a.png", buckling="load")),
        "--plot: it belongs to a path, or to an equilibrium alone; try: --path load=0:10",
    ),
    "figure of a path": (
        lambda: RestPicture(rest_options(along="load=0:10", figure="a.gif")),
        "--plot a.gif: a figure is a .png, .svg or .pdf file; try: --plot rest.png",
    ),
    "path and buckling": (
        lambda: LoadPaths(rest_options(along="load=0:10", buckling="load")),
        "--buckling: it is asked for together with --path; try: one of them",
    ),
    "modes from 1": (
        lambda: linearize._modes("2,0"),
        "--modes 2,0: numbers of modes from 1 on are needed; try: --modes 1,2,4",
    ),
    "modes in words": (
        lambda: linearize._modes("one"),
        "--modes one: numbers of modes from 1 on are needed; try: --modes 1,2,4",
    ),
    "two values": (
        lambda: options.assignments("--set", ["a=1,b=2"]),
        "--set a=1,b=2: this option takes one name and one value; try: --set a=1 --set b=2",
    ),
    "identifier": (lambda: check_identifier("2x", "function"), "function '2x' is not an identifier"),
    "rows of a twist": (
        lambda: operational_inertia(cast(Any, None), "arm", [0.0], rows=[3, 6]),
        "rows: '[3, 6]' are not rows of a twist; try: rows=[3, 4, 5]",
    ),
    "rows twice": (
        lambda: operational_inertia(cast(Any, None), "arm", [0.0], rows=[3, 3]),
        "rows: '[3, 3]' are not rows of a twist; try: rows=[3, 4, 5]",
    ),
    "negative setting": (lambda: checked_setting(SETTINGS, "rtol", -1e-9), "settings.rtol: rtol is negative: -1e-09"),
    "setting of two values": (
        lambda: checked_setting(SETTINGS, "reuse", 2.0),
        "settings.reuse: reuse must be 0 or 1, not 2; try: 1",
    ),
    "whole setting": (
        lambda: checked_setting(SETTINGS, "max_halvings", 30.5),
        "settings.max_halvings: max_halvings must be a whole number from 0 to 30, not 30.5; try: 10",
    ),
    "large setting": (
        lambda: checked_setting(SETTINGS, "max_halvings", 31.0),
        "settings.max_halvings: max_halvings must be a whole number from 0 to 30, not 31; try: 10",
    ),
    "setting of zero": (
        lambda: checked_setting(SETTINGS, "tolerance", 0.0),
        "settings.tolerance: tolerance is 0, and has to be above it; try: 1e-05, which it is by default",
    ),
    "delay of no sample": (
        lambda: delay_line("u", "y", 0, 0.1),
        "delay_line: a delay of 0 samples; try: a whole number of them, from 1 on",
    ),
    "delay of a truth value": (
        lambda: delay_line("u", "y", True, 0.1),
        "delay_line: a delay of True samples; try: a whole number of them, from 1 on",
    ),
    "filter of nothing": (
        lambda: shaping_filter([1.0], [0.0, 0.0], "w", "u"),
        "shaping_filter: the coefficients are not finite numbers; try: [2.0], [1.0, 0.5]",
    ),
    "regulator first": (
        lambda: OutputFeedback(cast(Any, SEEN), cast(Any, LAW)),
        "OutputFeedback: a Regulator comes first, not an Observer; try: OutputFeedback(regulator, observer), of lqr or"
        " place, and of kalman or place_observer",
    ),
    "noise that is none": (
        lambda: stationary_covariance(oscillator(), {"wind": 1.0}),
        "noise: there is no disturbance or input 'wind'; try: one of w, u",
    ),
    "gain that is none": (lambda: LAW.gain("u", "z"), "gain: there is no 'z' among the gains; try: one of x, v"),
    "cross terms": (
        lambda: without_cross_terms(np.eye(2), np.array([[1.1], [0.0]])),
        "the cost has no minimum: its cross terms outweigh the weights of states and inputs; try: smaller cross terms",
    ),
    "weight of a modal force": (
        lambda: optimal_modal_gains([2.0, 3.0], [0.1, 0.1], [1.0, 0.0]),
        "the weight of a modal force is 0; try: a number above zero",
    ),
    "frequency of zero": (
        lambda: placed_modal_gains([2.0], [0.1], [0.0], [0.5]),
        "a frequency of 0 rad/s is asked for; try: a number above zero",
    ),
    "ratio of zero": (
        lambda: placed_modal_gains([2.0], [0.1], [1.0], [0.0]),
        "a damping ratio of 0 is asked for; try: a number above zero",
    ),
    "time": (lambda: seconds("sample", cast(Any, [1.0])), 'sample: a time is needed, not list; try: 0.001 or "1 ms"'),
    "time of a truth value": (
        lambda: seconds("sample", True),
        'sample: a time is needed, not bool; try: 0.001 or "1 ms"',
    ),
    "endless time": (
        lambda: seconds("sample", math.inf),
        'sample: sample is inf, not a finite number; try: 0.001 or "1 ms"',
    ),
    "frequency of an excitation": (
        lambda: InputSpectrum("w", np.array([0.0, 1.0]), np.ones(2)),
        "InputSpectrum: w: the frequencies have to be two or more positive numbers that increase, Hz; try: [1.0, 20.0,"
        " 100.0]",
    ),
    "frequencies of an excitation": (
        lambda: InputSpectrum("w", np.array([1.0, 1.0]), np.ones(2)),
        "InputSpectrum: w: the frequencies have to be two or more positive numbers that increase, Hz; try: [1.0, 20.0,"
        " 100.0]",
    ),
    "segments of a road": (
        lambda: MeasuredRoad.of_profile(np.arange(64.0), np.zeros(64), segments=0),
        "MeasuredRoad: segments: they are a whole number of 1 and more; try: segments=8",
    ),
    "spectrum of a road": (
        lambda: MeasuredRoad(frequencies=np.array([1.0, 2.0]), density=np.array([1.0, -1e-9])),
        "MeasuredRoad: a spectrum needs two or more frequencies above 0 that increase, and as many densities of 0 or"
        " more; try: MeasuredRoad.of_profile(distance, elevation)",
    ),
    "vary without a distribution": (
        lambda: command._varied(("mass=",)),
        "--vary mass=: a name and a distribution are needed; try: --vary 'mass=normal(1, 0.1)'",
    ),
    "vary twice": (
        lambda: command._varied(("mass=normal(1, 2)", "mass = uniform(0, 1)")),
        "--vary mass = uniform(0, 1): mass varies twice; try: one distribution for each name",
    ),
    "list of two numbers": (
        lambda: read_distribution("vary x", "linspace(0, 1)"),
        "vary x: linspace takes 3 numbers, not 2; try: linspace(low, high, count)",
    ),
    "latin hypercube": (
        lambda: designs.random_design("latin_hypercube", [NORMAL] * 2, designs._MOST_AT_ONCE // 2 + 1, 0),
        f"samples: latin_hypercube makes all of its {designs._MOST_AT_ONCE + 2} numbers at once,"
        f" {designs._MOST_AT_ONCE} at most; try: fewer of them, or sobol",
    ),
    "no columns": (
        lambda: simulate_many._columns(cast(Any, PILOT), []),
        "columns: no column is looked at; try: one of model.simulate(...).columns()",
    ),
    "unknown column": (
        lambda: simulate_many._columns(cast(Any, PILOT), ["forse"]),
        "columns: there is no column 'forse'; try: force",
    ),
    "resume without a folder": (
        lambda: simulate_many._check_options({}, None, resume=True),
        "resume: there is no folder to go on with; try: folder=..., the folder of the ensemble before",
    ),
    "mesh of one cell": (
        lambda: Mesh((4, 1), 1.0),
        "Mesh: cells: (4, 1) is not a mesh; try: 1 to 3 numbers above 1: (64, 64)",
    ),
    "mesh of four axes": (
        lambda: Mesh((2, 2, 2, 2), 1.0),
        "Mesh: cells: (2, 2, 2, 2) is not a mesh; try: 1 to 3 numbers above 1: (64, 64)",
    ),
    "lengths of a mesh": (
        lambda: Mesh((4, 4), (1.0,)),
        "Mesh: lengths: (1.0,) are not 2 lengths from 1e-100 to 1e+100; try: one number, or one for each axis",
    ),
    "jitter": (lambda: sampler(jitter=1.0), "Sampler: jitter: 1 cannot be; try: from 0 to below 1"),
    "guard": (lambda: sampler(guard=0.0), "Sampler: guard: 0 cannot be; try: above 0 to 1, as 0.9, or inf for none"),
    "large guard": (
        lambda: sampler(guard=1.01),
        "Sampler: guard: 1.01 cannot be; try: above 0 to 1, as 0.9, or inf for none",
    ),
    "chains": (lambda: sampler(chains=0), "Sampler: chains: 0 cannot be; try: from 1 on"),
    "duration": (lambda: sampler(duration=0.0), "Sampler: duration: 0 cannot be; try: above 0"),
    "seed": (lambda: sampler(seed=-1), "Sampler: seed: -1 cannot be; try: from 0 to 9223372036854775807"),
    "first": (
        lambda: sampler(first="jump"),
        """Sampler: first: 'jump' is neither; try: "random", "drift" or "kick\"""",
    ),
    "no times": (
        lambda: measurements.times_of("run", {"x": np.zeros(3), "y": np.zeros(3)}),
        "run: there is no column t of times in s; try: t in place of one of x, y",
    ),
    "one row": (
        lambda: measurements.times_of("run", {"t": np.zeros(1)}),
        "run: there are 1 rows, and a run has two at least; try: more data",
    ),
    "runs of one name": (
        lambda: study._named_apart(cast(Any, [SimpleNamespace(name=name) for name in ("a", "b", "a")])),
        "data: two runs are named a; try: files of different names",
    ),
    "band": (
        lambda: discretized(Jonswap(2.0, 8.0), band=(0.0, 1.0)),
        "discretized: band: (0.0, 1.0) does not increase from above 0; try: (0.5, 3.0)",
    ),
    "band of nothing": (
        lambda: divided(Jonswap(2.0, 8.0), 4, band=(1.0, 1.0)),
        "divided: band: (1.0, 1.0) does not increase from above 0; try: (0.5, 3.0)",
    ),
    "depth of a wave": (
        lambda: wave_number(1.0, 0.0),
        "wave_number: depth: 0 m is not above 0; try: math.inf for water without a bottom",
    ),
    "frequency of a wave": (lambda: wave_number(0.0), "wave_number: frequency: 0 rad/s is not above 0"),
    "height": (lambda: Jonswap(0.0, 8.0), "Jonswap: height: 0 is not above 0"),
    "period": (lambda: Jonswap(2.0, math.inf), "Jonswap: period: inf is not above 0"),
    "peakedness": (
        lambda: Jonswap(2.0, 8.0, 0.99),
        "Jonswap: peakedness: 0.99 is not from 1 to 20; try: 3.3, or 1 for a fully developed sea",
    ),
    "large peakedness": (
        lambda: Jonswap(2.0, 8.0, 20.1),
        "Jonswap: peakedness: 20.1 is not from 1 to 20; try: 3.3, or 1 for a fully developed sea",
    ),
    "wind": (lambda: PiersonMoskowitz(0.0), "PiersonMoskowitz: wind: 0 m/s is not above 0"),
    "spectrum of nothing": (
        lambda: SpectrumTable([1.0, 2.0], [0.0, 0.0]),
        "SpectrumTable: densities: the least is 0 m^2 s/rad, the greatest 0; try: none below 0, one above 0",
    ),
    "spectrum below zero": (
        lambda: SpectrumTable([1.0, 2.0], [1.0, -0.1]),
        "SpectrumTable: densities: the least is -0.1 m^2 s/rad, the greatest 1; try: none below 0, one above 0",
    ),
    "spectrum from zero": (
        lambda: SpectrumTable([0.0, 2.0], [1.0, 1.0]),
        "SpectrumTable: frequencies: they have to increase from above 0",
    ),
    "spreading": (lambda: Spreading(0.0), "Spreading: exponent: 0 is not above 0"),
    "order of a sea": (lambda: Sea(SEA, math.inf, order=3), "Sea: order: there is no order 3; try: 1 or 2"),
    "gravity of a sea": (
        lambda: Sea(SEA, math.inf, gravity=0.0),
        "Sea: gravity: 0 m/s^2 is not above 0; try: 9.81",
    ),
    "depth of a sea": (
        lambda: Sea(SEA, 0.0),
        "Sea: depth: 0 m is not above 0; try: math.inf for water without a bottom",
    ),
    "vorticity": (
        lambda: Sea(SEA, math.inf, vorticity=cast(Any, "some")),
        "Sea: vorticity: there is no 'some'; try: none, or gerstner",
    ),
    "pairs of a sea of order 1": (
        lambda: Sea(SEA, math.inf, order=1).bound_waves(0.0),
        "Sea.bound_waves: a sea of order 1 has no pairs; try: order = 2",
    ),
    "range to velocity": (lambda: Radar(-0.1, 0.4), "Radar: range_to_velocity: -0.1 s is below 0"),
    "incidence": (
        lambda: Radar(100.0, 0.5 * math.pi),
        "Radar: incidence: 1.5708 rad is not from 0 to below pi/2; try: the angle from the vertical, 0.4 for 23"
        " degrees",
    ),
    "reflectivity": (
        lambda: RADAR.backscatter(0.1, -0.1),
        "Radar.backscatter: reflectivity: -0.1 is below 0",
    ),
    "periods of a profile": (
        lambda: multiples(np.array([1.0, math.sqrt(2.0)])),
        "Sea.profile: the wave numbers are not multiples of one that is not far smaller than all of them; try:"
        " components by discretized(...), or surface(labels, time)",
    ),
    "ramp": (lambda: Ramp(0.0), "Ramp: time: 0 is not above 0"),
    "power of a ramp": (lambda: Ramp(1.0, 0.0), "Ramp: power: 0 is not above 0"),
    "sections at no time": (
        lambda: section_loads._rows_at(cast(Any, SimpleNamespace(t=np.arange(3.0))), []),
        "plot_sections: at: there are no times; try: times in s, or no at for a map over time",
    ),
    "solution made by hand": (
        lambda: dense_output.factors_of({}),
        "at: this solution does not say which groups its coordinates are of: it was made by hand or by an older eomgen;"
        " try: a solution of simulate",
    ),
    "event that is none": (
        lambda: Events.__getitem__(cast(Any, SimpleNamespace(counts={"stop": 1}, names=("stop",))), "stpo"),
        "events: there is no event 'stpo'; try: stop",
    ),
    "parameters of a run that goes on": (
        lambda: checkpoint._same_parameters(cast(Any, PAIR), np.array([1.0, 2.0]), {"k": 2.5}),
        "parameter k: the run has 2, not 2.5; try: a run of its own for other parameters",
    ),
    "function of a run": (
        lambda: run_model._inputs({"force": "function", "lift": 2.0}, {"lift": 3.0}),
        "2 problems\n  1. input force: the run had a function here, which a solution does not hold; try: the same"
        " again: inputs={'force': ...}\n  2. input lift: the run had 2 here; try: leave it out",
    ),
    "end before the start": (
        lambda: time_grid(1.0, 0.5, 0.1),
        "t_end: the end 0.5 s lies before the start 1 s; try: a later t_end",
    ),
    "steps without number": (
        lambda: time_grid(0.0, 2.0, 1e-15),
        "step: 2 s in steps of 1e-15 s are 2e+15 steps; try: a larger step",
    ),
    "controller of nothing": (
        lambda: controllers._values(ROW, None, 0.5),
        "controller servo: the function gives nothing at t = 0.5 s, and has to give 2 numbers: force, lift; try:"
        " return force, lift",
    ),
    "controller of three numbers": (
        lambda: controllers._values(ROW, [1.0, 2.0, 3.0], 0.5),
        "controller servo: the function gives an array of shape (3,) at t = 0.5 s, and has to give 2 numbers: force,"
        " lift; try: return force, lift",
    ),
    "controller of words": (
        lambda: controllers._values({**ROW, "outputs": ["force"]}, "one", 0.5),
        "controller servo: the function gives str, which is not an array of numbers at t = 0.5 s, and has to give one"
        " number, force; try: return value, the number that force holds",
    ),
    "components": (
        lambda: arguments.components("q", [1.0, 2.0], 1),
        "q: the shape is (2,), (..., 1) is needed; try: q as a list of 1 number, or a batch of them along leading axes",
    ),
    "step longer than a run": (
        lambda: tuning_grid(1.0, 1.01, 0.1),
        "t_end: a step of 1.01 s does not fit into a run of 1 s; try: 10.1",
    ),
    "seed of an input": (
        lambda: variations._track(cast(Any, SimpleNamespace(name="force", road=None))),
        "input force: it is not a random road; try: an input with a road of a class",
    ),
    "sample beyond the last": (
        lambda: simulate_many._numbers([2, 3], 3),
        "keep: 3 is not the number of a sample; try: 0 to 2",
    ),
    "sample of a truth value": (
        lambda: simulate_many._numbers([True], 3),
        "keep: True is not the number of a sample; try: 0 to 2",
    ),
    "Sobol with a failure": (
        lambda: statistics._sobol(8, ["a", "b"], "y", np.array([1.0] * 7 + [np.nan])),
        "sensitivity: Sobol' indices need all 8 samples of the design, and 1 failed or are missing; try: distributions"
        " without the samples that fail, or another design",
    ),
    "Sobol before the end": (
        lambda: statistics._sobol(8, ["a", "b"], "y", np.ones(6)),
        "sensitivity: Sobol' indices need all 8 samples of the design, and 2 failed or are missing; try: distributions"
        " without the samples that fail, or another design",
    ),
}
PAIR = SimpleNamespace(parameters=("m", "k"), parameter_array=lambda whole: np.array([whole["m"], whole["k"]]))
ROW = {"name": "servo", "outputs": ["force", "lift"]}
SEA = divided(Jonswap(1.0, 8.0), 3).realisation(1)
NORMAL = read_distribution("vary x", "normal(0, 1)")
PILOT = SimpleNamespace(columns=lambda: ["t", "q.x", "output.force"])


def sampler(**values: Any) -> Sampler:
    posterior = SimpleNamespace(mesh=Mesh((4,), 1.0), mass=lambda choice: None)
    return Sampler(cast(Any, posterior), **{"step": 0.1, "duration": 1.0, **values})


@pytest.mark.parametrize("name", REFUSED)
def test_calls_beyond_the_border_are_refused_in_these_words(name: str) -> None:
    call, text = REFUSED[name]
    with pytest.raises(EomgenError) as caught:
        call()
    assert str(caught.value).partition("error: ")[2] == text


ACCEPTED: Sequence[Callable[[], object]] = (
    lambda: base_parameters._check(np.array([[1.0, 1.0]]) * 1e3, (0,), np.array([[1.0, 1.0]])),
    lambda: checked_setting(SETTINGS, "reuse", 0.0) == 0.0,
    lambda: checked_setting(SETTINGS, "max_halvings", 30.0),
    lambda: checked_setting(SETTINGS, "rtol", 0.0),
    lambda: delay_line("u", "y", 1, 0.1),
    lambda: Jonswap(2.0, 8.0, 1.0),
    lambda: Jonswap(2.0, 8.0, 20.0),
    lambda: Radar(0.0, 0.0),
    lambda: RADAR.backscatter(0.0, 0.0),
    lambda: SpectrumTable([1.0, 2.0], [0.0, 1.0]),
    lambda: without_cross_terms(np.eye(2), np.array([[1.0], [0.0]])),
    lambda: MeasuredRoad(frequencies=np.array([1.0, 2.0]), density=np.array([1.0, 0.0])),
    lambda: Mesh((2,), 1.0),
    lambda: LoadPaths(rest_options(figure="a.png")).answers,
)


@pytest.mark.parametrize("call", ACCEPTED)
def test_calls_at_the_border_are_taken(call: Callable[[], object]) -> None:
    call()


def test_units_that_can_be_read_in_two_ways() -> None:
    with pytest.raises(UnitError) as caught:
        read_unit("N/m s")
    assert (caught.value.what, caught.value.hint) == (
        "'N/m s' can be read in two ways", "brackets, N/(m s), or the divisor last, N s/m",
    )  # fmt: skip  # one line


def test_folders_of_others_are_not_written_into(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(EomgenError, match=f"{tmp_path / 'file'} is a file, not a folder; try: another folder"):
        folder._earlier_files(tmp_path / "file")
    assert folder._earlier_files(tmp_path / "none") == set()


def test_studies_of_other_things_are_not_gone_on_with(tmp_path: Path) -> None:
    def opened(identity: str, *, resume: bool) -> journal.Journal[int]:
        of: dict[str, Any] = {"identity": identity, "others": "another scene", "row_of": lambda line: line["row"]}
        return journal.Journal(tmp_path, "cells.jsonl", "cells of a study", resume=resume, **of)

    opened("a", resume=False).append({"row": 3})
    assert opened("a", resume=True).rows == [3]
    text = "holds the cells of a study, cells.jsonl; try: --resume, which goes on with it, or another folder"
    with pytest.raises(EomgenError) as caught:
        opened("a", resume=False)
    assert str(caught.value).endswith(f"{tmp_path}: {text}")
    with pytest.raises(EomgenError) as caught:
        opened("b", resume=True)
    assert str(caught.value).endswith(f"{tmp_path}: holds the cells of a study of another scene; try: another folder")
