"""Checks of joint types and of engines."""
