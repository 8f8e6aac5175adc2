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
    """A board at a serial port, or a program that serves the link at a Unix socket: the commands of ``specgen operate``.

    >>> with specgen.Machine(socket="link", spec="platform.toml") as machine:
    ...     machine.arm()
    ...     machine.wait("arming")
    ...     machine.run()
    ...     machine.wait("running")
    ...     machine.wait("arrived")
    ...     machine.move(x=0, y=0, z=5e-6, rx=0, ry=0, rz=0)
    ...     machine.wait("arrived")

    A separate thread keeps the session alive between commands. When it ends, the machine holds, then ramps down
    (``supervisor.host_lost``). Ctrl-C during a command, and an exception in a ``with`` block, ramp the machine down first.

    A refused command, and a fault during a command, raise `Error`; the session continues.
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
        """With a ``spec``, a machine with another controller is refused."""
        arguments = ["operate"]
        given = {"--socket": socket, "--port": port, "--baud": baud}
        for option, value in given.items():
            if value is not None:
                arguments.append(f"{option}={fspath(value) if isinstance(value, PathLike) else value}")
        if spec is not None:
            arguments.append(fspath(spec))
        self._session: Session | None = Session(arguments, listener(progress))
        self._answers(None)

    def execute(self, line: str) -> Any:
        """Executes a command of ``specgen operate``, such as ``"wait running 5"``, and returns its answer."""
        return self._answers(line)

    def _answers(self, line: str | None) -> Any:
        if self._session is None:
            raise Error("the session has ended")
        goes_on, text = self._session.answers(line)
        if not goes_on:
            self._session = None
            # `result_of` raises the reason.
            return result_of(json.loads(text)).data
        answers = json.loads(text)
        answer = answers[-1]["answer"] if answers else None
        if isinstance(answer, dict) and answer.keys() == {"error"}:
            raise Error(answer["error"])
        return answer

    def status(self) -> dict[str, Any]:
        """Tick, phase and cause (field ``state``), status, late ticks, health."""
        status: dict[str, Any] = self.execute("status")
        return status

    def arm(self) -> None:
        """Switches the amplifiers on; afterwards the machine can `run`."""
        self.execute("arm")

    def run(self) -> None:
        """Moves to the bias pose, or continues after a hold."""
        self.execute("run")

    def hold(self) -> None:
        """Holds the set-point."""
        self.execute("hold")

    def drive(self) -> None:
        """Begins an open drive from a hold: the law is suspended, and a wave or `set` commands the voltages of the legs."""
        self.execute("drive")

    def ramp_down(self) -> None:
        """Ramps the voltages down to rest, and switches the amplifiers off."""
        self.execute("ramp-down")

    def acknowledge(self) -> None:
        """Acknowledges a fault."""
        self.execute("acknowledge")

    def wait(self, until: str | float, limit: float | None = None) -> None:
        """Waits for a phase such as ``"running"``, for ``"arrived"``, or for some seconds; at most ``limit`` seconds."""
        self.execute(f"wait {until}" if limit is None else f"wait {until} {limit}")

    def move(self, **axes: float | str) -> list[float]:
        """Moves to a pose, and returns it, m and rad: ``x``, ``y``, ``z``, ``rx``, ``ry``, ``rz``, as numbers or with a unit,
        ``z="5um"``. Other axes keep their values; the first move of a session needs all six."""
        return self._go("move", axes)

    def jog(self, **axes: float | str) -> list[float]:
        """Moves by these steps."""
        return self._go("jog", axes)

    def _go(self, command: str, axes: dict[str, float | str]) -> list[float]:
        answer = self.execute(" ".join([command, *_quantities(axes)]))
        return [float(part) for part in answer["pose"]]

    def can_go(self, *, speed: str | None = None, **axes: float | str) -> str | None:
        """Checks whether a pose can be reached, with a ``speed`` such as ``"1 mm/s"`` or ``"1 mrad/s"`` at least that fast. Returns None,
        or the limit that is exceeded."""
        words = [] if speed is None else [f"speed={speed.replace(' ', '')}"]
        binds: str | None = self.execute(" ".join(["can-i-go", *_quantities(axes), *words]))["binds"]
        return binds

    def frame(self, kind: str | None = None, **axes: float | str) -> dict[str, Any]:
        """Returns the current frame, um and urad. ``"work"`` or ``"tool"`` with axes (0 if not given) sets the frame of poses first;
        ``"none"`` resets it to that of the spec."""
        words = [] if kind is None else [kind, *_quantities(axes)]
        frame: dict[str, Any] = self.execute(" ".join(["frame", *words]))
        return frame

    def where(self) -> dict[str, Any]:
        """Measured pose, set-point and error, um and urad; commanded voltage of each leg, V. Values that are not currently measured are
        None; ``last`` then has the last measured pose and its age, s, and ``why`` the reason."""
        where: dict[str, Any] = self.execute("where")
        return where

    def limits(self) -> list[list[float]]:
        """Least and largest value of each axis with the others unchanged, um and urad."""
        limits: list[list[float]] = self.execute("limits")["limits"]
        return limits

    def mark(self, name: str) -> None:
        """Saves the set-point under a name, for this session."""
        self.execute(f"mark {name}")

    def goto(self, name: str) -> None:
        """Moves to a mark, or to ``"zero"``."""
        self.execute(f"goto {name}")

    def play(self, trajectory: str, *, correction: StrPath | None = None, machine: str | None = None) -> dict[str, Any] | None:
        """Plays a trajectory of the spec. With a ``correction`` that `learn` wrote for it on this ``machine``, returns the error, nm and
        nrad rms."""
        words = ["play", trajectory]
        if correction is not None:
            words += [f"correction={fspath(correction)}", f"machine={machine}"]
        played = self.execute(" ".join(words))
        return played if isinstance(played, dict) else None

    def gains(self, **gains: float) -> dict[str, Any]:
        """Returns the current gains, after setting the given ones, in SI: ``machine.gains(**{"ki[2]": 1e9})``. Gains without
        sufficient stability margins raise `Error`."""
        words = [f"{name}={float(value)!r}" for name, value in gains.items()]
        found: dict[str, Any] = self.execute(" ".join(["gains", *words]))
        return found

    def output_line(self, line: int, **settings: float | str) -> None:
        """Changes settings of an output line (``[[trigger]]``), in SI: ``machine.output_line(0, kind="position", step=1e-6)``."""
        words = [f"{name}={value if isinstance(value, str) else repr(value)}" for name, value in settings.items()]
        self.execute(" ".join(["trigger", str(line), *words]))

    def watch(self, seconds: float, *, every: int = 1000) -> Table:
        """Samples of the running machine for some seconds: least, mean and largest value over ``every`` ticks. Rows are missing in
        gaps."""
        with tempfile.TemporaryDirectory(prefix="specgen-python-") as folder:
            file = Path(folder, "samples.csv")
            self.execute(f"watch {every} {float(seconds)!r} {file}")
            return read_table(file)

    def mode(self, mode: str) -> None:
        """Sets the control mode, such as ``"pf-pcc"``."""
        self.execute(f"mode {mode}")

    def set(self, **words: float) -> None:
        """Sets input words: ``machine.set(**{"setpoint[2]": 1e-6, "command": 2})``."""
        self.execute("set " + " ".join(f"{name}={value!r}" for name, value in words.items()))

    def settings(self) -> dict[str, float]:
        """The current settings."""
        settings: dict[str, float] = self.execute("config")
        return settings

    def write_settings(self, spec: StrPath) -> None:
        """Writes the settings of a spec to the machine, without its tables."""
        self.execute(f"config write {fspath(spec)}")

    def wave(self, file: StrPath | None) -> None:
        """Starts the wave in a file; None ends the running one."""
        self.execute("wave stop" if file is None else f"wave {fspath(file)}")

    def record(self, after: int | None = None) -> dict[str, Any]:
        """Starts the recorder, which keeps ``after`` ticks after its trigger."""
        recorder: dict[str, Any] = self.execute("record arm" if after is None else f"record arm {after}")
        return recorder

    def trigger(self) -> dict[str, Any]:
        """Triggers the recorder."""
        return self.recorder("trigger")

    def recorder(self, action: str = "look") -> dict[str, Any]:
        """State of the recorder; ``"stop"`` stops it first, ``"trigger"`` triggers it."""
        recorder: dict[str, Any] = self.execute(f"record {action}")
        return recorder

    def stop(self) -> None:
        """Ramps down and ends the program that serves the link; for a board it raises `Error`."""
        self.execute("stop")

    def download(self, file: StrPath) -> None:
        """Writes the recording to a file, for `replay`."""
        self.execute(f"record download {fspath(file)}")

    def close(self, *, ramp_down: bool = False) -> Result | None:
        """Ends the session, with ``ramp_down`` after ramping down. Returns the final state, or None if the session had ended."""
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
    """Words of a command; numbers get the unit of their axis."""

    def value(axis: str, given: float | str) -> str:
        if isinstance(given, str):
            return given.replace(" ", "")
        return f"{float(given)!r}{'m' if axis in ('x', 'y', 'z') else 'rad'}"

    return [f"{axis}={value(axis, given)}" for axis, given in axes.items()]
