"""Built-in cases for mpmath."""

# Round-off of the closed forms, some dozen operations in double precision, is 1e-15 of the numbers
# they pass through.
ROUND_OFF = 1e-13
