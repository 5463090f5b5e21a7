"""The packages: each folder of sources is one, so that a folder can come or go without a list."""

from pathlib import Path

from setuptools import setup

OWN = Path("core/kincheck")
folders = {file.parent for top in ("core", "adapters", "cases") for file in Path(top).rglob("*.py")}
setup(
    packages=["kincheck", *sorted(".".join(("kincheck", *each.parts)) for each in folders - {OWN})]
)
