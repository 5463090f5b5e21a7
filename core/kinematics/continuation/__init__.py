"""The walk along a motion: step halving, singular poses, passage over them, and curves by arc
length.
"""
