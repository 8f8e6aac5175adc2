"""The commands of specgen as functions, with exactly the same results."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import Any, TypeAlias

from . import _native
from ._controller import Controller
from ._findings import EndedEarly, Error, Interrupted, Refused, Result, Unavailable, UsageError, findings_of
from ._table import Table, read_table

StrPath: TypeAlias = str | PathLike[str]
Progress: TypeAlias = bool | Callable[[str], object]


def command(*arguments: str | PathLike[str], progress: Progress = False) -> Result:
    """Runs ``specgen ARGUMENTS`` in this process, such as ``command("tune", "platform.toml", "--evaluations", "50")``.

    It releases the interpreter. ``progress`` is called with each line of progress; True prints them to standard error.

    Raises `Refused`, `UsageError`, `Unavailable`, `EndedEarly`, `Interrupted` (with the result so far) or KeyboardInterrupt. If a figure
    exceeds its limit, nothing is raised, and `Result.passed` is False.
    """
    return result_of(json.loads(_native.call([fspath(argument) for argument in arguments], listener(progress))))


def listener(progress: Progress) -> Callable[[str], object] | None:
    """The function for lines of progress, if any."""
    return progress if callable(progress) else _print if progress else None


def result_of(document: dict[str, Any]) -> Result:
    """The result of a command's document; an error is raised."""
    findings, error, data = findings_of(document), document["error"], document["result"]
    match document["exit_code"], data:
        case 0, _:
            return Result(data or {}, findings, None)
        case 130, None:
            raise KeyboardInterrupt
        case 130, _:
            raise Interrupted(error, Result(data, findings, error))
        case 1, None if findings:
            raise Refused(error, findings)
        case 1, None:
            raise Error(error)
        case 1, _:
            return Result(data, findings, error)
        case 2, _:
            raise UsageError(error)
        case 4, _:
            raise EndedEarly(error, Result(data, findings, error) if data else None)
        case _:
            raise Unavailable(error)


def _print(line: str) -> None:
    print(line, file=sys.stderr)


def _options(**given: object) -> list[str]:
    """Options of a command line: None and False are omitted, sequences are joined by commas."""
    arguments = []
    for name, value in given.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            arguments.append(option)
        elif isinstance(value, Sequence) and not isinstance(value, str):
            arguments.append(f"{option}={','.join(map(str, value))}")
        elif value is not None and value is not False:
            # With `=`, because a value may start with a dash.
            arguments.append(f"{option}={fspath(value) if isinstance(value, PathLike) else value}")
    return arguments


def explain(code: str) -> str:
    """The page of a finding, in Markdown: what is checked, why it matters, an example, the fix."""
    return str(command("explain", code)["page"])


class Compiled:
    """A spec that compiled."""

    def __init__(self, spec: StrPath, checked: Result) -> None:
        self.spec = Path(spec)
        self.checked = checked
        """The result of ``specgen check --details --json``."""
        self.findings = checked.findings
        """Warnings and notes."""

    @property
    def name(self) -> str:
        """Name of the spec."""
        return str(self.checked["name"])

    @property
    def digest(self) -> str:
        """Digest of the spec and its records, hexadecimal."""
        return str(self.checked["digest"])

    @property
    def verdict(self) -> dict[str, Any]:
        """Figures with their limits."""
        return dict(self.checked["verdict"])

    @property
    def passed(self) -> bool:
        """Whether all figures, such as the noise of the pose at rest, are within their limits."""
        return self.checked.passed

    @property
    def assumed(self) -> list[str]:
        """Values that were not measured: paths in the spec, and files of simulated records."""
        assumed = self.verdict["assumed"]
        return [*assumed["values"], *assumed["simulated"]]

    @property
    def margins(self) -> list[dict[str, Any]]:
        """Stability margins: for a platform, of each control mode; for six legs with their own gauges, of the spec's."""
        design = self.design
        return [self.checked["margins"]] if design is None else list(design["margins"])

    @property
    def design(self) -> dict[str, Any] | None:
        """With ``[control]``: modes, notch, gains and their limits."""
        design: dict[str, Any] | None = self.checked["design"]
        return design

    @cached_property
    def constants(self) -> dict[str, Any]:
        """Every constant of the controller: ``specgen dump-ir``."""
        found = command("dump-ir", self.spec)
        if found["digest"] != self.digest:
            raise Error(f"{self.spec} has changed since it was compiled; compile it again")
        return found.data

    def controller(self, *, supervised: bool = False) -> Controller:
        """The controller, as from `controller`."""
        built = controller(self.spec, supervised=supervised)
        if built.digest != self.digest:
            raise Error(f"{self.spec} has changed since it was compiled; compile it again")
        return built

    def __repr__(self) -> str:
        return f"Compiled({self.name}, {self.digest[:16]}, {len(self.findings)} findings)"


def compile(spec: StrPath, *, deny_warnings: bool = False) -> Compiled:
    """Compiles a spec, with all checks and constants. It writes and builds nothing.

    Raises `Refused`, with the findings, if there is an error, or with ``deny_warnings`` a warning.
    """
    return Compiled(spec, command("check", spec, "--details", *_options(deny_warnings=deny_warnings)))


def controller(
    spec: StrPath, *, supervised: bool = False, emitted: bool = False, progress: Progress = False
) -> Controller:
    """The controller of a spec: the law with the constants of the compiled spec, without a build.

    With ``emitted``, the emitted crate is built for this computer and loaded, which needs ``cargo`` or a cached build. Both give the
    same bits; a tick of the emitted one takes half as long.
    """
    if not emitted:
        try:
            return Controller._of_spec(spec, supervised)
        except Error:
            # Raises `Refused` with the findings if the spec is refused.
            command("check", spec, progress=progress)
            raise
    with tempfile.TemporaryDirectory(prefix="specgen-python-") as folder:
        files = command("export", "c", spec, "-o", Path(folder, "c"), progress=progress)["files"]
        library = next(name for name in files if not name.endswith((".h", ".c")))
        # The library stays loaded after its file is removed.
        return Controller(Path(folder, "c", library), supervised=supervised)


def export_c(spec: StrPath, output: StrPath) -> list[Path]:
    """Writes header, library and sources for programs in C to the folder ``output``. `Controller` can load the library, without
    ``cargo``."""
    return [Path(output, name) for name in command("export", "c", spec, "-o", output)["files"]]


def export_python(spec: StrPath, output: StrPath) -> list[Path]:
    """Writes the library and ``controller.py``, which steps it without this package or numpy."""
    return [Path(output, name) for name in command("export", "python", spec, "-o", output)["files"]]


def export_fmu(spec: StrPath, output: StrPath, *, plant: bool = False, progress: Progress = False) -> list[Path]:
    """Writes FMI 2.0 units for Simulink, Dymola, OMSimulator: the controller and, with ``plant``, the simulated machine."""
    exported = command("export", "fmu", spec, "-o", output, *_options(plant=plant), progress=progress)
    return [Path(unit["file"]) for unit in exported["units"]]


class Simulation(Result):
    """Result of `simulate`; `traces` has every tick of every run by the name of the run, if requested."""

    traces: dict[str, Table]


def simulate(
    spec: StrPath,
    *,
    trajectory: str | None = None,
    frequency: float | Sequence[float] | None = None,
    latency: int = 0,
    samples: int | None = None,
    paper: bool = False,
    plant: StrPath | None = None,
    noise: bool = True,
    seed: int = 1,
    traces: bool = False,
    progress: Progress = False,
) -> Simulation:
    """Runs the controller on the simulated machine of a spec: ``specgen sim``.

    Args:
        trajectory: Play only this trajectory of the spec; otherwise rest, waves, and every trajectory.
        frequency: Frequency of the waves, Hz; 1 and 10 if not given.
        latency: Extra delay from controller to amplifiers, in ticks.
        samples: Without ``[control]``, control ticks per period of the motion.
        paper: Run the paper's experiments instead.
        plant: Hysteresis model of the legs: ``plays``, ``bouc-wen``, or a file of leg parameters.
        noise: Whether to simulate noise of gauges and amplifiers.
        seed: Seed of noise and tolerances.
        traces: Whether to return every tick.
    """
    with tempfile.TemporaryDirectory(prefix="specgen-python-") as folder:
        tables = Path(folder, "sim")
        options = _options(
            trajectory=trajectory,
            frequency=frequency,
            latency=latency or None,
            samples=samples,
            paper=paper,
            plant=plant,
            no_noise=not noise,
            seed=seed,
            output=tables if traces else None,
            traces=traces,
        )
        found = command("sim", spec, *options, progress=progress)
        simulation = Simulation(found.data, found.findings, found.reason)
        named = [path for path in sorted(tables.glob("*.csv")) if path.name not in _TABLES]
        simulation.traces = {path.stem: read_table(path) for path in named}
    return simulation


# Tables of `sim`, which are not traces.
_TABLES = ("motions.csv", "tracking.csv", "free-motion.csv", "machining.csv", "linearity.csv")


class Robustness(Result):
    """Result of `robust`; `runs` has a row for each machine."""

    runs: Table


def robust(
    spec: StrPath,
    *,
    draws: int = 100,
    vary: Mapping[str, str] | None = None,
    trajectory: str | None = None,
    frequency: float | None = None,
    max_error: str | None = None,
    max_orientation: str | None = None,
    quantile: float | None = None,
    diverged_above: str | None = None,
    threads: int | None = None,
    plant: StrPath | None = None,
    noise: bool = True,
    seed: int = 1,
    progress: Progress = False,
) -> Robustness:
    """Tests the closed loop on corners and random draws of the declared uncertainties: ``specgen robust``.

    Args:
        draws: Number of random machines, in addition to the corners.
        vary: Ranges of uncertainties, such as ``{"mass": "5%", "gain": "0.9:1.1"}``.
        trajectory: The trajectory.
        frequency: Its frequency, Hz.
        max_error: Gate, such as ``"30 nm"``; that of the spec if not given.
        max_orientation: Gate for the angles, such as ``"100 nrad"``.
        quantile: Quantile of the draws that the gates check, %.
        diverged_above: Error above which a run counts as diverged, such as ``"3 um"``.
        threads: Number of threads; the result does not depend on it.

    If a gate fails, `Result.passed` is False. After Ctrl-C, `Interrupted.result` has the machines so far.
    """
    with tempfile.TemporaryDirectory(prefix="specgen-python-") as folder:
        options = _options(
            draws=draws,
            trajectory=trajectory,
            frequency=frequency,
            max_error=max_error,
            max_orientation=max_orientation,
            quantile=quantile,
            diverged_above=diverged_above,
            threads=threads,
            plant=plant,
            no_noise=not noise,
            seed=seed,
            output=Path(folder, "robust"),
        )
        options += [f"--vary={name}={range}" for name, range in (vary or {}).items()]
        found = command("robust", spec, *options, progress=progress)
        robustness = Robustness(found.data, found.findings, found.reason)
        robustness.runs = read_table(Path(folder, "robust", "runs.csv"))
    return robustness


def tune(
    spec: StrPath,
    *,
    what: str | None = None,
    optimiser: str | None = None,
    evaluations: int | None = None,
    trajectory: str | None = None,
    frequency: float | None = None,
    seconds: float | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    threads: int | None = None,
    output: StrPath | None = None,
    noise: bool = True,
    seed: int = 1,
    progress: Progress = False,
) -> Result:
    """Tunes gains and weights on the simulated loop: ``specgen tune``. Use `command` for its other options.

    After Ctrl-C, `Interrupted.result` has the best result so far.
    """
    options = _options(
        what=what,
        optimiser=optimiser,
        evaluations=evaluations,
        trajectory=trajectory,
        frequency=frequency,
        seconds=seconds,
        threads=threads,
        output=output,
        no_noise=not noise,
        seed=seed,
    )
    options += [f"--bounds={group}={low}:{high}" for group, (low, high) in (bounds or {}).items()]
    return command("tune", spec, *options, progress=progress)


class Identification(Result):
    """Result of `identify`; `table` is the Everett table: ``up_V``, ``down_V``, ``everett_um``."""

    table: Table


def identify(
    record: StrPath,
    drive: tuple[float, float],
    *,
    grid: int | None = None,
    validate: StrPath | None = None,
    columns: Mapping[str, str] | None = None,
    rate: float | None = None,
    output: StrPath | None = None,
    progress: Progress = False,
) -> Identification:
    """Identifies an Everett table from a record of reversal curves: ``specgen identify``.

    Args:
        drive: Voltage range of the table, V.
        grid: Cells per axis; chosen by cross-validation if not given.
        validate: A second record, not used in the fit, to validate the table.
        columns: Columns of the file, if they have other names.
        rate: Sampling rate, if the file has no time, Hz.
        output: File for the table, for specs and `predict`.

    For other records use ``command("identify", "linear", file)``, and likewise ``response``, ``gauge``, ``stiffness``, ``gains``.
    """
    with tempfile.TemporaryDirectory(prefix="specgen-python-") as folder:
        file = Path(output) if output is not None else Path(folder, "table.csv")
        options = _options(
            drive=f"{drive[0]}:{drive[1]}",
            grid=grid,
            validate=validate,
            columns=_pairs(columns),
            rate=rate,
            output=file,
        )
        found = command("identify", record, *options, progress=progress)
        identification = Identification(found.data, found.findings, found.reason)
        identification.table = read_table(file)
    return identification


class Prediction(Result):
    """Result of `predict`; `samples` has ``time_s``, ``drive_V``, ``displacement_um`` and, if measured, ``measured_um`` and
    ``error_um``."""

    samples: Table


def predict(
    model: StrPath,
    drive: StrPath,
    *,
    leg: int | None = None,
    dead_time: float | None = None,
    mode: str | None = None,
    columns: Mapping[str, str] | None = None,
    rate: float | None = None,
    progress: Progress = False,
) -> Prediction:
    """Predicts the displacement of a leg from its drive: ``specgen identify predict``.

    Args:
        model: A table written by `identify`, or a spec.
        drive: A file with ``time_s`` and ``drive_V`` or ``monitor_V``.
        leg: Leg of the spec.
        dead_time: Dead time, ms.
        mode: Resonance, such as ``"735:0.015"`` (Hz and damping ratio), or ``"none"``.
    """
    with tempfile.TemporaryDirectory(prefix="specgen-python-") as folder:
        file = Path(folder, "prediction.csv")
        options = _options(leg=leg, dead_time=dead_time, mode=mode, columns=_pairs(columns), rate=rate, output=file)
        found = command("identify", "predict", model, drive, *options, progress=progress)
        prediction = Prediction(found.data, found.findings, found.reason)
        prediction.samples = read_table(file)
    return prediction


def _pairs(columns: Mapping[str, str] | None) -> list[str] | None:
    return None if columns is None else [f"{name}={column}" for name, column in columns.items()]


class Replayed(Result):
    """Result of `replay`; `rows` has the words of every tick."""

    rows: Table


def replay(recording: StrPath, spec: StrPath | None = None, *, progress: Progress = False) -> Replayed:
    """Reads a recording; with its spec, replays every tick and compares it bit for bit: ``specgen replay``.

    `Result.passed` is False if a bit differs or a block is damaged. Without a spec no ``cargo`` is needed.
    """
    with tempfile.TemporaryDirectory(prefix="specgen-python-") as folder:
        file = Path(folder, "rows.csv")
        found = command("replay", recording, *_options(spec=spec, csv=file), progress=progress)
        replayed = Replayed(found.data, found.findings, found.reason)
        replayed.rows = read_table(file)
    return replayed


def record(
    spec: StrPath,
    output: StrPath,
    *,
    seconds: float = 1.0,
    noise: bool = True,
    seed: int = 1,
    progress: Progress = False,
) -> Result:
    """Records a simulated wave under the supervisor, for `replay`: ``specgen sim --record``."""
    options = _options(record=output, seconds=seconds, no_noise=not noise, seed=seed)
    return command("sim", spec, *options, progress=progress)


def learn(
    spec: StrPath,
    *,
    trajectory: str | None = None,
    frequency: float | None = None,
    passes: int | None = None,
    bandwidth: float | None = None,
    vary: Mapping[str, str] | None = None,
    prepare: bool = False,
    start: StrPath | None = None,
    excite: StrPath | None = None,
    response: StrPath | None = None,
    on_device: int | None = None,
    output: StrPath | None = None,
    socket: StrPath | None = None,
    port: StrPath | None = None,
    baud: int | None = None,
    machine: str | None = None,
    plant: StrPath | None = None,
    noise: bool = True,
    seed: int = 1,
    progress: Progress = False,
) -> Result:
    """Learns the correction of a repeated motion, on the simulated machine or, over ``socket`` or ``port``, on a real one, which is armed
    first and ramped down afterwards: ``specgen learn``.

    Args:
        trajectory: A trajectory of the spec, or ``case-1``, ``case-2``, ``machining``, ``multisine``; ``case-1`` if not given.
        frequency: Operating frequency of the motion, Hz; that of the spec's trajectory, or 10, if not given.
        passes: Number of learning passes; 5 if not given.
        bandwidth: Highest frequency to learn, Hz; lowered until learning converges on every machine within ``[robust]``.
        vary: Ranges instead of those of ``[robust]``: ``{"stiffness": "2%"}``.
        prepare: Start from the correction that the model predicts for lag, modes and hysteresis.
        start: Start from this correction, of the same spec, machine and motion.
        excite: Do not learn: measure the response of the running loop, and write it to this file.
        response: Learn with this measured response instead of the model's.
        on_device: Let the device compute each correction, with storage for this number of knots.
        output: File for the correction of the best pass, for `Machine.play`.
        machine: Name of the machine on the link; a correction is played only on its machine.
        plant: Hysteresis model of the simulated legs: ``plays``, ``bouc-wen``, or a file of leg parameters.
        noise: Whether to simulate noise of gauges and amplifiers.
        seed: Seed of noise and tolerances.
    """
    options = _options(
        trajectory=trajectory,
        frequency=frequency,
        passes=passes,
        bandwidth=bandwidth,
        prepare=prepare,
        excite=excite,
        response=response,
        on_device=on_device,
        output=output,
        socket=socket,
        port=port,
        baud=baud,
        machine=machine,
        plant=plant,
        no_noise=not noise,
        seed=seed,
    )
    if start is not None:
        options.append(f"--from={fspath(start)}")
    for pair in _pairs(vary) or []:
        options.append(f"--vary={pair}")
    return command("learn", spec, *options, progress=progress)
