"""A solved case as C99: NAME.c and NAME.h, with libm alone and without allocation."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence

from ...case.case import TIME, Case
from .dialects import C, steps_text, tables, words_of
from .solved import SolvedCase, solved_case

WHOLE = ("CARRY", "STANDING", "DRIVER_SLOT")
"""Beginnings of the tables of whole numbers."""
HEADER = """\
/* {case}: {source}
 * Written by kincheck. Each output has three numbers, in the order of the outputs: its value,
 * velocity and acceleration in SI units; NAN is a number that nobody knows. */
#ifndef {guard}
#define {guard}
#include <stddef.h>
#ifdef __cplusplus
extern "C" {{
#endif

int {n}_outputs(void);                 /* number of outputs */
const char *{n}_output(int which);     /* name and unit of an output */
size_t {n}_size(void);                 /* bytes of a state, which holds numbers of type double */
void {n}_start(void *state);           /* the design position */

/* Move to a value of the driver, {driver} [{unit}], which has a rate there, and write
 * 3 * {n}_outputs() numbers. Returns 0; or 1: the iteration does not converge; 2: a lock-up or
 * another branch is in between. The state and the outputs then stay as they are. The way there is
 * followed in steps that are as small as it takes.{others} */
int {n}_move(void *state, double driver, double rate, double *outputs);
{steer}
int {n}_parameters(void);              /* number of parameters */
const char *{n}_parameter(int which);  /* name and unit of a parameter */
double {n}_nominal(int which);         /* its value at the start */

/* Give a parameter another value; the state returns to the design position. Where the mechanism
 * does not close there, {n}_move returns 1 until another value is set. */
void {n}_set(void *state, int which, double value);

#ifdef __cplusplus
}}
#endif
#endif
"""

STEER_HEADER = """
int {n}_drivers(void);                 /* number of drivers */
const char *{n}_driver(int which);     /* name and unit of a driver */

/* Move all drivers to values of their own, by a straight way from their present ones, and write
 * the outputs at these rates of the drivers. Returns what {n}_move does, which begins at the
 * design position again. */
int {n}_move_all(void *state, const double *drivers, const double *rates, double *outputs);
"""

STEER_TAIL = """
int {n}_drivers(void) {{ return DRIVERS; }}

const char *{n}_driver(int which) {{
  static const char *const names[] = {{{drivers}}};
  return which >= 0 && which < DRIVERS ? names[which] : "";
}}

int {n}_move_all(void *state, const double *drivers, const double *rates, double *outputs) {{
  double *s = state, w[SIZE], n[SIZE];
  int k, failed;
  for (k = 0; k < DRIVERS; k++) if (!isfinite(drivers[k]) || !isfinite(rates[k])) return 1;
  if (!(s[SIZE + PARAMETERS] > 0.0)) return 1;
  copy(w, s);
  failed = steer(w, n, drivers);
  if (failed) return failed;
  copy(s, w);
  tell_at(s, outputs, rates);
  return 0;
}}
"""

TAIL = """
int {n}_outputs(void) {{ return OUTPUTS; }}

const char *{n}_output(int which) {{
  static const char *const names[] = {{{outputs}}};
  return which >= 0 && which < OUTPUTS ? names[which] : "";
}}

/* a lane, then the value of each parameter, then whether the start closes */
size_t {n}_size(void) {{ return (SIZE + PARAMETERS + 1) * sizeof(double); }}

void {n}_start(void *state) {{
  double *s = state;
  copy(s, START);
  begin(s);
{reset}  s[SIZE + PARAMETERS] = 1.0;
}}

int {n}_move(void *state, double driver, double rate, double *outputs) {{
  double *s = state, w[SIZE], n[SIZE];
  const double goal = (driver - DESIGN) / PACE, r = rate / PACE;
  int failed;
  if (!isfinite(goal) || !isfinite(r) || !(s[SIZE + PARAMETERS] > 0.0)) return 1;
  copy(w, s);
{again}  failed = travel(w, n, goal, HALVINGS);
  if (failed) return failed;
  copy(s, w);
  tell(s, outputs, r);
  return 0;
}}

int {n}_parameters(void) {{ return PARAMETERS; }}
"""

WITHOUT_PARAMETERS = """
const char *{n}_parameter(int which) {{ (void)which; return ""; }}

double {n}_nominal(int which) {{ (void)which; return NAN; }}

void {n}_set(void *state, int which, double value) {{ (void)state; (void)which; (void)value; }}
"""

WITH_PARAMETERS = """
const char *{n}_parameter(int which) {{
  static const char *const names[] = {{{parameters}}};
  return which >= 0 && which < PARAMETERS ? names[which] : "";
}}

double {n}_nominal(int which) {{ return which >= 0 && which < PARAMETERS ? NOMINAL[which] : NAN; }}

void {n}_set(void *state, int which, double value) {{
  double *s = state, *values = s + SIZE;
  if (which < 0 || which >= PARAMETERS) return;
  values[which] = value;
  values[PARAMETERS] = place(s, values);
}}
"""


def files(case: Case, places: Sequence[str], *, forces: bool = False) -> Mapping[str, bytes]:
    """Return the bytes of NAME.c and NAME.h, by the names of the files.

    Raises:
        KincheckError: the case has a part that the code cannot have.
    """
    solved = solved_case(case, places, forces=forces)
    name = identifier(case.name)
    return {
        f"{name}.c": source(solved, name).encode(),
        f"{name}.h": header(solved, name).encode(),
    }


def identifier(name: str) -> str:
    """Return a name as an identifier of C."""
    found = re.sub(r"\W", "_", name, flags=re.ASCII)
    return found if not found[:1].isdigit() else f"_{found}"


def header(solved: SolvedCase, name: str) -> str:
    """Return the header."""
    case, sweep = solved.case, solved.case.sweep
    others = " The other drivers follow their motions,\n * or hold their values at design."
    source = re.sub(r"\*/|\s+", " ", case.source)
    return HEADER.format(
        n=name,
        case=case.name,
        source=source,
        guard=f"{name.upper()}_H",
        driver=sweep.driver,
        unit=solved.unit(sweep.driver),
        others=others if solved.is_steered and sweep.driver != TIME else "",
        steer=STEER_HEADER.format(n=name) if solved.is_steered else "",
    )


def source(solved: SolvedCase, name: str) -> str:
    """Return the source."""
    numbers = [f"#define {key} {value!r}" for key, value in solved.numbers.items()]
    known = tables(solved)
    if solved.parameters:
        known["NOMINAL"] = [each.nominal for each in solved.parameters]
    lines = [
        C.table.format(
            kind="int" if table.startswith(WHOLE) else "double",
            name=table,
            numbers=", ".join(map(repr, values)),
        )
        for table, values in known.items()
    ]
    words = {what: ", ".join(map(json.dumps, each)) for what, each in words_of(solved).items()}
    reset = "  for (int k = 0; k < PARAMETERS; k++) s[SIZE + k] = NOMINAL[k];\n"
    again = "place(w, s + SIZE)" if solved.parameters else "{ copy(w, START); begin(w); }"
    tail = TAIL + (WITH_PARAMETERS if solved.parameters else WITHOUT_PARAMETERS)
    tail += STEER_TAIL if solved.is_steered else ""
    return "\n".join(
        [
            f"/* {solved.case.name}, written by kincheck: see {name}.h */",
            "#include <math.h>",
            f'#include "{name}.h"',
            "",
            *numbers,
            *lines,
            "",
            C.text(steps_text(solved)),
            tail.format(
                n=name,
                **words,
                reset=reset if solved.parameters else "",
                again=f"  if (w[STEERED] > 0.0) {again};\n" if solved.is_steered else "",
            ),
        ]
    )
