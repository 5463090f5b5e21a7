"""Scripts for a simulator's own numbers without kincheck, named after its engine."""
