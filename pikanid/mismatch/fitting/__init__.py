"""One hypothesis: the nominal model with effects added, refitted."""
