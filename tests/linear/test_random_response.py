"""Random vibration of linear models against closed forms, Lyapunov's equation, and runs over generated roads."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import eomgen
from eomgen.errors import ModelError, UsageError
from eomgen.products.linear.linearization import Linearization
from eomgen.spectra import InputSpectrum, Road, RoadExcitation, weighting_response
from tests.anchors import anchor
from tests.linear.by_hand import linear_model

OMEGA, ZETA, MASS = 9.0, 0.2, 2.0
SPRING, DAMPER = MASS * OMEGA**2, 2.0 * ZETA * OMEGA * MASS
#: A band so wide that what is left out is below the tolerances here.
WIDE = (1e-6, 1e5)
EXAMPLES = Path(__file__).parents[2] / "examples"


def mass(damper: float = DAMPER) -> Linearization:
    """Return a mass whose spring and damper stand on a road, and whose position is measured absolutely, too."""
    inputs = {"road": [SPRING], "road_rate": [damper], "push": [1.0]}
    outputs = {"travel": {"q": [1.0], "u": [-1.0, 0.0, 0.0]}, "acceleration": {"a": [1.0]}, "height": {"q": [1.0]}}
    return linear_model(MASS, damper, SPRING, ["x"], inputs, None, outputs, ["m", "m/s^2", "m"])


def car() -> Linearization:
    """Return a plane car whose body heaves and pitches without coupling, 2.4 m between its axles."""
    axles = {"front": [2e4, -1.2 * 2e4], "rear": [2e4, 1.2 * 2e4]}
    outputs = {
        "heave_acceleration": {"a": [1.0, 0.0]},
        "pitch_acceleration": {"a": [0.0, 1.0]},
        "front_spring": {"q": [1.0, -1.2], "w": [-1.0, 0.0]},
    }
    M, C, K = np.diag([600.0, 900.0]), np.diag([4e3, 5e3]), np.diag([4e4, 5.76e4])
    return linear_model(M, C, K, ["heave", "pitch"], None, axles, outputs, ["m/s^2", "rad/s^2", "m"])


AXLES = RoadExcitation(Road("C"), 15.0, {"front": 0.0, "rear": 2.4}, {"front": 0.0, "rear": 0.0}, "independent")


def test_a_mass_on_white_noise_has_the_variances_of_crandall_and_mark() -> None:
    """sigma_x^2 = pi S0 / (2 zeta w^3 m^2), sigma_v^2 = w^2 sigma_x^2 with S0 two-sided over rad/s: G = 4 pi S0."""
    lin = mass()
    G = 3.0
    push = InputSpectrum("push", WIDE, function=lambda f: np.full_like(f, G))
    sigma = math.sqrt(G / 4.0 / (2.0 * ZETA * OMEGA**3 * MASS**2))
    assert lin.rms("height", push) == pytest.approx(sigma, rel=1e-6)
    assert lin.rms("v.x", push) == pytest.approx(OMEGA * sigma, rel=1e-4)  # a tail ~ 1 / f is left out
    tabulated = InputSpectrum("push", [1e-6, 0.1, 1e5], [G, G, G])
    assert lin.rms("height", tabulated) == pytest.approx(sigma, rel=1e-6)


def test_a_mass_on_a_road_by_closed_forms_integration_and_lyapunov() -> None:
    """z'' + 2 zeta w z' + w^2 z = -w'': sigma_z^2 = W / (4 zeta w) with the intensity W of the road's slope."""
    lin = mass()
    road = Road(roughness=5e-5, band=WIDE)
    excitation = RoadExcitation(road, 12.0, {"road": 0.0}, rates={"road": "road_rate"})
    intensity = 2.0 * math.pi**2 * 0.01 * 5e-5 * 12.0
    sigma = math.sqrt(intensity / (4.0 * ZETA * OMEGA))
    assert lin.rms_on_white_noise_road("travel", excitation) == pytest.approx(sigma, rel=1e-12)
    assert lin.rms("travel", excitation) == pytest.approx(sigma, rel=1e-6)
    ratio = 1j * 2.0 * math.pi * 1.7 / OMEGA
    expected = ratio**2 / (1.0 + 2.0 * ZETA * ratio - ratio**2 * -1.0)
    spectrum = lin.psd("travel", excitation, [1.7, 1.8])
    assert spectrum.density[0] == pytest.approx(abs(expected) ** 2 * 5e-5 * 0.01 * 12.0 / 1.7**2, rel=1e-12)
    assert (spectrum.unit, spectrum.quantity_unit) == ("m^2/Hz", "m")
    for name in ("height", "acceleration"):
        with pytest.raises(ModelError, match=f"{name} follows the road itself, whose variance has no bound"):
            lin.rms_on_white_noise_road(name, excitation)


@pytest.mark.slow
def test_integration_agrees_with_lyapunov_over_the_wheelbase() -> None:
    lin, wide = car(), AXLES.at(road=Road("C", band=(1e-6, 30.0)))
    side_by_side = RoadExcitation(wide.road, 15.0, {"front": 0.0, "rear": 0.0})
    # the band from 15 uHz to 450 Hz leaves out a part of the road itself, 1 / f^2, and below a constant
    for name, tolerance in (("pitch", 5e-6), ("v.heave", 6e-6), ("front_spring", 6e-4)):
        both = lin.rms(name, wide), lin.rms_on_white_noise_road(name, wide)
        assert both[0] == pytest.approx(both[1], rel=tolerance), name
    assert lin.rms_on_white_noise_road("pitch", side_by_side) <= 1e-9
    with pytest.raises(ModelError, match="pitch follows the road itself, whose variance has no bound"):
        lin.rms_on_white_noise_road("pitch", RoadExcitation(wide.road, 15.0, {"front": 0.0}))
    apart = RoadExcitation(wide.road, 15.0, {"front": 0.0, "rear": 2.0}, {"rear": 1.5}, 0.4)
    both = lin.rms("v.pitch", apart), lin.rms_on_white_noise_road("v.pitch", apart)
    assert both[0] == pytest.approx(both[1], rel=2e-5)


def test_the_wheelbase_filters_heave_by_cosine_and_pitch_by_sine() -> None:
    lin, excitation = car(), AXLES
    f = np.array([0.5, 1.3, 15.0 / 2.4 / 2.0, 4.1, 15.0 / 2.4, 20.0])
    s = 2j * np.pi * f
    road = 256e-6 * 0.01 * 15.0 / f**2
    half = np.pi * f * 2.4 / 15.0
    heave = s**2 * 4e4 * np.cos(half) / (600.0 * s**2 + 4e3 * s + 4e4)
    pitch = s**2 * 4.8e4 * np.sin(half) / (900.0 * s**2 + 5e3 * s + 5.76e4)
    for name, H in (("heave_acceleration", heave), ("pitch_acceleration", pitch)):
        density = lin.psd(name, excitation, f).density
        np.testing.assert_allclose(density, np.abs(H) ** 2 * road, rtol=1e-10, atol=1e-14 * np.max(density))


def test_tracks_of_an_isotropic_road_are_as_coherent_as_its_plane_spectrum_says() -> None:
    """The surface has a spectrum of its own over plane waves, ~ (n^2 + m^2)^(-(w + 1) / 2): integrated over m."""
    for exponent in (2.0, 2.5):
        road = Road(roughness=1e-5, exponent=exponent, band=(1e-3, 10.0))
        excitation = RoadExcitation(road, 20.0, {"left": 0.0, "right": 0.0}, {"left": -0.7, "right": 0.7})
        n = np.array([0.02, 0.1, 0.5])
        found = excitation.between_tracks(20.0 * n)
        assert np.all(excitation.between_tracks(np.zeros(1)) == 1.0)
        for k, wave in enumerate(n):

            def plane(m: float, wave: float = float(wave), exponent: float = exponent) -> float:
                return float((wave**2 + m**2) ** (-(exponent + 1.0) / 2.0))

            whole = quad(plane, 0.0, np.inf)[0]
            crossed = quad(plane, 0.0, np.inf, weight="cos", wvar=2.0 * math.pi * 1.4)[0]
            assert found[k, 0, 1] == pytest.approx(crossed / whole, rel=1e-6, abs=1e-9)
            assert found[k, 0, 0] == 1.0


def test_weightings_are_those_of_the_printed_table() -> None:
    """ISO 2631-1:1997, table 3: factors by third octaves, times 1000; the table rounds and so do its frequencies."""
    printed = {
        "Wk": {0.5: 418, 1: 482, 2: 531, 4: 967, 5: 1039, 6.3: 1054, 8: 1036, 10: 988, 16: 768, 31.5: 405, 80: 132},
        "Wd": {0.5: 853, 1: 1011, 2: 890, 4: 512, 8: 253, 16: 125, 31.5: 63.2, 80: 21.3},
    }
    for name, factors in printed.items():
        for nominal, factor in factors.items():
            exact = 10.0 ** (round(10.0 * math.log10(nominal)) / 10.0)
            assert abs(weighting_response(name, exact)) == pytest.approx(factor / 1000.0, rel=0.02)
    frequencies = 10.0 ** (np.array([0, 6, 9, 12, 19]) / 10.0)  # the exact centres of third octaves
    anchor("whole_body_weighting").check(np.abs([weighting_response("Wk", f) for f in frequencies]))
    with pytest.raises(UsageError, match="there is no weighting 'Wz'; try: Wk: vertical, of a seat or the floor; Wd:"):
        weighting_response("Wz", 1.0)


def test_a_road_of_two_exponents_is_continuous_and_ends_at_its_band() -> None:
    road = Road(roughness=64e-6, exponent=2.5, long_exponent=3.0)
    n = np.array([0.005, 0.05, 0.0999999, 0.1000001, 1.0, 3.0])
    expected = [0.0, 64e-6 * 2.0**3, 64e-6, 64e-6, 64e-6 * 10.0**-2.5, 0.0]
    np.testing.assert_allclose(road.over_distance(n), expected, rtol=1e-5)
    np.testing.assert_allclose(road.over_time(20.0 * n, 20.0), road.over_distance(n) / 20.0, rtol=1e-12)
    assert Road("E").over_distance(0.1) == pytest.approx(4096e-6)


def test_the_table_over_classes_and_speeds_holds_the_values_of_single_calls() -> None:
    lin, excitation = car(), AXLES
    outputs = {"heave_acceleration": "Wk", "front_spring": None}
    table = lin.ride_table(excitation, outputs, "AD", [10.0, 30.0])
    assert table.values.shape == (2, 2, 2)
    here = excitation.at(30.0, Road("D"))
    single = [lin.rms(output, here, weighting=weighting) for output, weighting in outputs.items()]
    np.testing.assert_allclose(table.values[1, 1], single, rtol=1e-7)
    np.testing.assert_allclose(table.values[1], 8.0 * table.values[0], rtol=1e-12)  # sqrt of the ratio of roughnesses
    assert repr(table).splitlines()[0].split("  ")[0] == "class"
    assert "rms heave_acceleration (Wk) [m/s^2]" in table.headings
    assert table._repr_html_().count("<tr>") == 5
    fault = r"weighting: front_spring is in m, and weightings apply to accelerations in m/s\^2; try: an output that is"
    for call in (
        lambda: lin.rms("front_spring", excitation, weighting="Wk"),
        lambda: lin.ride_table(excitation, {"front_spring": "Wd"}),
    ):
        with pytest.raises(UsageError, match=fault):
            call()


def test_parts_of_a_band_add_up() -> None:
    lin, excitation = car(), AXLES
    parts = [lin.rms("front_spring", excitation, band) for band in ((0.0, 1.0), (1.0, 4.0), (4.0, 100.0))]
    assert math.hypot(*parts) == pytest.approx(lin.rms("front_spring", excitation), rel=1e-8)
    spectrum = lin.psd("front_spring", excitation)
    assert spectrum.rms(1.0, 4.0) == pytest.approx(parts[1], rel=1e-3)
    with pytest.raises(UsageError, match=r"the band 100 to 200 Hz is outside the excitation's; try: a part of 0\.165"):
        lin.rms("front_spring", excitation, (100.0, 200.0))


def test_published_values_of_the_quarter_car() -> None:
    """Those of the example's paper, whose road has no ends of its band: 1.41708 m/s^2, 11.9296 mm, 720.33 N."""
    model = eomgen.build(EXAMPLES / "quarter_car" / "scene.toml", profile="instant")
    lin = model.linearize(t=30.0)
    excitation = model.road_excitation(Road("C", band=(1e-7, 1e6)))
    for name, printed, digits in (
        ("body_acceleration", 1.41708, 1e-5),
        ("suspension_travel", 11.9296e-3, 1e-7),
        ("tyre_load", 720.33, 1e-2),
    ):
        assert abs(lin.rms_on_white_noise_road(name, excitation) - printed) <= digits
        assert abs(lin.rms(name, excitation) - printed) <= digits


def test_what_has_no_stationary_motion_is_refused() -> None:
    excitation = InputSpectrum("push", [0.1, 100.0], [1.0, 1.0])
    undamped = mass(0.0)
    with pytest.raises(ModelError, match=r"mode 1 at 1\.43239 Hz has no damping, so the rms has no bound"):
        undamped.rms("height", excitation)
    above = undamped.rms("height", excitation, (10.0, 20.0))
    inertia = quad(lambda f: (MASS * (OMEGA**2 - (2.0 * math.pi * f) ** 2)) ** -2, 10.0, 20.0)[0]
    assert above == pytest.approx(math.sqrt(inertia), rel=1e-8)
    growing = mass(-1.0)
    with pytest.raises(ModelError, match=r"mode 1 \(x\) grows with 0\.25 1/s, so there is no stationary motion"):
        growing.psd("height", excitation)
    road = RoadExcitation(Road("C"), 10.0, {"road": 0.0})
    with pytest.raises(ModelError, match="mode 1 does not decay, so there is no stationary motion"):
        undamped.rms_on_white_noise_road("travel", road)


STEEP = RoadExcitation(Road("C", exponent=2.2), 10.0, {"road": 0.0})
APART = RoadExcitation(Road("C"), 10.0, {"front": 0.0, "rear": 0.0}, {"rear": 1.5})


def test_roads_and_wheels_that_cannot_be() -> None:
    for call, text in (
        (Road, "a road needs either a class or a roughness"),
        (lambda: Road("X"), "there is no road class 'X'; try: one of A, B, C, D, E, F, G, H"),
        (lambda: Road(roughness=-1.0), r"Road: roughness: -1\.0 is not a positive number"),
        (lambda: Road("A", exponent=0.0), r"Road: exponent: 0\.0 is not a positive number"),
        (lambda: Road("A", long_exponent=-1.0), r"Road: long_exponent: -1\.0 is not a positive number"),
        (lambda: Road("A", band=(1.0, 0.1)), "not a pair of spatial frequencies, the lower first"),
        (lambda: RoadExcitation(Road("A"), 0.0, {"w": 0.0}), "RoadExcitation: speed: 0.0 is not a positive number"),
        (lambda: RoadExcitation(Road("A"), 9.0, {}), "there are no wheels"),
        (lambda: RoadExcitation(Road("A"), 9.0, {"w": math.inf}), "wheels: w is inf, not a finite number"),
        (lambda: RoadExcitation(Road("A"), 9.0, {"w": 0}, {"x": 1.0}), "tracks: there is no wheel 'x'; try: one of w"),
        (lambda: RoadExcitation(Road("A"), 9.0, {"w": 0}, coherence=2.0), "2.0 is not a coherence between tracks"),
        (
            lambda: RoadExcitation(Road("A", long_exponent=3.0), 9.0, {"l": 0, "r": 0}, {"r": 1.0}),
            "an isotropic road between tracks has one exponent, and a measured one none",
        ),
        (lambda: mass().rms_on_white_noise_road("travel", STEEP), "is white noise where the exponent is 2 only"),
        (lambda: car().rms_on_white_noise_road("front_spring", APART), "between tracks depends on frequency"),
        (lambda: InputSpectrum("f", [1.0, 2.0]), "it needs either a density or a function"),
        (lambda: InputSpectrum("f", [2.0, 1.0], [1.0, 1.0]), "two or more positive numbers that increase"),
        (lambda: InputSpectrum("f", [1.0, 2.0], [1.0, -1.0]), "entries that are negative or not finite"),
    ):
        with pytest.raises(UsageError, match=text):
            call()
