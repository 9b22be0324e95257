"""The catalogue of messages with codes: extraction from the source, upkeep, and tests."""
