"""Noise of a recording: its standard deviation and colour, and where it is alone."""
