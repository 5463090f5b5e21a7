"""Programs and the loops that run them as machine code: text for LLVM, what it makes of that, and
how it is kept and called.
"""
