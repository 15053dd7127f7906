"""The singly diagonally implicit Runge-Kutta method of order 4 of the kit: L-stable, for what is
stiff (Hairer & Wanner, Solving Ordinary Differential Equations II, 2nd ed., Table 6.5).
"""

from __future__ import annotations

import numpy as np

SDIRK = np.array([
    [1 / 4, 0.0, 0.0, 0.0, 0.0],
    [1 / 2, 1 / 4, 0.0, 0.0, 0.0],
    [17 / 50, -1 / 25, 1 / 4, 0.0, 0.0],
    [371 / 1360, -137 / 2720, 15 / 544, 1 / 4, 0.0],
    [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4]])  # definition: its coefficients
NODES = np.array([1 / 4, 3 / 4, 11 / 20, 1 / 2, 1.0])  # definition: its times
