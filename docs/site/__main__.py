"""Build the documentation site: ``python -m docs.site``, without network."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from sphinx.cmd.build import build_main

from docs.site.doubts import page as page_of_doubts
from docs.site.gallery import drawn, gallery_pages, write_files
from docs.site.modules import page as page_of_modules
from docs.site.pages import BUILT, Page, external_links, site_pages, write
from docs.site.plain_text import write_plain_text
from docs.site.reference import reference_pages, sessions
from tests.integrators.orders.page import page as page_of_orders

HERE = Path(__file__).parent


def built_pages() -> tuple[Page, ...]:
    """Return the pages that are made of modules, registers and measured numbers."""
    return (
        Page("project/modules", page_of_modules()),
        Page("evidence/doubts", page_of_doubts()),
        Page("evidence/orders", page_of_orders(), *BUILT),
    )


def main(arguments: list[str]) -> int:
    """Write the sources of the site, then the HTML; return Sphinx's exit code, which warnings make nonzero."""
    parser = argparse.ArgumentParser(prog="python -m docs.site", description=__doc__)
    parser.add_argument("--out", type=Path, default=HERE.parent / "_build", help="folder of the site; docs/_build")
    parser.add_argument("--jobs", default="auto", help="processes of Sphinx; one for each core")
    options = parser.parse_args(arguments)
    sources = options.out / "sources"
    site = site_pages((*gallery_pages(), *reference_pages(sessions()), *built_pages()))
    pictures, animations = drawn(options.out / "pictures")
    write(site, sources, pictures)
    links = (f"{address}  {', '.join(places)}\n" for address, places in external_links(site).items())
    (options.out / "external_links.txt").write_text("".join(links), encoding="utf-8")
    words = ["-b", "dirhtml", "-W", "--keep-going", "-q", "-j", options.jobs, "-c", str(HERE)]
    code = build_main([*words, "-d", str(options.out / "doctrees"), str(sources), str(options.out / "html")])
    write_plain_text(site, options.out / "html")
    write_files(options.out / "html", pictures, animations)
    if code == 0:
        folder = options.out / "html"
        sys.stdout.write(f"{folder}; its pages are folders: python -m http.server -d {folder}\n")
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
