"""Register of target languages: C, rows of products, and entry points of other distributions."""

from __future__ import annotations

from functools import cache

from eomgen.base.extensions import broken, extensions, load_row
from eomgen.base.messages import nearest, shown
from eomgen.base.products import fault_of_absent, rows_of
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.target import Target
from eomgen.errors import Problem, UsageError

#: The group of rows of products, and of entry points for targets of other distributions: objects of ``Target``.
GROUP = "eomgen.targets"


def _c_files(program: Program) -> dict[str, str]:
    from eomgen.codegen.targets.c.target import generate_files  # noqa: PLC0415  # known texts of a library are not printed

    return generate_files(program)


C = Target("c", "C99", NAMES, _c_files, steppers=True)
BUILT_IN: tuple[Target, ...] = (C,)


@cache
def targets() -> dict[str, Target]:
    """Return all target languages by name: C, rows of products, and entry points of other distributions. Raises
    UsageError naming the distribution whose entry point cannot be loaded or takes a name twice."""
    by_name = {target.name: target for target in (*BUILT_IN, *rows_of(GROUP, Target))}
    for entry in extensions(GROUP):
        target = load_row(entry, Target)
        if target.name in by_name:
            raise broken(entry, f"takes the name {shown(target.name)}, which another target has")
        by_name[target.name] = target
    return by_name


def target_named(name: str) -> Target:
    """Return a target language by name. Raises UsageError with the nearest names, or with the product that would have
    the target but is absent."""
    known = next((target for target in BUILT_IN if target.name == name), None)
    if known is not None:
        return known
    if name not in targets():
        if absent := fault_of_absent(str(name)):
            raise UsageError(
                Problem("target", f"there is no target {shown(str(name))}: {absent[0]} [E0221]", absent[1])
            )
        raise UsageError(
            Problem("target", f"there is no target {shown(str(name))} [E0222]", nearest(str(name), targets()))
        )
    return targets()[name]
