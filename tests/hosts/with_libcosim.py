"""libcosim (of the Open Simulation Platform): both FMUs step at once, with the other's values of the step before."""

from common import HEAT, STOP, TIP, VOLTS, arguments, save
from libcosimpy.CosimEnums import CosimErrorCode
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

source, step, table = arguments()
log_output_level(CosimLogLevel.ERROR)
whole = source.suffix == ".ssp"
if whole:
    execution = CosimExecution.from_ssp_file(str(source), step * 1e9)
else:
    execution = CosimExecution.from_step_size(step * 1e9)
    for name in ("thermal", "rod"):
        execution.add_local_slave(CosimLocalSlave(str(source / f"{name}.fmu"), name))
slaves = {slave.name.decode(): slave.index for slave in execution.slave_infos()}
thermal, rod = slaves["thermal"], slaves["rod"]
reference = {
    slave: {v.name.decode(): v.reference for v in execution.slave_variables(slave)} for slave in (thermal, rod)
}
if not whole:
    for name, volt in VOLTS.items():
        execution.real_initial_value(thermal, reference[thermal][name], volt)
    execution.boolean_initial_value(rod, reference[rod]["dynamic"], False)
    for name in HEAT:
        execution.connect_real_variables(thermal, reference[thermal][name], rod, reference[rod][name])
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
rows = []
for k in range(1, round(STOP / step) + 1):
    execution.step()  # what it answers is inverted in some versions
    assert execution.status().error_code == CosimErrorCode.SUCCESS.value, f"step {k} failed"
    heat = observer.last_real_values(thermal, [reference[thermal][name] for name in HEAT])
    tip = observer.last_real_values(rod, [reference[rod][name] for name in TIP])
    rows.append((k * step, *heat, *tip))
save(table, rows)
