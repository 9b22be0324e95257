"""Files that descriptions name by addresses: ``package://NAME/...``, ``model://NAME/...``, ``file://...`` and paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from eomgen.base.messages import shown
from eomgen.scene.sources.source import OptionError

_OF_FOLDERS = ("package://", "model://")
_FILE = "file://"


def package_folders(packages: Sequence[str]) -> dict[str, Path]:
    """Return the folders of packages by name, from texts ``NAME=FOLDER`` (a list, or one text).

    Raises
    ------
    OptionError
        For a text of another form, or a folder that does not exist.
    """
    result = {}
    for text in [packages] if isinstance(packages, str) else packages:
        name, equals, folder = text.partition("=")
        if not name or not equals or not folder:
            fault = f"packages: {shown(text)} is not NAME=FOLDER [E1977]"
            raise OptionError("packages", fault, 'packages=["robot=../robot"]')
        if not Path(folder).expanduser().is_dir():
            fault = f"packages: there is no folder {shown(folder)} [E1978]"
            raise OptionError("packages", fault, "the folder of the package")
        result[name] = Path(folder).expanduser()
    return result


def locate(address: str, folder: Path, packages: Mapping[str, Path]) -> Path:
    """Return the path of an address (a path, or ``file://``, ``package://`` or ``model://`` with a path), which may not
    exist.

    Parameters
    ----------
    folder : Path
        Folder of the file that has the address. A package that is not in ``packages`` is looked for in this folder and
        in all folders around.
    packages : mapping
        Folders of packages by name. An address without a scheme may begin with such a name, too, if no file is there.
    """
    if address.startswith(_FILE):
        return Path(address.removeprefix(_FILE))
    scheme = next((scheme for scheme in _OF_FOLDERS if address.startswith(scheme)), "")
    if not scheme and (address.partition("/")[0] not in packages or is_there(folder / address)):
        return folder / address
    name, _, rest = address.removeprefix(scheme).partition("/")
    if name in packages:
        return packages[name] / rest
    around = folder.resolve()
    for holder in (around, *around.parents):
        there = holder / name / rest
        if is_there(there):
            return there
    return folder / name / rest


def is_there(path: Path) -> bool:
    """Return whether there is a file or folder; names that no file can have, as of a thousand letters, are of none."""
    try:
        path.stat()
    except (OSError, ValueError):
        return False
    return True


def is_remote(address: str) -> bool:
    """Return whether an address lies in a network."""
    return address.startswith(("http://", "https://"))
