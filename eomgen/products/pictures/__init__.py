"""Pictures: animations of runs, figures of machines, section loads along beams, and counts of load cycles."""

from eomgen.base.products import LateRow, Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.attributes": (
            {
                "Model": {"animate": "simulate(...).animate(path)"},
                "Solution": dict.fromkeys(("animation", "show"), "animate(path)"),
            },
        ),
        "eomgen.verbs": (
            Verb(
                "animate",
                "Write the motion as one HTML page in three dimensions.",
                "eomgen.products.pictures.command:animate",
                behind="plot",
                heading="Build and run",
                solution_methods=("eomgen.products.pictures.animation:animate",),
                parts={"equilibrium": "eomgen.products.pictures.command:RestPicture"},
                first_step="animate pendulum/out/solution.npz --out pendulum/out/motion.html",
            ),
            Verb(
                "plot_sections",
                behind="completion",
                solution_methods=("eomgen.products.pictures.section_loads:plot_sections",),
                parts={"simulate": "eomgen.products.pictures.command:SectionsOfRun"},
            ),
            Verb(
                "rainflow",
                behind="plot_sections",
                solution_methods=("eomgen.products.pictures.rainflow:rainflow",),
            ),
        ),
        "eomgen.mode_figures": (LateRow("shapes", "eomgen.products.pictures.shapes:draw_modes"),),
        "eomgen.scenery": (LateRow("scenery", "eomgen.products.pictures.scenery:scenery_at_poses"),),
    },
    moved={
        f"results.{name}": f"eomgen.products.pictures.{name}"
        for name in ("animation", "beam_curves", "rainflow", "roads", "scenery", "section_loads", "shapes", "solids")
    },
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["animation", "beam_curves", "rainflow", "scenery", "section_loads"]
