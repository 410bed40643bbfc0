"""A single FMU driven by the inputs that it saw at the start of a coupled run."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...cosim.subsystem import Port, Recorder
from ...errors import TerminationRequest
from ...scene import Member, Scene
from ...simulation import load_member, recorded_variables
from .runs import CoupledRun

__all__ = ["Case", "Course", "course_of", "until_its_end"]

_SEGMENTS = 12  # macro steps that a member is tested on: at the start, where most happens, of those of the run


@dataclass(frozen=True)
class Course:
    """Inputs that a member is driven with: times (n + 1,) [s], values (n + 1, n_u), their limits (2, n_u)."""

    times: np.ndarray
    values: np.ndarray
    limits: np.ndarray

    @property
    def varies(self) -> bool:
        """Whether any input changes."""
        return bool(np.ptp(self.values, axis=0).any()) if self.values.size else False


@dataclass(frozen=True)
class Case:
    """A member on its own, driven by a course of inputs."""

    scene: Scene
    member: Member
    course: Course

    @contextlib.contextmanager
    def opened(self) -> Iterator[Recorder]:
        """A fresh instance, initialised with the first inputs."""
        with contextlib.closing(load_member(self.scene, self.member)) as instance:
            instance.initialise(float(self.course.times[0]), self.course.values[0])
            instance.begin()
            yield instance

    def step(self, instance: Recorder, k: int, parts: int = 1, shift: float = 0.0) -> np.ndarray:
        """Step over segment k in equal parts under held inputs; the recorded variables after it.

        shift: moves the inputs by that share of their size.
        """
        polynomials = np.zeros((4, self.course.values.shape[1]))
        polynomials[0] = self.shifted(k, shift)
        begin, end = self.course.times[k : k + 2]
        length = float(end - begin) / parts
        for part in range(parts):
            instance.set_inputs(polynomials.copy())
            instance.step(float(begin) + part * length, length)
        return instance.record()

    def shifted(self, k: int, shift: float) -> np.ndarray:
        """Inputs (n_u,) of segment k, moved by a share of their size within their limits."""
        values = self.course.values[k]
        return np.clip(values * (1.0 + shift) + shift, *self.course.limits) if shift else values

    def played(self, parts: int = 1) -> np.ndarray:
        """Recorded variables (n, variables) after each segment, of a fresh instance."""
        with self.opened() as instance:
            return np.array([self.step(instance, k, parts) for k in range(self.segments)])

    @property
    def segments(self) -> int:
        """Number of macro steps."""
        return self.course.times.size - 1


def course_of(scene: Scene, member: Member, run: CoupledRun, ports: Sequence[Port]) -> Course:
    """Return the first inputs of a member in a run; ports: its inputs."""
    names = [v.name for v in recorded_variables(member)]
    rows = run.records.get(member.name)
    count = min(_SEGMENTS, max(1, run.times.size - 1))
    step = run.step if run.times.size < 2 else float(np.diff(run.times).max())
    # Steps of one length, since some FMUs take no other; inputs as they were in the run at about these times.
    times = scene.start_time + step * np.arange(count + 1)
    columns = []
    for name, start in ((port.name, port.start) for port in ports):
        if rows is None or not len(rows) or name not in names:
            columns.append(np.full(count + 1, start))
            continue
        course = rows[:, names.index(name)]
        columns.append(np.interp(times, run.times, np.where(np.isfinite(course), course, start)))
    limits = np.array([[port.least for port in ports], [port.most for port in ports]]).reshape(2, len(ports))
    return Course(times, np.array(columns).T.reshape(count + 1, len(ports)), limits)


def until_its_end(case: Case) -> Case:
    """The case with the segments before the FMU ends the simulation as its wish; all where it does not."""
    done = 0
    try:
        with case.opened() as instance:
            for k in range(case.segments):
                case.step(instance, k)
                done += 1
    except TerminationRequest:
        if not done:
            raise
        course = case.course
        return replace(case, course=replace(course, times=course.times[: done + 1], values=course.values[: done + 1]))
    return case
