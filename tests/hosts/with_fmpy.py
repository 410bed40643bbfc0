"""FMPy: one FMU after the other, as nothing flows back. It holds inputs over a step (its `set_input_derivatives` fails
where there is more than one), so the rod sees the temperature of one step before."""

import numpy as np
from common import HEAT, STOP, TIP, VOLTS, arguments, save
from fmpy import simulate_fmu

fmus, step, table = arguments()
volts = np.array([(0.0, *VOLTS.values())], dtype=[(name, float) for name in ("time", *VOLTS)])
heat = simulate_fmu(fmus / "thermal.fmu", stop_time=STOP, output_interval=step, input=volts, output=HEAT)
bent = simulate_fmu(
    fmus / "rod.fmu",
    stop_time=STOP,
    output_interval=step,
    input=heat,
    start_values={"dynamic": False},
    output=TIP,
)
columns = [heat["time"], *(heat[name] for name in HEAT), *(bent[name] for name in TIP)]
save(table, zip(*(column[1:] for column in columns), strict=True))
