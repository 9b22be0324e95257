"""Parameters, inputs, states, curves, roads and outputs: what the user writes, and what they become."""
