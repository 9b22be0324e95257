"""The gallery: pictures that lead to the examples, and for each its text, animation, cost of accuracy and files.

The animations are runs of the scenes whose cost of accuracy ``benchmarks.example_pages`` measures, and of further
scenes that move, five seconds at most if a row says no other duration. A build of the site makes them, each anew only
if a file of the example changed. Most pictures are the outputs of these runs.
"""

from __future__ import annotations

import math
import re
import runpy
import shutil
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import eomgen
from benchmarks.example_pages import BEGIN, END, STUDIES
from docs.site.pages import ROOT, Page, headings, read
from docs.site.pictures import PROGRAMS, commanded, costs, digest_of, drawings, saved

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER = "gallery"
#: Files of an example that are shown, by ending, and the language of their block; longer ones are named.
SHOWN, MOST_LINES = {".toml": "toml", ".py": "python", ".c": "c"}, 160
#: Seconds of motion that are animated.
LONGEST = 5.0


@dataclass(frozen=True)
class Motion:
    """A motion that is animated.

    Attributes
    ----------
    file : str
        Scene, or a program whose function ``scene`` returns one, in the folder of the example.
    arguments : tuple
        Of this function, as a number of elements.
    duration : float
        Seconds of motion, at most the duration of the scene.
    initial : list of float
        Configuration at the start; empty for the scene's own.
    inputs : mapping
        Functions of time, by input.
    words : str
        Description of the motion, if it is not the motion of the scene as it stands.
    """

    file: str
    arguments: tuple[int, ...] = ()
    duration: float = LONGEST
    initial: tuple[float, ...] = ()
    inputs: Mapping[str, Callable[[float], float]] = field(default_factory=dict)
    words: str = ""

    def scene(self, folder: Path) -> eomgen.Scene:
        """Return the scene of an example's folder."""
        path = folder / self.file
        if path.suffix == ".py":
            return eomgen.load(runpy.run_path(str(path))["scene"](*self.arguments))
        return eomgen.load(path)


def bump(t: float, axle: float = 0.0) -> float:
    """Return the height, m, of a road with a bump of 0.1 m by 2 m under an axle at 10 m/s."""
    along = 10.0 * t - 3.0 - axle
    return 0.05 * (1.0 - math.cos(math.pi * along)) if 0.0 < along < 2.0 else 0.0


def sweep(t: float) -> float:
    """Return the height, m, of a plate below a wheel, which shakes faster and faster."""
    return 0.01 * math.sin(2.0 * math.pi * (0.5 * t + 1.8 * t * t)) * (1.0 - math.exp(-4.0 * t))


#: Motions of examples whose cost of accuracy is not measured. The others without a row have nothing that moves as
#: bodies do: fields, waves, energies of particles, machines at rest.
MOTIONS: Mapping[str, Motion] = {
    "acrobot_swing_up": Motion("model/scene.toml", initial=(2.6, 0.4), words="without its motor, released high"),
    "car": Motion(
        "system/car.toml", inputs={"steering": lambda t: 0.6 if t > 1.0 else 0.0}, words="steered after a second"
    ),
    "car_in_side_wind": Motion("system/car.toml"),
    "cart_pole_swing_up": Motion("model/scene.toml", initial=(0.0, 2.8), words="without its drive, released high"),
    "coupled_fmus": Motion("scenes/monolith.toml"),
    "duffing_random_excitation": Motion("system/oscillator.toml"),
    "flexible_slider_crank": Motion("crank.py", (8,), 1.0),
    "flying_spaghetti": Motion("spaghetti.py", (16,)),
    "frame_in_earthquake": Motion("demo.py"),
    "identified_arm": Motion("demo.py"),
    "identified_quarter_car": Motion("demo.py", inputs={"plate": sweep}, words="its wheel on a plate that shakes"),
    "moored_platform": Motion("system/platform.toml", duration=120.0),
    "quarter_car_on_random_road": Motion("demo.py"),
    "right_angle_cantilever": Motion("cantilever.py", (5,)),
    "rolling_tyre": Motion("system/wheel.toml"),
    "tippe_top": Motion("system/top.toml"),
    "vehicle_with_preview": Motion(
        "model/scene.toml", inputs={"road_front": bump, "road_rear": lambda t: bump(t, 2.8)}, words="passive, on a bump"
    ),
} | {name: Motion(study.file) for name, study in STUDIES.items()}


def examples() -> list[str]:
    """Return the names of all examples, folders with a page."""
    return sorted(path.parent.name for path in (ROOT / "examples").glob("*/README.md"))


def files_of(name: str) -> list[Path]:
    """Return the files of an example whose text is shown or named, scenes first."""
    folder = ROOT / "examples" / name
    files = [path for path in sorted(folder.rglob("*")) if path.suffix in SHOWN and "__pycache__" not in path.parts]
    return sorted(files, key=lambda path: list(SHOWN).index(path.suffix))


def text_of(name: str) -> str:
    """Return the text of an example's page: its own page, the animation, the cost of accuracy and the files."""
    text = read(f"examples/{name}/README.md")
    if name in MOTIONS:
        motion = MOTIONS[name]
        words = f", {motion.words}" if motion.words else ""
        text += f"\n## Animation\n\nUp to {motion.duration:g} s of `{motion.file}`{words}; drag to turn.\n\n"
        # the frame's path starts at the page's own folder
        text += f'<iframe class="animation" src="../../animations/{name}.html" loading="lazy"></iframe>\n'
    if name in STUDIES:
        measured = read(f"docs/examples/{name}.md").partition(BEGIN)[2].partition(END)[0]
        text += "\n" + measured.replace(f"]({name}.png)", f"](../../docs/examples/{name}.png)").strip() + "\n"
    text += "\n## Files\n"
    for path in files_of(name):
        content = path.read_text(encoding="utf-8")
        shown = path.relative_to(ROOT / "examples" / name)
        if content.count("\n") <= MOST_LINES:
            text += f"\n`{shown}`\n\n```{SHOWN[path.suffix]}\n{content.rstrip()}\n```\n"
        else:
            text += f"\n`{shown}`, {content.count(chr(10))} lines\n"
    return text


def picture_of(name: str) -> str:
    """Return the path of the first picture on an example's page."""
    (first, *_) = re.findall(r"!\[[^\]]*\]\(([\w.]+)\)", read(f"examples/{name}/README.md"))
    return f"examples/{name}/{first}"


def gallery_pages() -> Iterator[Page]:
    """Yield the page of pictures, the pages of all examples, and the table of the cost of accuracy."""
    cards = "\n".join(
        f'<a class="card" href="../{name}/"><img src="../../{copied(name)}" alt="" loading="lazy">'
        f"<span>{headings(read(f'examples/{name}/README.md'))[0]}</span></a>"
        for name in examples()
    )
    listed = "\n".join(("index", *examples()))
    text = "# Gallery\n\nAll examples; each page has the scene or the program, and of scenes the motion.\n"
    text += "How much accuracy costs on them is [one table](index.md).\n"
    yield Page(
        f"{FOLDER}/contents",
        f'{text}\n<div class="cards">\n{cards}\n</div>\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n',
    )
    for name in examples():
        also = f"docs/examples/{name}.md" if name in STUDIES else ""
        yield Page(f"{FOLDER}/{name}", text_of(name), f"examples/{name}/README.md", also=also)
    yield Page(f"{FOLDER}/index", read("docs/examples/README.md"), "docs/examples/README.md")


def copied(name: str) -> str:
    """Return the path of the picture of an example among the files of the site."""
    return f"pictures/{name}{Path(picture_of(name)).suffix}"


def run_of(name: str) -> eomgen.Solution:
    """Return the run of an animation."""
    motion = MOTIONS[name]
    scene = motion.scene(ROOT / "examples" / name)
    model = eomgen.build(scene, profile="quick")
    options = {"initial": {"q": list(motion.initial)}} if motion.initial else {}
    duration = min(motion.duration, scene.simulation.duration)
    return model.simulate(duration, inputs=motion.inputs or None, error_estimate=False, **options)


def run_pictures() -> dict[str, str]:
    """Return the pictures of animated runs, which are in no file of the repository: example by path."""
    paths = {picture_of(name): name for name in MOTIONS if name not in PROGRAMS}
    return {path: name for path, name in paths.items() if not (ROOT / path).is_file()}


def built_pictures() -> set[str]:
    """Return the paths of all pictures that a build draws."""
    tables = {f"docs/examples/{name}.png" for name in STUDIES}
    return {*run_pictures(), *tables, *(picture for drawing in drawings() for picture in drawing.pictures)}


def drawn(kept: Path) -> tuple[dict[str, Path], dict[str, Path]]:
    """Return the files of pictures by their paths, and of animations by example; a folder keeps them."""
    kept.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(1) as pool:
        others = pool.submit(commanded, kept)  # in processes of their own
        pictures, pages = costs(kept), {}
        owners = {name: path for path, name in run_pictures().items()}
        for name in MOTIONS:
            sources = [Path(__file__), *files_of(name)]
            pages[name] = kept / f"{name}-{digest_of(sources)}.html"
            run = None if pages[name].is_file() else run_of(name)
            if run is not None:
                run.animate(pages[name])
            if name in owners:
                draw = partial(_figure, name, run)
                pictures[owners[name]] = saved(kept, name, sources, draw)
        return pictures | others.result(), pages


def _figure(name: str, run: eomgen.Solution | None) -> Figure:
    (first, *_) = (run or run_of(name)).plot()
    figure: Figure = first.figure
    return figure


def write_files(html: Path, pictures: Mapping[str, Path], pages: Mapping[str, Path]) -> None:
    """Copy the pictures of the gallery and the animations into the HTML of a site."""
    for name in examples():
        target = html / copied(name)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(pictures.get(picture_of(name), ROOT / picture_of(name)), target)
    (html / "animations").mkdir(exist_ok=True)
    for name, page in pages.items():
        shutil.copyfile(page, html / "animations" / f"{name}.html")
