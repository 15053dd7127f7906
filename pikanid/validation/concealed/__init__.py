"""Recordings with hidden physics, made by a simulator that knows nothing of the rest of pikanid.

`generate` writes a set: each case is a rig (`rig`, `tank`) that hides one effect, two, one that no
catalogue holds, effects with such laws left beside them (`remainder`), or nothing (`deck`,
`effects`), drawn at random in kind, size, noise and base parameters, moved twice in different ways
(`excitations`).  The truth goes to a file of its own,
with what can be known at all from such recordings (`visibility`), and is sealed by its SHA-256
(`seal`).  Nothing here imports the models, simulators or diagnosis that it is to examine.
"""

from __future__ import annotations
