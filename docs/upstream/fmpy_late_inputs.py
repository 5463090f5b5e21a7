"""simulate_fmu records outputs that depend on inputs at once with the inputs of a step before."""

import subprocess
import tempfile
import zipfile
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

# y = u, as fmi2GetReal computes it; all other functions do nothing
SOURCE = """
#include <stddef.h>
static double u;
int fmi2SetReal(void *c, const unsigned *k, size_t n, const double *x) { u = x[0]; return 0; }
int fmi2GetReal(void *c, const unsigned *k, size_t n, double *x) { x[0] = u; return 0; }
void *fmi2Instantiate() { return &u; }
"""
DESCRIPTION = """
<fmiModelDescription fmiVersion="2.0" modelName="through" guid="1">
  <CoSimulation modelIdentifier="through"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies="1"/></Outputs></ModelStructure>
</fmiModelDescription>
"""
names = [name for name in dir(FMU2Slave) if name.startswith("fmi2")]
stubs = [f"int {name}() {{ return 0; }}" for name in names if f"{name}(" not in SOURCE]
with tempfile.TemporaryDirectory() as place:
    folder = Path(place)
    (folder / "through.c").write_text("\n".join([SOURCE, *stubs]))
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-w", "-o", "through.so", "through.c"], cwd=folder, check=True
    )
    with zipfile.ZipFile(folder / "through.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.write(folder / "through.so", "binaries/linux64/through.so")
    t = np.linspace(0.0, 1.0, 6)
    given = np.array([*zip(t, t, strict=True)], dtype=[("time", float), ("u", float)])
    found = fmpy.simulate_fmu(
        str(folder / "through.fmu"),
        validate=False,
        stop_time=1.0,
        output_interval=0.2,
        input=given,
        output=["y"],
    )
print(f"FMPy {fmpy.__version__}")
for time, y in found:
    print(f"t {time:.1f}  u {time:.1f}  y {y:.1f}")
