"""From pictures of a liquid's surface to its angle, with a standard error for each picture."""
