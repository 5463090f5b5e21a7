"""Pairs of case and engine on the workers of a dask.distributed scheduler."""

from ...doors import Extension

EXTENSION = Extension(__name__, sources={"scheduler": "source:Scheduler"})
