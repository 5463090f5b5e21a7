"""Statics: equilibria of mechanisms with springs, bushings and loads, and their compliance."""
