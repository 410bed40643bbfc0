"""The verdict on a coupled system from all tests."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...errors import CosimError, SceneError
from ...scene import Member, Scene
from ...scene.manipulator import ROD
from ...simulation import recorded_variables
from .contract import Check, check_member
from .convergence import SignalVerdict, assess_signal, common_rows, scales_of
from .energy import PowerBond, power_bonds
from .loops import LoopReport, report_loops
from .runs import CoupledRun, run_with_step

__all__ = ["REFINEMENTS", "VERDICTS", "Comparison", "Verification", "verify"]

REFINEMENTS = (1.0, 0.5, 0.25)  # macro steps over that of the scene
FINER = 0.125  # the same of a further run, where these leave a doubt
VERDICTS = {
    "healthy": "The result can be trusted within the tolerance.",
    "step too long": "The coupling works, but the macro step is too long for the tolerance.",
    "diverging": "The coupling fails or does not settle, whatever the macro step.",
    "failing": "A part cannot be loaded or run, so that there is no result.",
    "hidden error": "A part breaks what its interface promises, so the result may be wrong without a sign of it.",
}
_MONOLITH_TOLERANCE = 1e-9  # of the monolith's integrator


@dataclass(frozen=True)
class Comparison:
    """Difference of the finest run to the monolith: per output the share of its range; empty where there is none.

    agrees: None where no monolith could be solved; text: in words.
    """

    agrees: bool | None
    differences: Mapping[str, float]
    text: str


@dataclass(frozen=True)
class Verification:
    """Results of all tests of a system.

    Parameters
    ----------
    scene : Scene
        The system.
    tolerance : float
        Error allowed, share of the range of each output.
    runs : tuple of CoupledRun
        Runs with H, H/2, H/4, and with H/8 where these leave a doubt.
    checks : mapping of str to list of Check
        Tests of each FMU.
    loops : LoopReport
        Loops, gain, residual.
    signals : tuple of SignalVerdict
        Every output.
    bonds : tuple of PowerBond
        Power bonds.
    monolith : Comparison
        Difference to the monolith.
    verdict : str
        Key of VERDICTS.
    reasons : tuple of str
        Why, the weightiest first.
    """

    scene: Scene
    tolerance: float
    runs: tuple[CoupledRun, ...]
    checks: Mapping[str, list[Check]]
    loops: LoopReport
    signals: tuple[SignalVerdict, ...]
    bonds: tuple[PowerBond, ...]
    monolith: Comparison
    verdict: str
    reasons: tuple[str, ...]

    @property
    def trusted(self) -> bool:
        """Whether the result can be trusted."""
        return self.verdict == "healthy"


def verify(scene: Scene, tolerance: float = 0.01, status: Callable[[str], None] = lambda text: None) -> Verification:
    """Verify a coupled system.

    Parameters
    ----------
    scene : Scene
        Any scene; its own macro step is H.
    tolerance : float
        Error allowed in every output, share of its range.
    status : callable
        Called with a few words before each test.

    Returns
    -------
    Verification

    Raises
    ------
    SceneError
        Where the scene leaves its models open (fidelity.level = "auto").
    """
    if scene.accuracy.level == "auto":
        raise SceneError(f"{scene.name}: fidelity.level = 'auto': verify a choice; set fidelity.level = 'given'")
    step = scene.coupling.macro_step
    runs = []
    for share in REFINEMENTS:
        status(f"run with a macro step of {share * step:.3g} s")
        runs.append(run_with_step(scene, share * step))
    checks = {}
    for member in scene.members:
        status(f"contract of {member.name}")
        longest = max(runs, key=lambda run: run.times.size * run.step)
        checks[member.name] = check_member(scene, member, runs[0] if runs[0].complete else longest)
    status("loops")
    loops = report_loops(scene, runs[0])
    signals = _signals(scene, runs, tolerance)
    doubtful = not all(run.complete for run in runs) or any(signal.kind == "unsettled" for signal in signals)
    if doubtful and runs[-1].complete:
        finer = FINER * step
        status(f"run with a macro step of {finer:.3g} s")
        runs.append(run_with_step(scene, finer))
        signals = (
            _refined(signals, _signals(scene, runs[-3:], tolerance), runs[-3].step) if runs[-1].complete else signals
        )
    bonds = tuple(power_bonds(scene, runs, tolerance))
    status("monolith")
    monolith = _compare_with_monolith(scene, runs, signals, tolerance)
    verdict, reasons = _judge(scene, runs, checks, loops, signals, bonds, monolith)
    return Verification(scene, tolerance, tuple(runs), checks, loops, signals, bonds, monolith, verdict, tuple(reasons))


def _outputs(scene: Scene) -> list[tuple[Member, int, str, bool]]:
    """Member, column and name of every recorded output, and whether it is not Real."""
    return [
        (member, k, f"{member.name}.{v.name}", v.type != "Real")
        for member in scene.members
        for k, v in enumerate(recorded_variables(member))
        if v.causality == "output"
    ]


def _signals(scene: Scene, runs: list[CoupledRun], tolerance: float) -> tuple[SignalVerdict, ...]:
    complete = [run for run in runs if run.complete]
    if not complete or (not runs[-1].complete and len(complete) < 2):
        return ()
    rows = common_rows(complete)
    step = runs[0].step
    verdicts = []
    for member in scene.members:
        variables = recorded_variables(member)
        courses = [run.records[member.name][row] for run, row in zip(complete, rows, strict=True)]
        sizes = scales_of([v.name for v in variables], [v.nominal for v in variables], courses[-1])
        verdicts += [
            assess_signal(
                f"{member.name}.{v.name}",
                v.unit,
                [course[:, k] for course in courses],
                step,
                tolerance,
                v.type != "Real",
                sizes[k],
            )
            for k, v in enumerate(variables)
            if v.causality == "output"
        ]
    return tuple(verdicts)


def _refined(
    first: tuple[SignalVerdict, ...], second: tuple[SignalVerdict, ...], half: float
) -> tuple[SignalVerdict, ...]:
    """The verdicts of three runs; of three finer ones, from the step `half` [s] on, for outputs that did not settle."""
    if not first:
        first = second
    merged = []
    for coarse, fine in zip(first, second, strict=True):
        if coarse.kind not in ("unsettled", "unknown", "step") or math.isfinite(coarse.error):
            merged.append(coarse)
        elif fine.kind == "settled":
            text = f"settles with shorter steps only: {fine.text}"
            merged.append(replace(fine, kind="step", error=math.inf, needed=half, text=text))
        else:
            merged.append(fine)
    return tuple(merged)


def _compare_with_monolith(
    scene: Scene, runs: list[CoupledRun], signals: tuple[SignalVerdict, ...], tolerance: float
) -> Comparison:
    missing = [m.name for m in scene.members if not _has_model_exchange(m)]
    if missing:
        return Comparison(None, {}, f"not solved: {', '.join(missing)} cannot be solved as model exchange")
    if not runs[-1].complete:
        return Comparison(None, {}, "not solved: the finest run did not reach its end")
    from .. import monolith  # its solver takes long to load

    fine = runs[-1]
    grid = fine.times[common_rows([runs[0], fine])[1]] if runs[0].complete else fine.times
    try:
        whole = monolith.closed_inside(scene)
        with monolith.assembled(whole) as system:
            logs = monolith.integrate(whole, system, _MONOLITH_TOLERANCE, grid)
    except CosimError as error:
        return Comparison(None, {}, f"not solved: {error}")
    other = CoupledRun(
        fine.step,
        np.array([log.time for log in logs]),
        {name: np.array([log.record[name] for log in logs]) for name in logs[0].record},
    )
    rows = common_rows([fine, other])
    differences, wrong = {}, []
    for (member, k, name, discrete), signal in zip(_outputs(scene), signals, strict=False):
        if discrete or signal.kind in ("count", "unknown"):
            continue
        gap = fine.records[member.name][rows[0], k] - other.records[member.name][rows[1], k]
        gap = gap[np.isfinite(gap)]  # the monolith leaves out what it cannot know
        share = float(np.sqrt(np.mean(np.square(gap)))) / signal.scale if gap.size else 0.0
        differences[name] = share
        estimate = signal.fine_error if math.isfinite(signal.fine_error) else 0.0
        if signal.kind != "unsettled" and not share <= max(tolerance, 5.0 * estimate):
            wrong.append(name)
    if wrong:
        worst = max(wrong, key=differences.__getitem__)
        return Comparison(
            False,
            differences,
            f"{worst} lies {100.0 * differences[worst]:.2g} % of its range from the monolith, more than its error "
            f"estimate allows ({len(wrong)} outputs do)",
        )
    worst_share = max(differences.values(), default=0.0)
    return Comparison(True, differences, f"the run with H/4 agrees with it to {100.0 * worst_share:.2g} % of the range")


def _has_model_exchange(member: Member) -> bool:
    quasi_static = member.archive.description.model_name == ROD and member.value("dynamic") is False
    return quasi_static or member.archive.description.model_exchange is not None


def _matters(scene: Scene, check: Check, loops: LoopReport) -> bool:
    """Whether a scene uses what a test found broken."""
    coupling = scene.coupling
    if check.name == "rollback":
        return coupling.control != "fixed" or bool(loops.members and coupling.method != "none")
    if check.name == "rates":
        used = [coupling.forward, *([coupling.torn] if loops.members else [])]
        return any(method.uses_rates for method in used)
    if check.name == "input derivatives":
        return coupling.forward.order > 1 or coupling.torn.order > 1
    return True


def _judge(
    scene: Scene,
    runs: list[CoupledRun],
    checks: Mapping[str, list[Check]],
    loops: LoopReport,
    signals: tuple[SignalVerdict, ...],
    bonds: tuple[PowerBond, ...],
    monolith: Comparison,
) -> tuple[str, list[str]]:
    """The verdict and its reasons, the weightiest first."""
    failing = [f"{name}: {c.text}" for name, each in checks.items() for c in each if c.passed is False and c.fatal]
    wrong = [(name, c) for name, each in checks.items() for c in each if c.passed is False and not c.fatal]
    broken = [f"{name}: {c.name}: {c.text}" for name, c in wrong if _matters(scene, c, loops)]
    unused = [
        f"{name}: {c.name}: {c.text} (not used in this scene)" for name, c in wrong if not _matters(scene, c, loops)
    ]
    open_bonds = [f"{bond.forward}, {bond.backward}: {bond.text}" for bond in bonds if not bond.closed]
    apart = [f"monolith: {monolith.text}"] if monolith.agrees is False else []
    failed = [f"the run with a macro step of {run.step:.3g} s fails: {run.failure}" for run in runs if not run.complete]
    unsettled = [f"{s.name}: {s.text}" for s in signals if s.kind == "unsettled"]
    too_long = sorted((s for s in signals if s.kind == "step"), key=lambda s: -s.error)
    long_texts = [f"{s.name}: {s.text}" for s in too_long]
    if failing and not runs[-1].complete:
        return "failing", [*failing, *failed]
    if broken or apart or open_bonds:
        return "hidden error", [*broken, *apart, *open_bonds, *failed, *unsettled, *long_texts, *unused]
    if all(not run.complete for run in runs) or not runs[-1].complete or unsettled:
        return "diverging", [*failed, f"loops: {loops.text}", *unsettled, *long_texts, *unused]
    if failed or too_long:
        needed = [s.needed for s in too_long if math.isfinite(s.needed)]
        advice = [f"take coupling.macro_step = {min(needed):.2g} s or less"] if needed else []
        return "step too long", [*advice, *failed, *long_texts, *unused]
    return "healthy", [f"loops: {loops.text}", f"monolith: {monolith.text}", *unused]
