"""Bytecode of templates, kept in a folder: to compile the templates of one model takes Jinja longer than all else that
is written of a small one."""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

import jinja2
from jinja2.bccache import Bucket

from eomgen.base.version import __version__

_DIGEST = 32


class TemplateBytecode(jinja2.BytecodeCache):
    """Bytecode in a folder that is made at its first use; none is kept if the folder cannot be written.

    A file is taken if it is whole by its digest, and of the same template, Python, Jinja and eomgen, whose filters may
    have been applied to constants.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def get_cache_key(self, name: str, filename: str | None = None) -> str:
        """Return the name of a template's file."""
        text = "\0".join((name, filename or "", jinja2.__version__, __version__))
        return hashlib.sha256(text.encode()).hexdigest()

    def load_bytecode(self, bucket: Bucket) -> None:
        """Take the bytecode of a template from the folder."""
        with contextlib.suppress(OSError):
            kept = (self.folder / bucket.key).read_bytes()
            if hashlib.sha256(kept[_DIGEST:]).digest() == kept[:_DIGEST]:
                bucket.bytecode_from_string(kept[_DIGEST:])

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Keep the bytecode of a template, under its name once it is whole."""
        code = bucket.bytecode_to_string()
        with contextlib.suppress(OSError):
            self.folder.mkdir(exist_ok=True)
            handle, private = tempfile.mkstemp(prefix="tmp-", dir=self.folder)
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(hashlib.sha256(code).digest() + code)
                Path(private).replace(self.folder / bucket.key)
            except OSError:
                Path(private).unlink()
                raise
