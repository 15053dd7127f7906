"""What is minimised: Eq. (2), shooting, and whether what is left is noise."""
