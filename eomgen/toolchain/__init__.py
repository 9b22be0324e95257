"""C text -> loaded library: compiler, cffi, cache. Knows no mechanics."""
