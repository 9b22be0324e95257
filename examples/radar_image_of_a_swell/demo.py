"""A swell along the flight as two radars see it: images, folds, caustics, specular points, and the azimuth cut-off.

python examples/radar_image_of_a_swell/demo.py [--seas 400] [--pixel 10] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import Literal

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from eomgen.base.arrays import Array
from eomgen.waves import (
    Components,
    DiscreteSpectrum,
    Jonswap,
    Radar,
    Sea,
    Spreading,
    discretized,
    specular_points,
    statistics_of,
)

BLUE, VERMILION, GREY = "#0072B2", "#D55E00", "0.5"
FOLDER = Path(__file__).parent
HEIGHT, PERIOD = 2.0, 10.0
#: Slant range over speed, s, of a radar in an aeroplane and of one in space; angle of their sight from the vertical.
RADARS = {"from the air": Radar(30.0, math.radians(23.0)), "from space": Radar(120.0, math.radians(23.0))}
COLOURS = dict(zip(RADARS, (BLUE, VERMILION), strict=True))
#: Labels and cells of a line, which is 32 wave lengths of the peak long, and the wave numbers that are looked at.
LABELS, CELLS, NUMBERS = 8192, 2048, 160
#: Slopes at which specular points are counted.
SLOPES = (0.0, 0.05, 0.1)


def swell(direction: Literal[1, -1] = 1) -> DiscreteSpectrum:
    """Return the swell, with the flight or against it."""
    return discretized(Jonswap(HEIGHT, PERIOD), height=HEIGHT, heading=0.0 if direction == 1 else math.pi)


def length_of(spectrum: DiscreteSpectrum) -> float:
    """Return after how many m a sea of equally spaced wave numbers repeats itself."""
    k = np.sort(np.hypot(*spectrum.vectors.T))
    return 2.0 * math.pi / float(k[1] - k[0])


def folds(radar: Radar, direction: Literal[1, -1], seas: int) -> tuple[float, float]:
    """Return the part of labels at which images of first order are folded: counted, and in closed form."""
    spectrum = swell(direction)
    sea, count, folded = Sea(spectrum.realisation(0), order=1), 1024, 0
    for seed in range(seas):
        profile = sea.with_waves(spectrum.realisation(seed)).profile(count, 0.0)
        k = 2.0 * math.pi * np.fft.rfftfreq(count, profile.labels[1])
        rate = np.fft.irfft(1j * k * np.fft.rfft(profile.w), count)
        seen = profile.xa + direction * radar.range_to_velocity * math.cos(radar.incidence) * rate
        folded += int(np.count_nonzero(seen < 0.0))
    return folded / (seas * count), radar.fold_probability(spectrum)


def caustics(radar: Radar, direction: Literal[1, -1]) -> tuple[float, float]:
    """Return from which amplitude on the image of one wave of 10 s runs backwards somewhere: by halving, and in closed
    form."""
    k = (2.0 * math.pi / PERIOD) ** 2 / 9.81
    # the image stands still at a crest or at a trough first
    near = np.linspace(-0.1, 0.1, 41)
    labels = np.concatenate((near, math.pi / k + near))
    low, high = 0.1, 3.0
    while high - low > 1e-8:
        middle = 0.5 * (low + high)
        sea = Sea(Components(np.array([[direction * k, 0.0]]), np.array([middle]), np.zeros(1)), order=1)
        x = radar.bunching(sea, np.column_stack((labels, 0.0 * labels)), 0.0)[0][:, 0].reshape(2, -1)
        low, high = (low, middle) if np.any(np.diff(x) < 0.0) else (middle, high)
    return 0.5 * (low + high), radar.critical_amplitude(k, direction)


def spectra(radar: Radar, seas: int) -> tuple[Array, Array, Array]:
    """Return by multiple of the lowest wave number: mean spectrum of the image, and what of the waves' phases is left
    in it, over many seas of first order; and the greatest change of the intensity of a line."""
    spectrum = swell()
    length, sea = length_of(spectrum), Sea(spectrum.realisation(0), order=1)
    k = 2.0 * math.pi / length * np.arange(1, NUMBERS + 1)
    power, product, energy, changed = np.zeros(NUMBERS), np.zeros(NUMBERS, dtype=complex), np.zeros(NUMBERS), 0.0
    for seed in range(seas):
        profile = sea.with_waves(spectrum.realisation(seed)).profile(LABELS, 0.0)
        line = radar.line(profile, length, CELLS)
        changed = max(changed, abs(float(line.mean()) - 1.0))
        cell = np.exp(1j * math.pi * np.arange(1, NUMBERS + 1) / CELLS)  # cells are told by their left edges
        image = np.fft.rfft(line)[1 : NUMBERS + 1] / CELLS / cell
        waves = np.fft.rfft(profile.z)[1 : NUMBERS + 1] / LABELS
        power += np.abs(image) ** 2 / seas
        product += image * np.conj(waves)
        energy += np.abs(waves) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        linear = -k * radar.range_to_velocity * math.cos(radar.incidence) * np.sqrt(9.81 * k)
        left = np.where(energy > 1e-6 * energy.max(), (product / energy).real / linear, np.nan)
    return power, left, np.array([changed])


def attenuation(radar: Radar, k: Array) -> Array:
    """Return what is left of waves in an image, exp(-k^2 D/2), with the variance D of what facets are moved by."""
    spectrum = swell()
    w = np.sqrt(9.81 * np.hypot(*spectrum.vectors.T))
    moved = np.sum(spectrum.energy * (radar.range_to_velocity * w * math.cos(radar.incidence) - 1.0) ** 2)
    return np.asarray(np.exp(-0.5 * k**2 * moved))


def specular(seas: int) -> tuple[Array, Array]:
    """Return specular points per km at each of ``SLOPES``, of seas of second order: counted, and in closed form."""
    spectrum = swell()
    length, sea = length_of(spectrum), Sea(spectrum.realisation(0))
    found = np.zeros(len(SLOPES))
    for seed in range(seas):
        profile = sea.with_waves(spectrum.realisation(seed)).profile(2 * LABELS, 0.0)
        found += [len(specular_points(profile, slope).labels) for slope in SLOPES]
    known = statistics_of(spectrum)
    return 1e3 * found / (seas * length), 1e3 * np.array([float(known.specular_points(slope)) for slope in SLOPES])


def patch() -> Sea:
    """Return the sea of the images, the swell with crests some hundred metres long."""
    spreading = Spreading(60.0, directions=5)
    return Sea(discretized(Jonswap(HEIGHT, PERIOD), length=1000.0, band=(0.6, 1.8), spreading=spreading).realisation(2))


def draw_images(axes: dict[str, plt.Axes], pixel: float) -> None:
    sea, edges = patch(), np.arange(0.0, 800.0 + pixel, pixel)
    for name, radar in RADARS.items():
        image = radar.image(sea, 0.0, edges, edges, labels_per_cell=4)
        extent = (0.0, float(edges[-1]), 0.0, float(edges[-1]))
        axes[name].imshow(image, origin="lower", extent=extent, cmap="gray", vmin=0.0, vmax=3.0)
        axes[name].set(xlabel="flight, m", ylabel="range, m", title=f"{name}, R/V = {radar.range_to_velocity:g} s")
        print(f"image {name}: mean intensity {image.mean():.3f}, deviation {image.std():.3f}")


def draw_line(surface: plt.Axes, brightness: plt.Axes) -> None:
    spectrum = swell()
    length = length_of(spectrum)
    profile = Sea(spectrum.realisation(5)).profile(16 * LABELS, 0.0)
    window = profile.x < 800.0
    surface.plot(profile.x[window], profile.z[window], color=GREY, linewidth=1.0)
    points = specular_points(profile, 0.05)
    near = points.x < 800.0
    surface.plot(points.x[near], points.z[near], "o", color=VERMILION, markersize=3)
    surface.set(xlabel="flight, m", ylabel="elevation, m", title="surface, specular points at the slope 0.05")
    cells = int(length / 4.0)
    x = (np.arange(cells) + 0.5) * length / cells
    for name, radar in RADARS.items():
        line = radar.line(profile, length, cells)
        brightness.step(x[x < 800.0], line[x < 800.0], where="mid", color=COLOURS[name], linewidth=0.9, label=name)
    brightness.set(
        xlabel="flight, m", ylabel="intensity", title="the same line in the images, cells of 4 m", ylim=(0, 8)
    )
    brightness.legend(frameon=False, fontsize="small")


def draw_spectra(power: plt.Axes, left: plt.Axes, seas: int) -> None:
    spectrum = swell()
    length = length_of(spectrum)
    k = 2.0 * math.pi / length * np.arange(1, NUMBERS + 1)
    for name, radar in RADARS.items():
        found, kept, changed = spectra(radar, seas)
        closed, colour = radar.intensity_spectrum(spectrum, length, NUMBERS), COLOURS[name]
        power.semilogy(k, found, ".", color=colour, markersize=3)
        power.semilogy(k, closed, color=colour, linewidth=1.0, label=f"{name}: dots counted, line closed form")
        left.plot(k, kept, ".", color=colour, markersize=3)
        left.plot(k, attenuation(radar, k), color=colour, linewidth=1.0, label=name)
        cutoff = radar.cutoff(spectrum)
        left.axvline(2.0 * math.pi / cutoff, color=colour, linewidth=0.8, linestyle=":")
        off = np.abs(found[31:] / closed[31:] - 1.0)
        print(f"{name}: intensity of lines kept to {changed[0]:.1e}, spectrum within {np.median(off):.3f} (median)")
        print(f"{name}: velocity {radar.velocity_deviation(spectrum):.3f} m/s, cut-off {cutoff:.1f} m")
    power.set(xlabel="wave number, rad/m", ylabel="spectrum of the intensity", ylim=(1e-5, 2e-2))
    power.set_title("spectra of images")
    left.set(xlabel="wave number, rad/m", ylabel="part of linear theory", ylim=(-0.1, 1.1))
    left.set_title("what is left of waves; dotted: cut-off")
    for axes in (power, left):
        axes.legend(frameon=False, fontsize="small")


def main(seas: int, pixel: float, out: Path) -> None:
    began = time.perf_counter()
    for name, radar in RADARS.items():
        for direction, word in ((1, "with"), (-1, "against")):
            counted, closed = folds(radar, direction, seas)
            halved, critical = caustics(radar, direction)
            print(f"{name}, {word} the flight: folded {counted:.4f}, closed form {closed:.4f};", end=" ")
            print(f"caustics from {halved:.6f} m on, closed form {critical:.6f} m")
    counted_points, closed_points = specular(max(1, seas // 10))
    for slope, one, other in zip(SLOPES, counted_points, closed_points, strict=True):
        print(f"specular points at the slope {slope:g}: {one:.2f} per km, closed form {other:.2f}")
    names = [list(RADARS), ["surface", "line"], ["power", "left"]]
    figure, axes = plt.subplot_mosaic(names, figsize=(9, 10.5), layout="constrained", height_ratios=(2.0, 1.0, 1.2))
    draw_spectra(axes["power"], axes["left"], seas)
    draw_line(axes["surface"], axes["line"])
    draw_images(axes, pixel)
    for name in ("surface", "line", "power", "left"):
        axes[name].grid(alpha=0.3, linewidth=0.5)
    out.mkdir(parents=True, exist_ok=True)
    figure.savefig(out / "radar_image_of_a_swell.png", dpi=110)
    plt.close(figure)
    print(f"figure {out / 'radar_image_of_a_swell.png'}, {time.perf_counter() - began:.1f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seas", type=int, default=400)
    parser.add_argument("--pixel", type=float, default=10.0, help="of the images, m")
    parser.add_argument("--out", type=Path, default=FOLDER)
    arguments = parser.parse_args()
    main(arguments.seas, arguments.pixel, arguments.out)
