"""Coverage-guided fuzzing of one reader: python -m tests.fuzz casefile --seconds 3600

Inputs that were found are in build/fuzz/NAME, from where the next run goes on; crashes are in
build/fuzz/NAME.crashes:

    python -m tests.fuzz casefile build/fuzz/casefile.crashes/*         run them again
    python -m tests.fuzz casefile --keep build/fuzz/casefile.crashes/*  keep them as tests, once the defect is understood
    python -m tests.fuzz casefile --keep                                keep a minimal set of all inputs as tests
"""  # noqa: E501

import argparse
import importlib
import os
import random
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from kincheck import core

from .keeping import READERS, fuzzer, keep, kept

# Before numpy is there: small matrices gain nothing by threads, which on a busy machine wait for
# each other as in a hang.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
HERE = Path(__file__).parent
BUILD = HERE.parent.parent / "build" / "fuzz"
# Bounds of one input: far above what any of these small ones needs, also on a busy machine.
SECONDS, MEGABYTES = 20, 2048
# Where half of the changes keep the document's form, the other half are free to break it.
FREE = 0.5


def main(argv: Sequence[str]) -> int:
    """Run the fuzzer, or keep what it has found."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("reader", choices=READERS)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--keep", action="store_true", help="beside the fuzzer")
    parser.add_argument("input", nargs="*", type=Path, help="these only, without the fuzzer")
    options = parser.parse_intermixed_args(argv)
    if options.input:
        inputs = [file.read_bytes() for file in options.input]
        if options.keep:
            keep(f"{options.reader}.defects", [*kept(f"{options.reader}.defects"), *inputs])
        for each in inputs:
            fuzzer(options.reader).one(each)
        return 0
    corpus = BUILD / options.reader
    crashes = BUILD / f"{options.reader}.crashes"
    for folder in (corpus, crashes):
        folder.mkdir(parents=True, exist_ok=True)
    bounds = [f"-timeout={SECONDS}", f"-rss_limit_mb={MEGABYTES}", f"-artifact_prefix={crashes}/"]
    if not options.keep:
        return fuzz(
            options.reader,
            [f"-max_total_time={options.seconds}", *bounds, "-print_final_stats=1", str(corpus)],
        )
    keep(options.reader, minimal(options.reader, corpus))
    return 0


def minimal(name: str, corpus: Path) -> list[bytes]:
    """Inputs that together take every step from line to line that all take, the short ones first.
    (libFuzzer's own merge starts its program anew, which Python is not.)"""
    reader = fuzzer(name)
    here = str(Path(str(core.__file__)).parent)  # as it is imported: not always this folder
    inputs = [*reader.seeds(), *(file.read_bytes() for file in corpus.iterdir())]
    steps: set[tuple[Any, int, int]] = set()
    last: dict[int, int] = {}

    def trace(frame: Any, event: str, _: object) -> Any:
        if not frame.f_code.co_filename.startswith(here):
            return None
        if event == "line":
            steps.add((frame.f_code, last.get(id(frame), 0), frame.f_lineno))
        last[id(frame)] = frame.f_lineno if event == "line" else 0
        return trace

    for each in reader.seeds():  # what is imported, or found once and kept, is no step of an input
        reader.one(each)
    found: set[tuple[Any, int, int]] = set()
    kept_inputs: list[bytes] = []
    for each in sorted(inputs, key=len):
        steps.clear()
        sys.settrace(trace)
        try:
            reader.one(each)
        finally:
            sys.settrace(None)
        if not steps <= found:
            found |= steps
            kept_inputs.append(each)
    assert found, f"none of {len(inputs)} inputs takes a line below {here}"
    return kept_inputs


def fuzz(name: str, arguments: Sequence[str]) -> int:
    """Hand over to libFuzzer, which ends the process."""
    atheris: Any = importlib.import_module("atheris")
    with atheris.instrument_imports(include=["kincheck"]):
        reader = fuzzer(name)
        for seed in reader.seeds():  # what is imported on use is imported now, and watched
            reader.one(seed)
    corpus = BUILD / name
    for k, seed in enumerate([*reader.seeds(), *kept(name)]):
        (corpus / f"seed{k}").write_bytes(seed)
    words = BUILD / f"{name}.words"
    words.write_text("".join(f'"{_quoted(word)}"\n' for word in reader.WORDS))

    def change(data: bytes, longest: int, seed: int) -> bytes:
        rng = random.Random(seed)
        changed = atheris.Mutate(data, longest) if rng.random() < FREE else reader.mutate(data, rng)
        return changed if len(changed) <= longest else atheris.Mutate(data, longest)

    options = [f"-dict={words}", f"-max_len={reader.LONGEST}", *arguments]
    atheris.Setup([sys.argv[0], *options], reader.one, custom_mutator=change)
    atheris.Fuzz()
    return 0


def _quoted(word: str) -> str:
    return "".join(chr(byte) if chr(byte).isalnum() else f"\\x{byte:02x}" for byte in word.encode())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
