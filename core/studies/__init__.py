"""Studies: joint checks, tolerance studies, benchmarks, stress tests, diagnosis, and the paper's
own figures.
"""
