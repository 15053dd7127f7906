"""What a diagnosis takes as given: error rates, what counts as evidence, budgets."""
