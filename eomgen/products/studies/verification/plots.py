"""Figure of a check: errors of closed forms over the step of differences."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.figures import new_figure, saved
from eomgen.products.studies.verification.differences import LADDER
from eomgen.products.studies.verification.form_report import FormReport

#: Curves of one panel: more cannot be told apart.
_CURVES = 7
_COLOURS = ("#0B62C4", "#F08C00", "#1A9850", "#C8102E", "#7B3FA0", "#222222", "#00A0B0")
_MARKS = ("o", "s", "^", "D", "v", "P", "X")
#: Errors below this are drawn there: exact ones have no place on a logarithmic axis.
_LEAST = 1e-17


def draw(forms: Sequence[FormReport], title: str, path: Path) -> Path:
    """Draw errors of closed forms over the step, a panel for each family. Raises FileError."""
    panels = _panels(forms)
    columns = 1 if len(panels) == 1 else 2
    rows = -(-len(panels) // columns)
    figure = new_figure((8.0 * columns, 0.9 + 3.6 * rows))
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis, (family, members) in zip(axes, panels, strict=False):
        _panel(axis, family, members)
    for axis in axes[len(panels) :]:
        axis.set_visible(False)
    figure.suptitle(f"{title}\ndotted: against complex steps", fontsize=11)
    return saved(figure, path)


def _panels(forms: Sequence[FormReport]) -> list[tuple[str, list[FormReport]]]:
    """Return the forms of each family, as evenly as a panel's limit allows."""
    families: dict[str, list[FormReport]] = {}
    for form in forms:
        families.setdefault(form.family, []).append(form)
    panels = []
    for family, members in families.items():
        count = -(-len(members) // _CURVES)
        size = -(-len(members) // count)
        panels += [(family, members[first : first + size]) for first in range(0, len(members), size)]
    return panels


def _panel(axis: Any, family: str, forms: Sequence[FormReport]) -> None:
    for form, colour, mark in zip(forms, _COLOURS, _MARKS, strict=False):
        errors = np.clip(np.array(form.errors, dtype=float), _LEAST, None)
        failed = form.verdict != "agrees"
        label = f"{form.name} ({form.verdict})" if failed else form.name
        axis.loglog(
            LADDER, errors, color=colour, marker=mark, markersize=3.5, linewidth=2.4 if failed else 1.2, label=label
        )
        if form.complex_step is not None:
            axis.axhline(max(form.complex_step, _LEAST), color=colour, linewidth=1.0, linestyle=":")
    axis.set_ylim(3e-18, 30.0)
    axis.set_xlim(LADDER[-1] / 2.0, LADDER[0] * 2.0)
    reference = np.array([1e-2, 1.0])
    axis.loglog(reference, 1e-8 * reference**2, color="#999999", linewidth=1.0, linestyle="--")
    axis.annotate("slope 2", (0.05, 2.5e-11), xytext=(3, -9), textcoords="offset points", color="#777777", fontsize=8)
    axis.set_title(family, fontsize=10, loc="left")
    axis.set_xlabel("step / scale of the direction (1 rad, 1 rad/s, 1 s, size of the scene)", fontsize=8)
    axis.set_ylabel("error / largest entry", fontsize=9)
    axis.grid(True, color="#dddddd", linewidth=0.6)
    axis.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, fontsize=8)
