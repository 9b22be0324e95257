"""A whole scene file as data: schema, validation entry by entry, assembly into a Scene, its reference page."""
