"""Colours of curves, on pages and in notebooks."""

# Okabe and Ito (https://jfly.uni-koeln.de/color): told apart by colour-blind readers
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
