"""Parts shared by adapters: joint chains, loop closures, frame constraints, the projection walk."""
