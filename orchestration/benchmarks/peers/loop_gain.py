"""Source of an FMU for PythonFMU: y = a + g u, with direct feedthrough."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Gain(Fmi2Slave):
    """y = a + g u."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.a, self.g, self.u, self.y = 0.0, 1.0, 0.0, 0.0
        for name in ("a", "g"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        """Compute the output."""
        self.y = self.a + self.g * self.u
        return True
