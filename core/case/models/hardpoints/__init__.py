"""Cases from hardpoints: files of named points, as suspension engineers use them, and templates of
suspensions.
"""
