"""The packages: each folder of sources is one, so that a folder can come or go without a list.

An extension's own entry points are in its folder, in entry_points.txt.
"""

from configparser import ConfigParser
from pathlib import Path

from setuptools import setup

OWN = Path("core/kincheck")
folders = {file.parent for top in ("core", "adapters", "cases") for file in Path(top).rglob("*.py")}
points = ConfigParser()
points.read_dict({"console_scripts": {"kincheck": "kincheck.__main__:main"}})
points.read(sorted(Path("core").rglob("entry_points.txt")))
setup(
    packages=["kincheck", *sorted(".".join(("kincheck", *each.parts)) for each in folders - {OWN})],
    entry_points={
        group: [f"{name} = {value}" for name, value in points.items(group)]
        for group in points.sections()
    },
)
