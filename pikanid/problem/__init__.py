"""A model bound to recordings: what is estimated, from what, and inputs as functions of time."""
