"""Large mechanisms whose components can be solved one after the other."""
