"""How far can a diagnosis be trusted for a rig of one's own?  Effects concealed in any model."""
