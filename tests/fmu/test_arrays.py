"""Vectors as arrays of FMI 3.0: the same numbers as by scalars, in runs, by reference and in derivatives."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.validation import validate_fmu

from eomgen.products.fmu.export import fmu_files
from tests.fmu.importers import Unit, run, toolbox_findings, written

EXAMPLES = Path(__file__).parents[2] / "examples"
BODY = EXAMPLES / "free_spinning_body" / "scene.toml"


@cache
def file_of(*, arrays: bool) -> Path:
    return written(BODY, 3, arrays=arrays)


@cache
def texts(**options: Any) -> Any:
    return fmu_files(BODY, binary=False, reference=False, **options)


def numbers_of(name: str) -> tuple[str, ...]:
    """Return the scalars of an array of the body."""
    first = {"q.free.orientation": 0, "q.free.position": 4, "v.free.angular": 0, "v.free.linear": 3}
    inner = name.removeprefix("der(").removesuffix(")")
    size = 4 if inner.endswith("orientation") else 3
    if inner not in first:
        return (name,) if name in ("time", "energy") else tuple(f"{name}[{k}]" for k in range(size))
    labels = [f"{inner[:6]}[{first[inner] + k}]" for k in range(size)]
    return tuple(labels if inner == name else [f"der({label})" for label in labels])


@pytest.mark.slow
def test_vectors_are_variables_with_a_dimension() -> None:
    files = texts(arrays=True).files
    text = str(files["modelDescription.xml"])
    orientation = 'name="q.free.orientation" valueReference="1" causality="local" variability="continuous"'
    assert (
        f'{orientation} initial="exact" start="1.0 0.0 0.0 0.0" reinit="true">\n      <Dimension start="4" />' in text
    )
    assert 'name="der(v.free.angular)" valueReference="21"' in text and 'derivative="8"' in text
    assert 'name="energy" valueReference="33"' in text and text.count("<Dimension") == 10
    assert '<ContinuousStateDerivative valueReference="18" dependencies="1 11" dependenciesKind=' in text
    assert "size_of[34]" in str(files["sources/free_spinning_body_fmi3.c"])
    assert texts().files["modelDescription.xml"] != text and "<Dimension" not in str(texts().files)


@pytest.mark.long
@pytest.mark.slow
def test_runs_have_the_numbers_of_scalars() -> None:
    file = file_of(arrays=True)
    assert validate_fmu(str(file)) == [] and toolbox_findings(file) == []
    names = ["q.free.orientation", "q.free.position", "v.free.angular", "v.free.linear", "omega", "handle", "energy"]
    scalars = [label for name in names for label in numbers_of(name)]
    for kind in ("CoSimulation", "ModelExchange"):
        rows = run(file, kind, 0.1, 1e-3, output=names)
        plain = run(file_of(arrays=False), kind, 0.1, 1e-3, output=scalars)
        table = np.concatenate([np.reshape(rows[name], (len(rows["time"]), -1)) for name in names], axis=1)
        assert np.array_equal(table, np.stack([plain[name] for name in scalars], axis=1)), kind


@pytest.mark.slow
def test_values_and_derivatives_are_in_the_order_of_the_numbers(rng: np.random.Generator) -> None:
    units = [Unit(file_of(arrays=arrays), "me") for arrays in (True, False)]
    loaded, plain = (unit.fmu for unit in units)
    knowns = ["v.free.linear", "q.free.orientation", "v.free.angular"]
    unknowns = ["omega", "der(q.free.position)", "energy", "der(v.free.angular)", "der(q.free.orientation)"]

    def references(names: list[str]) -> tuple[list[int], list[int]]:
        whole = [units[0].places[name] for name in names]
        return whole, [units[1].places[label] for name in names for label in numbers_of(name)]

    (known, single_known), (unknown, single_unknown) = references(knowns), references(unknowns)
    values = rng.normal(size=10)
    loaded.setFloat64(known, list(values))
    plain.setFloat64(single_known, list(values))
    assert loaded.getFloat64(known, nValues=10) == list(values)
    assert loaded.getFloat64(unknown, nValues=14) == plain.getFloat64(single_unknown)
    seed = list(rng.normal(size=10))
    along = loaded.getDirectionalDerivative(unknown, known, seed, nSensitivity=14)
    assert along == plain.getDirectionalDerivative(single_unknown, single_known, seed) and np.any(along)
    seed = list(rng.normal(size=14))
    back = loaded.getAdjointDerivative(unknown, known, seed, nSensitivity=10)
    assert back == plain.getAdjointDerivative(single_unknown, single_known, seed, nSensitivity=10) and np.any(back)


@pytest.mark.slow
def test_wrong_references_and_sizes_are_refused() -> None:
    unit = Unit(file_of(arrays=True), "me")
    for references, count, message in (
        ([2], 1, "the value reference 2 is within an array, which has the one of its first number"),
        ([99], 1, "no variable has the value reference 99; the last one is 33"),
        ([1], 3, "fmi3GetFloat64: 3 values, but the variables have 4"),
        ([1] * 9, 36, "one call is for 34 numbers at most, all of the model"),
    ):
        unit.refuses(message, lambda known=references, size=count: unit.fmu.getFloat64(known, nValues=size))
    sizes = "the sizes of seed and sensitivity do not fit"
    unit.refuses(sizes, lambda: unit.fmu.getDirectionalDerivative([14], [8], [1.0], nSensitivity=4))


@pytest.mark.slow
def test_scenes_with_constraints_have_arrays() -> None:
    scene = EXAMPLES / "four_bar" / "scene.toml"
    file = written(scene, 3, arrays=True, dae=True)
    assert validate_fmu(str(file)) == []
    rows = run(file, "CoSimulation", 0.01, 1e-3, output=["tracer", "speed"])
    plain = run(written(scene, 3), "CoSimulation", 0.01, 1e-3, output=["tracer[0]", "tracer[2]", "speed"])
    assert np.array_equal(rows["tracer"][:, 0], plain["tracer[0]"]) and np.array_equal(rows["speed"], plain["speed"])
    assert rows["tracer"].shape == (len(plain["time"]), 3)
