"""The version of the package, and of its code in a checkout, for all rooms."""

from functools import cache

__version__ = "0.1.0"


@cache
def checkout_stamp() -> str:
    """Return a hexadecimal digest of names, sizes and times of eomgen's files in a checkout, since code changes there
    under one version; empty if installed."""
    import hashlib  # noqa: PLC0415  # the package is imported without it
    import os  # noqa: PLC0415
    from pathlib import Path  # noqa: PLC0415

    package = Path(__file__).resolve().parents[1]
    templates = package.parent / "templates"
    if not templates.is_dir() or (package / "_templates").is_dir():
        return ""
    files, folders = [], [str(package), str(templates)]
    while folders:
        with os.scandir(folders.pop()) as entries:
            for entry in entries:
                name = entry.name
                if name.endswith((".py", ".jinja", ".toml")):
                    status = entry.stat()
                    files.append((entry.path, status.st_size, status.st_mtime_ns))
                elif name != "__pycache__" and entry.is_dir():
                    folders.append(entry.path)
    return hashlib.sha256(repr(sorted(files)).encode()).hexdigest()
