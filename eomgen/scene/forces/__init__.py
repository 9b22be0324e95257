"""Forces and force elements: what the user writes, and what they become."""
