"""Mistakes that users made when they tried eomgen, each with what its answer must say.

    python -m tests.failures.mistakes           all of them with the answers of today
    python -m tests.failures.mistakes motions   those of a group: files, calls or motions

An answer is an error, the message of a run, or the notes of a scene; where the call is right after all, what it gives.
"""

from __future__ import annotations

import os
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import eomgen
from tests.failures.failure import SCENE

FRAMES = [{"body": body, "axis": [0, 0, 1], "x_axis": [1, 0, 0]} for body in ("base", "w")]
COLUMN = """[bodies.lower]
mass = 1
inertia = [1, 1, 1]
[joints.back]
type = "revolute"
parent = "upper"
child = "lower"
axis = [0, 1, 0]
"""


@dataclass(frozen=True)
class Mistake:
    """A call and pieces of its answer: where, what, and what to try."""

    group: str
    what: str
    call: Callable[[], Any]
    pieces: tuple[str, ...]

    def answer(self) -> str:
        """Return what a user is told."""
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            try:
                answer = str(self.call())
            except Exception as error:  # the error is the answer
                answer = f"{type(error).__name__}: {error}"
        return " ".join([answer, *(str(item.message) for item in told)])


def scene_of(text: str, name: str = "scene.toml") -> eomgen.Scene:
    folder = Path(tempfile.mkdtemp())
    (folder / name).write_text(text, encoding="utf-8")
    return eomgen.load(folder / name)


def changed(old: str, new: str, more: str = "") -> Callable[[], Any]:
    """Return what reads the scene with one place changed, and gives its notes."""
    assert not old or SCENE.count(old) == 1, old
    return lambda: scene_of(SCENE.replace(old, new) + more if old else SCENE + more).notes


@cache
def arm() -> eomgen.Model:
    return eomgen.build(scene_of(SCENE), profile="quick")


def runs(**options: Any) -> Callable[[], Any]:
    return lambda: arm().simulate(**{"t_end": 0.1, "step": 1e-3, **options}).message


def slider(**keys: Any) -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder("slider").body("m", 1.0)
    return builder.joint("x", "prismatic", "base", "m", axis=[1, 0, 0], **keys)


def pendulum() -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder("pendulum").body("m", 1.0, center_of_mass=[0, 0, -1], inertia=[0.1, 0.1, 0.1])
    return builder.joint("h", "revolute", "base", "m", axis=[0, 1, 0], initial={"position": 0.5})


def run_of(builder: eomgen.SceneBuilder, t_end: float, step: float, **options: Any) -> Callable[[], Any]:
    return lambda: eomgen.build(builder.build(), profile="quick").simulate(t_end, step, **options).message


def stiff() -> eomgen.SceneBuilder:
    return slider(stiffness=1e6, initial={"position": 0.1})


def four_bar() -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder("bars")
    for name, length in (("crank", 0.3), ("coupler", 0.5), ("rocker", 0.4)):
        builder.body(name, 1.0, center_of_mass=[length / 2, 0, 0], inertia=[0.01, 0.01, 0.01])
    for name, parent, child, place in (
        ("a", "base", "crank", 0.0),
        ("b", "crank", "coupler", 0.3),
        ("c", "base", "rocker", 2.0),
    ):
        builder.joint(name, "revolute", parent, child, axis=[0, 1, 0], position=[place, 0, 0])
    return builder.constraint(
        "close", "spherical", {"body": "coupler", "position": [0.5, 0, 0]}, {"body": "rocker", "position": [0.4, 0, 0]}
    )


def driven(law: str) -> Callable[[], Any]:
    builder = eomgen.SceneBuilder("driven").body("w", 1.0, inertia=[1, 1, 1])
    builder.joint("w", "revolute", "base", "w", axis=[0, 0, 1])
    return lambda: eomgen.build(builder.constraint("m", "revolute", *FRAMES, drive=law).build())


def pushed() -> eomgen.SceneBuilder:
    return slider().input("u").effort("e", "x", "u")


def _files() -> Iterator[tuple[str, Callable[[], Any], tuple[str, ...]]]:
    yield "mass forgotten", changed('mass = "1 + load"\n', ""), ("scene.toml:11 (bodies.upper.mass)", "try: mass =")
    yield "a length for a mass", changed('"1 + load"', '"250 mm"'), ("is a length, a mass in kg", '"0.25 kg"')
    yield (
        "a misspelt key",
        changed("center_of_mass", "centre_of_mass"),
        ("'centre_of_mass' is unknown", "try: center_of_mass"),
    )
    yield "a misspelt section", changed("[points.tip]", "[point.tip]"), ("'point' is unknown here", "try: points")
    yield "a joint type that is none", changed('"revolute"', '"hinge"'), ("'hinge' is not known here", "revolute")
    yield "a body that is not there", changed('child = "upper"', 'child = "uper"'), ("no body 'uper'", "try: upper")
    more = '[joints.second]\ntype = "prismatic"\nparent = "base"\nchild = "upper"\naxis = [1, 0, 0]\n'
    yield (
        "two joints that carry a body",
        changed("", "", more),
        ("already carried by the joint shoulder", "[constraints]"),
    )
    yield (
        "a body without a joint",
        changed("", "", "[bodies.lost]\nmass = 1\n"),
        ("no joint carries the body lost", 'child = "lost"'),
    )
    yield (
        "a circle of joints",
        changed('parent = "base"', 'parent = "lower"', COLUMN),
        ("in a circle", "base as the parent"),
    )
    yield "an axis of zeros", changed("axis = [0, 1, 0]", "axis = [0, 0, 0]"), ("joints.shoulder.axis", "[0, 0, 1]")
    yield (
        "two numbers for three",
        changed("axis = [0, 1, 0]", "axis = [0, 1]"),
        ("joints.shoulder.axis", "3 entries", "not 2"),
    )
    yield "a negative mass", changed('"1 + load"', "-1"), ("the mass -1 is negative", "positive number of kg")
    yield (
        "an inertia of no body",
        changed("[0.03, 0.03, 0.002]", "[1, 0.1, 0.1]"),
        ("triangle inequality", "centre of mass"),
    )
    yield "a name that is not there", changed("2 * sin(t)", "2 * sin(tt)"), ("unknown name 'tt'", "column 9", "try: t")
    yield (
        "Python in a formula",
        changed("2 * sin(t)", "__import__('os')"),
        ("inputs.motor.formula", "not part of formulas"),
    )
    yield "^ for a power", changed("2 * sin(t)", "t^2"), ("'^' is not part of formulas", "** for powers")
    yield "an open bracket", changed("2 * sin(t)", "2 * sin(t"), ("not well formed", "matching brackets")
    yield "a number as NumPy writes it", changed("2 * sin(t)", "np.float64(0.3)"), ("np.float64", "the number alone")
    more = '[inputs.spare]\nunit = "N"\n'
    yield "an input that nothing uses", changed("", "", more), ("the input spare changes nothing", "no formula")
    yield (
        "30 for 30 degrees",
        changed("axis = [0, 1, 0]", "axis = [0, 1, 0]\ninitial = { position = 30 }"),
        ("30 rad, 4.77 turns", '"30 deg"'),
    )
    yield "another format", changed("format = 1", "format = 2"), ("scene.toml:1 (format)", "try: format = 1")
    yield "no TOML", lambda: scene_of("format = 1\nname = arm\n"), ("scene.toml:2", "not TOML", "texts in quotes")
    yield "a file that is not there", lambda: eomgen.load("nowhere.toml"), ("'nowhere.toml'", "No such file")
    yield (
        "a kind of file that is none",
        lambda: eomgen.load("scene.txt"),
        ("not a kind of file", ".toml scene, a .urdf file, an .xml file of MuJoCo or an .sdf file"),
    )
    yield (
        "a name with a space",
        changed("", "", '[bodies."my body"]\nmass = 1\n'),
        ("'my body' is not legal", "letters, digits"),
    )
    yield (
        "an initial state of another name",
        changed("axis = [0, 1, 0]", "axis = [0, 1, 0]\ninitial = { angle = 0.3 }"),
        ("'angle' is unknown here", "position"),
    )
    yield "a table that is there twice", changed("", "", '[points.tip]\nbody = "upper"\n'), ("scene.toml:32", "twice")


def _calls() -> Iterator[tuple[str, Callable[[], Any], tuple[str, ...]]]:
    yield "simulate(u=)", runs(u={"motor": 1}), ("no argument 'u'", "try: inputs")
    yield "simulate(dt=)", runs(dt=1e-3), ("no argument 'dt'", "try: step")
    yield "load(dict) that is no scene", lambda: eomgen.load({"format": 1}), ("scene (name)", "try: name =")
    yield "load(Scene)", lambda: repr(eomgen.load(scene_of(SCENE))), ("<Scene arm",)
    yield "Model of a path", lambda: eomgen.Model("scene.toml"), ('eomgen.build("scene.toml")',)
    yield (
        "joint(axes=)",
        lambda: eomgen.SceneBuilder("a").joint("j", "revolute", "base", "b", axes=[0, 1, 0]),
        ("'axes'", "try: axis"),
    )
    yield (
        "scene.simulate",
        lambda: scene_of(SCENE).simulate(1.0),
        ("a Scene has no 'simulate'", "eomgen.build(scene).simulate"),
    )
    yield (
        "system.simulate",
        lambda: eomgen.derive(scene_of(SCENE), ["mass"]).simulate(1.0),
        ("a System has no", "eomgen.build"),
    )
    yield "eomgen.simulate", lambda: eomgen.simulate, ("no attribute 'simulate'", "eomgen.build(scene).simulate")
    yield "the term inertia", lambda: eomgen.build(scene_of(SCENE), terms=["inertia"]), ("'inertia'", "try: mass")
    yield (
        "an output that is not there",
        lambda: arm().simulate(0.01, 1e-3).outputs["tipp"],
        ("no output 'tipp'", "try: tip"),
    )
    yield (
        "a column that is not there",
        lambda: arm().simulate(0.01, 1e-3)["q.elbow"],
        ("no column 'q.elbow'", "q.shoulder"),
    )
    yield (
        "a step longer than the run",
        runs(t_end=0.5, step=1.0),
        ("reached t = 0.5 s in 1 steps", "do not resolve", "try: a step of"),
    )
    yield "a q that is too long", lambda: arm().mass([0.1, 0.2]), ("the shape is (2,)", "q as a list of 1 number")
    yield "a q of text", lambda: arm().mass("zero"), ("q: an array of real numbers", "not str")
    yield "no v", lambda: arm().coupling([0.1]), ("the argument v is missing", "try: v=")
    yield "a method that is none", runs(method="rk5"), ("no method 'rk5'", "rk45 or rk4")
    yield "an input that is not there", runs(inputs={"motr": 1.0}), ("no input 'motr'", "try: motor")
    yield (
        "an input function without t",
        runs(inputs={"motor": lambda: 1.0}),
        ("input motor: the function failed at t = 0 s", "positional arguments"),
    )
    yield (
        "a table that is too short",
        runs(inputs={"motor": np.ones(5)}),
        ("(101,) is needed", "a table of that length"),
    )
    yield "a parameter that is not there", runs(parameters={"lod": 2.0}), ("no parameter 'lod'", "try: load")
    yield "a fixed parameter", runs(parameters={"length": 2.0}), ("fixed in the code", "tunable = true")
    yield (
        "a parameter that is not a number",
        runs(parameters={"load": float("nan")}),
        ("load is nan", "a finite number"),
    )
    yield (
        "a mass made negative",
        runs(parameters={"load": -3.0}),
        ("the mass -2 is negative at load = -3", "positive number"),
    )
    yield "a length as a mass", runs(parameters={"load": "3 m"}), ("'3 m' is a length", '"3 kg"')
    yield "a joint that is not there", runs(initial={"elbow": 0.3}), ("no joint 'elbow'", "shoulder")
    yield "an end before the start", runs(t_end=-1.0), ("lies before the start", "a later t_end")
    yield "a step of zero", runs(step=0.0), ("the step must be positive, not 0", "1e-3")
    yield (
        "a term that was not built",
        lambda: eomgen.build(scene_of(SCENE), terms=["mass"], profile="quick").energy([0.1], [0.0]),
        ("the term energy is not in this model", "terms=[..."),
    )
    yield "1e12 rows", runs(t_end=1e6, step=1e-6), ("GB", "try: record_every")
    yield "a time outside the run", lambda: arm().simulate(0.01, 1e-3).at(5.0), ("outside the solution", "a longer run")
    yield (
        "units in initial and t_end",
        lambda: arm().simulate("10 ms", 1e-3, initial={"shoulder": "30 deg"})["q.shoulder"][0],
        ("0.52359877559829",),
    )


def _motions() -> Iterator[tuple[str, Callable[[], Any], tuple[str, ...]]]:
    explicit = {"method": "rk4"}
    yield (
        "rk4 that overflows",
        run_of(stiff(), 1.0, 1e-2, **explicit),
        ("but the method is unstable at this step", "try: a step of 0.0025 s"),
    )
    yield (
        "rk4 that grows",
        run_of(stiff(), 0.3, 1e-2, **explicit),
        ("but the method is unstable at this step", "generalized_alpha"),
    )
    yield (
        "rk4 that is barely unstable",
        run_of(stiff(), 1.0, 2.9e-3, **explicit),
        ("but the method is unstable at this step", "try: a step of"),
    )
    yield (
        "a step that is too coarse",
        run_of(stiff(), 1.0, 1e-2),
        ("the estimated error is", "out of balance by 100 %", "159 Hz"),
    )
    yield "a drive that jumps", driven("1 if t > 0.5 else 0"), ("jumps from 0 to 1 rad at t = 0.5 s", "smooth")
    yield (
        "a base that jumps",
        lambda: eomgen.build(slider().base(position=["0 if t < 1 else 0.1", 0, 0]).build()),
        ("the position of the base jumps", "smooth"),
    )
    yield "a run shorter than a step", run_of(pendulum(), 1e-4, 1e-3), ("reached t = 0.0001 s",)
    yield (
        "a step of ten periods",
        run_of(pendulum(), 100.0, 10.0),
        ("but the step was halved", "% of a turn", "try: a step smaller"),
    )
    yield (
        "a four-bar that cannot close",
        run_of(four_bar(), 1.0, 1e-3),
        ("close: origins meet along x by", "lengths and axes that fit"),
    )
    yield (
        "a quaternion of length 1/2",
        run_of(
            eomgen.SceneBuilder("free").body("m", 1.0, inertia=[1, 2, 3]).joint("f", "free", "base", "m"),
            0.1,
            1e-3,
            initial={"q": [0.5, 0, 0, 0, 0, 0, 0], "v": np.zeros(6)},
        ),
        ("has length 0.5, not 1", "divided by its length"),
    )
    yield (
        "an absurd tolerance",
        run_of(pendulum(), 1.0, 0.1, method="taylor", tolerance=1e-30),
        ("far below the resolution of double precision", "1e-16"),
    )
    yield (
        "an input that raises",
        run_of(pushed(), 1.0, 1e-3, inputs={"u": lambda t: 0.0 if t < 0.5 else {}["x"]}),
        ("stopped at t =", "input u: the function failed", "KeyError"),
    )
    yield (
        "an input that is not a number",
        run_of(pushed(), 1.0, 1e-3, inputs={"u": lambda t: float("nan") if t > 0.5 else 0.0}),
        ("the function gives nan", "finite numbers over the whole run"),
    )
    yield (
        "equations that diverge",
        run_of(slider(initial={"position": 1.0}).effort("e", "x", "q.x**3"), 10.0, 1e-3),
        ("stopped at", "it is the equations that diverge"),
    )
    yield (
        "a root of a negative number",
        run_of(slider(initial={"position": 1.0, "velocity": -3.0}).effort("e", "x", "sqrt(q.x)"), 3.0, 1e-3),
        ("the first block that is not finite is Q", "v.x", "try:"),
    )
    yield (
        "an output without a value",
        run_of(slider(initial={"position": 1.0, "velocity": -3.0}).output("y", formula="log(q.x)"), 3.0, 1e-3),
        ("the output y (2667 of 3001 rows, from t = 0.334 s) has no value", "no root or logarithm"),
    )
    still = (
        slider()
        .point("a", "m", [0, 0, 0])
        .point("o", "base", [0, 0, 0])
        .spring("s", "a", "o", stiffness=10, length=1.0)
    )
    yield "a spring without length", run_of(still, 3.0, 1e-3), ("the first block that is not finite is Q", "t = 0 s")
    passing = slider(initial={"position": 2.5}).point("a", "m", [0, 0, 0]).point("o", "base", [0, 0, 0])
    passing = passing.spring("s", "a", "o", stiffness=10, length=1.0)
    yield "a spring through zero length", run_of(passing, 3.0, 1e-3), ("the ends of the spring s at t =", "try: limits")
    yield (
        "negative damping",
        run_of(slider(stiffness=100, damping=-5, initial={"position": 0.1}), 50.0, 1e-2),
        ("the estimated error is", "try: a step smaller"),
    )
    yield (
        "an attraction into a point",
        run_of(slider(initial={"position": 1.0, "velocity": -1.0}).effort("e", "x", "-1 / q.x"), 3.0, 1e-3),
        ("the step was halved", "the estimated error is", "try:"),
    )


MISTAKES = [
    Mistake(group, *row)
    for group, rows in (("files", _files()), ("calls", _calls()), ("motions", _motions()))
    for row in rows
]


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for mistake in MISTAKES:
            if mistake.group in (sys.argv[1:] or ("files", "calls", "motions")):
                sys.stdout.write(f"{mistake.group}: {mistake.what}\n    {mistake.answer()}\n")


if __name__ == "__main__":
    main()
