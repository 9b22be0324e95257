"""eomgen beside its peers: one table of rows, each checked before it is timed, stored as JSON, and the page made of
it."""
