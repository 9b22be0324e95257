"""Pages for readers; ``docs.site`` makes the documentation site of them."""
