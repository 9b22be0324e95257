"""Methods of Solution, for type checkers and editors: from the register of verbs, by
``python -m tests.model_stub``."""

from eomgen.products.linear.analyses.solutions import linearize as _linearize
from eomgen.products.linear.analyses.solutions import psd as _psd
from eomgen.products.linear.analyses.solutions import rms as _rms
from eomgen.products.pictures.animation import animate as _animate
from eomgen.products.pictures.rainflow import rainflow as _rainflow
from eomgen.products.pictures.section_loads import plot_sections as _plot_sections

class SolutionMethods:
    linearize = _linearize
    psd = _psd
    rms = _rms
    animate = _animate
    rainflow = _rainflow
    plot_sections = _plot_sections
