"""Files that eomgen writes, whole or not at all: texts, bytes and arrays (``.npz``); hints for missing files; digests
of files that were read; and the folders of templates and examples."""

from __future__ import annotations

import contextlib
import errno
import functools
import hashlib
import io
import itertools
import json
import math
import os
import stat
import tokenize
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.messages import close_names, shown
from eomgen.errors import FileError, Message, Problem

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable
    from zipfile import ZipFile

#: Errors of the operating system.
_SYSTEM: Mapping[int | None, str] = {
    errno.ENOSPC: "No space left on device [E0024]", errno.EACCES: "Permission denied [E0025]",
    errno.EISDIR: "Is a directory [E0026]", errno.ENOTDIR: "Not a directory [E0027]",
    errno.EEXIST: "File exists [E0028]", errno.EROFS: "Read-only file system [E0029]",
    errno.ENOENT: "No such file or directory [E0030]", errno.EMFILE: "Too many open files [E0031]",
    errno.ENAMETOOLONG: "File name too long [E0032]", errno.EDQUOT: "Disk quota exceeded [E0033]",
    errno.EIO: "Input/output error [E0034]", errno.EPERM: "Operation not permitted [E0035]",
}  # fmt: skip  # a table


def system_code(error: OSError) -> str:
    """Return the code of an error of the operating system; empty for a rare one."""
    return Message(_SYSTEM.get(error.errno, "")).code


def write_file(path: Path, needed: int, fill: Callable[[IO[bytes]], object], fewer: str = "") -> None:
    """Write a file of about ``needed`` bytes, whole or not at all: ``fill`` writes to the stream of a temporary file,
    which then takes the place of ``path``. Raises FileError. ``needed`` is for the message alone, and ``fewer``, which
    continues the remedy of a full disk, begins with a comma: ", or a larger record_every"."""
    temporary: Path | None = None
    try:
        with temporary_file(path) as stream:
            temporary = Path(stream.name)
            fill(stream)
        temporary.replace(path)
    except BaseException as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        if not isinstance(error, OSError):
            raise
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        hint = f"another disk{fewer}" if full else "another folder, or permission to write there"
        fault = f"cannot be written ({error.strerror or error}); about {needed} bytes are needed [E0128]"
        raise FileError(Problem(str(path), fault, hint)) from None


def write_text(path: Path, text: str) -> None:
    """Write a text file. Raises FileError."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file. Raises FileError."""

    def fill(stream: IO[bytes]) -> None:
        stream.write(data)

    write_file(path, len(data), fill)


#: Remedy for files with rows of a run that are too large.
FEWER_ROWS = ", or a larger record_every"
#: Endings of files that are written into folders.
_PICTURES = (".png", ".pdf", ".svg", ".jpg", ".jpeg")
_ENDINGS = (*_PICTURES, ".html", ".csv", ".json", ".npz", ".mat", ".parquet", ".tex", ".c", ".toml")


def make_folder(path: Path) -> Path:
    """Make a folder, with the folders above, unless present, and return the path. Raises FileError, for new folders
    with the ending of a file as well."""
    _check_kind(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(
            Problem(str(path), f"the folder cannot be made: {error.strerror or error} [E0131]", "another folder")
        ) from None
    return path


def make_private_folder(path: Path) -> Path:
    """Return a folder, made if missing; new folders are for their owner alone, for any mask of the process. Raises
    OSError."""
    missing = list(itertools.takewhile(lambda folder: not folder.exists(), (path, *path.parents)))
    for folder in reversed(missing):
        with contextlib.suppress(FileExistsError):  # by another process
            folder.mkdir(0o700)
            folder.chmod(0o700)  # a mask may take permissions from the owner
    if not path.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path))
    return path


def belongs_to_others(path: Path) -> bool:
    """Return whether a path is another user's, put into a folder that others than its owner can write: code there must
    not be run. Raises OSError."""
    if not hasattr(os, "geteuid") or (owner := path.lstat().st_uid) in (os.geteuid(), 0):
        return False
    above = path.parent.stat()
    return owner != above.st_uid or above.st_mode & 0o022 != 0


def _check_kind(folder: Path) -> None:
    """Raise FileError for a file, and for a new folder with the ending of a file."""
    if folder.is_file():
        raise FileError(Problem(str(folder), "this is a file, and a folder is needed [E0130]", "another folder"))
    if folder.suffix.lower() in _ENDINGS and not folder.exists():
        fault = f"a folder is needed, and {folder.suffix} is the ending of a file [E0129]"
        hint = f"the folder {folder.with_suffix('')}, which the files are written to"
        raise FileError(Problem(str(folder), fault, hint))


def check_writable(path: Path, *, folder_is_made: bool = False) -> None:
    """Raise FileError if a file could not be written, before the work whose result the file takes.

    Parameters
    ----------
    folder_is_made : bool
        Whether the folder of the file, if it is missing, is made before the file is written.
    """
    if path.exists() and not path.is_file():
        kind = "a folder" if path.is_dir() else "no regular file"
        raise FileError(
            Problem(str(path), f"this is {kind}, and a file is to be written [E0132]", "the name of a new file")
        )
    _check_place(path, path, folder_is_made)


def check_folder(path: Path) -> None:
    """Raise FileError if files could not be written into a folder, which may be missing yet."""
    _check_kind(path)
    _check_place(path, path / "result", True)


def _check_place(path: Path, file: Path, folder_is_made: bool) -> None:
    """Raise FileError that names ``path`` if ``file`` cannot be made, by making a temporary file there; with
    ``folder_is_made``, in the nearest folder above that exists."""
    folder = file.parent
    while folder_is_made and not folder.exists() and folder != folder.parent:
        folder = folder.parent
    if folder.is_file():
        raise FileError(Problem(str(folder), "this is a file, and a folder is needed [E0130]", "another folder"))
    try:
        with temporary_file(folder / file.name) as stream:
            pass
        Path(stream.name).unlink()
    except OSError as error:
        fault = f"cannot be written ({error.strerror or error}) [E0127]"
        raise FileError(Problem(str(path), fault, "another folder, or permission to write there")) from None


def temporary_file(path: Path) -> IO[bytes]:
    """Open a new file for bytes in the folder of ``path``, under a hidden unique name; the file remains when it is
    closed, and the caller renames or removes the file by its ``name``.

    The system sets the permissions of new files. Reading the process's mask would change the mask for a moment, for
    files of other threads as well.

    Raises
    ------
    OSError
        The file cannot be made.
    """
    flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_BINARY", 0)
    temporary_path = path.parent / f".{path.name}.{os.urandom(8).hex()}"
    return open(temporary_path, "wb", opener=lambda name, _: os.open(name, flags, 0o666))  # Path takes none


#: Kinds of files whose reading may never end, by format of the mode.
_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def open_file(path: Path) -> IO[bytes]:
    """Open a regular file for reading.

    Raises
    ------
    OSError
        The file cannot be opened; it is a folder, a named pipe, a socket or a device, which ``strerror`` names.
    """
    if (kind := _KINDS.get(stat.S_IFMT(path.stat().st_mode))) is not None:
        raise OSError(errno.EINVAL, f"this is {kind}, and a regular file is needed", str(path))
    return path.open("rb")


def read_file(path: Path) -> bytes:
    """Return the bytes of a regular file. Raises OSError."""
    with open_file(path) as stream:
        return stream.read()


def nearby(path: Path, otherwise: str = "another path", endings: Collection[str] = ()) -> str:
    """Return a hint for a missing file: up to three files in the same folder with the nearest names, or that the folder
    is missing.

    Parameters
    ----------
    otherwise : str
        The hint if the file exists, or if no name is near.
    endings : collection of str
        Of files that are of use, in small letters with a point; all by default.
    """
    folder = path.parent
    try:
        if path.exists():
            return otherwise
        if not folder.is_dir():
            return f"another path: there is no folder {str(folder)!a}"
        every: dict[str, list[str]] = {}
        for file in itertools.islice(folder.iterdir(), 2000):
            if not endings or file.suffix.lower() in endings:
                every.setdefault(file.stem.lower(), []).append(file.name)
    except (OSError, ValueError):
        return otherwise
    # of the same ending if there are any
    names = [name for stem in close_names(path.stem.lower(), every) for name in every[stem]]
    alike = [name for name in names if name.endswith(path.suffix)] or names
    named = [str(folder / name) for name in alike[:3]]
    return " or ".join(name if name.isascii() and name.isprintable() else ascii(name) for name in named) or otherwise


_METADATA = "metadata"


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any], fewer: str = "") -> None:
    """Write arrays and metadata to an ``.npz`` file.

    Parameters
    ----------
    path : of the file; an existing file is replaced
    arrays : by name, of numbers, without object arrays
    metadata : JSON types
    fewer : as of ``write_file``

    Raises
    ------
    FileError
        The file cannot be written.
    """
    text = np.array(json.dumps(metadata, sort_keys=True))
    needed = sum(array.nbytes for array in arrays.values()) + text.nbytes
    contents = {**arrays, _METADATA: text}
    write_file(path, needed, lambda stream: np.savez(stream, allow_pickle=False, **contents), fewer)


def read_arrays(
    path: Path, kind: str = "solution", hint: str = "a .npz file of Solution.save"
) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return arrays and metadata of a file of ``write_arrays``.

    Parameters
    ----------
    path : of the file
    kind : noun of the contents, for messages
    hint : remedy in messages

    Returns
    -------
    arrays : by name
    metadata : JSON types

    Raises
    ------
    FileError
        The file cannot be read, or was not written by ``write_arrays``.
    """
    import zipfile  # noqa: PLC0415  # with its decompressors; a run reads no archive

    try:
        with open_file(path) as stream:
            if not zipfile.is_zipfile(stream):
                raise ValueError("it is not an .npz archive, or not all of one")
            with zipfile.ZipFile(stream) as archive:
                _check_sizes(archive)
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
        metadata = json.loads(str(arrays.pop(_METADATA)[()]))
        if not isinstance(metadata, dict):
            raise ValueError("its metadata are not a mapping")
    except OSError as error:
        raise FileError(
            Problem(str(path), f"cannot be read: {error.strerror or error} [E0115]", nearby(path))
        ) from None
    except KeyError as error:
        raise FileError(
            Problem(str(path), f"this is not a {kind} written by eomgen: {error.args[0]} is missing [E0133]", hint)
        ) from None
    # zipfile raises NotImplementedError for a compression or encryption that zipfile does not know, and NumPy reads
    # headers as Python's text: such a file is not ours
    except (
        ValueError, EOFError, NotImplementedError, SyntaxError, tokenize.TokenError, zlib.error, zipfile.BadZipFile
    ) as error:  # fmt: skip  # a list of kinds
        raise FileError(Problem(str(path), f"this is not a {kind} written by eomgen: {error} [E0134]", hint)) from None
    except MemoryError:
        raise FileError(Problem(str(path), "its arrays are larger than the memory [E0135]", hint)) from None
    return arrays, metadata


def _check_sizes(archive: ZipFile) -> None:
    """Raise ValueError for an array of an ``.npz`` archive whose header promises more bytes than are stored, before
    memory is allocated."""
    for item in archive.infolist():
        with archive.open(item) as member:
            if (version := np.lib.format.read_magic(member)) not in _HEADERS:
                continue
            shape, _, kind = _HEADERS[version](member)
            stored = item.file_size - member.tell()
        if (promised := math.prod(shape) * kind.itemsize) > stored:
            name = item.filename.removesuffix(".npy")
            raise ValueError(f"the array {shown(name)} should have {promised} bytes, and has {stored}")


_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
#: In place of the digest of a missing file, which a reader has left out.
ABSENT = "absent"
_DIGESTS: ContextVar[dict[str, str] | None] = ContextVar("digests", default=None)


def read_bytes(path: Path, most: int, hint_of: Callable[[Path], str] = nearby) -> bytes:
    """Return the bytes of a user's file, and note the digest for ``digests_of_files``; ``hint_of`` returns the remedy
    for a file that cannot be read. Raises FileError, for more than ``most`` bytes, too."""
    try:
        with open_file(path) as stream:
            data = stream.read(most + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, FileNotFoundError):
            _collect(path, ABSENT)
        reason = getattr(error, "strerror", None) or error
        raise FileError(Problem(ascii(str(path)), f"cannot be read: {reason} [E0115]", hint_of(path))) from None
    _collect(path, digest_of_file(data))
    if len(data) > most:
        name = path.name if path.name.isascii() and path.name.isprintable() else ascii(path.name)
        raise FileError(Problem(name, f"the file is larger than {most // 1_000_000} MB [E1891]", "a smaller file"))
    return data


def _collect(path: Path, digest: str) -> None:
    digests = _DIGESTS.get()
    if digests is not None:
        file = os.path.abspath(path)  # noqa: PTH100  # links are followed again
        digests[file] = digest if digests.get(file, digest) == digest else ""  # the file changed in between


def digest_of_file(data: bytes) -> str:
    """Return the digest of the bytes of a file."""
    return hashlib.sha256(data).hexdigest()


@contextlib.contextmanager
def digests_of_files() -> Iterator[dict[str, str]]:
    """Give a mapping that collects the digests of the files which ``read_bytes`` reads within the block, by absolute
    path; ``ABSENT`` for a missing file, empty for a file that changed meanwhile."""
    digests: dict[str, str] = {}
    before = _DIGESTS.set(digests)
    try:
        yield digests
    finally:
        _DIGESTS.reset(before)


def template_folder() -> Path:
    """Return the folder of the templates, which has one folder for each kind of generated text."""
    return _data_folder("templates", "c")


def example_folder() -> Traversable:
    """Return the folder of the examples, each a folder with a ``README.md`` and scenes or a program; of an installed
    package it is an archive."""
    archive = Path(__file__).resolve().parents[1] / "_examples.zip.xz"
    if not archive.is_file():
        return _data_folder("examples", "four_bar")
    return _unpack(archive)


@functools.cache
def _unpack(archive: Path) -> Traversable:
    import lzma  # noqa: PLC0415  # for examples of installed packages only
    import zipfile  # noqa: PLC0415

    return zipfile.Path(io.BytesIO(lzma.decompress(archive.read_bytes())))


def _data_folder(name: str, part: str) -> Path:
    """Return the folder of data ``name`` that holds the folder ``part``: ``_name`` within an installed package,
    ``name`` next to the package in a checkout. Raises FileError without either."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / f"_{name}", package.parent / name):
        if (folder / part).is_dir():
            return folder
    raise FileError(
        f"the {name} are neither in {package / f'_{name}'} nor in {package.parent / name} [E0136]", "reinstall eomgen"
    )
