"""Reading: case files and reference tables to cases, every mistake to one clear message."""
