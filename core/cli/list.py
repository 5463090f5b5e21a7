"""kincheck list: list cases and engines, or the types known to case files."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

from ..extras import how_to_install, installed_version, is_extra
from .registry import House, Status, add_joint_types
from .verbosity import add_verbosity

if TYPE_CHECKING:
    from ..harness.engine import Engine

CUT = {"no_wrap": True, "overflow": "ellipsis", "crop": True}


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
    add_verbosity(
        listing,
        quiet="print the names alone: cases, then engines",
        verbose="print sources in full, on narrow terminals too",
    )
    add_joint_types(listing)


def _list(options: argparse.Namespace, house: House) -> int:
    """List the built-in cases with reference kind and source, and the engines with the installed
    versions, which kincheck doctor also imports; or the keys and types of files.
    """
    from ..report.terminal import page

    console = page(None)
    # a line for each case: cut at the edge of a terminal, whole in a pipe
    how: Any = {"soft_wrap": True} if options.verbose or not console.is_terminal else CUT
    tell = partial(console.print, **how)
    if options.schema or options.joints or options.outputs:
        from ..case.io.catalogue import catalogue, output_catalogue

        listed = [*(_references() if options.schema else ())]
        listed += [
            *(catalogue() if options.joints else ()),
            *(output_catalogue() if options.outputs else ()),
        ]
        console.print(*listed, sep="\n", soft_wrap=True)
        return Status.WITHIN
    cases = house.cases()
    if options.quiet:
        print(*cases, *dict.fromkeys((*house.engines, *house.simulations)), sep="\n")
        return Status.WITHIN
    tell("cases:")
    for name in cases:
        kind, source = house.summary(name)
        tell(f"  {name:{max(map(len, cases))}}  {kind.replace('_', ' '):16}  {source}")
    tell("engines:")
    engines: list[Engine] = [
        *map(house.engine, house.engines),
        *(house.engine(name, "simulate") for name in house.simulations),
    ]
    width = max(len(engine.name) for engine in engines)
    for engine in engines:
        version = _version(engine)
        state = (
            f"not installed: {how_to_install(engine.name)}"
            if version is None
            else f"{version}  {engine.mode}, loop: {engine.loop}"
        )
        tell(f"  {engine.name:{width}}  {state}")
    return Status.WITHIN


def _version(engine: Engine) -> str | None:
    """Return the installed version of an engine; a simulator with an extra is not imported."""
    from ..harness.engine_versions import versions

    return installed_version(engine.name) if is_extra(engine.name) else versions([engine])[0]


def _references() -> Iterator[str]:
    """Yield the descriptions of the keys of case and variation files, from their readers."""
    from ..case.io import loads, schema
    from ..case.variation import variation_schema

    for module in (schema, loads, variation_schema):
        what, _, keys = (module.__doc__ or "").partition("Reference. ")
        yield f"{what.splitlines()[0]}\n\n{keys}"
