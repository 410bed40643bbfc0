"""y = a + g u: no state, direct feedthrough, computed in the step alone."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real, String


class Gain(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.a, self.g, self.u, self.y, self.label = 0.0, 1.0, 0.0, 0.0, "plain"
        for name in ("a", "g"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        label = String("label", causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed)
        self.register_variable(label)
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        if self.label == "broken":
            raise ValueError("a broken part")
        if step_size <= 0.0 or (self.label == "short" and step_size > 0.03):
            return False
        self.y = self.a + self.g * self.u
        return True
