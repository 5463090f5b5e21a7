"""Writers: a mechanism in the format of a simulator, one format a file."""
