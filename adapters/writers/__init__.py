"""Writers of mechanisms in the formats of simulators, one module per format."""
