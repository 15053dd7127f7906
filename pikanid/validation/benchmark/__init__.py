"""The benchmark: scenarios × strategies × protocols × seeds, every finished trial kept at once.

A `scenario` says how data are made and what is fitted (`scenarios.toml` holds the ready-made ones,
`files` reads it and the user's own); `trial` makes one fit; `runner` spreads trials over processes
(`spread`) and keeps them in a `store`; `summary` says what a cell of the tables holds.
"""
