"""What a hypothesis predicts of held-out recordings, and the verdict."""
