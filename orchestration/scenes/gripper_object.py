"""An object between two fingertips, an FMU written in Python: it slides along x and pushes back where it is touched.

    m x'' + d x' = f(left) - f(right),   f(e) = k e for a penetration e > w, smooth from 0 on, 0 where nothing touches

Each fingertip is known by its position along its own x axis, from its own base towards the other finger. Backward Euler
in substeps of constant length, Newton's method in each.
"""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class GripperObject(Fmi2Slave):
    """Object of half width `half_width` between fingers whose bases are `gap` apart; SI units."""

    def __init__(self, **kwargs):
        """Register parameters, inputs, outputs and states."""
        super().__init__(**kwargs)
        parameters = {
            "stiffness": 100.0,  # k [N/m]
            "mass": 2e-3,  # m [kg]
            "friction": 0.5,  # d [N.s/m]
            "gap": 40e-3,  # between the bases [m]
            "half_width": 8e-3,  # of the object [m]
            "finger_radius": 5e-3,  # [m]
            "smoothing": 0.1e-3,  # w, penetration over which contact sets in [m]
            "substep": 2e-3,  # [s]
        }
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        for name, value in parameters.items():
            setattr(self, name, value)
            self.register_variable(Real(name, **fixed))
        for name, causality in (
            ("left", Fmi2Causality.input),
            ("right", Fmi2Causality.input),
            ("force_left", Fmi2Causality.output),  # on the left fingertip, along its x [N]
            ("force_right", Fmi2Causality.output),
            ("x", Fmi2Causality.output),  # from the middle towards the right finger [m]
            ("v", Fmi2Causality.output),
        ):
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=causality))
        for name in ("left_before", "right_before"):  # fingertips at the end of the last step: part of the state
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.local))

    def exit_initialization_mode(self):
        """Evaluate the forces at the start."""
        self.left_before, self.right_before = self.left, self.right
        self._evaluate()

    def do_step(self, current_time, step_size):
        """Advance the object; the fingertips move evenly to where the inputs put them at the end of the step."""
        count = max(1, round(step_size / self.substep))
        ends = self.left, self.right
        ways = ends[0] - self.left_before, ends[1] - self.right_before
        for k in range(1, count + 1):
            rest = 1.0 - k / count
            self.left, self.right = ends[0] - rest * ways[0], ends[1] - rest * ways[1]
            self._substep(step_size / count)
        self.left, self.right = self.left_before, self.right_before = ends
        self._evaluate()
        return True

    def _substep(self, h):
        v = self.v
        for _ in range(50):
            left, right = self._contact(self.x + h * v)
            residual = self.mass * (v - self.v) + h * (self.friction * v - left[0] + right[0])
            change = residual / (self.mass + h * self.friction + h * h * (left[1] + right[1]))
            v -= change
            if abs(change) < 1e-14 + 1e-12 * abs(v):
                break
        self.v = v
        self.x += h * v

    def _evaluate(self):
        left, right = self._contact(self.x)
        self.force_left, self.force_right = -left[0], -right[0]

    def _contact(self, x):
        """Force [N] and its slope in the penetration [N/m] at both sides of an object at x."""
        free = self.gap / 2 - self.half_width - self.finger_radius
        return self._law(self.left - free - x), self._law(self.right - free + x)

    def _law(self, penetration):
        k, w = self.stiffness, self.smoothing
        if penetration <= 0.0:
            return 0.0, 0.0
        if penetration < w:
            return 0.5 * k * penetration**2 / w, k * penetration / w
        return k * (penetration - 0.5 * w), k
