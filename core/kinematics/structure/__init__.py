"""What can be said of the equations before they are solved: freedoms, redundant rows, components
that go one after the other.
"""
