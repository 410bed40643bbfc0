"""FMUContainer (of the FMU manipulation toolbox): both FMUs become one, which steps them in sequence; FMPy runs it."""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from common import HEAT, STOP, TIP, VOLTS, arguments, save
from fmpy import simulate_fmu

fmus, step, table = arguments()
rules = [
    "rule;from_fmu;from_port;to_fmu;to_port",
    "FMU;thermal.fmu;;;",
    "FMU;rod.fmu;;;",
    *(f"LINK;thermal.fmu;{name};rod.fmu;{name}" for name in HEAT),
    *(f"START;thermal.fmu;{name};{volt};" for name, volt in VOLTS.items()),
    "START;rod.fmu;dynamic;0;",
    *(f"OUTPUT;thermal.fmu;{name};;{name}" for name in HEAT),
    *(f"OUTPUT;rod.fmu;{name};;{name}" for name in TIP),
]
with tempfile.TemporaryDirectory() as folder:
    for name in ("thermal.fmu", "rod.fmu"):
        shutil.copy(fmus / name, folder)
    (Path(folder) / "both.csv").write_text("\n".join(rules))
    build = [str(Path(sys.executable).with_name("fmucontainer")), "-container", f"both.csv:{step}", "-sequential"]
    subprocess.run([*build, "-no-auto-input", "-no-auto-output", "-no-auto-link"], cwd=folder, check=True)
    actual = simulate_fmu(Path(folder) / "both.fmu", stop_time=STOP, step_size=step, output_interval=step)
save(table, zip(*(actual[name][1:] for name in ("time", *HEAT, *TIP)), strict=True))
