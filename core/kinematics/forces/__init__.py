"""Forces of a solved motion: inverse dynamics, reactions of joints and efforts of drivers."""
