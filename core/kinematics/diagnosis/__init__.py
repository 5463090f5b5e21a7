"""What people are told of a mechanism: which rows say the same, how well the motion is determined,
what moves, in words.
"""
