"""Models of links in other programs' files: MJCF, URDF and SDF, read into one tree of links."""
