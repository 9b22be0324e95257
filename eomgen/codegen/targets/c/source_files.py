"""Distribution of the functions of a large model over several C files, which compilers take side by side."""

from __future__ import annotations

from eomgen.base.data import dataclass, field
from eomgen.codegen.program import Program, ProgramFunction

#: Operations per C file, roughly; a file this long compiles in half a second, and an arm of seven joints has three.
FILE_LIMIT = 3000
#: Operations in a statement of a loop, roughly.
_PER_STATEMENT = 2


@dataclass
class SourceFile:
    """A C file: the loops and the parts of long functions in the file, and the functions defined there.

    ``name`` has no suffix; loops are numbers of the Program's loops.
    """

    name: str
    functions: list[ProgramFunction] = field(default_factory=list)
    parts: list[tuple[ProgramFunction, int]] = field(default_factory=list)
    loops: list[int] = field(default_factory=list)
    operations: int = 0


def plan_files(program: Program, limit: int = FILE_LIMIT) -> list[SourceFile]:
    """Return the files of a Program; the first file has the prefix as name and calls the parts in the other files."""
    first = SourceFile(program.prefix)
    files = [first]
    loops = [_PER_STATEMENT * len(loop.statements) for loop in program.loops]
    total = sum(function.operations for function in program.functions) + sum(loops)
    for function in program.functions:
        if len(function.parts) > 1 and total > limit:
            for number, part in enumerate(function.parts):
                target = _room(files, part.operations, limit, program.prefix)
                target.parts.append((function, number))
                target.operations += part.operations
            first.functions.append(function)
        else:
            target = _room(files, function.operations, limit, program.prefix)
            target.functions.append(function)
            target.operations += function.operations
            target.parts += [(function, number) for number in range(len(function.parts)) if len(function.parts) > 1]
    for number, operations in enumerate(loops):
        target = min(files, key=lambda file: file.operations) if total > limit else first
        if target.operations and target.operations + operations > limit and total > limit:
            target = SourceFile(f"{program.prefix}_{len(files) + 1}")
            files.append(target)
        target.loops.append(number)
        target.operations += operations
    return files


def _room(files: list[SourceFile], operations: int, limit: int, prefix: str) -> SourceFile:
    last = files[-1]
    if last.operations and last.operations + operations > limit:
        last = SourceFile(f"{prefix}_{len(files) + 1}")
        files.append(last)
    return last
