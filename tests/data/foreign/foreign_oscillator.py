"""m x'' + d x' + c x = F with F held over a step, solved exactly."""

import cmath

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Oscillator(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.m, self.d, self.c, self.F, self.x, self.v = 1.0, 1.0, 1.0, 0.0, 1.0, 0.0
        for name in ("m", "d", "c"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        self.register_variable(Real("F", causality=Fmi2Causality.input))
        for name in ("x", "v"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        half, rest = self.d / (2 * self.m), self.F / self.c
        pole = complex(-half, abs(cmath.sqrt(self.c / self.m - half**2)))
        x, v = self.x - rest, self.v
        # x = Re((x + i b) exp(pole t)) with v = Re(pole (x + i b))
        b = (pole.real * x - v) / pole.imag
        now = complex(x, b) * cmath.exp(pole * step_size)
        self.x, self.v = rest + now.real, (pole * now).real
        return True
