"""Cache keys of libraries: digests of everything that their bytes depend on."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from eomgen.toolchain.compiler import Compiler, library_suffix, processor
from eomgen.toolchain.profiles import Profile


def library_key(content: bytes, compiler: Compiler, profile: Profile, flags: Sequence[str], mode: str) -> str:
    """Return the key of the library of these content bytes that a compiler makes with these flags on this machine.

    Parameters
    ----------
    content : everything that the sources depend on
    flags : all of them, with the flags of the profile
    mode : of cffi, ``api`` or ``abi``
    """
    return _digest(compiler.identity, content, profile, flags, mode)


def origin_of(content: bytes, profile: Profile, flags: Sequence[str], mode: str) -> str:
    """Return the key of the same library for any compiler."""
    return _digest("", content, profile, flags, f"{mode} on {platform.system()} {platform.machine()}")


def wrapper_key(compiler: Compiler, cdef: str, header: str, headers: Path) -> str:
    """Return the key of the extension module's object, made with the headers of Python in this folder."""
    content = "\0".join((compiler.identity, cdef, header, version("cffi"), library_suffix(), str(headers)))
    return hashlib.sha256(b"wrapper\0" + content.encode()).hexdigest()


def _digest(compiler: str, content: bytes, profile: Profile, flags: Sequence[str], mode: str) -> str:
    machine = processor() if profile.native else ""
    digest = hashlib.sha256()
    for text in (compiler, " ".join(flags), machine, mode, library_suffix()):
        digest.update(text.encode() + b"\0")
    digest.update(content)
    return digest.hexdigest()
