"""Ecos: both FMUs step at once, with the other's values of the step before."""

from common import HEAT, STOP, TIP, VOLTS, arguments, save
from ecospy import EcosSimulation, EcosSimulationStructure

source, step, table = arguments()
if source.suffix == ".ssp":
    parameters = "fig3"  # its name in the archive; none is taken otherwise
    simulation = EcosSimulation(ssp_path=str(source), step_size=step)
else:
    parameters = "step"
    structure = EcosSimulationStructure()
    for name in ("thermal", "rod"):
        structure.add_model(name, source / f"{name}.fmu")
    for name in HEAT:
        structure.make_real_connection(f"thermal::{name}", f"rod::{name}")
    volts = {f"thermal::{name}": volt for name, volt in VOLTS.items()}
    structure.add_parameter_set(parameters, {**volts, "rod::dynamic": False})
    simulation = EcosSimulation(structure=structure, step_size=step)
with simulation:
    simulation.init(parameter_set=parameters)
    rows = []
    for k in range(1, round(STOP / step) + 1):
        simulation.step()
        values = [f"thermal::{name}" for name in HEAT] + [f"rod::{name}" for name in TIP]
        rows.append((k * step, *(simulation.get_real(name) for name in values)))
save(table, rows)
