"""A machine that is operated over the link."""

from __future__ import annotations

import json
import tempfile
from os import PathLike, fspath
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from ._commands import Progress, StrPath, listener, result_of
from ._findings import Error, Result
from ._native import Session
from ._table import Table, read_table


class Machine:
    """A board at a serial port, or a program that serves the link at a Unix socket: the words of ``specgen operate``.

    >>> with specgen.Machine(socket="link", spec="platform.toml") as machine:
    ...     machine.arm()
    ...     machine.wait("arming")
    ...     machine.run()
    ...     machine.wait("running")
    ...     machine.wait("arrived")
    ...     machine.move(x=0, y=0, z=5e-6, rx=0, ry=0, rz=0)
    ...     machine.wait("arrived")

    The session stays alive between two orders, in a thread of its own. The machine holds, then ramps down, when it ends
    (``supervisor.host_lost``); Ctrl-C while an order is under way, and an exception in a ``with`` block, ramp it down first.

    An order that is refused, and a fault while one waits, raise `Error`; the session goes on.
    """

    def __init__(
        self,
        *,
        socket: StrPath | None = None,
        port: StrPath | None = None,
        baud: int | None = None,
        spec: StrPath | None = None,
        progress: Progress = False,
    ) -> None:
        """With a ``spec`` a machine with another controller is refused."""
        arguments = ["operate"]
        given = {"--socket": socket, "--port": port, "--baud": baud}
        for option, value in given.items():
            if value is not None:
                arguments.append(f"{option}={fspath(value) if isinstance(value, PathLike) else value}")
        if spec is not None:
            arguments.append(fspath(spec))
        self._session: Session | None = Session(arguments, listener(progress))
        self._answers(None)

    def order(self, line: str) -> Any:
        """Gives an order as ``specgen operate`` takes it, such as ``"wait running 5"``, and returns its answer."""
        return self._answers(line)

    def _answers(self, line: str | None) -> Any:
        if self._session is None:
            raise Error("the session has ended")
        goes_on, text = self._session.answers(line)
        if not goes_on:
            self._session = None
            # Why it ended: `result_of` raises it.
            return result_of(json.loads(text)).data
        answers = json.loads(text)
        answer = answers[-1]["answer"] if answers else None
        if isinstance(answer, dict) and answer.keys() == {"error"}:
            raise Error(answer["error"])
        return answer

    def status(self) -> dict[str, Any]:
        """Tick, phase (``stands``), status, late ticks, health."""
        status: dict[str, Any] = self.order("status")
        return status

    def arm(self) -> None:
        """Switches the amplifiers on; from then on the machine may `run`."""
        self.order("arm")

    def run(self) -> None:
        """Goes to the bias pose, or goes on after a hold."""
        self.order("run")

    def hold(self) -> None:
        """Keeps the set-point."""
        self.order("hold")

    def ramp_down(self) -> None:
        """Leads the voltages to rest, and switches the amplifiers off."""
        self.order("ramp-down")

    def acknowledge(self) -> None:
        """Acknowledges a fault."""
        self.order("acknowledge")

    def wait(self, until: str | float, limit: float | None = None) -> None:
        """Until a phase such as ``"running"``, until it has ``"arrived"``, or some seconds; at most ``limit`` seconds."""
        self.order(f"wait {until}" if limit is None else f"wait {until} {limit}")

    def move(self, **axes: float | str) -> list[float]:
        """Moves to a pose, and returns it, m and rad: ``x``, ``y``, ``z``, ``rx``, ``ry``, ``rz``, as numbers or with a unit,
        ``z="5um"``. Axes that are not given stay; the first move of a session gives all six."""
        return self._go("move", axes)

    def jog(self, **axes: float | str) -> list[float]:
        """Moves by so much."""
        return self._go("jog", axes)

    def _go(self, order: str, axes: dict[str, float | str]) -> list[float]:
        answer = self.order(" ".join([order, *_quantities(axes)]))
        return [float(part) for part in answer["pose"]]

    def can_go(self, *, speed: str | None = None, **axes: float | str) -> str | None:
        """None if it can go there, or what binds; nothing moves. With a ``speed``, ``"1 mm/s"`` or ``"1 mrad/s"``, at that at least."""
        words = [] if speed is None else [f"speed={speed.replace(' ', '')}"]
        binds: str | None = self.order(" ".join(["can-i-go", *_quantities(axes), *words]))["binds"]
        return binds

    def frame(self, kind: str | None = None, **axes: float | str) -> dict[str, Any]:
        """Frames in force, um and urad; with ``"work"`` or ``"tool"`` and axes (0 if not given) poses are said in that one from here on,
        with ``"none"`` in that of the spec."""
        words = [] if kind is None else [kind, *_quantities(axes)]
        frame: dict[str, Any] = self.order(" ".join(["frame", *words]))
        return frame

    def where(self) -> dict[str, Any]:
        """Pose by the gauges, set-point and error, um and urad; voltage commanded for each leg, V. What is not measured now is None; ``last`` then has
        the pose of then and its age, s, and ``why`` the reason."""
        where: dict[str, Any] = self.order("where")
        return where

    def limits(self) -> list[list[float]]:
        """Least and largest value of each axis from here, the others staying, um and urad."""
        limits: list[list[float]] = self.order("limits")["limits"]
        return limits

    def mark(self, name: str) -> None:
        """Gives the set-point a name for this session."""
        self.order(f"mark {name}")

    def goto(self, name: str) -> None:
        """Goes to a mark, or to ``"zero"``."""
        self.order(f"goto {name}")

    def play(self, trajectory: str, *, correction: StrPath | None = None, machine: str | None = None) -> dict[str, Any] | None:
        """Plays a trajectory of the spec; under a ``correction`` that `learn` wrote for it on this ``machine``, with its error, nm and
        nrad rms."""
        words = ["play", trajectory]
        if correction is not None:
            words += [f"correction={fspath(correction)}", f"machine={machine}"]
        played = self.order(" ".join(words))
        return played if isinstance(played, dict) else None

    def gains(self, **gains: float) -> dict[str, Any]:
        """Gains in force; sets those that are given first, in SI: ``machine.gains(**{"ki[2]": 1e9})``. Those that
        the margins of the spec do not bear raise `Error`."""
        words = [f"{name}={float(value)!r}" for name, value in gains.items()]
        found: dict[str, Any] = self.order(" ".join(["gains", *words]))
        return found

    def output_line(self, line: int, **settings: float | str) -> None:
        """Lets an output line (``[[trigger]]``) show something else: ``machine.output_line(0, kind="position", step=1e-6)``, in SI."""
        words = [f"{name}={value if isinstance(value, str) else repr(value)}" for name, value in settings.items()]
        self.order(" ".join(["trigger", str(line), *words]))

    def watch(self, seconds: float, *, every: int = 1000) -> Table:
        """Samples of the running machine for so long: least, mean and largest value over ``every`` ticks. Gaps are rows that are not
        there."""
        with tempfile.TemporaryDirectory(prefix="specgen-python-") as folder:
            file = Path(folder, "samples.csv")
            self.order(f"watch {every} {float(seconds)!r} {file}")
            return read_table(file)

    def mode(self, mode: str) -> None:
        """Terms of the law, such as ``"pf-pcc"``."""
        self.order(f"mode {mode}")

    def set(self, **words: float) -> None:
        """Sets input words: ``machine.set(**{"setpoint[2]": 1e-6, "command": 2})``."""
        self.order("set " + " ".join(f"{name}={value!r}" for name, value in words.items()))

    def settings(self) -> dict[str, float]:
        """Settings in force."""
        settings: dict[str, float] = self.order("config")
        return settings

    def write_settings(self, spec: StrPath) -> None:
        """Takes the settings of a spec; its tables stay in the spec."""
        self.order(f"config write {fspath(spec)}")

    def wave(self, file: StrPath | None) -> None:
        """Starts the wave of a file; None ends the one under way."""
        self.order("wave stop" if file is None else f"wave {fspath(file)}")

    def record(self, after: int | None = None) -> dict[str, Any]:
        """Starts the recorder, which keeps ``after`` ticks after its trigger."""
        recorder: dict[str, Any] = self.order("record arm" if after is None else f"record arm {after}")
        return recorder

    def trigger(self) -> dict[str, Any]:
        """Triggers the recorder."""
        return self.recorder("trigger")

    def recorder(self, action: str = "look") -> dict[str, Any]:
        """How the recorder stands; ``"stop"`` stops it first, ``"trigger"`` triggers it."""
        recorder: dict[str, Any] = self.order(f"record {action}")
        return recorder

    def stop(self) -> None:
        """Ramps down and ends the program that serves the link; a board only ramps down, and raises `Error`."""
        self.order("stop")

    def download(self, file: StrPath) -> None:
        """Writes the recording to a file, for `replay`."""
        self.order(f"record download {fspath(file)}")

    def close(self, *, ramp_down: bool = False) -> Result | None:
        """Ends the session; with ``ramp_down`` only when the amplifiers are off. How the machine stood, or None if it had ended."""
        session, self._session = self._session, None
        document = session.close(ramp_down) if session is not None else None
        if document is None:
            return None
        decoded = json.loads(document)
        if ramp_down and decoded["exit_code"] == 130 and decoded["result"] is not None:
            return Result(decoded["result"], [], None)
        return result_of(decoded)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close(ramp_down=error is not None)


def _quantities(axes: dict[str, float | str]) -> list[str]:
    """Words of an order: numbers get the unit of their axis."""

    def value(axis: str, given: float | str) -> str:
        if isinstance(given, str):
            return given.replace(" ", "")
        return f"{float(given)!r}{'m' if axis in ('x', 'y', 'z') else 'rad'}"

    return [f"{axis}={value(axis, given)}" for axis, given in axes.items()]
