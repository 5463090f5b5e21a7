"""The checks of a joint type behind `kincheck check-joint`."""
