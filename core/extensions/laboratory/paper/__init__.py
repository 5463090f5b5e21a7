"""The paper's claims: operation counts, round-off and run time of its rows against the
textbook's.
"""
