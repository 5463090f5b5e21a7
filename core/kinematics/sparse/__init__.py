"""Large indivisible mechanisms as one sparse system."""
