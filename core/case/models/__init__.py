"""Models in other formats: MJCF, URDF, SDF and hardpoint tables, read into cases."""
