"""Run of a job by CoFmuPy, executed under the Python that has it.

The job is JSON from stdin, the answer JSON in the last line of stdout.

job: fmus [{id, path, reals, integers, booleans (name -> value), outputs [name]}], connections [[id, variable, id,
variable]], step [s], steps, watch [[id, variable]]. Answer: version, failure ("" if complete), times, watched (steps,
variables), cpu [s]. CoFmuPy sets and reads everything as Real, reads all outputs and leaves the order in a loop to
chance; so other types are set here before it starts, only wired outputs are named to it, and loops are
ordered as in the job. A job {build: {source, folder}} builds an FMU from a source of PythonFMU, which comes with
CoFmuPy, and answers with its path.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import time
from importlib import metadata


def build(source: str, folder: str) -> str:
    """Build an FMU; its path."""
    from pythonfmu import FmuBuilder

    return str(FmuBuilder.build_FMU(source, dest=folder, canGetAndSetFMUstate=True))


def run_job(job: dict) -> dict:
    """Run a job; the answer."""
    from cofmupy import Coordinator
    from cofmupy.master import DefaultMaster

    whole = Coordinator()
    ends = ("id", "variable")
    whole.parse_config(
        {
            "fmus": [{"id": f["id"], "path": f["path"], "initialization": f["reals"]} for f in job["fmus"]],
            "connections": [
                {"source": dict(zip(ends, c[:2])), "target": dict(zip(ends, c[2:]))}  # noqa: B905 (old Pythons)
                for c in job["connections"]
            ],
            "cosim_method": "gauss_seidel",
            "iterative": True,
        }
    )
    whole.start_graph_engine(whole.config_parser.graph_config)
    config = whole.config_parser.master_config
    names = [fmu["id"] for fmu in job["fmus"]]  # otherwise the order within a loop is random
    order = [sorted(loop, key=names.index) for loop in whole.graph_engine.sequence_order]
    whole.master = DefaultMaster(config["fmus"], config["connections"], order, config["cosim_method"], True)
    for fmu in job["fmus"]:
        handler = whole.master.fmu_handlers[fmu["id"]]
        handler.get_output_names = lambda names=fmu["outputs"]: names
        for kind, setter in (("integers", handler.fmu.setInteger), ("booleans", handler.fmu.setBoolean)):
            for name, value in fmu[kind].items():
                setter([handler.var_name2attr[name].valueReference], [value])
    whole.master.init_simulation({})
    whole.stream_handlers = []
    times, watched, failure, begin = [], [], "", time.process_time()
    try:
        for _ in range(job["steps"]):
            whole.do_step(job["step"])
            times.append(whole.master.current_time)
            outputs = whole.master.get_outputs()
            watched.append([outputs[name][variable][0] for name, variable in job["watch"]])
    except Exception as error:
        failure = f"{type(error).__name__}: {error}"
    return {"failure": failure, "times": times, "watched": watched, "cpu": time.process_time() - begin}


if __name__ == "__main__":
    job = json.load(sys.stdin)
    with contextlib.redirect_stdout(io.StringIO()):
        answer = {"path": build(**job["build"])} if "build" in job else run_job(job)
    print(json.dumps({"version": metadata.version("cofmupy"), **answer}))
