"""y = u for FMI 3.0."""

from pythonfmu3 import Float64, Fmi3Causality, Fmi3Slave, Fmi3StepResult


class Third(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.y = 0.0, 0.0
        self.register_variable(Float64("u", causality=Fmi3Causality.input))
        self.register_variable(Float64("y", causality=Fmi3Causality.output))

    def do_step(self, current_time, step_size):
        self.y = self.u
        return Fmi3StepResult()
