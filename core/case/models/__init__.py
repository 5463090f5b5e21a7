"""Models in other formats: MJCF, URDF, SDF, USD, OpenSim and hardpoint tables, read into cases."""
