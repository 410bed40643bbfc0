"""PI control of a voltage: u = clip(k e + i, 0, most), i' = k e / t_i, e = setpoint - measured."""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real


class Controller(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.k, self.t_i, self.most = 0.05, 4.0, 3.0
        self.setpoint, self.measured, self.on, self.channel = 298.15, 298.15, True, 1
        self.integral, self.u = 0.0, 0.0
        for name in ("k", "t_i", "most"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        for name in ("setpoint", "measured"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        discrete = {"causality": Fmi2Causality.input, "variability": Fmi2Variability.discrete}
        self.register_variable(Boolean("on", **discrete))
        self.register_variable(Integer("channel", **discrete))
        self.register_variable(Real("u", causality=Fmi2Causality.output))
        self.register_variable(Real("integral", causality=Fmi2Causality.local))

    def do_step(self, current_time, step_size):
        error = self.setpoint - self.measured if self.on and self.channel == 1 else 0.0
        wanted = self.k * error + self.integral + step_size * self.k * error / self.t_i
        self.u = min(max(wanted, 0.0), self.most)
        if wanted == self.u:  # no wind-up
            self.integral += step_size * self.k * error / self.t_i
        return True
