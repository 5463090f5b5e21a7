"""Cases: a mechanism, its motion, the outputs to compare and their reference."""
