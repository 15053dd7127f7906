"""What checks the kit from outside: concealed effects, and the equivalence of Eq. (5)."""
