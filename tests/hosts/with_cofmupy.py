"""CoFmuPy: Gauss-Seidel, so the rod steps with the temperature at the end of the step."""

from cofmupy import Coordinator
from cofmupy.wrappers import Fmu2Handler
from common import HEAT, STOP, TIP, VOLTS, arguments, save
from fmpy import read_model_description

fmus, step, table = arguments()


def set_by_type(handler, name, value):
    """CoFmuPy 1.0 sets everything as Real, Booleans too."""
    variable = handler.var_name2attr[name]
    getattr(handler.fmu, f"set{variable.type}")([variable.valueReference], value)


def outputs(handler):
    """It also gets everything as Real, and all outputs that there are."""
    return [name for name in (*HEAT, *TIP) if name in handler.var_name2attr]


Fmu2Handler._set_variable = set_by_type
Fmu2Handler.get_output_names = outputs
values = {"thermal": VOLTS, "rod": {"dynamic": False}}
models = []
for name in ("thermal", "rod"):
    path = str(fmus / f"{name}.fmu")
    inputs = [variable for variable in read_model_description(path).modelVariables if variable.causality == "input"]
    start = {variable.name: float(variable.start) for variable in inputs}  # CoFmuPy would set them all to 0
    models.append({"id": name, "path": path, "initialization": {**start, **values[name]}})
coordinator = Coordinator()
coordinator.start(
    {
        "fmus": models,
        "connections": [
            {"source": {"id": "thermal", "variable": name}, "target": {"id": "rod", "variable": name}} for name in HEAT
        ],
        "cosim_method": "gauss_seidel",
        "iterative": True,
    }
)
wanted = [("thermal", name) for name in HEAT] + [("rod", name) for name in TIP]
rows = []
for k in range(1, round(STOP / step) + 1):
    coordinator.do_step(step)
    rows.append((k * step, *(coordinator.get_variable(name)[0] for name in wanted)))
save(table, rows)
