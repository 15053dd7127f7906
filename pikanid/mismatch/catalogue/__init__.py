"""The catalogue: which physics a model can leave out, and what only looks like it."""
