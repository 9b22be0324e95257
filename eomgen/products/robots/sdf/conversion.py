"""Conversion of SDF to a scene."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from eomgen.base.messages import listed
from eomgen.products.robots.conversion import Conversion, joints_to_hold
from eomgen.products.robots.scene_draft import SceneDraft
from eomgen.products.robots.sdf.reading import SdfReader
from eomgen.products.robots.uris import package_folders
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.xml import read_xml
from eomgen.scene.sources.source import ConvertedScene


def sdf_data(
    text: str,
    *,
    file: str = "model.sdf",
    strict: bool = False,
    path: Path | None = None,
    lock: Sequence[str] = (),
    limits: bool = False,
    friction: bool = False,
    actuated: bool = False,
    weld: Sequence[str] = (),
    packages: Sequence[str] = (),
    included: bool = False,
) -> ConvertedScene:
    """Return an SDF file in the form of a scene file, with notes on all that is left out.

    `text` and `file` are the text and its name in messages; `path` is the file, from whose folder meshes and included
    files are named (None: the current folder). `strict` refuses elements that would be left out; `lock` names joints to
    hold at zero; `limits` and `friction` take stops and dry friction; with `actuated` joints have efforts as inputs;
    `weld` names links or frames to fix to the base; `packages` has texts NAME=FOLDER; `included`: a scene includes the
    file, so the base may move. Raises DescriptionError, OptionError.
    """
    home = Path() if path is None else path.parent
    report = Report(file, {})
    draft = SdfReader(report, package_folders(packages), home).draft(read_xml(text, file), file, home)
    conversion = Conversion(draft, SceneDraft(report, {}, included=included), limits=limits, friction=friction)
    joints = conversion.joints
    locked = joints_to_hold(lock, joints, file)
    conversion.connect({joints[name]: 0.0 for name in locked}, [weld] if isinstance(weld, str) else weld)
    conversion.convert(actuated=actuated)
    if locked:
        draft.notes.append(f"joints locked at zero: {listed(sorted(locked))} [W0171]")
    if any("::" in conversion.name_of(node) for node in conversion.links):
        draft.notes.append("names of models within one another are joined: arm::hand is arm__hand [W0172]")
    return conversion.result(strict=strict)
