"""Drawn linear models: margins, responses, modes and root loci of synthetic results."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest

from eomgen.products.linear import eigenvalue_loci, plots
from eomgen.products.linear import modes as linear_modes
from eomgen.products.linear.control.margins import Margins
from eomgen.products.linear.control.notebook import plot_margins

matplotlib.use("Agg")
from typing import cast

from matplotlib import pyplot

from eomgen.products.linear.eigenvalue_loci import RootLocus
from eomgen.products.linear.linearization import Linearization
from eomgen.products.linear.modes import Modes, oscillating_first
from eomgen.products.linear.spectra import PowerSpectrum
from tests.linear.by_hand import linear_model


@pytest.fixture(autouse=True)
def closed_figures() -> Iterator[None]:
    yield
    pyplot.close("all")


def test_margins_are_drawn_with_the_circles_that_they_measure() -> None:
    loop = np.array([0.5 - 0.5j, 20.0 + 1.0j, -0.25 - 0.1j])
    margins = {
        name: Margins(3.0, 0.5, 40.0 + k, 0.2, 0.6, (1.0,), np.arange(3.0), loop * (k + 1))
        for k, name in enumerate(("u1", "u2"))
    }
    for k, (name, axis) in enumerate(zip(margins, plot_margins(margins), strict=True)):
        upper, lower, unit, around, point, *rings = axis.lines
        words = [text.get_text() for text in axis.get_legend().get_texts()]
        assert words[0] == "open loop, which leaves the frame" and words[3].startswith("modulus margin 0.6: least")
        written = {text.xy: text.get_text() for text in axis.texts if text.get_text()}
        places = [(k + 1) * value for value in loop[:3:2]]
        assert written == {(places[0].real, places[0].imag): "0 Hz", (places[1].real, places[1].imag): "0.318 Hz"}
        assert [complex(*ring.get_xydata()[0]) for ring in rings] == places
        near = (k + 1) * loop[[0, 2]]
        for line, sign in ((upper, 1.0), (lower, -1.0)):
            np.testing.assert_array_equal(line.get_xdata()[[0, 2]], near.real)
            np.testing.assert_array_equal(line.get_ydata()[[0, 2]], sign * near.imag)
            assert np.isnan(line.get_xdata()[1])
        np.testing.assert_allclose(np.hypot(*unit.get_xydata().T), 1.0, rtol=1e-12)
        np.testing.assert_allclose(np.hypot(*(around.get_xydata() - [-1.0, 0.0]).T), 0.6, rtol=1e-12)
        assert point.get_xydata().tolist() == [[-1.0, 0.0]] and axis.get_aspect() == 1.0
        assert axis.get_title("left") == (
            f"open loop at {name}\nstable for gains times 0.5 to 3\nphase margin {40 + k}°, delay margin 200 ms"
        )


def test_responses_are_drawn_with_units_and_continuous_phase(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[Any] = []
    monkeypatch.setattr(plots, "save_figure", lambda figure, path: kept.append(figure) or path)
    f = np.geomspace(0.1, 100.0, 400)
    chain = 5.0 / (1.0 + 1j * f / 2.0) ** 5
    responses = {("push", "tip"): chain, ("push", "push2"): 0.0 * chain, ("road", "force"): chain**2}
    plots.draw_responses(f, responses, {"push": "N", "push2": "N", "tip": "m"}, "car", Path("a.png"))
    magnitudes, phases = kept[0].axes[:3], kept[0].axes[3:]
    assert kept[0].get_suptitle() == "car: frequency responses"
    titles = [axis.get_title("left") for axis in magnitudes]
    assert titles == ["tip for push", "push2 for push", "force for road"]
    assert [axis.get_ylabel() for axis in magnitudes] == ["magnitude, m per N", "magnitude", "magnitude"]
    assert [axis.get_yscale() for axis in magnitudes] == ["log"] * 3
    np.testing.assert_allclose(magnitudes[0].lines[0].get_ydata(), 5.0 / np.hypot(1.0, f / 2.0) ** 5, rtol=1e-12)
    for k, order in ((0, 5), (2, 10)):
        angles = -order * np.degrees(np.arctan(f / 2.0))
        np.testing.assert_allclose(phases[k].lines[0].get_ydata(), angles, atol=1e-9)
        low, high = phases[k].get_ylim()
        assert low + high == pytest.approx(angles.min() + angles.max())
        assert high - low == pytest.approx(1.1 * np.ptp(angles))
        ticks = np.diff(phases[k].get_yticks())
        assert set(ticks) == {90.0 if order == 5 else 180.0}
    assert np.ptp(phases[1].get_ylim()) == pytest.approx(200.0)


def modes_of(count: int, coordinates: int, rng: np.random.Generator) -> Any:
    shapes = rng.normal(size=(coordinates, count)) + 1j * rng.normal(size=(coordinates, count))
    shapes /= np.abs(shapes).max(axis=0)
    frequency = np.linspace(1.0, 2.0, count)

    class Modes(SimpleNamespace):
        def __len__(self) -> int:
            return count

    return Modes(
        shapes=shapes, coordinates=tuple(f"c{k}" for k in range(coordinates)), weights=np.ones(coordinates),
        eigenvalues=2j * math.pi * frequency - 0.1, uncertainty=np.full(count, 1e-9),
        oscillating=np.ones(count, bool), frequency=frequency, damping_ratio=np.full(count, 0.05),
    )  # fmt: skip


@pytest.mark.parametrize("count", [1, 2, 4])
def test_shapes_of_modes_are_bars_with_amplitudes_and_phases(count: int, rng: np.random.Generator) -> None:
    modes = modes_of(count, 3, rng)
    modes.shapes[1, 0] = 0.0
    drawn = Modes.plot(modes)
    assert len(drawn) == count and len(drawn[0].figure.axes) == (6 if count == 4 else count)
    assert not any(axis.get_visible() for axis in drawn[0].figure.axes[count:])
    for k, axis in enumerate(drawn):
        values = modes.shapes[:, k]
        assert [bar.get_width() for bar in axis.patches] == np.abs(values).tolist()
        assert [bar.get_y() + 0.5 * bar.get_height() for bar in axis.patches] == pytest.approx([2, 1, 0])
        assert [text.get_text() for text in axis.get_yticklabels()] == ["c0", "c1", "c2"]
        shown = [(k, value) for k, value in enumerate(values) if value]
        degrees = [f"{round(math.degrees(math.atan2(value.imag, value.real)))}°" for _, value in shown]
        assert [text.get_text() for text in axis.texts] == degrees
        places = [(abs(value) + 0.02, 2 - k) for k, value in shown]
        np.testing.assert_allclose([text.get_position() for text in axis.texts], places, rtol=1e-12)
        assert axis.get_title("left") == f"mode {k + 1}: {modes.frequency[k]:.5g} Hz undamped, damping ratio 0.05"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.5, "grows with 0.5 1/s"), (-0.25, "decays with 0.25 1/s"), (1e-3, "no stiffness"), (-1e-3, "no stiffness")],
)
def test_motions_that_do_not_oscillate_are_captioned_by_their_rate(value: float, text: str) -> None:
    modes = SimpleNamespace(eigenvalues=np.array([value + 0j]), oscillating=[False], uncertainty=[1e-3])
    assert linear_modes.caption(modes, 0) == f"mode 1: {text}"  # type: ignore[arg-type]  # a part of it


def test_roots_over_a_parameter_are_the_upper_half_plane_with_both_ends_marked() -> None:
    values = np.array([1.0, 2.0, 4.0])
    roots = np.array([[-1 + 5j, -1 - 5j, -9.0], [-2 + 6j, -2 - 6j, -1.0], [1e-13 + 7j, 1e-13 - 7j, -1.1]])
    locus = SimpleNamespace(parameter="speed", values=values, eigenvalues=roots)
    (axis,) = RootLocus.plot(locus)  # type: ignore[arg-type]  # has all drawn attributes
    dots = [points.get_offsets().tolist() for points in axis.collections]
    upper = [[-1.0, 5.0], [-2.0, 6.0], [0.0, 7.0]]
    assert dots == [
        upper, upper[:1], upper[-1:], [], [[-9.0, 0.0], [-1.0, 0.0], [-1.1, 0.0]], [[-9.0, 0.0]], [[-1.1, 0.0]],
    ]  # fmt: skip
    assert axis.collections[0].get_array().tolist() == values.tolist()
    assert type(axis.collections[0].norm).__name__ == "LogNorm"
    lines = [line.get_xydata().tolist() for line in axis.lines]
    assert lines[:2] == [upper[:2], [[-1.0, 0.0], [-1.1, 0.0]]]  # further apart than 0.08 (9 + 14) are the others
    assert len(lines) == 3
    assert axis.get_title("left") == "× speed = 1   ○ speed = 4"
    even = SimpleNamespace(parameter="speed", values=np.array([1.0, 2.0, 3.0]), eigenvalues=1j * roots.imag)
    (axis,) = RootLocus.plot(even)  # type: ignore[arg-type]  # has all drawn attributes
    assert type(axis.collections[0].norm).__name__ == "Normalize" and axis.get_xlim() == pytest.approx((-0.7, 0.7))
    assert axis.figure.axes[1].get_ylabel() == "speed"


@pytest.mark.parametrize("few", [3, 8])
def test_decaying_modes_are_listed_after_all_others(few: int) -> None:
    """Unless there are only a few modes, which are listed slowest first."""

    class Modes:
        eigenvalues = np.array([0.0, -5.0, -6.0, -1.0 + 9.0j, 9.5])
        uncertainty = np.full(5, 1e-9)
        oscillating = np.array([False, False, False, True, False])

        def __len__(self) -> int:
            return len(self.eigenvalues)

    modes = Modes()
    found = oscillating_first(cast("Any", modes), few)
    assert found == ([0, 1, 2, 3, 4] if few == 8 else [0, 3, 4, 1, 2])


def oscillators(count: int) -> Linearization:
    """Return masses that are not coupled, with 1, 2, ... rad/s, the last one overdamped."""
    squares, damping = np.arange(1.0, count + 1.0) ** 2, np.full(count, 0.1)
    damping[-1] = 1e3
    return linear_model(np.eye(count), np.diag(damping), np.diag(squares), [f"x{k}" for k in range(count)])


def test_figures_are_saved_under_their_titles(monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[tuple[Any, Path]] = []
    for module in (plots, linear_modes, eigenvalue_loci):
        monkeypatch.setattr(module, "save_figure", lambda figure, path: kept.append((figure, path)) or path)
    few, many, path = oscillators(3).modes(), oscillators(15).modes(), Path("a.png")
    f = np.array([1.0, 2.0])
    spectra = [PowerSpectrum("travel", "m", f, f, "a road"), PowerSpectrum("load", "N", f, 2.0 * f)]
    locus = RootLocus("c", np.array([1.0, 2.0]), np.array([[1j, -1j], [2j, -2j]]), ("marginal",) * 2)
    for returned in (
        linear_modes.draw_modes(few, "rig", path),
        linear_modes.draw_modes(many, "rig", path),
        plots.draw_spectra(spectra, "rig", path),
        eigenvalue_loci.draw_root_locus(locus, "N s/m", "rig", path),
    ):
        assert returned == path
    figures = [figure for figure, _ in kept]
    assert [figure.get_suptitle() for figure in figures] == [
        "rig: shapes of modes",
        "rig: shapes of modes (4 more are not drawn; of 15 coordinates, of each mode the 14 with most kinetic energy)",
        "rig: spectra on a random road",
        "rig: roots over c",
    ]
    shapes = [axis for axis in figures[0].axes if axis.get_visible()]
    assert [axis.get_title("left").split(":")[0] for axis in shapes] == [f"mode {k + 1}" for k in range(len(few))]
    assert len([axis for axis in figures[1].axes if axis.get_visible()]) == 12
    assert all(len(axis.patches) == 14 for axis in figures[1].axes if axis.get_visible())
    assert [axis.get_title("left") for axis in figures[2].axes] == ["travel; a road", "load"]
    assert [axis.get_ylabel() for axis in figures[2].axes] == [f"power spectral density, {u}^2/Hz" for u in "mN"]
    assert figures[3].axes[1].get_ylabel() == "c, N s/m"
