"""Options: data classes whose fields say once what an option means.

The class gives the options of the command line, the arguments of the function in Python, the help
and the completion.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Any, Literal, TypeVar, cast, dataclass_transform

from .errors import KincheckError, unknown

T = TypeVar("T")


@dataclass(frozen=True)
class Option:
    """Meaning of an option.

    Attributes:
        help: what it means.
        read: reader of the text of its value; raises KincheckError.
        metavar: name of its value in the help.
        flags: on the command line; none of them for an argument without one.
        nargs: number of values, as of argparse.
        action: of argparse, for what is no single value.
        heading: heading in the help.
        required: on the command line.
        exclusive: whether it excludes others that are.
        environment: variable whose value is the default.
    """

    help: str
    read: Callable[[str], Any] = str
    metavar: str | None = None
    flags: tuple[str, ...] = ()
    nargs: str | None = None
    action: str | None = None
    choices: Sequence[Any] | None = None
    heading: str = ""
    required: bool = False
    exclusive: bool = False
    environment: str = ""


def option(
    help: str,
    read: Callable[[str], Any] = str,
    metavar: str | None = None,
    *,
    default: Any = None,
    flag: str = "",
    several: Literal["", "once", "together", "repeated"] = "",
    choices: Sequence[Any] | None = None,
    heading: str = "",
    required: bool = False,
    kw_only: Any = MISSING,
    init: bool = True,
) -> Any:
    """Declare an option with a value.

    Args:
        flag: on the command line; by default from the name of the field.
        several: the value is a tuple: "once": --x A B; "together": --x A B, also repeated;
            "repeated": --x A --x B.
        init: whether Python has it too.
    """
    meaning = Option(
        help,
        read,
        metavar,
        (flag,),
        nargs="+" if several in ("once", "together") else None,
        action={"together": "extend", "repeated": "append"}.get(several),
        choices=choices,
        heading=heading,
        required=required,
    )
    value = () if several and default is None else default
    # a type checker takes an option as needed unless its default stands in the class
    how: dict[str, Any] = {} if required else {"default": value}
    return field(**how, kw_only=kw_only, init=init, metadata={"option": meaning})


def switch(
    help: str, *, default: bool = False, flag: str = "", heading: str = "", init: bool = True
) -> Any:
    """Declare an option that is given or not."""
    meaning = Option(help, flags=(flag,), action="store_true", heading=heading)
    return field(default=default, init=init, metadata={"option": meaning})


def argument(
    help: str,
    metavar: str,
    nargs: str | None = None,
    *,
    read: Callable[[str], Any] = str,
    default: Any = None,
    choices: Sequence[Any] | None = None,
    kw_only: bool = False,
) -> Any:
    """Declare an argument without a flag; nargs: "*", "+" or "?", as of argparse."""
    meaning = Option(help, read, metavar, nargs=nargs, choices=choices)
    what: dict[str, Any] = {"kw_only": kw_only, "metadata": {"option": meaning}}
    if nargs in ("*", "?"):
        what["default"] = () if nargs == "*" and default is None else default
    return field(**what)


def destination(
    help: str,
    read: Callable[[str], Any] = str,
    metavar: str = "FILE",
    *,
    default: Any = None,
    flag: str = "",
    required: bool = False,
    environment: str = "",
    init: Literal[False] = False,
) -> Any:
    """Declare a destination of results, or another option that Python has no need of."""
    meaning = Option(help, read, metavar, (flag,), required=required, environment=environment)
    return field(default=default, init=init, metadata={"option": meaning})


def json_file(what: str = "the results", *, init: Literal[False] = False) -> Any:
    """Declare the option --json."""
    return destination(f"write {what} as JSON; - for standard output", init=init)


def joint_types(*, init: Literal[False] = False) -> Any:
    """Declare the option for the user's joint types, which the command line loads."""
    return option(
        "your own joint type for case files, in a module of this folder or an installed one;"
        " may be repeated; check-joint checks it",
        metavar="MODULE:CLASS",
        several="repeated",
        init=init,
    )


def verbosity(help: str, flag: str = "-q", *, init: Literal[False] = False) -> Any:
    """Declare -q or -v, to print less or more."""
    meaning = Option(help, flags=(flag, ""), action="store_true", exclusive=True)
    return field(default=False, init=init, metadata={"option": meaning})


def group(*, default_factory: Callable[[], T], kw_only: bool = True, init: bool = True) -> T:
    """Declare all options of another data class, which is the value."""
    metadata = {"group": default_factory}
    found: Any = field(
        default_factory=default_factory, kw_only=kw_only, init=init, metadata=metadata
    )
    return found


@dataclass_transform(
    frozen_default=True,
    kw_only_default=True,
    field_specifiers=(
        field,
        option,
        switch,
        argument,
        destination,
        json_file,
        joint_types,
        verbosity,
        group,
    ),
)
def options(cls: type[T]) -> type[T]:
    """Make a class with declared options a frozen data class."""
    return dataclass(frozen=True, kw_only=True)(cls)


def with_values(found: T, **values: Any) -> T:
    """Return options with other values, also of those that only the command line has."""
    other = copy(found)
    for name, value in values.items():
        object.__setattr__(other, name, value)
    return other


def option_fields(cls: Any) -> Iterator[tuple[Field[Any], Option | None, Any]]:
    """Yield the fields of a class, each with its option, or with the class of its group."""
    for each in fields(cls):
        meaning, below = each.metadata.get("option"), each.metadata.get("group")
        if meaning is not None or below is not None:
            yield each, meaning, below


def flags_of(each: Field[Any], meaning: Option) -> list[str]:
    """Return the flags of an option on the command line."""
    return [flag or f"--{each.name.replace('_', '-')}" for flag in meaning.flags]


def names_of_given(options: object, names: Iterable[str]) -> str:
    """Return the names of the given options, for a message.

    Options with the default None, False or [] count.
    """
    found = (
        name
        for name in names
        if getattr(options, name) not in ([], (), None) and getattr(options, name) is not False
    )
    return ", ".join(f"--{name.replace('_', '-')}" for name in found)


def asked(added: Iterable[type[T]], options: object) -> list[type[T]]:
    """Return the classes of which the options have one that is given."""
    return [
        each
        for each in added
        if isinstance(options, each)
        and names_of_given(options, (one.name for one, *_ in option_fields(each)))
    ]


def read_values(found: T) -> T:
    """Return options from Python as their readers read them.

    Raises:
        KincheckError: a value cannot be read.
    """
    values: dict[str, Any] = {}
    for each, meaning, below in option_fields(type(found)):
        value: Any = getattr(found, each.name)
        default: Any = cast("Any", each).default
        if not each.init:
            continue
        if meaning is None:
            values[each.name] = below() if value is None else value
            if not isinstance(values[each.name], type(below())):
                raise KincheckError(
                    f"{each.name}: found {value!r}, expected kincheck.{type(below()).__name__}(...)"
                )
            continue
        if meaning.action == "store_true":
            if value is not None and value not in (True, False):
                raise KincheckError(f"{each.name}: found {value!r}, expected True or False")
            continue

        def read(one: Any, meaning: Option = meaning) -> Any:
            return one if meaning.read is str else meaning.read(str(one))

        many = isinstance(default, tuple) or meaning.nargs == "+"
        known = [*map(str, meaning.choices or ())]
        if known and not many and value is not None and str(value) not in known:
            raise KincheckError(unknown(each.name, str(value), known))
        try:
            if many:
                values[each.name] = tuple(map(read, several(value)))
            elif value is not None:
                values[each.name] = read(value)
            elif default is not MISSING:
                values[each.name] = default
        except (KincheckError, ValueError) as error:
            raise KincheckError(f"{each.name}: {error}") from None
    return with_values(found, **values)


def several(given: T | Iterable[T] | None) -> tuple[T, ...]:
    """Return the values of an option that takes several, one, or none."""
    if given is None:
        return ()
    one = isinstance(given, str | Mapping) or not isinstance(given, Iterable)
    return tuple(cast("Iterable[T]", (given,) if one else given))


def function_of(name: str, command: Any, call: Callable[[Any], Any]) -> Callable[..., Any]:
    """Return the function of a class with a method `answer`: its arguments are the options.

    Args:
        call: returns the answer to options.
    """
    import inspect  # slow
    from textwrap import fill

    first = next(meaning for each, meaning, _ in option_fields(command) if each.init)

    def found(*args: Any, **kwargs: Any) -> Any:
        if len(args) > 1 and first is not None and first.nargs == "+":
            args = (args,)  # the only argument without a name
        try:
            signature.bind(*args, **kwargs)
        except TypeError as error:
            known = ", ".join(signature.parameters)
            raise TypeError(f"{name}: {error}; its arguments: {known}") from None
        return call(read_values(command(*args, **kwargs)))

    signature, answer = inspect.signature(command), inspect.signature(command.answer)
    helps = {each.name: each for each, meaning, _ in option_fields(command) if meaning is not None}
    lines = [
        fill(
            f"{each}: {option.metadata['option'].help % {'default': option.default}}.",
            width=100,
            initial_indent="    ",
            subsequent_indent="        ",
            break_on_hyphens=False,
        )
        for each in signature.parameters
        if (option := helps.get(each))
    ]
    found.__name__ = found.__qualname__ = name
    found.__doc__ = "\n".join([inspect.getdoc(command.answer) or "", "", "Args:", *lines])
    found.__dict__["__signature__"] = signature.replace(return_annotation=answer.return_annotation)
    return found


ONE_CASE = "name of a built-in case, or path to a case file or to another tool's file"
CASES = "built-in names, patterns such as 'mcpherson*', or case files; default: all built-in cases"


def whole(least: int, most: int | None = None) -> Callable[[str], int]:
    """Return a reader of whole numbers between two limits: 1000000, 1_000_000 or 1e6."""
    expected = f"of {least} or more" if most is None else f"from {least} to {most}"

    def read(text: str) -> int:
        found = _whole(text)
        if found is None or found < least or (most is not None and found > most):
            raise KincheckError(f"{text!r} is not a whole number {expected}. Give one.")
        return found

    return read


def _whole(text: str) -> int | None:
    """Return the whole number in a text; None if it holds none."""
    try:
        return int(text)
    except ValueError:
        pass
    try:
        found = float(text)
    except ValueError:
        return None
    return int(found) if found.is_integer() else None


def positive(text: str) -> float:
    """Return the positive number in the text of an option."""
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not 0.0 < found < math.inf:
        raise KincheckError(f"{text!r} is not a positive number. Give one such as 1, 0.5 or 1e-12.")
    return found


def number_with_unit(text: str) -> str:
    """Return the text of an option that is a number, with or without a unit."""
    if not re.fullmatch(r"\s*[-+]?[\d.]*\d\.?(?:[eE][-+]?\d+)?\s*[A-Za-z]*\s*", text):
        raise KincheckError(f"{text!r} is not a number. Give one such as 0.02, 20mm or -3deg.")
    return text
