"""The names of `import kincheck`, and when they are loaded."""

import ast
import inspect
import json
import re
import subprocess
import sys

import kincheck
import kincheck.adapters
import kincheck.core
import pytest
from kincheck.adapters.native import Native
from kincheck.core.cli.main import main, parser
from kincheck.core.doors import offers

from .support.case_texts import at_hand, rows
from .support.sources import ROOT, tree

ONLY_NAMES = """
import sys
import kincheck
assert kincheck.__version__ and "Mechanism" in kincheck.core.__all__
print(*sorted({name.split(".")[0] for name in sys.modules} & {"numpy", "scipy", "msgspec", "rich"}))
print(*sorted(name for name in sys.modules if name.startswith("kincheck")))
kincheck.Revolute
print("numpy" in sys.modules, "kincheck.core.harness" in sys.modules)
"""


def test_import_loads_names_only():
    """In a fresh interpreter: numpy alone would take three times as long as all the rest."""
    found = subprocess.run(
        [sys.executable, "-c", ONLY_NAMES], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    assert found == ["", "kincheck kincheck.core kincheck.core.version", "True False"]


BY_NAME = ("load", "primitives", "report", "run")


@pytest.mark.parametrize("name", kincheck.__all__)
def test_public_name_is_found(name):
    assert getattr(kincheck, name) is not None


def test_core_names_exclude_functions_by_name():
    assert set(kincheck.__all__) - set(kincheck.core.__all__) == {*BY_NAME, *offers("public")}
    assert kincheck.Mechanism is kincheck.core.Mechanism


def test_core_names_match_type_checking_imports():
    """The imports under TYPE_CHECKING: name -> module, as the table that loads them."""
    block = next(node for node in tree("core/__init__.py").body if isinstance(node, ast.If))
    told = {alias.name: node.module for node in block.body for alias in node.names}
    assert told == kincheck.core._MODULES
    assert {*told, "__version__"} == set(kincheck.core.__all__)


def test_unknown_public_name_is_refused():
    with pytest.raises(AttributeError, match="no attribute 'solv'"):
        _ = kincheck.solv


def test_run_of_built_in_case():
    results = kincheck.run("rssr", engines=["native"])
    assert [(each.case, each.outcome) for each in results.records] == [("rssr", "pass")]
    assert "rssr" in results.scenes


def test_run_takes_files_and_engine_objects():
    class Own(Native):
        def unsupported(self, case):
            return "only native's" if case.name == "rssr" else None

    file = ROOT / "cases" / "hooke_joint.toml"
    results = kincheck.run([kincheck.load("rssr"), file], [Own(name="own")])
    assert [(each.case, each.engine, each.outcome) for each in results.records] == [
        ("rssr", "own", "unsupported"),
        ("hooke_joint", "own", "pass"),
    ]


@pytest.mark.parametrize("path", ["core/__init__.py", "core/kincheck/__init__.py"])
def test_packages_define_no_static_getattr(path):
    """It would hide every misspelt name from type checkers."""
    assert "__getattr__" not in {getattr(node, "name", "") for node in tree(path).body}


def test_import_addresses_before_02_work():
    """The README named them before version 0.2."""
    from kincheck.core.harness import check_joint
    from kincheck.core.harness.reporting.table import print_table
    from kincheck.core.report import table

    assert check_joint is kincheck.core.check_joint
    assert print_table is table.print_table


COMMANDS_IN_PYTHON = {
    command: getattr(kincheck, name)
    for command, name in (
        *((each, each) for each in ("run", "explain", "sweep", "free", "compare")),
        ("serve", "live"),
    )
    if name in kincheck.__all__
}


@pytest.mark.parametrize("name", COMMANDS_IN_PYTHON)
def test_function_documents_options_of_command(name):
    """All but those that print, write or store, which have no use in Python."""
    function, command = COMMANDS_IN_PYTHON[name], parser([name]).commands()[name]
    options = {each.help for each in command.arguments()}
    arguments = inspect.signature(function).parameters
    text = " ".join(inspect.getdoc(function).split())
    untold = {each for each in arguments if f"{each}: " not in text}
    assert untold <= {"supplied", "curve", "rates"}
    shared = [each for each in options if " ".join(f"{each}.".split()[:6]) in text]
    assert len(shared) >= len(arguments) - 3


REFUSED = """
solve(None, "crank", [0.1]) | solve: mechanism is None, expected a Mechanism
solve("four_bar", "crank", [0.1]) | solve: mechanism is 'four_bar', expected a Mechanism
solve(kincheck.Mechanism, "crank", [0.1]) | solve: mechanism is <class 'kincheck.
solve_designs(None, "crank", [0.1], {}) | solve_designs: mechanism is None, expected a Mechanism
trace(None, "crank") | trace: mechanism is None, expected a Mechanism
assemble(None, {}) | assemble: mechanism is None, expected a Mechanism
find_assemblies(None, {}) | find_assemblies: mechanism is None, expected a Mechanism
check_joint(3) | joint_class is 3, expected a class
check_engine(3) | 3 is no engine: name, mode, loop
run("rssr", [None]) | None is no engine: name, mode, loop
run("rsrs") | there is no case 'rsrs'; did you mean 'rssr'
run("rssr", "mujocco") | there is no engine 'mujocco'; did you mean 'mujoco'
run("no/such.toml", "native") | no/such.toml
run(3, "native") | 3 is no case. Give a name, a path, or
run("rssr", static="no") | static: found 'no', expected True or False
run("rssr", mode="simulated") | there is no mode 'simulated'; did you mean 'simulate'
run("rssr", curve=kincheck.core.case.io.reader_options.CurveOptions(signs="iso8855"))
    | --signs: for a measured curve, and
run("rssr", engine="native") | run: got an unexpected keyword argument
load(["rssr"]) | ['rssr'] is no case
load("rssr", "mm") | supplied: found 'mm', expected kincheck.Supplied(...)
explain() | explain: missing a required argument: 'case'; its arguments:
explain("rssr", "mm") | supplied: found 'mm', expected kincheck.Supplied
explain("rssr", samples=0) | samples: '0' is not a whole number of 1 or more
explain("rssr", tol=-1.0) | tol: '-1.0' is not a positive number
sweep("rssr", "x", sampling="ltin") | did you mean 'latin'?
compare([]) | compare: found none, expected two or more
compare([1, 2]) | 1 is no case
report("x", "y") | report: found 'x', expected what kincheck.run returns
free("bricard", rates=[1]) | rates: found [1], expected {DRIVER or JOINT
free("bricard", rates={"hinge": float("nan")}) | hinge: found nan, expected
free("rssr", duration="long") | duration: 'long' is not a positive number
"""


@pytest.mark.parametrize(("call", "said"), at_hand(rows(REFUSED, named=False), kincheck.__all__))
def test_function_refuses_invalid_arguments(call, said):
    with pytest.raises((kincheck.KincheckError, TypeError), match=re.escape(said)):
        eval(f"kincheck.{call}")


def test_run_option_reactions_equals_command(tmp_path, capsys):
    file = tmp_path / "r.json"
    assert main(["run", "rssr", "--engine", "native", "--reactions", "--json", str(file)]) == 0
    (record,) = kincheck.run("rssr", "native", reactions=True).records
    assert [*record.outputs] == [*json.loads(file.read_text())["records"][0]["outputs"]]
    assert len(record.outputs) > 3
