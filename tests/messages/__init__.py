"""Codes of messages: upkeep and tests."""
