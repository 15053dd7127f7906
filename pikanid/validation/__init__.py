"""What checks the kit from outside: the study, concealed effects, the equivalence of Eq. (5)."""
