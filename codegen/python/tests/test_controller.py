"""A controller on numpy arrays."""

import threading
from pathlib import Path

import numpy as np
import pytest
from conftest import LEGS, REFERENCE, REPOSITORY
from numpy.typing import NDArray

import specgen


def rows(law: specgen.Controller, count: int) -> NDArray[np.void]:
    """Drifting gauges, and streamed set-points."""
    made = np.zeros(count, law.inputs)
    random = np.random.default_rng(7)
    for name in ("gauge", "displacement"):
        if name in (law.inputs.names or ()):
            made[name] = 1e-6 * random.standard_normal((count, 6)).cumsum(axis=0) / 100
    return made


def test_it_says_what_it_is(library: Path) -> None:
    law = specgen.Controller(library)
    compiled = specgen.compile(REFERENCE)
    assert (law.name, law.digest, law.scalar_bits) == (compiled.name, compiled.digest, 64)
    assert law.inputs["gauge"].shape == (6,) and law.outputs["voltage"].shape == (6,)
    # Every word has 8 bytes, and integers are not reals.
    assert law.inputs.itemsize % 8 == 0 and law.outputs["dac_code"].base == np.uint64
    assert set(specgen.Controller(library, supervised=True).inputs.names or ()) - set(law.inputs.names or ()) == {
        "request",
        "events",
    }


def test_rows_at_once_are_ticks_one_by_one(library: Path) -> None:
    together, single = specgen.Controller(library), specgen.Controller(library)
    given = rows(together, 3000)
    out = together.run(given)
    names = given.dtype.names or ()
    for row, expected in zip(given, out):
        found = single.step(**{name: row[name] for name in names})
        assert found.tobytes() == expected.tobytes()
    assert single.state_digest == together.state_digest
    # Another input gives another state.
    single.step(gauge=np.full(6, 1e-7))
    together.step(gauge=np.full(6, np.nextafter(1e-7, 1)))
    assert single.state_digest != together.state_digest


@pytest.mark.parametrize("supervised", [False, True])
def test_what_is_not_built_has_the_bits_of_the_library(library: Path, supervised: bool) -> None:
    emitted = specgen.Controller(library, supervised=supervised)
    made = specgen.controller(REFERENCE, supervised=supervised)
    assert (made.name, made.digest, made.inputs, made.outputs) == (
        emitted.name,
        emitted.digest,
        emitted.inputs,
        emitted.outputs,
    )
    assert made.settings == emitted.settings
    given = rows(emitted, 3000)
    if supervised:
        given["request"] = 1
    else:
        given["gauge"] *= 3
    assert made.run(given).tobytes() == emitted.run(given).tobytes()
    assert made.state_digest == emitted.state_digest
    # The comparison is able to fail.
    given["gauge"][-1] = np.nextafter(given["gauge"][-1], 1)
    made.reset()
    made.run(given)
    assert made.state_digest != emitted.state_digest


def test_a_spec_that_is_refused_makes_no_controller(tmp_path: Path) -> None:
    spec = tmp_path / "platform.toml"
    spec.write_text((REPOSITORY / "specs/minimal.toml").read_text().replace("[", "\n[unknown]\nkey = 1\n[", 1))
    with pytest.raises(specgen.Refused) as raised:
        specgen.controller(spec)
    assert raised.value.code and raised.value.line


def test_nothing_is_copied(library: Path) -> None:
    law = specgen.Controller(library)
    given, out = rows(law, 100), np.empty(100, law.outputs)
    assert law.run(given, out) is out
    law.reset()
    # Into the second half of an array, from a part of another.
    whole = np.zeros(200, law.outputs)
    law.run(given[50:], whole[100:150])
    assert whole[:100].tobytes() == bytes(100 * whole.itemsize) and whole[100:150]["voltage"].any()


def test_what_does_not_fit_is_refused(library: Path) -> None:
    law = specgen.Controller(library)
    given = rows(law, 10)
    for bad, out in [
        (given[::2], None),
        (np.zeros(10, law.outputs), None),
        (given, np.empty(9, law.outputs)),
    ]:
        with pytest.raises((TypeError, ValueError)):
            law.run(bad, out)
    with pytest.raises(TypeError):
        law.run(np.zeros((10, 3)))  # type: ignore[arg-type]
    frozen = np.empty(10, law.outputs)
    frozen.flags.writeable = False
    with pytest.raises((ValueError, BufferError)):
        law.run(given, frozen)
    shared = np.zeros(10 * (law.inputs.itemsize + law.outputs.itemsize), np.uint8)
    with pytest.raises(ValueError, match="overlap"):
        law.run(
            shared[: 10 * law.inputs.itemsize].view(law.inputs),
            shared[: 10 * law.outputs.itemsize].view(law.outputs),
        )
    unaligned = np.zeros(10 * law.inputs.itemsize + 1, np.uint8)[1:].view(law.inputs)
    with pytest.raises((ValueError, BufferError)):
        law.run(unaligned)
    with pytest.raises(specgen.Error, match="not a controller library"):
        specgen.Controller(REFERENCE)
    with pytest.raises(ValueError):
        law.step(gauges=np.zeros(6))


def test_settings_are_taken_whole_or_not_at_all(library: Path) -> None:
    law, spec = specgen.Controller(library), specgen.Controller(library)
    name = next(name for name in law.settings if name.startswith("level_weight"))
    law.configure(**{name: law.settings[name] / 2})
    given = rows(law, 2000)
    changed, same = law.run(given), spec.run(given)
    assert changed.tobytes() != same.tobytes()
    law.configure()
    law.reset()
    assert law.run(given).tobytes() == same.tobytes()
    with pytest.raises(specgen.Error, match=name):
        law.configure(**{name: -1.0})
    with pytest.raises(specgen.Error, match="no word"):
        law.configure(colour=1)


def test_the_machine_of_a_recording_goes_the_same_way(library: Path, tmp_path: Path) -> None:
    """Inputs that the simulator recorded, given to the machine in Python: the recorded codes and states."""
    specgen.record(REFERENCE, tmp_path / "run.rec", seconds=0.2)
    recorded = specgen.replay(tmp_path / "run.rec").rows
    machine = specgen.Controller(library, supervised=True)
    given = np.zeros(len(recorded["tick"]), machine.inputs)
    for name in machine.inputs.names or ():
        given[name] = recorded[name]
    out = machine.run(given)
    assert np.array_equal(out["dac_code"], recorded["dac_code"])
    assert np.array_equal(out["status"], recorded["status"])
    assert np.ptp(recorded["dac_code"]) > 1000


def test_f32_rounds_what_it_is_given() -> None:
    law = specgen.controller(REPOSITORY / "specs/features/f32.toml")
    assert law.scalar_bits == 32
    given = rows(law, 500)
    out = law.run(given)
    name = "voltage"
    assert np.array_equal(out[name], out[name].astype(np.float32))
    rounded = given.copy()
    for field in given.dtype.names or ():
        if given[field].dtype == np.float64:
            rounded[field] = given[field].astype(np.float32)
    law.reset()
    assert law.run(rounded).tobytes() == out.tobytes()


def test_six_legs_have_their_own_words() -> None:
    law = specgen.compile(LEGS).controller()
    assert law.inputs.names == ("setpoint", "displacement")
    assert law.run(rows(law, 10)).shape == (10,)


def test_the_interpreter_is_free_meanwhile(library: Path) -> None:
    law = specgen.Controller(library)
    given = rows(law, 400_000)
    out = np.empty(len(given), law.outputs)
    thread = threading.Thread(target=law.run, args=(given, out))
    thread.start()
    seen = 0
    while thread.is_alive():
        seen += 1
        if seen == 1:
            # One thread at a time.
            with pytest.raises(RuntimeError, match="borrowed"):
                law.step()
    assert seen > 1000
