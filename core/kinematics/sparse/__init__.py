"""Large mechanisms that cannot be divided: one sparse system."""
