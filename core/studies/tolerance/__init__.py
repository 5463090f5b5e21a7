"""Studies of a design: its hardpoints varied, its outputs reduced over all variants."""
