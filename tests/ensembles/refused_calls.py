"""Refused calls of ensembles from Python with their texts."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from eomgen.products.ensembles import command, designs, simulate_many, statistics, variations
from eomgen.products.ensembles.distributions import read_distribution

NORMAL = read_distribution("vary x", "normal(0, 1)")

SEAS = [SimpleNamespace(name="sea", variables=()), SimpleNamespace(name="swell", variables=("swell_z1",))]
GUST = SimpleNamespace(follows="wind", own_variables=())
MODEL: Any = SimpleNamespace(
    description=SimpleNamespace(
        parts={"waves": SEAS},
        inputs=[SimpleNamespace(name="gust", given=True, road=None, series=GUST)],
    ),
    scene=SimpleNamespace(curves=()), parameters={}, inputs=("gust",), input_units={}, states=(), z_units=(),
    q_names=("q.free[0]",), q_units=("1",), v_names=("v.free[0]",), v_units=("rad/s",),
    evaluator=SimpleNamespace(parameter_units={}, fixed_parameters=("length",)),
)  # fmt: skip

REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "seed of fixed waves": (
        lambda: variations.find_variation(MODEL, "seed.sea"),
        "vary seed.sea: sea are waves, whose numbers are fixed in the code; try: variables = true in [waves.sea]",
    ),
    "factor of waves": (
        lambda: variations.find_variation(MODEL, "scale.swell"),
        'vary scale.swell: swell are waves, which are as high as their spectrum says; try: height = "height" in the'
        " spectrum of [waves.swell], a tunable parameter, which varies",
    ),
    "seed of a follower": (
        lambda: variations.find_variation(MODEL, "seed.gust"),
        "vary seed.gust: the random process gust follows wind, and has its variables; try: seed.wind",
    ),
    "part of a quaternion": (
        lambda: variations.find_variation(MODEL, "q.free[0]", "table"),
        "table q.free[0]: q.free[0] is a component of a unit quaternion, and its parts are not free; try: initial=..."
        " of all samples, or a joint with an angle",
    ),
    "vary without a distribution": (
        lambda: command._read_variations(("mass=",)),
        "--vary mass=: a name and a distribution are needed; try: --vary 'mass=normal(1, 0.1)'",
    ),
    "vary twice": (
        lambda: command._read_variations(("mass=normal(1, 2)", "mass = uniform(0, 1)")),
        "--vary mass = uniform(0, 1): mass varies twice; try: one distribution for each name",
    ),
    "list of two numbers": (
        lambda: read_distribution("vary x", "linspace(0, 1)"),
        "vary x: linspace takes 3 numbers, not 2; try: linspace(low, high, count)",
    ),
    "latin hypercube": (
        lambda: designs.random_design("latin_hypercube", [NORMAL] * 2, 50_000_001, 0),
        "samples: latin_hypercube makes all of its 100000002 numbers at once, 100000000 at most; try: fewer of them, or"
        " sobol",
    ),
    "no columns": (
        lambda: simulate_many._columns(["t", "q.x", "output.force"], []),
        "columns: no column is looked at; try: one of model.simulate(...).columns()",
    ),
    "unknown column": (
        lambda: simulate_many._columns(["t", "q.x", "output.force"], ["forse"]),
        "columns: there is no column 'forse'; try: force",
    ),
    "resume without a folder": (
        lambda: simulate_many._check_options({}, None, resume=True),
        "resume: there is no folder to go on with; try: folder=..., of an ensemble",
    ),
    "seed of an input": (
        lambda: variations._track(cast(Any, SimpleNamespace(name="force", road=None))),
        "input force: it is not a random road; try: an input with a road of a class",
    ),
    "sample beyond the last": (
        lambda: simulate_many._kept_samples([2, 3], 3, "npz", None),
        "keep: 3 is not the number of a sample; try: 0 to 2",
    ),
    "sample of a truth value": (
        lambda: simulate_many._kept_samples([True], 3, "npz", None),
        "keep: True is not the number of a sample; try: 0 to 2",
    ),
    "Sobol with a failure": (
        lambda: statistics._sobol(8, ["a", "b"], "y", np.array([1.0] * 7 + [np.nan])),
        "sensitivity: Sobol' indices need all 8 samples of the design, and 1 failed or are missing; try: distributions"
        " without failing samples, or another design",
    ),
    "Sobol before the end": (
        lambda: statistics._sobol(8, ["a", "b"], "y", np.ones(6)),
        "sensitivity: Sobol' indices need all 8 samples of the design, and 2 failed or are missing; try: distributions"
        " without failing samples, or another design",
    ),
}
