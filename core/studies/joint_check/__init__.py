"""Checking a joint type: the battery behind `kincheck check-joint`."""
