"""Sources of descriptions: scene files, sources of products and of other distributions."""

__all__ = ["register", "renamed_keys", "source", "toml"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["register", "source"]
