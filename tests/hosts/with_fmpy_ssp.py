"""FMPy's master for SSP archives: it hands on every value one step late."""

from common import HEAT, STOP, TIP, arguments, save
from fmpy.ssp import simulation

archive, step, table = arguments()
instantiate = simulation.instantiate_fmu


def prepare(component, folder, start_time, stop_time, _):
    """FMPy starts every connector at 0 and applies no bound parameter set; here the set is applied, and connectors
    start at what the FMU then says. It takes the text 'false' for true, so Booleans are read here."""
    [binding] = component.parameterBindings
    [parameters] = binding.parameterValues
    for parameter in parameters.parameters:
        parameter.name = f"{component.name}.{parameter.name}"
        if parameter.type == "Boolean":
            parameter.value = parameter.value == "true"
    instantiate(component, folder, start_time, stop_time, parameters)
    for connector in component.connectors:
        connector.value = simulation.get_value(component, connector.name)


simulation.instantiate_fmu = prepare
actual = simulation.simulate_ssp(archive, stop_time=STOP - step / 2, step_size=step)
names = [f"thermal.{name}" for name in HEAT] + [f"rod.{name}" for name in TIP]
save(table, zip(actual["time"] + step, *(actual[name] for name in names), strict=True))
