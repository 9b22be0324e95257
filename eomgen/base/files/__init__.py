"""Files that eomgen writes: text, tables as CSV, archives of arrays; whole or not at all. Tables that it
reads."""

from __future__ import annotations

from eomgen.base.files.archives import read_arrays, write_arrays
from eomgen.base.files.csv_tables import read_cells, read_table, write_rows, write_table
from eomgen.base.files.journal import Journal
from eomgen.base.files.writing import check_writable, make_folder, nearby, temporary_file, write_bytes, write_text

__all__ = [
    "Journal",
    "check_writable",
    "make_folder",
    "nearby",
    "read_arrays",
    "read_cells",
    "read_table",
    "temporary_file",
    "write_arrays",
    "write_bytes",
    "write_rows",
    "write_table",
    "write_text",
]
