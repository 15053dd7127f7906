"""Before any data: what an experiment can reveal, and which one comes next."""
