"""Structure of the equations before the solution: freedoms, redundant rows and components."""
