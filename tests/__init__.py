"""Tests. A package of its own, because dartpy installs one of this name, which would hide it."""
