"""The steps of a diagnosis, one a file, in the order in which `diagnose` takes them."""
