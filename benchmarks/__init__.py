"""Timings side by side with peers; see README.md. Nothing in eomgen imports this folder."""
