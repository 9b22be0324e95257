"""The pages of the site: hand-written pages in their places, with links and images that follow.

A page of the repository is Markdown whose links are paths of the repository. The site has another arrangement. So every
link is resolved to the file and heading that it names, and written again for the place of this heading in the site.
Links to an anchor of a page in parts, as ``docs/scene.md#springs``, go to the part. Links to files that the site does
not have become the path of the file.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: Fenced and indented code, and code in a line, where brackets are no links.
_CODE = re.compile(r"^(```+|~~~+).*?^\1[`~]*$|(?:^|\n\n)(?: {4}[^\n]*\n)+|`[^`\n]+`", re.DOTALL | re.MULTILINE)
_FENCED = re.compile(r"^(```+|~~~+).*?^\1[`~]*$", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^(#+) (.+)$", re.MULTILINE)


@dataclass(frozen=True)
class Page:
    """One page of the site.

    Attributes
    ----------
    place : str
        Path within the site, without ending: ``reference/scene/springs``.
    text : str
        Markdown, or reStructuredText with the ending ``.rst``.
    source : str
        Path in the repository from which links start; empty for a generated page, whose links are the site's own.
    ending : str
        ``.md`` or ``.rst``.
    also : str
        Path of another page of the repository whose text this page contains; empty for none.
    """

    place: str
    text: str
    source: str = ""
    ending: str = ".md"
    also: str = ""


@dataclass(frozen=True)
class Part:
    """A part of the navigation: a page of links to its pages.

    Attributes
    ----------
    place, title, text : str
        Of the page with the list; the text stands above the list.
    pages : tuple of str
        Places of its pages in the order of the list.
    captions : mapping, optional
        Headings of the list, by the place of the first page below each.
    gains : mapping, optional
        Result of each page, by place: a line of the list in place of the title alone.
    """

    place: str
    title: str
    text: str
    pages: tuple[str, ...] = ()
    captions: Mapping[str, str] = field(default_factory=dict)
    gains: Mapping[str, str] = field(default_factory=dict)


@dataclass
class Site:
    """Pages by place, the places of headings of the repository's pages, and anchors of pages in parts."""

    pages: dict[str, Page] = field(default_factory=dict)
    anchors: dict[tuple[str, str], str] = field(default_factory=dict)
    moved: dict[tuple[str, str], tuple[str, str]] = field(default_factory=dict)

    def add(self, page: Page) -> None:
        """Add a page, and its headings as targets of links."""
        if page.place in self.pages:
            raise ValueError(f"the site has two pages {page.place}")
        self.pages[page.place] = page
        if page.source:
            self.anchors.setdefault((page.source, ""), page.place)
            self.anchors.setdefault((page.also or page.source, ""), page.place)
            for heading in headings(page.text):
                self.anchors.setdefault((page.source, anchor(heading)), page.place)


def anchor(heading: str) -> str:
    """Return the anchor of a heading, as repositories on the web make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")


def headings(text: str) -> list[str]:
    """Return the headings of a page outside of blocks of code."""
    return [match[2] for match in _HEADING.finditer(_FENCED.sub("", text))]


def read(path: str) -> str:
    """Return the text of a file of the repository."""
    return (ROOT / path).read_text(encoding="utf-8")


def parts_of(page: str) -> list[str]:
    """Return the paths of the parts of a page, such as ``docs/scene.md``, in the order of its list."""
    folder = Path(page).stem
    names = re.findall(rf"\]\(({folder}/\w+\.md)\)", read(page))
    return [f"docs/{name}" for name in dict.fromkeys(names)]


def moved_anchors(page: str) -> dict[tuple[str, str], tuple[str, str]]:
    """Return the file and the heading of a part by the page and by the anchor that the heading had on the page.

    The list of a page in parts keeps the anchors: ``<a id="springs"></a>[springs](scene/springs.md)``.
    """
    found: dict[tuple[str, str], tuple[str, str]] = {}
    for name, target in re.findall(r'<a id="([^"]+)"></a>\[[^\]]*\]\(([^)\s]+)\)', read(page)):
        file, _, heading = target.partition("#")
        found[page, name] = (os.path.normpath(Path(page).parent / file), heading)
    return found


def relinked(page: Page, site: Site, copied: Callable[[str], str]) -> str:
    """Return the text of a page with the links of its place in the site.

    Parameters
    ----------
    page : Page
        With paths of the repository.
    site : Site
        All pages.
    copied : callable
        From the path of a file in the repository to the path of its copy in the site.

    Raises
    ------
    ValueError
        A link names a heading that its page does not have.
    """
    here = Path(page.place).parent

    def link(match: re.Match[str]) -> str:
        image, shown, target = match[1], match[2], match[3]
        if re.match(r"[a-z]+:", target):
            return match[0]
        shown = _LINK.sub(link, shown)  # an image that is a link
        file, _, heading = target.partition("#")
        path = os.path.normpath(Path(page.source).parent / file) if file else page.source
        if image or path.endswith((".png", ".svg")):
            return f"{image}[{shown}]({os.path.relpath(copied(path), here)})"
        if (ROOT / path).is_dir() and (f"{path}/README.md", "") in site.anchors:
            path = f"{path}/README.md"
        path, heading = site.moved.get((path, heading), (path, heading))
        if (path, "") in site.anchors:
            place = site.anchors.get((path, heading))
            if place is None:
                raise ValueError(f"{page.source}: {path} has no heading {heading}")
            to = "" if place == page.place and heading else os.path.relpath(place + site.pages[place].ending, here)
            whole = heading and heading != anchor(headings(site.pages[place].text)[0])
            return f"[{shown}]({to}{f'#{heading}' if whole or not to else ''})"
        return shown if f"`{path}`" == shown else f"{shown} (`{path}`)"

    pieces, end = [], 0
    for match in _CODE.finditer(page.text):
        # a link whose text is code starts before the code
        pieces.append((page.text[end : match.start()], match[0]))
        end = match.end()
    codes = [code for _, code in pieces]
    hidden = "".join(f"{text}\0{number}\0" for number, (text, _) in enumerate(pieces)) + page.text[end:]
    linked = _LINK.sub(lambda match: link(_shown(match, codes)), hidden)
    return re.sub("\0(\\d+)\0", lambda match: codes[int(match[1])], linked)


class _Restored:
    """Groups of a link whose text has its code in place."""

    def __init__(self, match: re.Match[str], codes: list[str]) -> None:
        self._groups = [re.sub("\0(\\d+)\0", lambda it: codes[int(it[1])], match[number]) for number in range(4)]

    def __getitem__(self, number: int) -> str:
        return self._groups[number]


def _shown(match: re.Match[str], codes: list[str]) -> re.Match[str]:
    return _Restored(match, codes)  # type: ignore[return-value]


def contents(part: Part) -> str:
    """Return the page of a part: title, text and list of pages."""
    here, text = Path(part.place).parent, f"# {part.title}\n\n{part.text}\n"
    starts = [number for number, place in enumerate(part.pages) if number == 0 or place in part.captions]
    for start, end in zip(starts, [*starts[1:], len(part.pages)], strict=True):
        listed = part.pages[start:end]
        heading = f"\n## {part.captions[listed[0]]}\n" if listed[0] in part.captions else ""
        pages = "\n".join(os.path.relpath(place, here) for place in listed)
        lines = "".join(f"- {part.gains[place]}\n" for place in listed if place in part.gains)
        text += f"{heading}\n{lines}\n" if lines else f"{heading}\n"
        text += f"```{{toctree}}\n{':hidden:' if lines else ':maxdepth: 1'}\n\n{pages}\n```\n"
    return text


def gain(page: Page) -> str:
    """Return the line of a how-to page in the list: title, and first sentence, which starts with "You get"."""
    title, _, rest = page.text.partition("\n\n")
    found = re.match(r"You get (.+?[.])(?=\s)", rest, re.DOTALL)
    if found is None:
        raise ValueError(f"{page.source}: the first sentence does not start with You get")
    return f"[{title[2:]}]({Path(page.place).name}.md): {' '.join(found[1].split())}"


#: Paths by which pages link to pages that a build of the site makes.
BUILT = ("docs/orders.md",)
#: Pages in parts, and the folders of their parts in the site.
IN_PARTS = {
    "docs/scene.md": "reference/scene",
    "docs/python.md": "guide",
    "docs/command_line.md": "reference/command_line/guide",
}
#: Pages about one subject each, by their place among the guides.
GUIDES = (
    "overview", "choosing", "urdf_robots", "statics", "identification", "ensembles", "clusters", "random_vibration",
    "waves", "hamiltonian", "fields", "optimisers", "fmu", "live", "sympy", "compilers", "extending",
)  # fmt: skip  # a list of words
EVIDENCE = ("verification", "peers", "accuracy", "orders", "extremes", "benchmarks")
THEORY = (
    "separated_form", "lie_groups", "tape_and_loops", "constraints", "beams", "time_integration", "errors_of_runs",
    "equilibria", "derivatives_of_runs", "random_vibration", "waves", "fields", "generated_code",
)  # fmt: skip  # a list of words
TUTORIALS: tuple[str, ...] = ("pendulum", "active_vehicle", "four_bar")
PROJECT = ("support", "architecture")
CONTRIBUTING = (
    "first_change", "inside", "changes_of_scenes_and_equations", "changes_of_code_and_runs", "changes_of_products",
    "new_parts", "decisions", "tests",
)  # fmt: skip  # a list of words
#: How-to pages by subject.
HOW_TO = {
    "Describe a machine": (
        "units", "cable_net", "beam_with_large_deflection", "closed_loop_in_a_urdf", "mujoco_model",
        "arm_with_a_gripper", "kinematics_and_compliance", "contact_with_the_ground", "shake_the_base_with_measured_data", "own_force_law",
        "drive_a_car", "write_a_plug_in", "force_element_plug_in",
    ),
    "Find a task by its name": ("short_recipes",),
    "Run and compare": (
        "choose_method_and_step", "stop_at_an_event", "forces_in_joints", "many_runs", "ensemble_on_a_cluster",
        "fit_parameters", "compare_two_runs", "page_for_a_colleague", "same_digits_everywhere",
    ),
    "Control": (
        "my_own_controller", "my_own_controller_in_c", "hybrid_test", "sampled_controller", "state_space",
        "inverse_dynamics_of_a_loop", "optimal_control_with_casadi",
    ),
    "Vibration": (
        "natural_frequencies_and_modes", "frequency_response", "campbell_diagram", "ride_comfort_on_a_rough_road",
        "fatigue_damage",
    ),
    "Equations, derivatives and code": (
        "equations_as_symbols", "exact_derivatives", "check_derivatives", "gradients_in_jax", "models_on_a_gpu",
        "urdf_to_c", "c_code_for_a_microcontroller", "fmu_for_simulink", "machine_without_compiler",
        "cuda_in_a_program",
    ),
}  # fmt: skip  # lists of words


def hand_written() -> Iterator[Page]:
    """Yield the pages of the repository in their places."""
    yield Page("index", read("docs/index.md"), "docs/index.md")
    for page, folder in IN_PARTS.items():
        yield Page(f"{folder}/index", read(page), page)
        yield from (Page(f"{folder}/{Path(part).stem}", read(part), part) for part in parts_of(page))
    for folder, names in (
        ("guide", GUIDES),
        ("evidence", EVIDENCE),
        ("project", PROJECT),
        ("reference", ("index_of_words", "glossary", "glossary_of_methods", "mjcf", "sdf")),
    ):
        for name in (name for name in names if f"docs/{name}.md" not in BUILT):
            yield Page(f"{folder}/{name}", read(f"docs/{name}.md"), f"docs/{name}.md")
    for folder in ("theory", "contributing", "tutorials", "how_to"):
        for path in sorted((ROOT / "docs" / folder).glob("*.md")):
            yield Page(f"{folder}/{path.stem}", read(f"docs/{folder}/{path.name}"), f"docs/{folder}/{path.name}")


def parts(site: Site) -> list[Part]:
    """Return the parts of the navigation in their order."""

    def under(folder: str, *first: str) -> tuple[str, ...]:
        pages = [
            place
            for place in site.pages
            if place.startswith(f"{folder}/") and place.count("/") == folder.count("/") + 1
        ]
        return (
            *(f"{folder}/{name}" for name in first if f"{folder}/{name}" in site.pages),
            *(it for it in pages if Path(it).name not in (*first, "index")),
        )

    reference = (
        "scene/contents",
        "python/index",
        "command_line/index",
        "methods/index",
        "c_interface",
        "messages/index",
        "index_of_words",
        "glossary",
        "glossary_of_methods",
        "mjcf",
        "sdf",
    )
    rows = (
        ("tutorials/index", "Tutorials", "A quarter of an hour each, from nothing.", under("tutorials", *TUTORIALS)),
        (
            "how_to/index",
            "How-to pages",
            "One task on each page. Every block runs as it stands.",
            under("how_to", *(name for names in HOW_TO.values() for name in names)),
            {f"how_to/{names[0]}": subject for subject, names in HOW_TO.items()},
            {place: gain(page) for place, page in site.pages.items() if place.startswith("how_to/")},
        ),
        ("guide/contents", "Guides", "All uses of one subject, with options.", ("guide/index", *under("guide"))),
        (
            "reference/index",
            "Reference",
            "Every key, name, verb, method, C function and message.",
            tuple(f"reference/{name}" for name in reference),
        ),
        ("theory/index", "Theory", "The equations and algorithms, with their sources.", under("theory", *THEORY)),
        ("evidence/index", "Verification", "Measured orders, errors and times.", under("evidence", *EVIDENCE)),
        (
            "project/index",
            "Project",
            "Versions, and the inside of the package.",
            (*under("project", *PROJECT), *under("contributing", *CONTRIBUTING)),
        ),
        (
            "reference/command_line/guide/contents",
            "Guide to the command line",
            "Options, files and exit codes.",
            ("reference/command_line/guide/index", *under("reference/command_line/guide")),
        ),
        (
            "reference/scene/contents",
            "Scene files",
            "A page for each section of a scene file, and pages on all sections.",
            ("reference/scene/index", *under("reference/scene")),
        ),
    )
    return [Part(*row) for row in rows]


def site_pages(generated: Iterable[Page]) -> Site:
    """Return the pages of the site, with the given generated ones."""
    site = Site(moved={key: place for page in IN_PARTS for key, place in moved_anchors(page).items()})
    for page in (*hand_written(), *generated):
        site.add(page)
    made = parts(site)
    for part in made:
        places = tuple(place for place in part.pages if place != part.place)
        site.add(Page(part.place, contents(replace(part, pages=places))))
    front, tops = site.pages["index"], [part.place for part in made if part.place.count("/") == 1]
    tops.insert(tops.index("project/index"), "gallery/contents")
    tree = "\n".join(tops)
    site.pages["index"] = Page("index", f"{front.text}\n```{{toctree}}\n:hidden:\n\n{tree}\n```\n", front.source)
    return site


def external_links(site: Site) -> dict[str, list[str]]:
    """Return the places that link to each address outside of the site; a build has no network to follow them."""
    found: dict[str, list[str]] = {}
    for page in site.pages.values():
        for match in _LINK.finditer(_CODE.sub("", page.text)):
            if re.match(r"https?:", match[3]):
                found.setdefault(match[3], []).append(page.place)
    return dict(sorted(found.items()))


def write(site: Site, folder: Path, drawn: Mapping[str, Path]) -> None:
    """Write the sources of the site; files whose text is unchanged keep their time, so that Sphinx reads them once.

    Parameters
    ----------
    site : Site
        All pages.
    folder : Path
        For the sources.
    drawn : mapping
        Files of pictures that the repository does not have, by the paths of links.
    """
    kept: set[Path] = set()

    def put(path: Path, content: bytes) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_bytes() != content:
            path.write_bytes(content)
        kept.add(path)

    def copied(path: str) -> str:
        put(folder / "images" / path, drawn.get(path, ROOT / path).read_bytes())
        return f"images/{path}"

    for page in site.pages.values():
        text = relinked(page, site, copied) if page.source else page.text
        put(folder / f"{page.place}{page.ending}", text.encode())
    for path in sorted(folder.rglob("*"), reverse=True):
        if path.is_file() and path not in kept:
            path.unlink()
        elif path.is_dir() and not any(path.iterdir()):
            shutil.rmtree(path)
