"""Controllers and state feedback: what the user writes, and what they become."""
