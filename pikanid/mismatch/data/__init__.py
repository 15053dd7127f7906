"""Recordings made ready to be judged: outliers out, noise in, residuals white."""
