"""The answer: as data, in words, in figures."""
