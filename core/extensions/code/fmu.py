"""A solved case as a functional mock-up unit, FMI 2 or 3: the C code with its sources, and a binary
where a compiler is there.

The driver and its rate are inputs; so are those of the other drivers, if they hold their values. A
case driven by time has none. Beyond a lock-up the unit
returns Discard and no numbers.
"""

from __future__ import annotations

import io
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from xml.sax.saxutils import quoteattr

from ...case.case import TIME, Case
from ...errors import KincheckError
from ...mechanism.motions import Ramp
from .c import header, identifier, source
from .solved import SolvedCase, solved_case

BASE = {"m": {"m": 1}, "s": {"s": 1}, "rad": {"rad": 1}, "1": {}}
"""Powers of base units by unit."""
COMPILERS = "cc", "gcc", "clang"
FLAGS = "-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden"

WRAPPER = r"""
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "{n}.h"
#if defined _WIN32
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif
typedef double R;
enum {{ OUT = {outputs}, PARAMETERS = {parameters}, DRIVERS = {drivers} }};
enum {{ OWN = 1 + 2 * DRIVERS, FIRST = OWN + PARAMETERS }};
enum {{ LAST = FIRST + 3 * OUT }};
enum {{ OK, WARNING, DISCARD, ERROR }};
typedef struct {{
  R time, driver[DRIVERS], rate[DRIVERS], *out; int known, failed; void *state;
}} M;

static void begin(M *m) {{
  const R driver[] = {{{start}}}, rate[] = {{{rate}}};
  {n}_start(m->state);
  memcpy(m->driver, driver, sizeof(driver)); memcpy(m->rate, rate, sizeof(rate));
  m->time = 0.0; m->known = 0;
}}
static M *made(void) {{
  M *m = calloc(1, sizeof(M));
  if (m) {{ m->state = calloc(1, {n}_size()); m->out = calloc(3 * OUT, sizeof(R)); }}
  if (!m || !m->state || !m->out) return NULL;
  begin(m);
  return m;
}}
static void freed(M *m) {{ if (m) {{ free(m->state); free(m->out); free(m); }} }}
static int solved(M *m) {{
  if (!m->known) m->failed = {n}_{moved}, m->out);
  m->known = 1;
  return m->failed ? DISCARD : OK;
}}
static int get(M *m, const unsigned *which, size_t n, R *x) {{
  int status = OK;
  size_t k;
  for (k = 0; k < n; k++) {{
    unsigned i = which[k];
    if (i >= LAST) return ERROR;
    if (i == 0) x[k] = m->time;
    else if (i < OWN) x[k] = (i % 2 ? m->driver : m->rate)[(i - 1) / 2];
    else if (i < FIRST) x[k] = ((R *)m->state)[{n}_size() / sizeof(R) - 1 - PARAMETERS + i - OWN];
    else if ((status = solved(m)) != OK) return status;
    else x[k] = m->out[i - FIRST];
  }}
  return status;
}}
static int set(M *m, const unsigned *which, size_t n, const R *x) {{
  size_t k;
  for (k = 0; k < n; k++) {{
    unsigned i = which[k];
    if (i == 0 || i >= FIRST) return ERROR;
    if (i < OWN) (i % 2 ? m->driver : m->rate)[(i - 1) / 2] = x[k];
    else {n}_set(m->state, (int)i - OWN, x[k]);
  }}
  m->known = 0;
  return OK;
}}
static int at(M *m, R t) {{ m->time = t; m->known = 0; return OK; }}
"""
FMI2 = r"""
typedef const char *S;
API S fmi2GetTypesPlatform(void) {{ return "default"; }}
API S fmi2GetVersion(void) {{ return "2.0"; }}
API int fmi2SetDebugLogging(void *m, int on, size_t n, const S *what) {{
  (void)m; (void)on; (void)n; (void)what; return OK;
}}
API void *fmi2Instantiate(S name, int kind, S guid, S place, const void *calls, int visible,
    int log) {{
  (void)name; (void)kind; (void)place; (void)calls; (void)visible; (void)log;
  return strcmp(guid, {token}) ? NULL : made();
}}
API void fmi2FreeInstance(void *m) {{ freed(m); }}
API int fmi2SetupExperiment(void *m, int known, R tol, R start, int ends, R end) {{
  (void)known; (void)tol; (void)ends; (void)end; return at(m, start);
}}
API int fmi2EnterInitializationMode(void *m) {{ (void)m; return OK; }}
API int fmi2ExitInitializationMode(void *m) {{ return solved(m); }}
API int fmi2Terminate(void *m) {{ (void)m; return OK; }}
API int fmi2Reset(void *m) {{ begin(m); return OK; }}
API int fmi2GetReal(void *m, const unsigned *k, size_t n, R *x) {{ return get(m, k, n, x); }}
API int fmi2SetReal(void *m, const unsigned *k, size_t n, const R *x) {{ return set(m, k, n, x); }}
#define NONE(name) \
  API int fmi2##name(void *m, const unsigned *k, size_t n, const void *x) {{ \
    (void)m; (void)k; (void)x; return n ? ERROR : OK; \
  }}
NONE(GetInteger) NONE(SetInteger) NONE(GetBoolean) NONE(SetBoolean) NONE(GetString) NONE(SetString)
API int fmi2EnterEventMode(void *m) {{ (void)m; return OK; }}
API int fmi2EnterContinuousTimeMode(void *m) {{ (void)m; return OK; }}
API int fmi2NewDiscreteStates(void *m, int *event) {{
  (void)m; memset(event, 0, 5 * sizeof(int)); return OK;
}}
API int fmi2CompletedIntegratorStep(void *m, int last, int *event, int *stop) {{
  (void)m; (void)last; *event = *stop = 0; return OK;
}}
API int fmi2SetTime(void *m, R t) {{ return at(m, t); }}
#define EMPTY(name) \
  API int fmi2##name(void *m, R *x, size_t n) {{ (void)m; (void)x; return n ? ERROR : OK; }}
EMPTY(GetDerivatives)
EMPTY(GetEventIndicators)
EMPTY(GetContinuousStates)
EMPTY(GetNominalsOfContinuousStates)
API int fmi2SetContinuousStates(void *m, const R *x, size_t n) {{
  (void)m; (void)x; return n ? ERROR : OK;
}}
API int fmi2DoStep(void *m, R t, R h, int keep) {{ (void)keep; at(m, t + h); return solved(m); }}
/* what the description does not offer */
#define LACKS(name) API int fmi2##name(void) {{ return ERROR; }}
LACKS(CancelStep) LACKS(GetFMUstate) LACKS(SetFMUstate) LACKS(FreeFMUstate)
LACKS(SerializedFMUstateSize) LACKS(SerializeFMUstate) LACKS(DeSerializeFMUstate)
LACKS(GetDirectionalDerivative) LACKS(SetRealInputDerivatives) LACKS(GetRealOutputDerivatives)
LACKS(GetStatus) LACKS(GetRealStatus) LACKS(GetIntegerStatus) LACKS(GetBooleanStatus)
LACKS(GetStringStatus)
"""
FMI3 = r"""
typedef const char *S;
API S fmi3GetVersion(void) {{ return "3.0"; }}
API int fmi3SetDebugLogging(void *m, _Bool on, size_t n, const S *what) {{
  (void)m; (void)on; (void)n; (void)what; return OK;
}}
API void *fmi3InstantiateModelExchange(S name, S token, S place, _Bool visible, _Bool log,
    void *where, void *call) {{
  (void)name; (void)place; (void)visible; (void)log; (void)where; (void)call;
  return strcmp(token, {token}) ? NULL : made();
}}
API void *fmi3InstantiateCoSimulation(S name, S token, S place, _Bool visible, _Bool log,
    _Bool events, _Bool early, const unsigned *k, size_t n, void *where, void *call,
    void *update) {{
  (void)events; (void)early; (void)k; (void)n; (void)update;
  return fmi3InstantiateModelExchange(name, token, place, visible, log, where, call);
}}
API void fmi3FreeInstance(void *m) {{ freed(m); }}
API int fmi3EnterInitializationMode(void *m, _Bool known, R tol, R start, _Bool ends, R end) {{
  (void)known; (void)tol; (void)ends; (void)end; return at(m, start);
}}
API int fmi3ExitInitializationMode(void *m) {{ return solved(m); }}
API int fmi3Terminate(void *m) {{ (void)m; return OK; }}
API int fmi3Reset(void *m) {{ begin(m); return OK; }}
API int fmi3GetFloat64(void *m, const unsigned *k, size_t n, R *x, size_t count) {{
  (void)count; return get(m, k, n, x);
}}
API int fmi3SetFloat64(void *m, const unsigned *k, size_t n, const R *x, size_t count) {{
  (void)count; return set(m, k, n, x);
}}
API int fmi3EnterEventMode(void *m) {{ (void)m; return OK; }}
API int fmi3EnterContinuousTimeMode(void *m) {{ (void)m; return OK; }}
API int fmi3UpdateDiscreteStates(void *m, _Bool *a, _Bool *b, _Bool *c, _Bool *d, _Bool *e, R *t) {{
  (void)m; *a = *b = *c = *d = *e = 0; *t = 0.0; return OK;
}}
API int fmi3CompletedIntegratorStep(void *m, _Bool last, _Bool *event, _Bool *stop) {{
  (void)m; (void)last; *event = *stop = 0; return OK;
}}
API int fmi3SetTime(void *m, R t) {{ return at(m, t); }}
#define EMPTY(name) \
  API int fmi3##name(void *m, R *x, size_t n) {{ (void)m; (void)x; return n ? ERROR : OK; }}
EMPTY(GetContinuousStateDerivatives)
EMPTY(GetEventIndicators)
EMPTY(GetContinuousStates)
EMPTY(GetNominalsOfContinuousStates)
API int fmi3SetContinuousStates(void *m, const R *x, size_t n) {{
  (void)m; (void)x; return n ? ERROR : OK;
}}
API int fmi3DoStep(void *m, R t, R h, _Bool keep, _Bool *event, _Bool *stop, _Bool *early,
    R *last) {{
  (void)keep;
  *event = *stop = *early = 0;
  at(m, *last = t + h);
  return solved(m);
}}
/* what the description does not offer */
#define LACKS3(name) API int fmi3##name(void) {{ return ERROR; }}
LACKS3(EvaluateDiscreteStates) LACKS3(SetShiftDecimal) LACKS3(SetShiftFraction)
LACKS3(ActivateModelPartition) LACKS3(DeserializeFMUState) LACKS3(EnterConfigurationMode)
LACKS3(EnterStepMode) LACKS3(ExitConfigurationMode) LACKS3(FreeFMUState)
LACKS3(GetAdjointDerivative) LACKS3(GetBinary) LACKS3(GetBoolean) LACKS3(GetClock)
LACKS3(GetDirectionalDerivative) LACKS3(GetFMUState) LACKS3(GetFloat32) LACKS3(GetInt16)
LACKS3(GetInt32) LACKS3(GetInt64) LACKS3(GetInt8) LACKS3(GetIntervalDecimal)
LACKS3(GetIntervalFraction) LACKS3(GetNumberOfContinuousStates)
LACKS3(GetNumberOfEventIndicators) LACKS3(GetNumberOfVariableDependencies)
LACKS3(GetOutputDerivatives) LACKS3(GetShiftDecimal) LACKS3(GetShiftFraction) LACKS3(GetString)
LACKS3(GetUInt16) LACKS3(GetUInt32) LACKS3(GetUInt64) LACKS3(GetUInt8)
LACKS3(GetVariableDependencies) LACKS3(InstantiateScheduledExecution) LACKS3(SerializeFMUState)
LACKS3(SerializedFMUStateSize) LACKS3(SetBinary) LACKS3(SetBoolean) LACKS3(SetClock)
LACKS3(SetFMUState) LACKS3(SetFloat32) LACKS3(SetInt16) LACKS3(SetInt32) LACKS3(SetInt64)
LACKS3(SetInt8) LACKS3(SetIntervalDecimal) LACKS3(SetIntervalFraction) LACKS3(SetString)
LACKS3(SetUInt16) LACKS3(SetUInt32) LACKS3(SetUInt64) LACKS3(SetUInt8)
"""


def files(
    case: Case, places: Sequence[str], fmi: int = 2, *, forces: bool = False
) -> Mapping[str, bytes]:
    """Return the bytes of NAME.fmu, by the name of the file.

    Raises:
        KincheckError: the case has a part that the code cannot have, or the compiler fails.
    """
    solved = solved_case(case, places, forces=forces)
    name = identifier(case.name)
    token = "{" + sha256(source(solved, name).encode()).hexdigest()[:32] + "}"
    sources = {
        f"{name}.c": source(solved, name),
        f"{name}.h": header(solved, name),
        f"{name}_fmu.c": wrapper(solved, name, fmi, token),
    }
    texts = {f"sources/{file}": text for file, text in sources.items()}
    texts["modelDescription.xml"] = description(solved, name, fmi, token)
    if fmi == 3:
        texts["sources/buildDescription.xml"] = _build_description(name)
    found = io.BytesIO()
    with zipfile.ZipFile(found, "w", zipfile.ZIP_DEFLATED) as archive:
        for file, content in {**texts, **_binary(sources, name, fmi)}.items():
            # the same case gives the same bytes
            archive.writestr(zipfile.ZipInfo(file), content, zipfile.ZIP_DEFLATED)
    return {f"{name}.fmu": found.getvalue()}


def wrapper(solved: SolvedCase, name: str, fmi: int, token: str) -> str:
    """Return the functions of the standard around the code."""
    by_time, inputs = solved.case.sweep.driver == TIME, _inputs(solved)
    given = "driver, m->rate" if len(inputs) > 1 else "driver[0], m->rate[0]"
    every = "move_all" if len(inputs) > 1 else "move"
    given = "time, 1.0" if by_time else given
    return (WRAPPER + (FMI2 if fmi == 2 else FMI3)).format(
        n=name,
        outputs=len(solved.outputs),
        parameters=len(solved.parameters),
        drivers=len(inputs),
        start=", ".join(repr(design) for _, design, _ in inputs),
        rate=", ".join(repr(rate) for *_, rate in inputs),
        moved=f"{every}(m->state, m->{given}",
        token=f'"{token}"',
    )


def description(solved: SolvedCase, name: str, fmi: int, token: str) -> str:
    """Return modelDescription.xml."""
    by_time, given = solved.case.sweep.driver == TIME, _inputs(solved)
    variables = [_variable(fmi, 0, "time", "independent", "continuous", "s")]
    for k, (driver, *starts) in enumerate([] if by_time else given):
        for order, (ending, start) in enumerate(zip(("", ".velocity"), starts, strict=True)):
            name_of, unit = driver + ending, solved.unit(driver) + "/s" * order
            variables.append(
                _variable(fmi, 1 + 2 * k + order, name_of, "input", "continuous", unit, repr(start))
            )
    own = 1 + 2 * len(given)
    variables += [
        _variable(fmi, own + k, each.name, "parameter", "tunable", each.unit, repr(each.nominal))
        for k, each in enumerate(solved.parameters)
    ]
    first, inputs = own + len(solved.parameters), [] if by_time else [*range(1, own)]
    outputs: list[int] = []
    for k, each in enumerate(solved.outputs):
        for order, ending in enumerate(("", ".velocity", ".acceleration")):
            unit = each.quantity.unit + ("", "/s", "/s2")[order]
            outputs.append(first + 3 * k + order)
            label = each.quantity.name + ending
            variables.append(_variable(fmi, outputs[-1], label, "output", "continuous", unit))
    units = sorted(set(re.findall(r' unit="([^"]*)"', "".join(variables))))
    listed = _listed(name) if fmi == 2 else ""
    kinds = "".join(
        f"<{kind} modelIdentifier={quoteattr(name)}{extra}>{listed}</{kind}>"
        for kind, extra in (
            ("ModelExchange", ""),
            ("CoSimulation", ' canHandleVariableCommunicationStepSize="true"'),
        )
    )
    # FMI 2 counts variables from one in their order, FMI 3 names their references
    index = {k: k + 1 - (2 if by_time else 0) for k in range(1, first + len(outputs))}
    if fmi == 2:
        known = " ".join(str(index[k]) for k in inputs)
        told = "".join(f'<Unknown index="{index[k]}" dependencies="{known}"/>' for k in outputs)
        structure = f"<Outputs>{told}</Outputs><InitialUnknowns>{told}</InitialUnknowns>"
    else:
        known = " ".join(map(str, inputs))
        structure = "".join(
            f'<{kind} valueReference="{k}" dependencies="{known}"/>'
            for kind in ("Output", "InitialUnknown")
            for k in outputs
        )
    title = "guid" if fmi == 2 else "instantiationToken"
    events = ' numberOfEventIndicators="0"' if fmi == 2 else ""
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<fmiModelDescription fmiVersion="{fmi}.0" modelName={quoteattr(solved.case.name)}'
        f' {title}="{token}" generationTool="kincheck"{events}>'
        f"{kinds}<UnitDefinitions>{''.join(map(_unit, units))}</UnitDefinitions>"
        '<DefaultExperiment startTime="0.0" stopTime="1.0"/>'
        f"<ModelVariables>{''.join(variables)}</ModelVariables>"
        f"<ModelStructure>{structure}</ModelStructure></fmiModelDescription>\n"
    )


def _inputs(solved: SolvedCase) -> list[tuple[str, float, float]]:
    """Return the drivers that are inputs, with value and rate at the start; time for none."""
    sweep, mechanism = solved.case.sweep, solved.case.mechanism
    if sweep.driver == TIME:
        return [(TIME, 0.0, 1.0)]
    swept = (sweep.driver, float(sweep.design), float(sweep.pace))
    if any(motion != Ramp(0.0) for motion in sweep.motions.values()):
        return [swept]  # others follow it
    return [
        swept if name == sweep.driver else (name, mechanism.design_value(name), 0.0)
        for name in solved.drivers
    ]


def _variable(
    fmi: int, k: int, name: str, causality: str, variability: str, unit: str, start: str = ""
) -> str:
    about = f'name={quoteattr(name)} valueReference="{k}" causality="{causality}"'
    about += f' variability="{variability}"'
    about += ' initial="calculated"' if causality == "output" else ""
    given = f' unit="{unit}"' + (f' start="{start}"' if start else "")
    if fmi == 2:
        return f"<ScalarVariable {about}><Real{given}/></ScalarVariable>"
    return f"<Float64 {about}{given}/>"


def _unit(unit: str) -> str:
    powers: dict[str, int] = {}
    for k, part in enumerate(unit.split("/")):
        power = -1 if k else 1
        if part.endswith("2") and part != "1":
            part, power = part[:-1], 2 * power
        for base, each in BASE.get(part, {}).items():
            powers[base] = powers.get(base, 0) + power * each
    told = "".join(f' {base}="{power}"' for base, power in powers.items())
    return f'<Unit name="{unit}"><BaseUnit{told}/></Unit>'


def _listed(name: str) -> str:
    names = "".join(f'<File name="{each}"/>' for each in (f"{name}.c", f"{name}_fmu.c"))
    return f"<SourceFiles>{names}</SourceFiles>"


def _build_description(name: str) -> str:
    names = "".join(f'<SourceFile name="{each}"/>' for each in (f"{name}.c", f"{name}_fmu.c"))
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">'
        f'<BuildConfiguration modelIdentifier="{name}"><SourceFileSet language="C99">{names}'
        "</SourceFileSet></BuildConfiguration></fmiBuildDescription>\n"
    )


def _binary(sources: Mapping[str, str], name: str, fmi: int) -> Mapping[str, bytes]:
    """Return the binary for this machine by its place; none without a compiler."""
    compiler = next((found for each in COMPILERS if (found := shutil.which(each))), None)
    if compiler is None or not sys.platform.startswith("linux"):
        return {}
    with tempfile.TemporaryDirectory() as folder:
        for file, text in sources.items():
            (Path(folder) / file).write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, "-o", f"{name}.so", f"{name}.c", f"{name}_fmu.c", "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if done.returncode:
            raise KincheckError(f"{compiler} does not compile the FMU: {done.stderr[-500:]}")
        machine = platform.machine()
        place = "linux64" if fmi == 2 else f"{machine}-linux"
        return {f"binaries/{place}/{name}.so": (Path(folder) / f"{name}.so").read_bytes()}
