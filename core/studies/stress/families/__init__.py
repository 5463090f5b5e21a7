"""Families of difficult situations. The study loads every module in this folder, so a new class in
a new file is a new family.
"""

import importlib
import pkgutil

from .base import Family, Specimen

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f".{_module.name}", __name__)

__all__ = ["Family", "Specimen"]
