"""The potential of a field and its derivatives, against NumPy, differences and dense matrices."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError, UsageError
from eomgen.fields import (
    OPERATORS,
    CellEnergy,
    FieldPosterior,
    LinearOperator,
    Mesh,
    Outcome,
    Record,
    Sampler,
    amplitude,
    autocorrelation_time,
    difference,
    gaussian,
    lognormal_amplitude,
    mask,
    negative_binomial,
    poisson,
    smoothing,
    split_r_hat,
    white,
)
from tests.fields.density import density

AXES = (0, 1, 2)
MESHES = [Mesh((9,), 40.0), Mesh((8, 6), (40.0, 25.0)), Mesh((6, 5, 7), 40.0)]


def stream(seed: int = 5) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(seed))


def spectrum_of(k: Array) -> Array:
    return np.asarray(300.0 * np.exp(-((4.0 * k) ** 2)))


def operators(mesh: Mesh) -> list[LinearOperator]:
    made = [amplitude(mesh, spectrum_of), lognormal_amplitude(mesh, spectrum_of, warn=False), smoothing(mesh, 3.0)]
    made += [white(mesh), mask(mesh, stream().random(mesh.cells))]
    made += [difference(mesh, axis) for axis in range(len(mesh.cells))]
    assert {operator.name for operator in made} == set(OPERATORS)
    return [*made, made[4] @ made[-1] @ made[0] @ made[2], made[4] @ made[4]]


@pytest.mark.parametrize("mesh", MESHES, ids=lambda mesh: f"{len(mesh.cells)}d")
def test_adjoints(mesh: Mesh) -> None:
    for operator in operators(mesh):
        assert operator.dot_test(stream()) <= 1e-13, operator.name


@pytest.mark.parametrize("mesh", [MESHES[1], Mesh((5, 7), (25.0, 7.0))])
def test_differences_are_those_of_neighbouring_cells(mesh: Mesh) -> None:
    field = stream().standard_normal(mesh.cells)
    for axis, width in enumerate(np.array(mesh.lengths) / mesh.cells):
        by_cells = (np.roll(field, -1, axis) - np.roll(field, 1, axis)) / (2.0 * width)
        assert difference(mesh, axis).apply(mesh.spectrum(field)) == pytest.approx(by_cells, abs=1e-14)


def test_a_power_spectrum_is_that_of_the_fields() -> None:
    mesh = Mesh((24, 24, 24), 100.0)
    operator = amplitude(mesh, lambda k: 500.0 / (1.0 + (8.0 * k) ** 2))
    drawn = [mesh.power(operator.symbol * mesh.white(stream(seed)), 4) for seed in range(16)]
    k, exact = mesh.power(operator.symbol, 4)
    assert np.all((k > np.array([0.0, 0.25, 0.5, 0.75]) * 0.24 * math.pi) & (k < np.array([0.25, 0.5, 0.75, 1]) * 0.76))
    assert np.mean([power for _, power in drawn], axis=0) == pytest.approx(exact, rel=0.06)
    values = operator.apply(mesh.white(stream()))
    assert values.var() == pytest.approx(operator.variance, rel=0.1)


def test_the_field_of_a_lognormal_one_has_the_published_deviation() -> None:
    """0.9671 and 35.68 are of an implementation in NumPy (research dossier, A5)."""
    operator = density(16)
    assert math.sqrt(operator.variance) == pytest.approx(0.9671, abs=5e-5)
    assert np.max(operator.symbol**2) == pytest.approx(35.68, abs=5e-3)
    contrast = np.exp(operator.apply(operator.mesh.white(stream())) - operator.variance / 2) - 1
    assert abs(contrast.mean()) < 0.2


def of_template(mesh: Mesh, case: str) -> FieldPosterior:
    operator = amplitude(mesh, spectrum_of)
    counts = stream(2).poisson(0.7, mesh.cells).astype(float)
    response = stream(3).random(mesh.cells)
    fields: dict[str, LinearOperator] = {"s": operator}
    data: dict[str, Array] = {"counts": counts}
    energy: CellEnergy | str
    if case == "poisson":
        energy = poisson(0.7, 0.4)
    elif case == "biased":
        energy, data = poisson(0.7, 0.4, 1.6, True), {"counts": counts, "response": response}
    elif case == "negative binomial":
        energy = negative_binomial(0.7, 0.4, 3.0, 1.3)
    elif case == "gaussian":
        energy = gaussian(0.7, 0.4, 0.5)
    elif case == "masked":
        energy, fields = poisson(0.7, 0.4), {"s": mask(mesh, response) @ operator}
    else:  # a density and its gradient, which enter together
        slope = mask(mesh, response) @ difference(mesh, 0) @ operator
        energy, fields = "exp(s)*(1 + gx**2) - counts*s*gx", {"s": operator, "gx": slope}
    return FieldPosterior(mesh, energy, fields, data)


@pytest.mark.parametrize("case", ["poisson", "masked", "two fields"])
def test_derivatives_against_differences(case: str) -> None:
    for mesh in MESHES:
        posterior = of_template(mesh, case)
        x, along = mesh.white(stream()), mesh.white(stream(6))
        along /= math.sqrt(mesh.product(along, along))
        h = 1e-3

        def differences(function: Callable[[float], Any], h: float = h) -> Any:
            return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h)

        gradient = posterior.gradient(x)
        slope = differences(lambda t, p=posterior, x=x, along=along: p.energy(x + t * along))
        size = math.sqrt(mesh.product(gradient, gradient))
        assert abs(mesh.product(gradient, along) - slope) <= 2e-9 * size
        product = posterior.hessian(x)(along)
        change = differences(lambda t, p=posterior, x=x, along=along: p.gradient(x + t * along))
        assert np.abs(product - change).max() <= 2e-9 * np.abs(product).max()


def test_energies_are_summed_with_compensation() -> None:
    large = 1e10 * stream().standard_normal(5003)
    values = np.concatenate([large, [1.0], -large])  # cells that fill no whole vectors at the end
    mesh = Mesh(values.shape, 1.0)
    posterior = FieldPosterior(mesh, "d*cos(s)", {"s": white(mesh)}, {"d": values})
    assert posterior.energy(np.zeros(mesh.half, complex)) == pytest.approx(1.0, abs=1e-12)
    assert abs(np.cumsum(values)[-1] - 1.0) > 1e-6


def dense(posterior: FieldPosterior, x: Any) -> Array:
    """Return the Hessian as a matrix over the cells of the white field."""
    mesh = posterior.mesh
    product = posterior.hessian(x)
    unit = np.eye(mesh.size).reshape(-1, *mesh.cells)
    return np.array([mesh.field(product(mesh.spectrum(row))).ravel() for row in unit])


def test_frequencies_and_masses_against_a_dense_hessian() -> None:
    mesh = Mesh((6, 5), 30.0)
    posterior = of_template(mesh, "biased")
    x = mesh.white(stream())
    hessian = dense(posterior, x)
    assert hessian == pytest.approx(hessian.T, abs=1e-12)
    by_prior = math.sqrt(np.linalg.eigvalsh(hessian)[-1])
    assert posterior.largest_frequency(x, products=200) == pytest.approx(by_prior, rel=1e-6)
    with pytest.raises(UsageError, match="seed: a whole number from 0 on is needed, not -1"):
        posterior.largest_frequency(x, seed=-1)
    mass = posterior.mass("fisher")
    assert mass is not None
    inverse = np.array([mesh.field(mesh.spectrum(row.reshape(mesh.cells)) / mass).ravel() for row in np.eye(mesh.size)])
    by_fisher = math.sqrt(np.linalg.eigvals(inverse @ hessian).real.max())
    assert posterior.largest_frequency(x, mass, products=200) == pytest.approx(by_fisher, rel=1e-6)
    symbol = posterior.operators["s"].symbol
    deviation = posterior.operators["s"].variance - 0.4  # the energy was made for another variance: its mean is another
    intensity = 1.6**2 * 0.7 * np.mean(posterior.data["response"]) * math.exp(1.6**2 * deviation / 2)
    assert mass == pytest.approx(1.0 + intensity * symbol**2, rel=1e-6)
    assert posterior.mass("prior") is None
    assert posterior.mass("unit") == pytest.approx(symbol**2)


@pytest.mark.parametrize("case", ["poisson", "biased", "negative binomial", "gaussian"])
def test_the_mode_is_where_the_gradient_is_nought(case: str) -> None:
    posterior = of_template(MESHES[2], case)
    mode = posterior.mode()
    assert mode.gradient <= 1e-8 and 1 <= mode.iterations < 30
    assert np.abs(posterior.gradient(mode.spectrum)).max() < 1e-5
    assert mode.energy <= posterior.energy(np.zeros(MESHES[2].half, complex))
    if case in ("poisson", "biased"):  # convex: one mode, from anywhere
        other = posterior.mode(3.0 * MESHES[2].white(stream()))
        assert other.spectrum == pytest.approx(mode.spectrum, abs=1e-6)


MESH = MESHES[1]
COUNTS = np.ones(MESH.cells)


@pytest.mark.parametrize(
    ("energy", "masses"), [("(s**2 - 4)**2", "fisher"), ("5*cos(s)", "fisher"), ("(s**2 + r**2 - 3)**2", "prior")]
)
def test_a_mode_is_no_saddle(energy: str, masses: str) -> None:
    """Energies whose gradient is 0 at a field of 0, which is a maximum along some directions."""
    mesh = Mesh((8, 8), 40.0)
    operator = amplitude(mesh, lambda k: 300.0 * np.exp(-((4.0 * k) ** 2)))
    fields = {"s": operator, "r": smoothing(mesh, 3.0)} if "r" in energy else {"s": operator}
    posterior = FieldPosterior(mesh, energy, fields)
    zero = np.zeros(mesh.half, complex)
    assert np.abs(posterior.gradient(zero)).max() < 1e-14
    mode = posterior.mode()
    assert mode.energy < posterior.energy(zero) - 10.0 and mode.gradient <= 1e-8
    matrix = dense(posterior, mode.spectrum)
    assert matrix == pytest.approx(matrix.T, abs=1e-12)
    assert np.linalg.eigvalsh(matrix)[0] > 0.1
    assert posterior.largest_frequency(mode.spectrum, posterior.mass(masses)) > 0.5


def test_spectra_in_another_order_or_precision_are_the_same_field() -> None:
    posterior, spectrum, to = made("s**4 + counts*s"), MESH.white(stream()), np.zeros(MESH.half, complex)
    turned = np.asfortranarray(spectrum)
    assert posterior.energy(turned) == posterior.energy(spectrum)
    assert posterior.energy(spectrum.astype(np.complex64)) == pytest.approx(posterior.energy(spectrum), rel=1e-5)
    assert posterior.norm(turned, np.asfortranarray(MESH.wave_numbers)) == posterior.norm(spectrum, MESH.wave_numbers)
    posterior.add(2.0, turned, to)
    assert np.array_equal(to, 2.0 * spectrum)


@pytest.mark.parametrize("name", ["add", "add_gradient", "drift", "energy_and_gradient"])
def test_spectra_that_are_changed_have_to_be_arrays_of_c(name: str) -> None:
    """A converted copy would be changed in their place."""
    posterior, x = made("s**2"), MESH.white(stream())
    before = {"add": (1.0, x), "add_gradient": (1.0, x), "drift": (1.0, None, x), "energy_and_gradient": (x,)}[name]
    for wrong in (x.astype(np.complex64), np.asfortranarray(x), np.zeros((3, 3), complex)):
        with pytest.raises(UsageError, match=r"are not a half spectrum; try: complex128 of the shape \(8, 4\)"):
            getattr(posterior, name)(*before, wrong)
    getattr(posterior, name)(*before, to := np.zeros_like(x))
    assert np.any(to)


def test_a_prior_alone_has_no_curvature_and_zeros_have_an_adjoint() -> None:
    assert FieldPosterior(MESH, "0", {"s": white(MESH)}).mean_curvature() == [0.0]
    assert LinearOperator("zero", MESH, np.zeros(MESH.half)).dot_test(stream()) == 0.0


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: amplitude(MESH, lambda k: 0.5 - k), "power: the power is -"),
        (lambda: amplitude(MESH, lambda k: 1.0 / k), "power: the power is inf at k = 0"),
        (lambda: smoothing(MESH, 1.0) @ mask(MESH, COUNTS), "a filter after a mask is diagonal neither in Fourier"),
        (lambda: smoothing(MESH, 1.0) @ white(MESHES[0]), "the operators have different meshes"),
        (lambda: difference(MESH, 2), "difference: axis: there is no axis 2 in 2 dimensions; try: 0 to 1"),
        (lambda: mask(MESH, COUNTS[1:]), "an array of the shape (7, 6) is not a mask of finite numbers for (8, 6)"),
        (lambda: made("s**2").value("g", MESH.white(stream())), "value: there is no field 'g'; try: one of s"),
        (
            lambda: made("s**2").energy(MESH.white(stream())[:4]),
            "spectrum: complex128 of the shape (4, 4) are not a half",
        ),
        (lambda: negative_binomial(1.0, 0.1, beta=0.0), "beta: 0 is invalid; try: a number above 0"),
        (lambda: gaussian(1.0, 0.1, deviation=-1.0), "deviation: -1 is invalid; try: a number above 0"),
        (lambda: poisson(0.0, 1.0), "mean: the mean of counts is 0; try: the mean number of objects in a cell"),
        (lambda: made("exp(s) - cuonts*s"), "cell energy: "),
        (lambda: made("exp(s"), "cell energy: the formula is not well formed"),
        (lambda: made("s/0"), "cell energy: the divisor is zero (column 3); try: another divisor"),
        (lambda: made(CellEnergy("s", {"counts": "s"})), "cell energy: two things are called counts; try: another"),
        (lambda: made(CellEnergy("s", {"2s": "s"})), "cell energy: the name '2s' is not legal"),
        (lambda: made(poisson(1.0, 1.0), -COUNTS), "data.counts: 48 cells out of range: -1 at (0, 0)"),
        (lambda: made("s*counts", COUNTS * np.nan), "data.counts: 48 cells out of range: nan at (0, 0); try: finite"),
        (lambda: made("s*counts", COUNTS[0]), "data.counts: the array has the shape (6,), and the mesh (8, 6)"),
        (lambda: made("s**2").mass("fischer"), "mass: there is no mass 'fischer'; try: "),
        (lambda: FieldPosterior(MESH, "s", {"s": white(MESHES[0])}), "fields.s: the operator has another mesh"),
        (
            lambda: FieldPosterior(Mesh((4096, 4096, 4096), 1.0), "0", {}),
            "memory: a trajectory on 4096 x 4096 x 4096 cells takes 4.61e+03 GiB, and this machine has",
        ),
        (lambda: lognormal_amplitude(MESH, lambda k: -1.0 + 0.0 * k), "power: the power is -1 at k = 0"),
        (lambda: lognormal_amplitude(MESH, 5e3 * (MESH.wave_numbers > 0.0)), "is not lognormal; try: a covariance abo"),
        (lambda: made("1/(s - s)"), "cell energy: div(1, 0) in a formula has no finite value for any state"),
        (
            lambda: made("exp(exp(9*s))").mass("fisher"),
            "mass: the curvature of the energy of a cell has no finite mean",
        ),
        (lambda: FieldPosterior(MESH, "0", {}).mass("unit"), "mass: a unit mass of the field needs one field"),
        (
            lambda: FieldPosterior(MESH, "s", {"s": difference(MESH, 0)}).mass("unit"),
            "mass: a unit mass of the field needs one field whose filter is 0 at no wave number",
        ),
        (
            lambda: made("exp(exp(9*s))").largest_frequency(9.0 * MESH.white(stream())),
            "largest_frequency: second derivatives of U are not finite here",
        ),
        (lambda: autocorrelation_time(np.ones((2, 3))), "chains: samples of the shape (2, 3) are not chains of four"),
        (lambda: split_r_hat(np.ones(9)), "chains: samples of the shape (9,) are not chains of four samples or more"),
        (
            lambda: Sampler(made("exp(exp(9*s))"), start=[9.0 * MESH.white(stream())], mass="prior"),
            "Sampler: start: U is inf at the start of chain 0",
        ),
        (
            lambda: Sampler(made("s**2"), start=None).take({}, {}, "file"),
            "file: this is not a file of chains: spectra is missing; try: a file of Sampler.save",
        ),
        (lambda: made("log(1e-300*s - 1)").mode(), "mode: U is nan at the start; try: another start, or an energy"),
        (lambda: made("log(1 + s**2)").mode(iterations=0, tolerance=-1.0), "mode: Newton's method has left a gradient"),
    ],
)
def test_what_cannot_be_is_refused_in_one_message(call: Callable[[], object], text: str) -> None:
    with pytest.raises(EomgenError) as caught:
        call()
    assert text in str(caught.value)


def made(energy: CellEnergy | str, counts: Array = COUNTS) -> FieldPosterior:
    return FieldPosterior(MESH, energy, {"s": white(MESH)}, {"counts": counts})


def test_a_larger_record_keeps_its_samples(rng: np.random.Generator) -> None:
    record = Record(Mesh((4, 4), 1.0), 1, 2, np.array([0, 5]), 2)
    fields = rng.standard_normal((5, 4, 4))
    for number, values in enumerate(fields):
        if number == 2:
            record.resize(5)
        record.add(0, Outcome(0.1, True, 3), float(number), values)
    samples = record.samples(np.array([0.1]))
    assert record.size == 5 and samples.cells.tolist() == fields.reshape(1, 5, 16)[:, :, [0, 5]].tolist()
    assert samples.potential.tolist() == [[0.0, 1.0, 2.0, 3.0, 4.0]]
    smaller = Record(Mesh((4, 4), 1.0), 1, 2, np.array([0, 5]), 2)
    smaller.add(0, Outcome(0.2, True, 3), 7.0, fields[0])
    before = {name: array.copy() for name, array in smaller.arrays().items()}
    with pytest.raises(ValueError, match=r"the shapes of energy_errors, accepted, .* are of another record"):
        smaller.take(record.arrays())
    assert all(np.array_equal(array, before[name]) for name, array in smaller.arrays().items())
    smaller.resize(5)
    smaller.take(record.arrays())
    assert all(np.array_equal(array, record.arrays()[name]) for name, array in smaller.arrays().items())
    coarse = Record(Mesh((4, 4), 2.0), 1, 2, np.array([0, 5]), 2)
    coarse.add(0, Outcome(0.2, True, 3), 7.0, fields[0])
    of_coarse, waves = coarse.samples(np.array([0.1])), coarse.arrays()["wave_numbers"].copy()
    coarse.resize(5)
    coarse.take(record.arrays())
    assert np.array_equal(of_coarse.wave_numbers, waves) and not np.array_equal(waves, samples.wave_numbers)
