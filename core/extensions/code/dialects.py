"""Dialects: the programs as lines of C or of JavaScript, and one text of the steps for both.

The text is written in what both languages have in common; declarations and functions of mathematics
differ by a word.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from ...case.quantity import STILL
from ...kinematics.compiled.request import TIME
from ...mechanism.motions import Absolute, Motion, Ramp, Sine, Table
from ...program import Program
from ...unit_text import with_unit
from .solved import CodeOutput, SolvedCase

PIECE = 500
"""Operations of a function: compilers of JavaScript leave long functions slow, and those of C take
long for them.
"""
OPERATIONS = {
    "+": "({0} + {1})",
    "-": "({0} - {1})",
    "*": "({0} * {1})",
    "/": "({0} / {1})",
    "neg": "(-{0})",
    "sqrt": "sqrt({0})",
    "sin": "sin({0})",
    "cos": "cos({0})",
    "atan2": "atan2({0}, {1})",
    "abs": "fabs({0})",
    # what is no number stays none
    "min": "({0} < {1} || {0} != {0} ? {0} : {1})",
    "max": "({0} > {1} || {0} != {0} ? {0} : {1})",
    "larger": "(fabs({0}) > fabs({1}) ? 1.0 : 0.0)",
    "where": "({0} != 0.0 ? {1} : {2})",
}


@dataclass(frozen=True)
class Dialect:
    """A language.

    Attributes:
        words: words of the text, and those of the language in their place.
        table: declaration of a table, of its kind, name and numbers.
        scratch: declaration of room for numbers, of a name and their count.
    """

    words: dict[str, str]
    table: str
    scratch: str

    def text(self, text: str) -> str:
        """Return a text of the steps in this language."""
        text = re.sub(r"SCRATCH\((\w), (\d+)\);", self.scratch, text)
        return re.sub(r"\b[A-Za-z]\w*\b", lambda word: self.words.get(word[0], word[0]), text)


C = Dialect(
    {
        "REAL": "const double",
        "VALUE": "double",
        "COUNT": "int",
        "NUMBER": "double",
        "WHOLE": "int",
        "LANE": "double *",
        "FROM": "const double *",
        "ACTION": "static void",
        "ANSWER": "static int",
        "NOTHING": "NAN",
    },
    "static const {kind} {name}[] = {{{numbers}}};",
    r"double \1[\2];",
)
JAVASCRIPT = Dialect(
    {
        "REAL": "const",
        "VALUE": "let",
        "COUNT": "let",
        "NUMBER": "",
        "WHOLE": "",
        "LANE": "",
        "FROM": "",
        "ACTION": "function",
        "ANSWER": "function",
        "NOTHING": "NaN",
        "INFINITY": "Infinity",
        "fabs": "Math.abs",
        **{name: f"Math.{name}" for name in ("sqrt", "sin", "cos", "atan2", "floor")},
    },
    "const {name} = [{numbers}];",
    r"const \1 = new Float64Array(\2);",
)

STEPS = """
ACTION copy(LANE to, FROM lane) { for (COUNT k = 0; k < SIZE; k++) to[k] = lane[k]; }

ACTION carry(LANE s) { for (COUNT k = 0; k < CARRIED; k++) s[CARRY_TO[k]] = s[CARRY_FROM[k]]; }

ANSWER settle(LANE s) {
  for (COUNT k = 0; k < MOST; k++) {
    newton(s);
    if (!(s[RESIDUAL] < INFINITY)) return 0;
    if (s[RESIDUAL] < TOLERANCE) {
      newton(s); /* near a singular pose its last digits count */
      return s[RESIDUAL] < TOLERANCE ? 1 : 0;
    }
  }
  return 0;
}

/* one step of any length from lane w to time t, in lane n: 0, or why it is none */
ANSWER attempt(LANE n, FROM w, NUMBER t) {
  copy(n, w);
  sample(n, t);
  predict(n);
  n[IS_DONE] = settle(n);
  outputs(n);
  alone_gaps(n);
  alone(n);
  return n[MARGIN] > 0.0 ? 0 : n[IS_DONE] > 0.0 ? 2 : 1;
}

ACTION begin(LANE s) {
  sample(s, s[AT]);
  outputs(s);
  carry(s);
}

BETTER_ROWS
/* lane w to time t by as many steps as it takes, halved so many times where one fails; n is for
   attempts */
ANSWER travel(LANE w, LANE n, NUMBER goal, WHOLE most) {
  VALUE step = goal - w[AT];
  COUNT halvings = 0;
  for (COUNT k = 0; w[AT] != goal; k++) {
    TRY_BETTER_ROWSVALUE to = w[AT] + step;
    if (step > 0.0 ? to > goal : to < goal) to = goal;
    COUNT failed = attempt(n, w, to);
    if (failed == 0) {
      keep(n, w, to - w[AT]);
      carry(n);
      n[AT] = to;
      copy(w, n);
      step = 2.0 * step;
      halvings = 0;
    } else {
      step = 0.5 * step;
      halvings = halvings + 1;
      if (halvings > most || k > 20000 || !(fabs(step) > 0.0)) {
        return w[SIGMA] < 0.1 * w[LARGEST] ? 2 : failed;
      }
    }
  }
  return 0;
}
"""
BETTER_ROWS = """
/* lane w at its pose with another choice of the independent rows, in lane n: 1 if it stands there,
   and these are far from dependent */
ANSWER renew(LANE n, FROM w, NUMBER choice) {
  for (COUNT k = 0; k < SIZE; k++) n[k] = 0.0;
  for (COUNT k = 0; k < STAYING; k++) n[STANDING[k]] = w[STANDING[k]];
  n[CHOICE] = choice;
  sample(n, w[AT]);
  PREPARE
  for (COUNT k = 0; k < ASSEMBLING; k++) {
    newton(n);
    if (!(n[RESIDUAL] > CLOSED)) break;
  }
  begin(n);
  VALUE moved = 0.0;
  for (COUNT k = 0; k < POSE; k++) {
    VALUE far = fabs(n[STANDING[k]] - w[STANDING[k]]);
    if (far > moved) moved = far;
  }
  if (!(n[CLOSURE] <= CLOSED && n[LEFTOVER] <= CONSISTENT && n[BRANCH] > 0.0)) return 0;
  if (!(moved <= NEAR * n[SIGMA] && n[SIGMA] > BETTER * w[SIGMA])) return 0;
  if (n[LARGEST] < w[LARGEST]) n[LARGEST] = w[LARGEST];
  if (n[LARGEST_NOW] < w[LARGEST]) n[LARGEST_NOW] = w[LARGEST];
  return 1;
}

"""
TRY_BETTER_ROWS = """for (COUNT c = 0; c < CHOICES && w[SIGMA] < 0.1 * w[LARGEST]; c++) {
      if (c != w[CHOICE] && renew(n, w, c)) copy(w, n);
    }
    """
ASSEMBLE = """
/* lane s at the design position of its geometry: 1 if it closes there */
ANSWER assemble(LANE s) {
  prepare(s);
  stand(s);
  for (COUNT k = 0; k < ASSEMBLING; k++) {
    newton(s);
    if (!(s[RESIDUAL] > CLOSED)) break;
  }
  outputs(s);
  return s[CLOSURE] <= CLOSED && s[BRANCH] > 0.0 ? 1 : 0;
}
"""
PLACE = """
/* lane s at the design position of values of the parameters: 1 if it closes there */
ANSWER place(LANE s, FROM values) {
  copy(s, START);
  for (COUNT k = 0; k < PARAMETERS; k++) move_geometry(s, k, values[k] - NOMINAL[k]);
  COUNT closes = assemble(s);
  begin(s);
  return closes;
}
"""


STEER = """
/* lane w by a straight way of the drivers to other values; n is for attempts */
ANSWER steer(LANE w, LANE n, FROM values) {
  for (COUNT k = 0; k < DRIVERS; k++) {
    REAL now = w[DRIVER_SLOT[3 * k]] / DRIVER_UNIT[k];
    w[STEERED + 1 + 2 * k] = now;
    w[STEERED + 2 + 2 * k] = values[k] - DRIVER_DESIGN[k] - now;
  }
  w[STEERED] = 1.0;
  w[AT] = 0.0;
  begin(w);
  return travel(w, n, 1.0, HALVINGS);
}

ACTION tell_at(FROM s, LANE out, FROM rates) {
  SCRATCH(f, SIZE);
  copy(f, s);
  for (COUNT k = 0; k < DRIVERS; k++) {
    f[DRIVER_SLOT[3 * k + 1]] = DRIVER_UNIT[k] * rates[k];
    f[DRIVER_SLOT[3 * k + 2]] = 0.0;
  }
  outputs(f);
  tell(f, out, 1.0);
}
"""


def _by_choice(name: str, programs: Sequence[Program]) -> Iterator[str]:
    """Yield the functions of a program, by the choice of rows of the lane if there are several."""
    if len(programs) == 1:
        yield program_text(name, programs[0])
        return
    yield from (program_text(f"{name}_of_{k}", each) for k, each in enumerate(programs))
    calls = [f"if (s[CHOICE] == {k}.0) {name}_of_{k}(s);" for k in range(len(programs))]
    yield _function(f"ACTION {name}(LANE s)", calls)


def program_text(name: str, program: Program) -> str:
    """Return a program as a function of a lane, in pieces if it is long."""
    if program.times > 1:
        return _repeated(name, program)
    nodes, worked = (
        program.nodes,
        [k for k, (op, *_) in enumerate(program.nodes) if op in OPERATIONS],
    )
    pieces = [worked[k : k + PIECE] for k in range(0, len(worked), PIECE)]
    at = {k: number for number, piece in enumerate(pieces) for k in piece}
    last = len(pieces) - 1
    outputs = program.outputs.values()
    # what a later piece reads, or the last lines where there are several
    kept = [x for k in worked for x in map(int, nodes[k][1:]) if at.get(x, at[k]) != at[k]]
    kept += [k for k in outputs if at.get(k, last) != last]
    place = {k: number for number, k in enumerate(dict.fromkeys(kept))}
    functions, before = list[str](), list[str]()
    for number, piece in enumerate(pieces or [[]]):
        needed = [x for k in piece for x in map(int, nodes[k][1:])]
        needed += outputs if number == max(last, 0) else ()
        lines = [
            f"REAL v{k} = {f't[{place[k]}]' if k in at else _given(nodes[k])};"
            for k in dict.fromkeys(needed)
            if at.get(k) != number
        ]
        for k in piece:
            op, *read = nodes[k]
            lines.append(f"REAL v{k} = {OPERATIONS[op].format(*(f'v{int(x)}' for x in read))};")
            if k in place:
                lines.append(f"t[{place[k]}] = v{k};")
        if number < last:
            used = [each for each in "st" if any(f"{each}[" in line for line in lines)]
            given = ", ".join(f"LANE {each}" for each in used)
            functions.append(_function(f"ACTION {name}_{number}({given})", lines))
            before.append(f"{name}_{number}({', '.join(used)});")
            continue
        if before:
            before.insert(0, f"SCRATCH(t, {max(1, len(place))});")
        writes = [f"s[{slot}] = v{k};" for slot, k in program.outputs.items()]
        functions.append(_function(f"ACTION {name}(LANE s)", [*before, *lines, *writes]))
    return "\n\n".join(functions)


def _given(node: Sequence[object]) -> str:
    """Return the text of a number that is not computed."""
    op, value = node
    return f"s[{value}]" if op == "input" else _constant(float(str(value)))


def _repeated(name: str, program: Program) -> str:
    """Return the function of a program that runs over neighbouring slots, and keeps the largest."""
    lines: list[str] = []
    for k, (op, *read) in enumerate(program.nodes):
        if op == "input":
            value = f"s[{int(read[0])} + k]"
        elif op == "const":
            value = _constant(float(read[0]))
        else:
            value = OPERATIONS[op].format(*(f"v{int(x)}" for x in read))
        lines.append(f"REAL v{k} = {value};")
    largest = [f"VALUE m{slot} = 0.0;" for slot in program.outputs]
    lines += [
        f"if (v{k} > m{slot} || v{k} != v{k}) m{slot} = v{k};"
        for slot, k in program.outputs.items()
    ]
    return "\n".join(
        [
            f"ACTION {name}(LANE s) {{",
            *(f"  {each}" for each in largest),
            f"  for (COUNT k = 0; k < {program.times}; k++) {{",
            *(f"    {each}" for each in lines),
            "  }",
            *(f"  s[{slot}] = m{slot};" for slot in program.outputs),
            "}",
        ]
    )


def _constant(value: float) -> str:
    if math.isfinite(value):
        return repr(value)
    return "NOTHING" if math.isnan(value) else "INFINITY" if value > 0.0 else "(-INFINITY)"


def _drive(
    k: int, slots: Sequence[int], motion: Motion, factor: float, steered: int
) -> Iterator[str]:
    """Yield the lines that set the five numbers of the k-th driver at time t.

    Args:
        steered: the number of a lane that tells whether the way is straight; zero for none.
    """
    shift = 0.0
    if isinstance(motion, Absolute):
        motion, shift = motion.motion, motion.design
    if isinstance(motion, Sine):
        w = 2.0 * math.pi * motion.frequency
        angle = f"({w!r} * t + {motion.phase!r})"
        x = f"{motion.amplitude!r} * sin{angle} - {shift!r}"
        v = f"{motion.amplitude * w!r} * cos{angle}"
        a = f"{-motion.amplitude * w * w!r} * sin{angle}"
    elif isinstance(motion, Table):
        yield f"COUNT i{k} = 0;"
        yield f"while (i{k} < {len(motion.times) - 2} && t > KNOTS_{k}[i{k} + 1]) i{k}++;"
        yield f"REAL h{k} = t - KNOTS_{k}[i{k}];"
        c3, c2, c1, c0 = (f"PIECES_{k}[4 * i{k} + {j}]" for j in range(4))
        first, last = motion.span
        known = f"t >= {first!r} && t <= {last!r}"
        x = f"({known} ? (({c3} * h{k} + {c2}) * h{k} + {c1}) * h{k} + {c0} - {shift!r} : NOTHING)"
        v = f"(3.0 * {c3} * h{k} + 2.0 * {c2}) * h{k} + {c1}"
        a = f"6.0 * {c3} * h{k} + 2.0 * {c2}"
    else:
        assert isinstance(motion, Ramp)
        x, v, a = f"{motion.rate!r} * t - {shift!r}", repr(motion.rate), "0.0"
    if steered:
        begin, change = f"s[{steered + 1 + 2 * k}]", f"s[{steered + 2 + 2 * k}]"
        x = f"s[STEERED] > 0.0 ? {begin} + {change} * t : {x}"
        v = f"s[STEERED] > 0.0 ? {change} : {v}"
        a = f"s[STEERED] > 0.0 ? 0.0 : {a}"
    yield f"x = {x};"
    for slot, value in zip(slots[:3], ("x", v, a), strict=True):
        yield f"s[{slot}] = {factor!r} * ({value});"
    yield f"s[{slots[3]}] = cos(0.5 * x);"
    yield f"s[{slots[4]}] = sin(0.5 * x);"


def _kept(each: CodeOutput) -> Iterator[str]:
    """Yield the lines that count the turns of an output, or keep the sign of an attitude."""
    at = each.kept
    if each.period:
        ((x,), (v,), *_) = each.slots
        yield f"x = w[{at}] + 0.5 * (w[{v}] + n[{v}]) * h;"
        period = repr(each.period)
        yield f"n[{at}] = n[{x}] + {period} * floor((x - n[{x}]) / {period} + 0.5);"
    elif each.completion:
        own = [f"n[{slot}]" for slot in each.slots[0]]
        dot = " + ".join(f"{x} * w[{at + k}]" for k, x in enumerate(own))
        yield f"x = {dot} < 0.0 ? -1.0 : 1.0;"
        yield from (f"n[{at + k}] = x * {x};" for k, x in enumerate(own))


def _told(k: int, each: CodeOutput) -> Iterator[str]:
    """Yield the lines that write the three orders of an output at rate r."""
    factors = ("", "r * ", "r * r * ")
    if each.quantity.forces:
        parts = [f"{factor!r} * f[{slot}]" for slot, factor in each.pushed.items()]
        yield f"out[{3 * k}] = f[SIGMA_NOW] > FIRM ? {' + '.join(parts) or '0.0'} : NOTHING;"
        yield from (f"out[{3 * k + j}] = NOTHING;" for j in (1, 2))
        return
    if each.completion:
        # Euler parameters go on with their sign; a rotation vector is of half a turn at most
        first, turned = each.slots[0], each.quantity.unit != "1"
        sign = (
            f"s[{first[0]}]"
            if turned
            else " + ".join(f"s[{slot}] * s[{each.kept + j}]" for j, slot in enumerate(first))
        )
        yield f"x = {sign} < 0.0 ? -1.0 : 1.0;"
        yield from (
            f"c[{4 * order + j}] = x * s[{slot}];"
            for order, slots in enumerate(each.slots)
            for j, slot in enumerate(slots)
        )
        yield f"complete_{k}(c);"
        yield from (f"out[{3 * k + j}] = {factors[j]}c[{j}];" for j in range(3))
        return
    known = ["NOTHING"] * 3
    for order, (slot,) in enumerate(each.slots):
        known[order] = f"{factors[order]}s[{slot}]"
    if each.period:
        known[0] = f"s[{each.kept}]"
    if each.resting:
        own, fastest = each.resting
        yield f"x = s[{own}] > {STILL**2!r} * s[{fastest}] ? 1.0 : NOTHING;"
        known = [f"x * {value}" for value in known]
    yield from (f"out[{3 * k + j}] = {value};" for j, value in enumerate(known))


def _function(head: str, body: Iterable[str]) -> str:
    return "\n".join([f"{head} {{", *(f"  {line}" for line in body), "}"])


def steps_text(solved: SolvedCase) -> str:
    """Return the functions of a lane: programs, samples, steps and outputs."""
    time = solved.model.slots[TIME]
    steered = solved.steered if solved.is_steered else 0
    drives = [line for k, each in enumerate(solved.drives()) for line in _drive(k, *each, steered)]
    kept = [line for each in solved.outputs for line in _kept(each)]
    told = [line for k, each in enumerate(solved.outputs) for line in _told(k, each)]
    programs = [text for each in solved.programs.items() for text in _by_choice(*each)]
    parts = [
        *programs,
        _function("ACTION sample(LANE s, NUMBER t)", ["VALUE x;", f"s[{time}] = t;", *drives]),
    ]
    steps = STEPS.strip()
    if kept:
        parts.append(_function("ACTION keep(LANE n, FROM w, NUMBER h)", ["VALUE x;", *kept]))
    else:
        steps = steps.replace("      keep(n, w, to - w[AT]);\n", "")
    has_choices = bool(solved.others)
    prepare = "prepare(n);" if solved.parameters else ""
    renew = BETTER_ROWS.replace("PREPARE", prepare).lstrip()
    steps = steps.replace("TRY_BETTER_ROWS", TRY_BETTER_ROWS if has_choices else "")
    steps = steps.replace("BETTER_ROWS\n", renew if has_choices else "")
    if solved.parameters:
        values = (0.0, 0.0, 0.0, 1.0, 0.0)
        still = [
            f"s[{slot}] = {value!r};"
            for slots, *_ in solved.drives()
            for slot, value in zip(slots, values, strict=True)
        ]
        parts.append(_function("ACTION stand(LANE s)", [f"s[{time}] = 0.0;", *still]))
        parts.append(ASSEMBLE.strip())
        moved = [
            f"if (which == {k}) s[{slot}] = s[{slot}] + {change!r} * change;"
            for k, each in enumerate(solved.parameters)
            for slot, change in each.moves.items()
        ]
        parts.append(_function("ACTION move_geometry(LANE s, WHOLE which, NUMBER change)", moved))
    own = ["VALUE x;"] if any(line.startswith("x =") for line in told) else []
    own += ["SCRATCH(c, 12);"] if any(each.completion for each in solved.outputs) else []
    if any(each.quantity.forces for each in solved.outputs):
        # forces are no powers of the rate: a lane at this rate has them
        own += [f"SCRATCH(f, {solved.size});", "copy(f, s);"]
        for slots, *_ in solved.drives():
            own += [
                f"f[{slots[1]}] = r * f[{slots[1]}];",
                f"f[{slots[2]}] = r * r * f[{slots[2]}];",
            ]
        own.append("outputs(f);")
    parts += [steps, _function("ACTION tell(FROM s, LANE out, NUMBER r)", [*own, *told])]
    if solved.parameters:
        parts.append(PLACE.strip())
    if solved.is_steered:
        parts.append(STEER.strip().replace("SIZE", str(solved.size)))
    return "\n\n".join(parts)


def tables(solved: SolvedCase) -> dict[str, Sequence[float]]:
    """Return the tables of the code by name: whole numbers but for the start."""
    carried = solved.model.plan.carried
    motions = dict[str, Sequence[float]]()
    for k, (_, motion, _) in enumerate(solved.drives()):
        plain = motion.motion if isinstance(motion, Absolute) else motion
        if isinstance(plain, Table):
            motions |= {f"KNOTS_{k}": plain.times, f"PIECES_{k}": plain.pieces}
    standing = {"STANDING": solved.standing} if solved.others else {}
    if solved.is_steered:
        mechanism = solved.case.mechanism
        standing |= {
            "DRIVER_SLOT": [each for slots, *_ in solved.drives() for each in slots[:3]],
            "DRIVER_UNIT": [factor for *_, factor in solved.drives()],
            "DRIVER_DESIGN": [mechanism.design_value(name) for name in solved.drivers],
        }
    return {
        **standing,
        **motions,
        "CARRY_FROM": [source for source, _ in carried],
        "CARRY_TO": [target for _, target in carried],
        "START": solved.start,
    }


def words_of(solved: SolvedCase) -> dict[str, list[str]]:
    """Return the names of outputs, parameters and drivers, with their units."""
    outputs = [(each.quantity.name, each.quantity.unit) for each in solved.outputs]
    parameters = [(each.name, each.unit) for each in solved.parameters]
    drivers = [(name, solved.unit(name)) for name in solved.drivers]
    found = {"outputs": outputs, "parameters": parameters, "drivers": drivers}
    return {what: [with_unit(*each) for each in named] for what, named in found.items()}
