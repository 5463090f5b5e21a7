"""Kinematics and compliance of a suspension: its equilibria over travel and over loads."""
