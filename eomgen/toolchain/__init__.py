"""C text -> loaded library: compiler, cffi, cache. Knows no mechanics."""

__all__ = [
    "builder",
    "cache",
    "compiler",
    "cross",
    "doctor",
    "large_stack",
    "library",
    "number_tables",
    "profiles",
    "python_functions",
]
