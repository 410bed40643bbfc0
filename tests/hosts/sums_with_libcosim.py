"""An SSP archive with a weighted sum under libcosim; arguments: the archive, the CSV to write: time, T [K], tip [m]."""

import csv
import sys

from libcosimpy.CosimEnums import CosimErrorCode
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver

STEP, COUNT = 0.1, 10
archive, table = sys.argv[1:]
log_output_level(CosimLogLevel.ERROR)
execution = CosimExecution.from_ssp_file(archive, STEP * 1e9)
[rod] = [slave.index for slave in execution.slave_infos() if slave.name.decode() == "rod"]
references = {v.name.decode(): v.reference for v in execution.slave_variables(rod)}
names = [*(f"T[{k}]" for k in (1, 2, 3)), *(f"tip.p[{k}]" for k in (1, 2, 3))]
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
with open(table, "w", newline="") as file:
    rows = csv.writer(file)
    for k in range(1, COUNT + 1):
        execution.step()
        assert execution.status().error_code == CosimErrorCode.SUCCESS.value, f"step {k} failed"
        rows.writerow([k * STEP, *observer.last_real_values(rod, [references[name] for name in names])])
