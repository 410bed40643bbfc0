"""Tests of a single FMU against what its interface promises, on the inputs that it saw in the coupled run.

Everything is compared in the recorded variables (Real inputs and outputs), as shares of their ranges.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...errors import CosimError, TerminationRequest
from ...scene import Member, Scene
from ...simulation import load_member, recorded_variables
from .case import Case, course_of, until_its_end
from .convergence import scales_of
from .runs import CoupledRun

__all__ = ["Check", "check_member"]

_ROUNDING = 1e-9  # share of the range: deviations below are rounding
_ROLLBACK = 1e-6  # share of the range above which a restored state is taken to be another one
_RATES = 0.02  # largest relative deviation of a rate from differences
_DIFFERENCE = 1e-3  # step of differences over the macro step
_STEPS = 1e-3  # share of the range by which a result may depend on how steps are divided
_SHRINKS = 0.7  # ratio of differences below which they vanish with the step
_SHIFT = 0.01  # share by which inputs are moved for steps that are taken back or set anew
_SUBSTEPS = 16  # held steps that an interpolated input is compared with


@dataclass(frozen=True)
class Check:
    """One test of one FMU.

    passed: None where it does not apply; deviation: what was found, share of the range; text: in words.
    """

    name: str
    passed: bool | None
    text: str
    deviation: float = 0.0

    @property
    def fatal(self) -> bool:
        """Whether the FMU cannot be loaded or stepped at all."""
        return self.name in ("loads", "steps alone")


def check_member(scene: Scene, member: Member, run: CoupledRun) -> list[Check]:
    """Test one member of a scene on the inputs of a run; a run that failed at once leaves the start values."""
    try:
        with contextlib.closing(load_member(scene, member)) as instance:
            ports = instance.inputs
            traits = (instance.can_rollback, instance.has_rates, instance.takes_polynomials)
    except CosimError as error:
        return [Check("loads", False, f"cannot be loaded: {error}", np.inf)]
    case = Case(scene, member, course_of(scene, member, run, ports))
    try:
        case = until_its_end(case)
        base = case.played()
    except CosimError as error:
        return [
            Check("loads", True, "loads and initialises"),
            Check("steps alone", False, f"fails alone on inputs of the coupled run: {error}", np.inf),
        ]
    variables = recorded_variables(member)
    scales = np.array(
        [scale for scale, _ in scales_of([v.name for v in variables], [v.nominal for v in variables], base)]
    )
    checks = [Check("loads", True, "loads, initialises and steps")]
    tests: list[tuple[str, bool, str, Callable[[], Check]]] = [
        ("determinism", True, "", lambda: _determinism(case, base, scales)),
        ("order of calls", True, "", lambda: _order_of_calls(case, base, scales)),
        ("rollback", traits[0], "offers no saved states", lambda: _rollback(case, scales)),
        (
            "rates",
            all(traits[:2]) and _varies_steps(member),
            "offers no output derivatives, or no short steps to compare them with",
            lambda: _rates(case, scales),
        ),
        ("step size", True, "", lambda: _step_size(case, base, scales)),
        ("input derivatives", traits[2], "takes held inputs only", lambda: _input_derivatives(case, scales)),
    ]
    for name, applies, otherwise, test in tests:
        if not applies:
            checks.append(Check(name, None, otherwise))
            continue
        try:
            checks.append(test())
        except TerminationRequest as request:  # with shorter steps it may end earlier than in the run
            checks.append(Check(name, None, f"cut short: the FMU ends the simulation at t = {request.reached:.6g} s"))
        except CosimError as error:
            checks.append(Check(name, False, f"fails: {error}", np.inf))
    return checks


def _varies_steps(member: Member) -> bool:
    """Whether a member takes steps of any length."""
    interface = member.archive.description.co_simulation
    return interface is None or bool(interface.takes_variable_steps)


def _deviation(a: np.ndarray, b: np.ndarray, scales: np.ndarray) -> float:
    """Largest difference over the scale of each variable; inf where one is finite and the other is not."""
    with np.errstate(invalid="ignore"):
        gaps = np.where(np.isfinite(a) & np.isfinite(b), np.abs(a - b) / scales, np.inf)
    return float(np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, gaps).max(initial=0.0))


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} % of the range"


def _determinism(case: Case, base: np.ndarray, scales: np.ndarray) -> Check:
    """Same calls, same results: again alone, and as two instances whose steps alternate."""
    again = _deviation(case.played(), base, scales)
    if again > _ROUNDING:
        text = f"the same calls give other results, {_percent(again)} apart: random numbers, clocks or memory never set"
        return Check("determinism", False, text, again)
    single = case.member.archive.description.co_simulation
    if single is not None and single.once_per_process:
        return Check("determinism", True, "the same calls give the same results; one instance per process")
    with case.opened() as first, case.opened() as second:
        rows = np.array([(case.step(first, k), case.step(second, k)) for k in range(case.segments)])
    beside = max(_deviation(rows[:, 0], base, scales), _deviation(rows[:, 1], base, scales))
    if beside > _ROUNDING:
        text = f"two instances disturb each other, by {_percent(beside)}: they share memory, such as static variables"
        return Check("determinism", False, text, beside)
    same = "bitwise" if again == beside == 0.0 else "to rounding"
    return Check("determinism", True, f"the same calls give the same results {same}, beside another instance too")


def _order_of_calls(case: Case, base: np.ndarray, scales: np.ndarray) -> Check:
    """Outputs read twice are equal, and of inputs set twice before a step the last count."""
    twice, worst = 0.0, 0.0
    with case.opened() as instance:
        for k in range(case.segments):
            wrong = np.zeros((4, case.course.values.shape[1]))
            wrong[0] = case.shifted(k, _SHIFT)
            instance.set_inputs(wrong)
            record = case.step(instance, k)
            twice = max(twice, _deviation(instance.record(), record, scales))
            worst = max(worst, _deviation(record, base[k], scales))
    if twice > 0.0:
        return Check("order of calls", False, f"reading outputs changes them, by {_percent(twice)}", twice)
    if worst > _ROUNDING:
        text = f"setting inputs twice before a step leaves a trace of the first values, {_percent(worst)}"
        return Check("order of calls", False, text, worst)
    return Check("order of calls", True, "reading outputs changes nothing; of inputs set twice the last count")


def _rollback(case: Case, scales: np.ndarray) -> Check:
    """Save, step on, restore, step with other inputs, restore, step on: the same two results again."""
    worst, bitwise = 0.0, True
    with case.opened() as instance:
        for k in range(case.segments - 1 if case.segments > 1 else 1):
            pair = range(k, min(k + 2, case.segments))
            state = instance.save()
            first = np.array([case.step(instance, j) for j in pair])
            instance.restore(state)
            case.step(instance, k, shift=_SHIFT)
            instance.restore(state)
            second = np.array([case.step(instance, j) for j in pair])
            instance.restore(state)
            instance.free(state)
            worst = max(worst, _deviation(second, first, scales))
            bitwise = bitwise and np.array_equal(first, second, equal_nan=True)
            case.step(instance, k)
    if worst > _ROLLBACK:
        text = f"a restored state steps on differently, by {_percent(worst)}: not all of the state is saved"
        return Check("rollback", False, text, worst)
    return Check("rollback", True, "bitwise" if bitwise else f"to {_percent(worst)}, not bitwise", worst)


def _rates(case: Case, scales: np.ndarray) -> Check:
    """Output derivatives against differences of short steps under held inputs."""
    worst, where = 0.0, ""
    span = float(case.course.times[-1] - case.course.times[0])
    names = [v.name for v in recorded_variables(case.member)]
    with case.opened() as instance:
        if not instance.outputs:
            return Check("rates", None, "no output is connected")
        columns = [names.index(port.name) for port in instance.outputs if port.name in names]
        wired = [k for k, port in enumerate(instance.outputs) if port.name in names]
        size = scales[columns]
        for k in range(case.segments):
            case.step(instance, k)
            time, length = float(case.course.times[k + 1]), float(np.diff(case.course.times).min())
            before, rates = instance.values(), instance.rates()
            state = instance.save()
            polynomials = np.zeros((4, case.course.values.shape[1]))
            polynomials[0] = case.course.values[k]
            quotients = []
            for part in (1.0, 0.5):
                short = part * _DIFFERENCE * length
                instance.set_inputs(polynomials.copy())
                instance.step(time, short)
                quotients.append((instance.values() - before) / short)
                instance.restore(state)
            instance.free(state)
            estimate = 2.0 * quotients[1] - quotients[0]  # of second order in the short step
            noise = 1e-14 * np.abs(before) / (_DIFFERENCE * length) + np.abs(quotients[1] - quotients[0])
            gaps = np.abs(rates - estimate)[wired]
            limit = np.maximum(np.abs(estimate[wired]), size / span)
            off = np.where(gaps > 10.0 * noise[wired], gaps / limit, 0.0)
            if off.max(initial=0.0) > worst:
                worst = float(off.max())
                where = instance.outputs[wired[int(off.argmax())]].name
    if worst > _RATES:
        text = f"the derivative of {where} is off by {100.0 * worst:.2g} % of what differences of its values show"
        return Check("rates", False, text, worst)
    return Check("rates", True, f"agree with differences to {100.0 * worst:.2g} %", worst)


def _step_size(case: Case, base: np.ndarray, scales: np.ndarray) -> Check:
    """Under held inputs, steps of h, h/2 and h/4 must lead to the same result, or to one limit."""
    halves, quarters = case.played(2), case.played(4)
    counts = [
        _is_count(base[:, j]) and _is_count(halves[:, j]) and not np.array_equal(base[:, j], halves[:, j])
        for j in range(base.shape[1])
    ]
    kept = ~np.array(counts, dtype=bool)
    first = _deviation(base[:, kept], halves[:, kept], scales[kept])
    second = _deviation(halves[:, kept], quarters[:, kept], scales[kept])
    if first <= _STEPS:
        return Check(
            "step size", True, f"the result does not depend on how steps are divided ({_percent(first)})", first
        )
    if second > _SHRINKS * first:  # an event that moves with the steps may hide that differences vanish: look further
        halves, quarters = quarters, case.played(8)
        second = min(second, _deviation(halves[:, kept], quarters[:, kept], scales[kept]))
    if second <= _SHRINKS * first:
        text = (
            f"its own integration depends on the step: {_percent(first)} between h and h/2, {_percent(second)} between "
            "h/2 and h/4; its own steps follow the macro step"
        )
        return Check("step size", True, text, first)
    text = (
        f"the result depends on the number of steps: {_percent(first)} between h and h/2, {_percent(second)} between "
        "h/2 and h/4 under the same inputs; it counts calls instead of time, or is noisy"
    )
    return Check("step size", False, text, second)


def _is_count(course: np.ndarray) -> bool:
    return bool(np.array_equal(course, np.round(course)) and (np.diff(course) >= 0.0).all() and np.ptp(course) > 0.0)


def _input_derivatives(case: Case, scales: np.ndarray) -> Check:
    """Linear inputs over a step against many short steps with held inputs at their middles."""
    if not case.course.varies or case.segments < 2:
        return Check("input derivatives", None, "its inputs do not vary in the run")
    values, times = case.course.values, case.course.times
    with case.opened() as linear, case.opened() as held, case.opened() as fine:
        rows = []
        for k in range(case.segments):
            begin, length = float(times[k]), float(times[k + 1] - times[k])
            polynomials = np.zeros((4, values.shape[1]))
            polynomials[:2] = values[k], (values[k + 1] - values[k]) / length
            linear.set_inputs(polynomials)
            linear.step(begin, length)
            case.step(held, k)
            part = length / _SUBSTEPS
            for j in range(_SUBSTEPS):
                middle = np.zeros((4, values.shape[1]))
                middle[0] = values[k] + (j + 0.5) / _SUBSTEPS * (values[k + 1] - values[k])
                fine.set_inputs(middle)
                fine.step(begin + j * part, part)
            rows.append((linear.record(), held.record(), fine.record()))
    names = [v.name for v in recorded_variables(case.member)]
    outputs = [j for j, name in enumerate(names) if case.member.archive.variables[name].causality == "output"]
    at = np.array(rows)[:, :, outputs]
    counts = [_is_count(at[:, 2, j]) for j in range(len(outputs))]
    at, size = at[:, :, ~np.array(counts, dtype=bool)], scales[outputs][~np.array(counts, dtype=bool)]
    used, ignored = _deviation(at[:, 0], at[:, 2], size), _deviation(at[:, 1], at[:, 2], size)
    if ignored > _STEPS and np.array_equal(at[:, 0], at[:, 1]):
        text = (
            f"are ignored though canInterpolateInputs = true: inputs are held, which costs {_percent(ignored)} per step"
        )
        return Check("input derivatives", False, text, ignored)
    if used > _STEPS and used > 0.5 * ignored:
        text = f"linear inputs lead {_percent(used)} away from short steps, held ones {_percent(ignored)}"
        return Check("input derivatives", False, text, used)
    return Check("input derivatives", True, f"agree with short steps to {_percent(used)}", used)
