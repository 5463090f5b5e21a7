"""A mechanism's constraints as equations over any scalar, in Cartesian or joint coordinates."""
