"""Maestro (INTO-CPS): both FMUs step at once, with the other's values of the step before. Its importer of multi-models
has no enumerations, so the co-simulation is written in its own language, MaBL. MAESTRO: the folder of its jars."""

import csv
import os
import subprocess
import tempfile
from pathlib import Path

from common import HEAT, STOP, TIP, VOLTS, arguments, save
from fmpy import read_model_description

SPECIFICATION = """simulation
import FMI2;
import FMI2Component;
import DataWriter;
import DataWriterConfig;
{{
  DataWriter writer = load("DataWriter");
  string heads[6] = {{"T1", "T2", "T3", "x", "y", "z"}};
  DataWriterConfig table = writer.writeHeader(heads);
  FMI2 thermalFmu = load("FMI2", "{thermal_guid}", "{folder}/thermal.fmu");
  FMI2 rodFmu = load("FMI2", "{rod_guid}", "{folder}/rod.fmu");
  FMI2Component thermal = thermalFmu.instantiate("thermal", false, false);
  FMI2Component rod = rodFmu.instantiate("rod", false, false);
  uint voltage[3] = {{{voltage}}};
  uint heat[3] = {{{heat}}};
  uint heated[3] = {{{heated}}};
  uint tip[3] = {{{tip}}};
  uint dynamic[1] = {{{dynamic}}};
  real V[3] = {{{volts}}};
  real T[3] = {{0.0, 0.0, 0.0}};
  real p[3] = {{0.0, 0.0, 0.0}};
  bool no[1] = {{false}};
  int status = thermal.setReal(voltage, 3, V);
  status = rod.setBoolean(dynamic, 1, no);
  status = thermal.setupExperiment(false, 0.0, 0.0, true, {stop});
  status = rod.setupExperiment(false, 0.0, 0.0, true, {stop});
  status = thermal.enterInitializationMode();
  status = rod.enterInitializationMode();
  status = thermal.getReal(heat, 3, T);
  status = rod.setReal(heated, 3, T);
  status = thermal.exitInitializationMode();
  status = rod.exitInitializationMode();
  int k = 0;
  while (k < {steps})
  {{
    status = rod.setReal(heated, 3, T);
    status = thermal.doStep(k * {step}, {step}, true);
    status = rod.doStep(k * {step}, {step}, true);
    status = thermal.getReal(heat, 3, T);
    status = rod.getReal(tip, 3, p);
    k = k + 1;
    writer.writeDataPoint(table, k * {step}, T[0], T[1], T[2], p[0], p[1], p[2]);
  }}
  writer.close();
  status = thermal.terminate();
  status = rod.terminate();
  thermalFmu.freeInstance(thermal);
  rodFmu.freeInstance(rod);
  unload(thermalFmu);
  unload(rodFmu);
  unload(writer);
}}
"""

fmus, step, table = arguments()
thermal, rod = (read_model_description(str(fmus / f"{name}.fmu")) for name in ("thermal", "rod"))


def references(model, names):
    actual = {variable.name: str(variable.valueReference) for variable in model.modelVariables}
    return ", ".join(actual[name] for name in names)


specification = SPECIFICATION.format(
    thermal_guid=thermal.guid,
    rod_guid=rod.guid,
    folder=fmus.as_uri(),
    voltage=references(thermal, VOLTS),
    heat=references(thermal, HEAT),
    heated=references(rod, HEAT),
    tip=references(rod, TIP),
    dynamic=references(rod, ["dynamic"]),
    volts=", ".join(map(str, VOLTS.values())),
    stop=STOP,
    step=step,
    steps=round(STOP / step),
)
with tempfile.TemporaryDirectory() as name:
    folder = Path(name)
    (folder / "spec.mabl").write_text(specification)
    (folder / "run.json").write_text('{"DataWriter": [{"filename": "outputs.csv", "type": "CSV"}]}')
    java = ["java", "-cp", str(Path(os.environ["MAESTRO"]).resolve() / "*"), "org.intocps.maestro.Main", "interpret"]
    options = ["-runtime", "run.json", "-output", "out"]
    subprocess.run([*java, "spec.mabl", *options], cwd=folder, check=True)
    with (folder / "out" / "outputs.csv").open() as file:
        save(table, list(csv.reader(file))[1:])
