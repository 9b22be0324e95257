"""Pictures: animations of runs, figures of machines, section loads along beams, and counts of load cycles."""

from eomgen.base.products import LateRow, Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.verbs": (
            Verb(
                "animate",
                "Write the motion as one HTML page in three dimensions.",
                "eomgen.products.pictures.command:animate",
                behind="plot",
                heading="Build and run",
                solution_methods=("eomgen.products.pictures.animation:animate",),
            ),
            Verb(
                "plot_sections",
                behind="completion",
                solution_methods=("eomgen.products.pictures.section_loads:plot_sections",),
            ),
            Verb(
                "rainflow",
                behind="plot_sections",
                solution_methods=("eomgen.products.pictures.rainflow:rainflow",),
            ),
        ),
        "eomgen.pictures": (
            LateRow("scenery", "eomgen.products.pictures.scenery:scenery_at_poses"),
            LateRow("modes", "eomgen.products.pictures.shapes:draw_modes"),
            LateRow("rest", "eomgen.products.pictures.command:draw_rest_with_loads"),
            LateRow("beams_at_rest", "eomgen.products.pictures.section_loads:beams_at_rest"),
            LateRow("printed_beams", "eomgen.products.pictures.command:print_beams"),
            LateRow("largest_section_loads", "eomgen.products.pictures.section_loads:largest_section_loads"),
            LateRow("stored_section_loads", "eomgen.products.pictures.section_loads:store_drawn_loads"),
            LateRow("section_drawing", "eomgen.products.pictures.section_loads:section_drawing"),
        ),
    },
    moved={
        f"results.{name}": f"eomgen.products.pictures.{name}"
        for name in ("animation", "beam_curves", "rainflow", "roads", "scenery", "section_loads", "shapes", "solids")
    },
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["animation", "beam_curves", "rainflow", "scenery", "section_loads"]
