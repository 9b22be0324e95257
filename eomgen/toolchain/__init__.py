"""C text -> loaded library: compiler, cffi, cache. Knows no mechanics."""

__all__ = ["builder", "cache", "compiler", "doctor", "large_stack", "library", "profiles", "python_functions"]
