"""A machine over a socket: the emitted program for a PC, on the simulated machine of its spec."""

import shutil
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import COMMAND, LEGS, REFERENCE

import specgen


@pytest.fixture(scope="session")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program that `specgen build --target rt-pc` writes."""
    folder = tmp_path_factory.mktemp("rt-pc") / "controller"
    specgen.command("build", REFERENCE, "--target", "rt-pc", "-o", folder)
    return next(folder.glob("target/rt-pc/release/rt-pc"))


@pytest.fixture
def link(program: Path, tmp_path: Path) -> Iterator[Path]:
    """The socket of a machine."""
    name, socket = f"python-{uuid.uuid4().hex[:12]}", tmp_path / "link"
    plant = subprocess.Popen([COMMAND, "plant", REFERENCE, "--name", name], stderr=subprocess.DEVNULL)
    place = Path("/dev/shm") / f"specgen-plant-{name}"
    controller = None
    try:
        waited(place)
        line = [str(program), "--sim", name, "--allow-no-rt", "--elastic", "--sim-timeout", "5000", "--link-silence", "1000"]
        controller = subprocess.Popen([*line, "--link", str(socket)], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        waited(socket)
        yield socket
    finally:
        for process in (controller, plant):
            if process is not None:
                process.terminate()
                process.wait()
        place.unlink(missing_ok=True)


def waited(path: Path) -> None:
    begun = time.monotonic()
    while not path.exists():
        assert time.monotonic() < begun + 30, f"{path} does not appear"
        time.sleep(0.05)


@pytest.mark.skipif(sys.platform != "linux" or shutil.which("cargo") is None, reason="a program of Linux, which cargo builds")
def test_a_machine_is_operated(link: Path, tmp_path: Path) -> None:
    with pytest.raises(specgen.Error, match="digest"):
        specgen.Machine(socket=link, spec=LEGS)
    with specgen.Machine(socket=link, spec=REFERENCE) as machine:
        assert machine.status()["state"] == "disarmed"
        with pytest.raises(specgen.Error, match="moves only while running"):
            machine.move(z=1e-6)
        with pytest.raises(specgen.Error, match="invalid command"):
            machine.execute("dance")
        machine.record()
        machine.arm()
        machine.wait("arming", 60)
        machine.run()
        machine.wait("running", 60)
        machine.wait("arrived", 60)
        machine.move(x=0, y=0, z=5e-6, rx=0, ry=0, rz=0)
        machine.wait("arrived", 60)
        # The session stays alive without commands.
        time.sleep(2)
        assert machine.status()["state"] == "running"
        assert machine.jog(z="1 um", rx=1e-6)[2] == pytest.approx(6e-6)
        machine.wait("arrived", 60)
        with pytest.raises(specgen.Error, match="no motion was started"):
            machine.move(z=1e-3)
        assert machine.where()["target"][2] == pytest.approx(6.0)
        assert machine.can_go(z=1e-6) is None and "leg" in (machine.can_go(z="1 mm") or "")
        assert machine.can_go(z=1e-6, speed="1 um/s") is None and "speed" in (machine.can_go(z=1e-6, speed="1 m/s") or "")
        assert machine.limits()[2][1] > 6.0
        assert machine.frame("work", z="1 um")["work"][2] == pytest.approx(1.0)
        assert machine.where()["target"][2] == pytest.approx(5.0)
        assert machine.frame("none") == machine.frame() and machine.frame()["work"] == [0.0] * 6
        gains = machine.gains()["gains"]
        assert machine.gains(**{"ki[2]": 0.9 * gains[1][2]})["gains"][1][2] == pytest.approx(0.9 * gains[1][2])
        with pytest.raises(specgen.Error):
            machine.gains(ki=1e3 * gains[1][2])
        machine.gains(**{"ki[2]": gains[1][2]})
        samples = machine.watch(0.5, every=100)
        assert len(samples["tick"]) > 10 and samples["tick"][1] - samples["tick"][0] == 100
        with pytest.raises(specgen.Error):
            machine.output_line(0, kind="motion")
        assert machine.recorder()["running"]
        with pytest.raises(specgen.Error, match="none.json"):
            machine.play("case-1", correction="none.json", machine="here")
        machine.mark("here")
        machine.jog(y=-2e-6)
        machine.wait("arrived", 60)
        machine.goto("here")
        machine.wait("arrived", 60)
        assert machine.where()["target"][1] == pytest.approx(0.0)
        assert machine.settings() == specgen.compile(REFERENCE).controller().settings
        machine.ramp_down()
        machine.wait("disarmed", 60)
        machine.recorder("stop")
        machine.download(tmp_path / "run.rec")
    assert machine.close() is None
    with pytest.raises(specgen.Error, match="ended"):
        machine.status()
    again = specgen.replay(tmp_path / "run.rec", REFERENCE)
    assert again.passed and again["ticks"] > 100
    # An exception ramps it down.
    with pytest.raises(LookupError), specgen.Machine(socket=link) as machine:
        machine.arm()
        machine.wait("arming", 60)
        assert machine.status()["amplifiers_on"]
        raise LookupError
    with specgen.Machine(socket=link) as machine:
        status = machine.status()
        assert status["state"] == "disarmed" and not status["amplifiers_on"]
        machine.stop()
    waited_for_end(link)


def waited_for_end(path: Path) -> None:
    begun = time.monotonic()
    while path.exists():
        assert time.monotonic() < begun + 30, f"{path} is still there"
        time.sleep(0.05)


def test_what_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(specgen.Unavailable, match="none"):
        specgen.Machine(socket=tmp_path / "none")
    with pytest.raises(specgen.UsageError):
        specgen.Machine()
