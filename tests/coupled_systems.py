"""Coupled systems whose verdict is known: healthy, step too long, diverging, with a hidden error."""

from __future__ import annotations

import json
from pathlib import Path

from fmu_maker import make_fmu, real

# The input at time t of the step that began at memory[0], as a polynomial through the derivatives that were set.
COURSE = (
    "double s = t - memory[0];double u = real[0] + s * (slope[0][1] + s * (slope[0][2] / 2.0 + s * slope[0][3] / 6.0));"
)
STEP = "memory[0] = t; return integrate(m, h);"
SMOOTH = {"canInterpolateInputs": "true"}
VOLT = '<Unit name="V"><BaseUnit kg="1" m="2" s="-3" A="-1"/></Unit><Unit name="A"><BaseUnit A="1"/></Unit>'


def first_order(path: Path, rate: str, start: float, **how: object) -> Path:
    """x' = rate(u, x), output x: real[0] = u, real[1] = x, real[2] = der(x)."""
    how.setdefault("step", STEP)
    how.setdefault("co_simulation", SMOOTH)
    units = how.pop("unit", ("1", "1"))
    variables = [
        real("u", "input", start=0.0, unit=units[0]),
        real("x", "output", start=start, initial="exact", unit=units[1]),
        real("der(x)", "local"),
    ]
    return make_fmu(path, variables, output=f"{COURSE} real[2] = {rate};", states={"x": "der(x)"}, **how)


def gain(path: Path, a: str, g: float) -> Path:
    """y = a + g u, at once; a may depend on t."""
    variables = [real("u", "input", start=0.0), real("y", "output")]
    output = f"{COURSE} real[1] = {a} + {g} * u;"
    return make_fmu(path, variables, output=output, step="memory[0] = t;", co_simulation=SMOOTH)


def sine(path: Path, frequency: float) -> Path:
    """A source: y = sin(w t)."""
    return make_fmu(path, [real("y", "output")], output=f"real[0] = sin({frequency} * t);")


def inline(wire: str | dict[str, object]) -> str:
    """A connection as TOML."""
    if isinstance(wire, str):
        return json.dumps(wire)
    return "{" + ", ".join(f"{key} = {json.dumps(value)}" for key, value in wire.items()) + "}"


def scene(
    folder: Path, wires: list[str | dict[str, object]], names: list[str], stop: float, step: float, **settings: object
) -> Path:
    given = {"exchange": "linear", "waveform": "linear", **settings, "macro_step": step}
    lines = [
        f"stop_time = {stop}",
        f"connections = [{', '.join(map(inline, wires))}]",
        "[fmus]",
        *(f'{name} = "{name}.fmu"' for name in names),
        "[coupling]",
        *(f"{key} = {json.dumps(value)}" for key, value in given.items()),
    ]
    file = folder / "system.toml"
    file.write_text("\n".join(lines) + "\n")
    return file


PAIR = (["one.x -> two.u", "two.x -> one.u"], ["one", "two"])
CHAIN = (["source.y -> filter.u"], ["source", "filter"])
HELD = {"exchange": "held", "waveform": "held"}
EXPLICIT = {**HELD, "method": "none"}


def circuit(folder: Path, **how: object) -> None:
    """A capacitor and an inductor with a resistor: V' = I, I' = -V - 0.4 I, here with the current's sign turned."""
    both = {"units": VOLT, "model_exchange": {}, **how}
    first_order(folder / "one.fmu", "-u", 1.0, unit=("A", "V"), **both)
    first_order(folder / "two.fmu", "u - 0.4 * real[1]", 0.0, unit=("V", "A"), **both)


def healthy_circuit(folder: Path) -> Path:
    circuit(folder)
    return scene(folder, *PAIR, 4.0, 0.05)


def healthy_chain(folder: Path) -> Path:
    sine(folder / "source.fmu", 2.0)
    first_order(folder / "filter.fmu", "u - real[1]", 0.0)
    return scene(folder, *CHAIN, 3.0, 0.05)


def healthy_without_states(folder: Path) -> Path:
    """Explicit, since nothing can be set back."""
    circuit(folder, state=False)
    return scene(folder, *PAIR, 3.0, 0.005, **EXPLICIT)


def healthy_loop(folder: Path) -> Path:
    """An algebraic loop of gain 4, iterated, with a source."""
    first_order(folder / "one.fmu", "u - real[1]", 1.0)
    gain(folder / "two.fmu", "0.2", -4.0)
    return scene(folder, ["one.x -> two.u", "two.y -> one.u"], ["one", "two"], 2.0, 0.02)


def long_circuit(folder: Path) -> Path:
    circuit(folder)
    return scene(folder, *PAIR, 4.0, 0.2, **EXPLICIT)


def long_chain(folder: Path) -> Path:
    sine(folder / "source.fmu", 6.0)
    first_order(folder / "filter.fmu", "u - real[1]", 0.0)
    return scene(folder, *CHAIN, 3.0, 0.15, **HELD)


def long_dahlquist(folder: Path) -> Path:
    """Unstable above H = ln(5/3) = 0.51."""
    first_order(folder / "one.fmu", "u - real[1]", 1.0)
    gain(folder / "two.fmu", "0.0", -4.0)
    return scene(folder, ["one.x -> two.u", "two.y -> one.u"], ["one", "two"], 6.0, 0.6, **EXPLICIT)


def diverging_iteration(folder: Path) -> Path:
    gain(folder / "one.fmu", "sin(5.0 * t)", -4.0)
    gain(folder / "two.fmu", "0.1", 1.0)
    return scene(folder, ["one.y -> two.u", "two.y -> one.u"], ["one", "two"], 0.4, 0.1, **{**HELD, "method": "plain"})


def diverging_explicit(folder: Path) -> Path:
    """A loop of gain 4 at once: explicit coupling lags by a step, so that an error grows at every step."""
    gain(folder / "one.fmu", "sin(5.0 * t)", -4.0)
    gain(folder / "two.fmu", "0.1", 1.0)
    return scene(folder, ["one.y -> two.u", "two.y -> one.u"], ["one", "two"], 1.0, 0.1, **EXPLICIT)


def hidden_rollback(folder: Path) -> Path:
    """Half of the state lies in a static variable that no saved state has."""
    circuit(folder)
    forgetful = "static double kept = 0.0;"
    step = "memory[0] = t; kept += h * (real[0] - kept); real[1] += h * (kept - 0.4 * real[1]);"
    variables = [real("u", "input", start=0.0), real("x", "output", start=0.0, initial="exact")]
    make_fmu(folder / "two.fmu", variables, head=forgetful, step=step, co_simulation=SMOOTH)
    return scene(folder, *PAIR, 4.0, 0.05)


def hidden_rates(folder: Path) -> Path:
    """Output derivatives of another unit, such as per minute."""
    offered = {**SMOOTH, "maxOutputDerivativeOrder": "1"}
    first_order(folder / "one.fmu", "-u", 1.0, co_simulation=offered, rates="update(m); rate[1] = m->real[2];")
    first_order(
        folder / "two.fmu",
        "u - 0.4 * real[1]",
        0.0,
        co_simulation=offered,
        rates="update(m); rate[1] = 3.0 * m->real[2];",
    )
    return scene(folder, *PAIR, 4.0, 0.05, exchange="hermite", waveform="hermite")


def healthy_with_unused_rates(folder: Path) -> Path:
    hidden_rates(folder)
    return scene(folder, *PAIR, 4.0, 0.05)


def healthy_with_one_step_length(folder: Path) -> Path:
    fixed = {**SMOOTH, "canHandleVariableCommunicationStepSize": "false", "maxOutputDerivativeOrder": "1"}
    circuit(folder, co_simulation=fixed, rates="update(m); rate[1] = m->real[2];")
    return scene(folder, *PAIR, 4.0, 0.05)


def healthy_until_its_end(folder: Path) -> Path:
    """The filter ends the simulation after 0.4 s, as its wish."""
    sine(folder / "source.fmu", 2.0)
    ends = "if (t > 0.375) { m->terminated = 1; m->reached = t; return fmi2Discard; }" + STEP
    first_order(folder / "filter.fmu", "u - real[1]", 0.0, step=ends)
    return scene(folder, *CHAIN, 1.0, 0.05)


def failing_part(folder: Path) -> Path:
    circuit(folder)
    fails = 'LOG(fmi2Error, "no model here"); return fmi2Error;'
    first_order(folder / "two.fmu", "u - 0.4 * real[1]", 0.0, step=fails, units=VOLT, unit=("V", "A"))
    return scene(folder, *PAIR, 4.0, 0.05)


def hidden_counter(folder: Path) -> Path:
    """Takes every step for one of 0.05 s."""
    circuit(folder)
    variables = [real("u", "input", start=0.0), real("x", "output", start=0.0, initial="exact")]
    make_fmu(folder / "two.fmu", variables, step="real[1] += 0.05 * (real[0] - 0.4 * real[1]);", co_simulation=SMOOTH)
    return scene(folder, *PAIR, 4.0, 0.05)


def hidden_noise(folder: Path) -> Path:
    circuit(folder)
    noisy = (
        "memory[0] = t; fmi2Status s = integrate(m, h); real[1] += 2e-3 * (rand() / (double)RAND_MAX - 0.5); return s;"
    )
    first_order(folder / "two.fmu", "u - 0.4 * real[1]", 0.0, step=noisy, units=VOLT, unit=("V", "A"))
    return scene(folder, *PAIR, 4.0, 0.05, tolerance=1e-2)


def hidden_other_model(folder: Path) -> Path:
    """Co-simulation integrates another resistor than model exchange."""
    circuit(folder)
    resistor = "(m->interface == fmi2CoSimulation ? 0.8 : 0.4)"
    how = {"units": VOLT, "unit": ("V", "A"), "model_exchange": {}}
    first_order(folder / "two.fmu", f"u - {resistor} * real[1]", 0.0, **how)
    return scene(folder, *PAIR, 4.0, 0.05)


def hidden_held_inputs(folder: Path) -> Path:
    """Declares to interpolate inputs and holds them."""
    circuit(folder)
    held = "double u = real[0]; real[2] = u - 0.4 * real[1];"
    variables = [
        real("u", "input", start=0.0),
        real("x", "output", start=0.0, initial="exact"),
        real("der(x)", "local"),
    ]
    make_fmu(folder / "two.fmu", variables, output=held, states={"x": "der(x)"}, co_simulation=SMOOTH)
    return scene(folder, *PAIR, 4.0, 0.05)
