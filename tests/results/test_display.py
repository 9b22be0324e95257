"""What objects show at a prompt and in a notebook: short, escaped, with the numbers that they hold."""

from __future__ import annotations

from html import unescape
from html.parser import HTMLParser

import pytest
import sympy

import eomgen
from tests.models.scenes import MASS, pendulum, pendulum_scene


class Cells(HTMLParser):
    """The text of all cells; fails on tags that do not match."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.rows: list[list[str]] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


def rows_of(html: str) -> list[list[str]]:
    parser = Cells()
    parser.feed(html)
    parser.close()
    assert parser.open == []
    return parser.rows


def test_a_prompt_shows_one_line() -> None:
    scene = pendulum_scene()
    assert repr(scene) == "<Scene shaken: 1 body, 1 joint, 1 force element, 1 input, 2 parameters, 2 outputs>"
    system = eomgen.derive(scene, ["mass", "coupling", "force"])
    flops = {name: system.counts[name].flops for name in ("mass", "coupling", "force")}
    assert repr(system).startswith("<System shaken: nq 1, nv 1, nu 1; operations: mass ")
    assert all(f"{name} {count}" in repr(system) for name, count in flops.items())
    model = pendulum()
    linear = model.linearize(at="initial")
    solution = model.simulate(0.01, 1e-3)
    shown = [scene, system, model, solution, solution.error, linear, linear.modes(), model.equilibrium()]
    assert all(len(repr(item)) < 300 and "\n" not in repr(item) for item in shown)


def test_a_notebook_shows_the_tables_of_a_scene() -> None:
    rows = rows_of(pendulum_scene()._repr_html_())
    assert ["link", f"{MASS:.9g}", "0, 0, -length", "hinge", "revolute", "base"] in rows
    assert ["length", "0.5", "m", "tunable"] in [row[:4] for row in rows]
    assert ["tip", "output", "m"] in [row[:3] for row in rows]


def test_text_of_the_user_is_escaped() -> None:
    scene = eomgen.SceneBuilder("marked", description="<script>alert(1)</script> & more").body("slug", 1.0)
    html = scene.joint("slide", "prismatic", "base", "slug", axis=[1, 0, 0]).build()._repr_html_()
    assert "<script>" not in html and "&lt;script&gt;alert(1)&lt;/script&gt; &amp; more" in html


def test_a_notebook_shows_the_equations_and_their_counts() -> None:
    system = eomgen.derive(pendulum_scene(), ["mass", "coupling", "force", "partials"])
    html = system._repr_html_()
    counted = {row[0]: row[2] for row in rows_of(html)[1:]}
    assert counted["partials"] == str(system.counts["partials"].flops)
    assert f"$$\\displaystyle M = {sympy.latex(system.sympy('mass'))}$$" in unescape(html)
    assert r"M(q)\,\dot v + h(q, v) + b(q, v, t) = Q(q, v, t, u)" in system._repr_latex_()


@pytest.mark.slow
def test_latex_of_a_long_term_names_its_intermediates() -> None:
    system = eomgen.derive("examples/robot_arm/scene.toml", ["forward_dynamics"])
    text = system.latex("forward_dynamics", r"\dot v")
    named, _ = system.sympy("forward_dynamics")
    assert text.count("&=") == len(named) + 1
    assert r"\dot v &= \left[" in text
    with pytest.raises(eomgen.UsageError, match="the term mass is not in this System"):
        system.latex("mass")


def test_a_notebook_shows_the_equation_and_the_tables_of_a_model() -> None:
    model = pendulum()
    page = model._repr_html_()
    rows = rows_of(page)
    assert model._repr_latex_() == r"$\displaystyle M(q)\,\dot v + h(q, v) + b(q, v, t) = Q(q, v, t, u)$"
    assert unescape(page).count(r"$$\displaystyle M(q)\,\dot v + h(q, v) + b(q, v, t) = Q(q, v, t, u)$$") == 1
    names = [row[0] for row in rows]
    assert {*model.q_names, *model.parameters, *model.inputs, *model.terms} <= set(names)
    for name, value in model.parameters.items():
        assert rows[names.index(name)][1] == f"{value:.6g}"
