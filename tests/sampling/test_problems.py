"""Posteriors of files against those that are made by calls, and what files may not say."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError
from eomgen.fields import (
    FieldPosterior,
    LinearOperator,
    Mesh,
    amplitude,
    difference,
    lognormal_amplitude,
    mask,
    poisson,
    smoothing,
)
from eomgen.products.fields.documents.field_reading import fields_from_data, load_fields
from eomgen.sampling import FieldProblem, field_problem, sample
from eomgen.scene.sources.toml import toml_data
from tests.fields.density import power
from tests.sampling.files import changed

EXAMPLE = Path(__file__).parents[2] / "examples" / "density_field" / "system" / "density_field.toml"
MESH = Mesh((8, 6, 5), (40.0, 30.0, 25.0))


def stream(seed: int = 5) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(seed))


def problem(folder: Path | None = None, **changes: Any) -> FieldProblem:
    return field_problem(fields_from_data(changed(**changes), folder=folder))


def spectrum_of(k: Array) -> Array:
    return np.asarray(300.0 * np.exp(-((4.0 * k) ** 2)))


def test_a_file_is_the_posterior_that_calls_make() -> None:
    made = problem()
    operator = amplitude(MESH, spectrum_of)
    truth = MESH.white(stream(3))
    assert made.truth == pytest.approx(truth, abs=0)
    assert made.true_field() == pytest.approx(operator.apply(truth), abs=1e-13)
    counts = made.posterior.data["counts"]
    by_calls = FieldPosterior(MESH, poisson(0.7, operator.variance), {"s": operator}, {"counts": counts})
    x = MESH.white(stream())
    assert made.posterior.energy(x) == pytest.approx(by_calls.energy(x), rel=1e-14)
    assert made.posterior.gradient(x) == pytest.approx(by_calls.gradient(x), abs=1e-13)


#: A definition for each kind of formula, one of another that follows, and the formulas with their definitions in place.
DEFINED: dict[str, Any] = {
    "definitions": {"q": "(radius*k)**2", "e": "log(mean) + contrast", "contrast": "s - s_variance/2", "edge": 20},
    "operators": {"s": {"power": "300*exp(-q)"}, "half": {"mask": "1 if x < edge else 0"}},
    "data": {"counts": {"poisson": "mean*exp(contrast)"}},
    "cell": {"energy": "part - counts*e + half**2", "where": {"part": "exp(e)"}},
}
WRITTEN: dict[str, Any] = {
    "operators": {"s": {"power": "300*exp(-((radius*k)**2))"}, "half": {"mask": "1 if x < 20 else 0"}},
    "data": {"counts": {"poisson": "mean*exp((s - s_variance/2))"}},
    "cell": {
        "energy": "part - counts*(log(mean) + (s - s_variance/2)) + half**2",
        "where": {"part": "exp((log(mean) + (s - s_variance/2)))"},
    },
}


@pytest.mark.slow
def test_definitions_are_the_text_in_their_place_with_paragraphs_of_their_own_in_the_c() -> None:
    """Energy, gradient and products with the Hessian have the same bits; an expression is evaluated once."""
    defined, written = problem(**DEFINED), problem(**WRITTEN)
    x, along = MESH.white(stream()), MESH.white(stream(7))
    assert defined.truth is not None and written.truth is not None
    assert np.array_equal(defined.posterior.data["counts"], written.posterior.data["counts"])
    assert defined.posterior.energy(x) == written.posterior.energy(x)
    assert np.array_equal(defined.posterior.gradient(x), written.posterior.gradient(x))
    assert np.array_equal(defined.posterior.hessian(x)(along), written.posterior.hessian(x)(along))
    text = defined.posterior.source
    assert "/* Definition e */" in text and "e_value" in text
    assert text.count("EG_EXP(") == written.posterior.source.count("EG_EXP(")
    assert not defined.system.notes


def test_counts_of_a_file_are_drawn_about_the_truth() -> None:
    made = problem(mesh__cells=[32, 32], mesh__length=160.0, parameters__mean=3.0)
    true = made.true_field()
    assert true is not None
    mean = 3.0 * np.exp(true - made.operators["s"].variance / 2)
    off = (made.posterior.data["counts"] - mean) / np.sqrt(mean)
    assert abs(off.mean()) < 3.0 / 32 and off.std() == pytest.approx(1.0, abs=0.1)
    again = problem(mesh__cells=[32, 32], mesh__length=160.0, parameters__mean=3.0)
    assert again.digest == made.digest
    other = problem(mesh__cells=[32, 32], mesh__length=160.0, parameters__mean=3.0, truth__seed=4)
    assert other.digest != made.digest


def test_memory_counts_what_settings_ask_for() -> None:
    """Samples that are kept, chains with a gradient each where trajectories begin with kicks, a second precision."""
    base = {"chains": 2, "warm_up": 6, "samples": 10, "watched": 20, "bins": 3}

    def memory(**more: Any) -> int:
        return problem(sampling={**base, **more}).memory

    spectrum, field = 16 * 8 * 6 * 3, 8 * MESH.size
    assert memory(samples=1010) - memory() == 8 * 2 * 1000 * (20 + 3 + 4)
    assert memory(warm_up=106) - memory() == 8 * 2 * 100 * 4
    assert memory(chains=3) - memory() == 2 * spectrum + 8 * (10 * 27 + 6 * 4)
    assert memory() - memory(first="drift") == 3 * spectrum
    assert memory(precision="single") - memory() == spectrum + field


@pytest.mark.parametrize(
    ("entry", "spread"),
    [
        ({"normal": "2*s", "deviation": "0.5"}, lambda mean: 0.25 + 0.0 * mean),
        ({"negative_binomial": "4*exp(s - s_variance/2)", "beta": "2"}, lambda mean: mean + mean**2 / 2),
    ],
)
def test_what_is_drawn_has_its_mean_and_its_variance(entry: dict[str, str], spread: Any) -> None:
    made = problem(mesh__cells=[64, 64], mesh__length=320.0, data={"seen": entry}, cell={"energy": "(s - seen)**2"})
    s = made.true_field()
    assert s is not None
    mean = 2.0 * s if "normal" in entry else 4.0 * np.exp(s - made.operators["s"].variance / 2)
    off = (made.posterior.data["seen"] - mean) / np.sqrt(spread(mean))
    assert abs(off.mean()) < 3.0 / 64 and off.std() == pytest.approx(1.0, abs=0.08)


def test_operators_of_a_file_are_those_of_calls() -> None:
    made = problem(
        operators__slope={"difference": "x", "of": "s"},
        operators__smooth={"smoothing": "2*radius", "of": "slope"},
        operators__seen={"mask": "1 if x < 20 else 0", "of": "smooth"},
        operators__logs={"lognormal_power": "P0*q", "where": {"P0": "200", "q": "exp(-(4*k)**2)"}},
        operators__narrow={"filter": "exp(-(3*kx)**2 - (2*kz)**2)*volume"},
        operators__noise={"white": True},
    )
    s = amplitude(MESH, spectrum_of)
    half = np.zeros(MESH.cells)
    half[:4] = 1.0
    kx, _, kz = MESH.wave_vectors
    by_calls = {
        "s": s,
        "slope": difference(MESH, 0) @ s,
        "seen": mask(MESH, half) @ smoothing(MESH, 8.0) @ difference(MESH, 0) @ s,
        "logs": lognormal_amplitude(MESH, lambda k: 200.0 * np.exp(-((4.0 * k) ** 2))),
        "narrow": LinearOperator("narrow", MESH, 125 * np.exp(-((3 * kx) ** 2) - (2 * kz) ** 2 + np.zeros(MESH.half))),
        "noise": LinearOperator("white", MESH),
    }
    x = MESH.white(stream())
    for name, operator in by_calls.items():
        assert made.operators[name].apply(x) == pytest.approx(operator.apply(x), abs=1e-13), name
        assert made.operators[name].dot_test(stream()) < 1e-13
    assert made.system.fields == ("s",)  # what the energy names


def test_data_come_from_files_and_formulas(tmp_path: Path) -> None:
    counts = stream().poisson(0.8, MESH.cells)
    np.save(tmp_path / "counts.npy", counts)
    rows = "\n".join(str(value) for value in counts.ravel())
    (tmp_path / "counts.csv").write_text(f"counts\n{rows}\n", encoding="utf-8")
    rows = "\n".join(f"{place},{value}" for place, value in enumerate(counts.ravel()))
    (tmp_path / "two.csv").write_text(f"i,n\n{rows}\n", encoding="utf-8")
    for entry in ("counts.npy", "counts.csv", {"file": "two.csv", "column": "n"}):
        made = problem(tmp_path, data__counts=entry, truth=None)
        assert np.array_equal(made.posterior.data["counts"], counts)
        assert made.truth is None and made.true_field() is None
    linear = problem(truth=None, data={"slope": "x/40", "counts": "1 + 2*slope + 0*y*z"})
    x = (np.arange(8) + 0.5) / 8
    assert linear.posterior.data["counts"][:, 2, 3] == pytest.approx(1 + 2 * x, abs=1e-15)


def test_a_power_spectrum_comes_from_a_table(tmp_path: Path) -> None:
    k = np.geomspace(0.05, 3.0, 40)
    rows = "\n".join(f"{one:.17g},0,{50 / one**1.5:.17g}" for one in k)
    (tmp_path / "power.csv").write_text(f"k,other,P\n{rows}\n", encoding="utf-8")
    made = problem(tmp_path, operators__s={"power": {"file": "power.csv", "columns": ["k", "P"]}})
    symbol = made.operators["s"].symbol
    assert symbol is not None and symbol[0, 0, 0] == 0.0
    numbers = MESH.wave_numbers.ravel()[1:]
    assert symbol.ravel()[1:] ** 2 == pytest.approx(50 / numbers**1.5 / MESH.cell_volume, rel=1e-10)


def test_the_power_of_the_example_is_that_of_the_benchmarks() -> None:
    """The formula of its file against NumPy's, whose variance is that of spheres of 8 Mpc/h by an integral."""
    system = load_fields(EXAMPLE)
    assert system.cells == (64, 64, 64)
    made = field_problem(replace(system, cells=(16,) * 3, lengths=(78.125,) * 3))
    symbol = made.operators["density"].symbol
    assert symbol is not None
    assert symbol == pytest.approx(lognormal_amplitude(made.mesh, power).symbol, rel=1e-9)
    assert math.sqrt(made.operators["density"].variance) == pytest.approx(0.9671, abs=5e-5)


def message(folder: Path | None = None, **changes: Any) -> str:
    with pytest.raises(EomgenError) as caught:
        problem(folder, **changes)
    return str(caught.value)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"mesh": {}}, "mesh.cells): the key cells is missing; try: 1 to 3 whole numbers from 2 on"),
        ({"mesh__cells": [8, 1]}, "mesh.cells): the numbers of cells cannot be [8, 1]; try: 1 to 3"),
        ({"mesh__length": -1.0}, "mesh.length): the length of the box cannot be -1.0; try: a number above 0"),
        ({"kind": "scene"}, "this is not a file of fields: a system to be sampled has a kind and a mesh"),
        ({"mesh": None}, "there is no mesh: sampling draws fields on the cells of a mesh, not motions of coordinates"),
        ({"operators__s": {"power": "k", "filter": "k"}}, "operators.s): power, filter are said together"),
        ({"operators__s": {}}, "operators.s): no key gives its kind; try: one of white, power"),
        ({"operators__s__power": "q"}, "operators.s.power): unknown name 'q'"),
        (
            {"operators__t": {"difference": "z"}, "mesh": {"cells": [8, 6], "length": 9.0}},
            "operators.t.difference): there is no axis 'z'; try: one of x, y",
        ),
        ({"operators__t": {"smoothing": -2.0}}, "operators.t.smoothing): the radius is -2; try: a radius from 0 on"),
        ({"operators__t": {"white": True, "of": "u"}}, "operators.t.of): there is no operator 'u' above this one"),
        ({"cell__where": {"pi": "3"}}, "cell.where.pi): the name pi is a word of formulas; try: pi_value"),
        ({"parameters__s_variance": 1.0}, "parameters.s_variance): this is the name of the variance of s"),
        ({"prior": {"white": False}}, "try: white = true, and an operator that gives the field its covariance"),
        ({"truth": None}, "data.counts): counts is drawn about fields of a truth that is missing; try: [truth]"),
        ({"truth__seed": 2**63}, "try: 9223372036854775807 or less"),
        ({"data__counts": {"normal": "s"}}, "data.counts): deviation is missing"),
        ({"data__counts": {"poisson": "t"}}, "data.counts.poisson): time t cannot be used here"),
        ({"cell__energy": "exp(e) - count*e"}, "cell.energy): unknown name 'count' (column 10); try: counts"),
        ({"cell__where": {"mean": "1"}}, "cell.where.mean): the name 'mean' is taken; try"),
        ({"definitions": {"a": "b + 1", "b": "2*a"}}, "definitions.b): the definition a mentions itself"),
        ({"definitions__a": "4*k", "cell__energy": "a*s"}, "cell.energy): in the definition a, unknown name 'k'"),
        (
            {"definitions": {f"d{n}": f"d{n + 1} + 1" if n < 200 else "s" for n in range(201)}, "cell__energy": "d0"},
            "150 operations in 151 levels, of 20000 and 150 at most",
        ),
        ({"sampling__guard": math.nan}, "sampling.guard): nan is out of range here: it should be greater than 0; try:"),
        ({"definitions__a": "2", "operators__t": {"smoothing": "a"}}, "unknown name 'a' (column 1); try: the formula"),
        ({"sampling__field": "r"}, "sampling.field): there is no field 'r' in the energy; try: s"),
        # what only numbers tell
        ({"operators__s__power": "100 - 300*k"}, "operators.s): the power is -"),
        ({"operators__s__power": "0"}, "operators.s): the field s is 0 in all cells, and so are all of its samples"),
        ({"operators__s__power": "1/k"}, "operators.s): the power is nan at k = 0; try: finite values from 0 on"),
        ({"operators__s__power": "exp(-(kx - 0.1)**2)"}, "operators.s): the power is not the same at k and at -k,"),
        ({"operators__s": {"filter": "1/k"}}, "operators.s): the filter has no finite value at k = 0"),
        (
            {"operators__m": {"mask": "1"}, "operators__t": {"smoothing": 1.0, "of": "m"}},
            "operators.t): a filter after a mask is diagonal neither in Fourier space nor in the cells",
        ),
        ({"data__counts": "-1.0*z", "truth": None}, "data.counts): 240 cells out of range: -2.5 at (0, 0, 0)"),
        ({"data__counts": {"poisson": "s"}}, "data.counts): the mean of drawn fields is -"),
        ({"data__counts": {"negative_binomial": "3", "beta": "0"}}, "fields is 0 somewhere, or not finite"),
        ({"sampling__chains": 10**9}, "mesh.cells): sampling with 1000000000 chains on 8 x 6 x 5 cells takes"),
    ],
)  # fmt: skip  # a table
def test_what_files_may_not_say(changes: dict[str, Any], text: str) -> None:
    found = message(**changes)
    assert text in found
    assert found.count("\n") <= 2


def test_steps_may_have_no_guard() -> None:
    assert problem(sampling__guard=math.inf).system.sampling.guard == math.inf
    with pytest.raises(EomgenError, match="guard"):
        sample(changed(sampling__guard=2))


@pytest.mark.parametrize(
    "changes",
    [
        {"operators__s__of": 1, "operators__t": {"smoothing": 1.0, "of": "s"}, "sampling__field": "t"},
        {"operators__s": {"white": True, "power": "k"}, "operators__t": {"smoothing": 1.0, "of": "s"}},
        {"parameters__shape": {"value": 1.0, "unit": 1}, "operators__s__power": "shape*exp(-k)"},
        {"parameters__shape": [1.0], "parameters__half": "shape/2", "cell__energy": "(shape + half)*s - counts"},
        {"data__seen": {"formula": 1, "column": 1}, "data__more": "2*seen", "sampling__field": "s"},
        {"definitions__shape": True, "definitions__half": "shape/2", "operators__s__power": "half*exp(-k)"},
    ],
)
def test_entries_with_a_fault_are_no_unknown_names(changes: dict[str, Any]) -> None:
    with pytest.raises(EomgenError) as caught:
        problem(**changes)
    assert len(caught.value.problems) == 1, caught.value


def test_files_of_data_that_cannot_be_taken(tmp_path: Path) -> None:
    np.save(tmp_path / "flat.npy", np.ones((4, 4)))
    np.save(tmp_path / "complex.npy", np.ones(MESH.cells, complex))
    below = np.ones(MESH.cells)
    below[1, 2, 3] = -2.0
    np.save(tmp_path / "below.npy", below)
    (tmp_path / "text.npy").write_text("no array", encoding="utf-8")
    (tmp_path / "two.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    (tmp_path / "k.csv").write_text("k,P\n0.1,2\n0.2,-1\n", encoding="utf-8")
    (tmp_path / "short.csv").write_text("k,P\n0.1,2\n0.2,1\n", encoding="utf-8")

    def of_data(entry: Any) -> str:
        return message(tmp_path, data__counts=entry, truth=None)

    assert f"flat.npy has the shape (4, 4), and the mesh {MESH.cells}" in of_data("flat.npy")
    assert "complex128 are not real numbers" in of_data("complex.npy")
    assert "data.counts): 1 cell out of range: -2 at (1, 2, 3); try: finite numbers from 0 on" in of_data("below.npy")
    assert problem(tmp_path, data__counts={"file": "below.npy", "minimum": -3.0}, truth=None).posterior.data
    np.save(tmp_path / "objects.npy", np.array([{}] * 3, dtype=object))
    (tmp_path / "empty.npy").touch()
    for file in ("text.npy", "objects.npy", "empty.npy"):
        assert of_data(file).endswith("this is not a .npy file of numbers; try: numpy.save of an array of real numbers")
    assert "none.npy: cannot be read" in of_data("none.npy")
    assert "there is no column 'counts'; try: column = one of a, b in data.counts" in of_data("two.csv")
    assert "two.csv has 1 row, and the mesh 240 cells" in of_data({"file": "two.csv", "column": "a"})
    assert problem(tmp_path, data__counts="1.5e1/2.5", truth=None).posterior.data["counts"][0, 0, 0] == 6.0

    def of_power(file: str) -> str:
        return message(tmp_path, operators__s={"power": {"file": file}})

    text = "k = 0.2, P = -1 in row 2 are not positive or in order; try: k above 0 that increases, and P above 0"
    assert text in of_power("k.csv")
    assert "the table is from k = 0.1 to 0.2, the mesh from 0.157" in of_power("short.csv")


def test_messages_say_the_line() -> None:
    text = EXAMPLE.read_text(encoding="utf-8").replace("power_at_shape_one*k**tilt", "-k**tilt")
    line = 1 + text[: text.index("[operators.density]")].count("\n")
    path = EXAMPLE.with_name("wrong.toml")
    data, lines = toml_data(text, path.name)
    data["mesh"]["cells"] = [8, 8, 8]
    with pytest.raises(EomgenError, match=rf"wrong\.toml:{line} \(operators\.density\): the power is -"):
        field_problem(fields_from_data(data, file=path.name, lines=lines))
