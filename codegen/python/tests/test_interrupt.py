"""Ctrl-C, and use without a toolchain."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import REFERENCE, REPOSITORY

# A program that a shell starts in the background ignores the signal; a notebook does not.
HEAD = """import signal, specgen, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
def said(line): print(line, flush=True)
"""


def interrupted(body: str, when: str, after: float = 0.0) -> tuple[float, str, int]:
    """Seconds from the signal to the end, output and exit code of a program that is interrupted once it has printed `when`."""
    program = subprocess.Popen([sys.executable, "-c", HEAD + body], stdout=subprocess.PIPE, text=True, stderr=subprocess.STDOUT)
    assert program.stdout is not None
    text = ""
    for line in program.stdout:
        text += line
        if when in line:
            break
    time.sleep(after)
    program.send_signal(signal.SIGINT)
    begun = time.monotonic()
    text += program.communicate(timeout=60)[0]
    return time.monotonic() - begun, text, program.returncode


def test_a_simulation_ends_at_ctrl_c() -> None:
    body = f"""
try:
    specgen.simulate({str(REFERENCE)!r}, frequency=0.005, progress=said)
except KeyboardInterrupt:
    print("interrupted")
"""
    seconds, text, code = interrupted(body, "wave 0.005 Hz")
    assert text.endswith("interrupted\n") and code == 0, text
    # A wave of 800 s.
    assert seconds < 5, f"{seconds} s"


def test_an_identification_ends_at_ctrl_c(tmp_path: Path) -> None:
    short = (REPOSITORY / "specs/records/reference-forc.csv").read_text().splitlines()
    comments = [line for line in short if line.startswith("#")]
    names, *rows = [line for line in short if not line.startswith("#")]
    times = [float(row.split(",")[0]) for row in rows]
    step = times[1] - times[0]
    record = tmp_path / "long.csv"
    with record.open("w") as file:
        print(*comments, names, sep="\n", file=file)
        for number in range(2_000_000):
            print(f"{times[0] + number * step!r},{rows[number % len(rows)].split(',', 1)[1]}", file=file)
    body = f"""
print("begun", flush=True)
try:
    specgen.identify({str(record)!r}, (0, 100), grid=48)
except KeyboardInterrupt:
    print("interrupted")
"""
    seconds, text, code = interrupted(body, "begun", after=1.0)
    assert text.endswith("interrupted\n") and code == 0, text
    assert seconds < 3, f"{seconds} s"


def test_machines_that_are_done_make_a_result() -> None:
    body = f"""
try:
    specgen.robust({str(REFERENCE)!r}, draws=100000, progress=said)
except specgen.Interrupted as interrupted:
    print("part:", sorted(interrupted.result)[:1], interrupted)
print(len(specgen.compile({str(REFERENCE)!r}).digest))
"""
    seconds, text, code = interrupted(body, "machines")
    assert "part: ['" in text and "interrupted" in text and text.endswith("64\n"), text
    assert code == 0 and seconds < 15, f"{code}, {seconds} s"


def test_without_a_toolchain_all_but_building_works(library: Path, tmp_path: Path) -> None:
    body = f"""
compiled = specgen.compile({str(REFERENCE)!r})
for law in specgen.Controller({str(library)!r}), compiled.controller():
    assert law.digest == compiled.digest
    law.step()
specgen.simulate({str(REFERENCE)!r}, trajectory="case-1")
recording = {str(tmp_path / "run.rec")!r}
specgen.record({str(REFERENCE)!r}, recording, seconds=0.1)
assert specgen.replay(recording, {str(REFERENCE)!r}).passed
try:
    specgen.controller({str(REFERENCE)!r}, emitted=True)
except specgen.Unavailable as error:
    print(error)
"""
    environment = {**os.environ, "PATH": "/nonexistent", "SPECGEN_CACHE": str(tmp_path), "HOME": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", HEAD + body], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "cargo" in done.stdout


def test_what_progress_raises_is_raised() -> None:
    import specgen

    def progress(line: str) -> None:
        raise LookupError(line)

    with pytest.raises(LookupError, match="controller: run-time law"):
        specgen.simulate(REFERENCE, progress=progress)
