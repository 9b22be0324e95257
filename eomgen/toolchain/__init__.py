"""C text -> loaded library: compiler, cffi, cache. Knows no mechanics."""

__all__ = [
    "builder",
    "cache",
    "compiler",
    "cross",
    "doctor",
    "large_stack",
    "library",
    "profiles",
    "python_functions",
    "tables",
]
