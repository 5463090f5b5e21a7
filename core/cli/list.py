"""kincheck list: list cases and engines, or the types known to case files."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from functools import partial
from typing import Any

from ..extras import how_to_install
from .registry import House, Status, add_joint_types


def add(commands: Any) -> None:
    """Add the command to the parser."""
    listing: argparse.ArgumentParser = commands.add_parser(
        "list", help="list cases and engines", description=_list.__doc__
    )
    listing.set_defaults(do=_list)
    listing.add_argument(
        "--schema",
        action="store_true",
        help="list the keys of a case file, and of a file of variations",
    )
    listing.add_argument(
        "--joints",
        action="store_true",
        help="list the types a case file can name: joints, drivers, motions",
    )
    listing.add_argument(
        "--outputs",
        action="store_true",
        help="list the types of outputs a case file can name, with their signs",
    )
    add_joint_types(listing)


def _list(options: argparse.Namespace, house: House) -> int:
    """List the built-in cases with reference kind and source, and the engines with their versions;
    or the keys and types of files.
    """
    from ..case.io.catalogue import catalogue, output_catalogue
    from ..harness.engine_versions import versions
    from ..harness.provenance import truth_of
    from ..report.terminal import page

    tell = partial(page(None).print, soft_wrap=True)
    if options.schema or options.joints or options.outputs:
        listed = [*(_references() if options.schema else ())]
        listed += [
            *(catalogue() if options.joints else ()),
            *(output_catalogue() if options.outputs else ()),
        ]
        tell(*listed, sep="\n")
        return Status.WITHIN
    tell("cases:")
    names = house.cases()
    for name in names:
        case = house.case(name)
        tell(
            f"  {name:{max(map(len, names))}}  {str(truth_of(case)).replace('_', ' '):16} "
            f" {case.source}"
        )
    tell("engines:")
    engines = [
        *map(house.engine, house.engines),
        *(house.engine(name, "simulate") for name in house.simulations),
    ]
    width = max(len(engine.name) for engine in engines)
    for engine, version in zip(engines, versions(engines), strict=True):
        name = engine.name
        missing = (
            f"not installed, or cannot be imported: {how_to_install(name)}; kincheck doctor says"
            " which"
        )
        state = missing if version is None else f"{version}  {engine.mode}, loop: {engine.loop}"
        tell(f"  {name:{width}}  {state}")
    return Status.WITHIN


def _references() -> Iterator[str]:
    """Yield the descriptions of the keys of case and variation files, from their readers."""
    from ..case.io import loads, schema
    from ..case.variation import variation_schema

    for module in (schema, loads, variation_schema):
        what, _, keys = (module.__doc__ or "").partition("Reference. ")
        yield f"{what.splitlines()[0]}\n\n{keys}"
