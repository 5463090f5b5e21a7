"""A solved case as JavaScript: NAME.mjs, one class without dependencies."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from ...case.case import Case
from .c import identifier
from .dialects import JAVASCRIPT, steps_text, tables, words_of
from .solved import SolvedCase, solved_case

CLASS = """
class Mechanism {{
  /* the state is three lanes, then the value of each parameter, then whether the start closes */
  constructor() {{
    this.state = new Float64Array(3 * SIZE + PARAMETERS + 1);
    this.lanes = [0, 1, 2].map((k) => this.state.subarray(k * SIZE, (k + 1) * SIZE));
    this.values = this.state.subarray(3 * SIZE);
    this.start();
  }}
  outputs() {{ return OUTPUTS; }}
  output(which) {{ return NAMES[which] ?? ""; }}
  size() {{ return 8 * this.state.length; }}
  start() {{
    copy(this.lanes[0], START);
    begin(this.lanes[0]);
    for (let k = 0; k < PARAMETERS; k++) this.values[k] = NOMINAL[k];
    this.values[PARAMETERS] = 1;
  }}
  /* 0, and three numbers of each output: value, velocity and acceleration; or 1: the iteration does
     not converge, 2: a lock-up or another branch is in between. State and outputs then stay. */
  move(driver, rate, outputs, most = HALVINGS) {{
    const [s, w, n] = this.lanes, goal = (driver - DESIGN) / PACE, r = rate / PACE;
    if (!Number.isFinite(goal) || !Number.isFinite(r) || !(this.values[PARAMETERS] > 0)) return 1;
    copy(w, s);{again}
    const failed = travel(w, n, goal, most);
    if (failed) return failed;
    copy(s, w);
    tell(s, outputs, r);
    return 0;
  }}{steer}
  parameters() {{ return PARAMETERS; }}
  parameter(which) {{ return PARAMETER_NAMES[which] ?? ""; }}
  nominal(which) {{ return NOMINAL[which] ?? NaN; }}
  /* the state returns to the design position */
  set(which, value) {{
    if (!(which >= 0 && which < PARAMETERS)) return;
    this.values[which] = value;
    this.stand();
  }}
  stand() {{{stand}}}
}}
"""
EXPORT = "export { Mechanism, Mechanism as default };\n"
STAND = """
    this.values[PARAMETERS] = place(this.lanes[0], this.values);
  """
STEER = """
  drivers() { return DRIVERS; }
  driver(which) { return DRIVER_NAMES[which] ?? ""; }
  /* all drivers to values of their own, by a straight way from their present ones; move begins at
     the design position again */
  moveAll(drivers, rates, outputs) {
    const [s, w, n] = this.lanes;
    if (![...drivers, ...rates].every(Number.isFinite) || !(this.values[PARAMETERS] > 0)) return 1;
    copy(w, s);
    const failed = steer(w, n, drivers);
    if (failed) return failed;
    copy(s, w);
    tell_at(s, outputs, rates);
    return 0;
  }"""


def files(case: Case, places: Sequence[str], *, forces: bool = False) -> Mapping[str, bytes]:
    """Return the bytes of NAME.mjs, by the name of the file.

    Raises:
        KincheckError: the case has a part that the code cannot have.
    """
    text = source(solved_case(case, places, forces=forces)) + EXPORT
    return {f"{identifier(case.name)}.mjs": text.encode()}


def source(solved: SolvedCase) -> str:
    """Return the text of the class `Mechanism`, and all that it takes."""
    known = tables(solved) | {"NOMINAL": [each.nominal for each in solved.parameters]}
    words = words_of(solved)
    again = "place(w, this.values)" if solved.parameters else "{ copy(w, START); begin(w); }"
    return "\n".join(
        [
            f"/* {solved.case.name}, written by kincheck: lengths in m, angles in rad */",
            *(f"const {key} = {value!r};" for key, value in solved.numbers.items()),
            *(
                JAVASCRIPT.table.format(name=table, numbers=", ".join(map(repr, values)))
                for table, values in known.items()
            ),
            f"const NAMES = {json.dumps(words['outputs'])};",
            f"const PARAMETER_NAMES = {json.dumps(words['parameters'])};",
            f"const DRIVER_NAMES = {json.dumps(words['drivers'])};",
            "",
            JAVASCRIPT.text(steps_text(solved)),
            CLASS.format(
                stand=STAND if solved.parameters else "",
                again=f"\n    if (w[STEERED] > 0) {again};" if solved.is_steered else "",
                steer=STEER if solved.is_steered else "",
            ),
        ]
    )
