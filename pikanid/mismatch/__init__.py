"""What is missing in a model?  Detected, located, named, modelled, proved."""
