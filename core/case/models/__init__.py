"""Models in other formats: MJCF files and hardpoint tables, read into cases."""
