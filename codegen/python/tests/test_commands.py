"""Functions give the results of the commands."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import LEGS, REFERENCE, REPOSITORY, command

import specgen


def test_a_spec_that_compiles_says_all_that_the_command_says() -> None:
    compiled = specgen.compile(REFERENCE)
    document = command("check", REFERENCE, "--details")
    assert compiled.checked.data == document["result"]
    assert [finding.code for finding in compiled.findings] == [one["code"] for one in document["findings"]]
    assert compiled.margins == document["result"]["design"]["margins"]
    assert compiled.constants == command("dump-ir", REFERENCE)["result"]
    assert len(compiled.assumed) == 14 and compiled.assumed[-1] == "records/reference-forc.csv" and compiled.passed
    assert specgen.compile(LEGS).margins == [command("check", LEGS)["result"]["margins"]]


def test_a_refusal_carries_code_place_and_mend(tmp_path: Path) -> None:
    spec = tmp_path / "platform.toml"
    spec.write_text((REPOSITORY / "specs/minimal.toml").read_text().replace("[", "\n[unknown]\nkey = 1\n[", 1))
    with pytest.raises(specgen.Refused) as raised:
        specgen.compile(spec)
    found = command("check", spec)["findings"]
    first = next(one for one in found if one["severity"] == "error")
    error = raised.value
    assert len(error.findings) == len(found)
    assert (error.code, error.file, error.line, error.column) == (first["code"], first["file"], first["line"], first["column"])
    assert error.line == spec.read_text().split("[unknown]")[0].count("\n") + 1
    assert error.help and error.help in str(error) and f"{spec}:{error.line}" in str(error)
    assert error.code in specgen.explain(error.code)


def test_warnings_are_denied_where_it_is_asked_for() -> None:
    with pytest.raises(specgen.Refused) as raised:
        specgen.compile(REFERENCE, deny_warnings=True)
    assert raised.value.code.startswith("W")


def test_a_file_that_is_not_there_and_a_bad_argument_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(specgen.Refused):
        specgen.compile(tmp_path / "none.toml")
    with pytest.raises(specgen.UsageError, match="frequency"):
        specgen.simulate(REFERENCE, frequency=-1)
    with pytest.raises(ValueError, match="case-9"):
        specgen.simulate(REFERENCE, trajectory="case-9")


def test_the_first_simulation_is_that_of_the_command() -> None:
    lines: list[str] = []
    ours = specgen.simulate(REFERENCE, frequency=10, progress=lines.append)
    theirs = command("sim", REFERENCE, "--frequency", 10)["result"]
    assert ours.data == theirs
    assert ours["digest"] == specgen.compile(REFERENCE).digest
    assert "playing case-1 on board" in lines
    # The comparison is able to fail.
    assert specgen.simulate(REFERENCE, frequency=10, seed=2).data != theirs


def test_traces_are_the_run() -> None:
    found = specgen.simulate(REFERENCE, trajectory="case-1", traces=True)
    (trace,) = found.traces.values()
    assert trace["error"].shape == (len(trace["time_s"]), 6)
    rms = 1e9 * np.sqrt(np.mean(np.square(trace["error"]), axis=0))
    # The file has five digits.
    assert np.allclose(rms, found["rms_nano"], rtol=1e-5)
    # The last tick is where it comes to rest.
    assert set(trace["status_text"][:-1]) == {"moving"} and trace["status_text"][-1] != "moving"
    assert len(trace["time_s"]) * 1e-4 == pytest.approx(found["seconds"]) and found["seconds"] == found["path_seconds"]


def test_legs_are_simulated_too() -> None:
    found = specgen.simulate(LEGS, frequency=10, traces=True)
    assert found.data == command("sim", LEGS, "--frequency", 10)["result"]
    assert sorted(found.traces) == ["trace-ewma-10hz", "trace-invhys-10hz", "trace-pcc-10hz"]


def test_robustness_has_a_row_a_machine_and_its_gate_raises_nothing(tmp_path: Path) -> None:
    found = specgen.robust(REFERENCE, draws=4, vary={"mass": "5%"}, max_error="1 pm")
    theirs = command("robust", REFERENCE, "--draws", 4, "--vary", "mass=5%", "--max-error", "1 pm", "-o", tmp_path / "r")
    assert found.data == theirs["result"]
    assert not found.passed and found.reason == theirs["error"]
    runs = specgen.read_table(tmp_path / "r/runs.csv")
    assert list(runs) == list(found.runs) and all(np.array_equal(runs[name], found.runs[name]) for name in runs)
    assert len(next(iter(runs.values()))) > 4


def test_identified_and_predicted_as_by_the_command(tmp_path: Path) -> None:
    record = REPOSITORY / "specs/records/reference-forc.csv"
    table = tmp_path / "table.csv"
    found = specgen.identify(record, (0, 100), grid=16, output=table)
    theirs = command("identify", record, "--drive", "0:100", "--grid", 16, "-o", tmp_path / "theirs.csv")
    assert found.data == theirs["result"]
    assert table.read_bytes() == (tmp_path / "theirs.csv").read_bytes()
    assert found.table["everett_um"].max() > 1
    predicted = specgen.predict(table, record)
    assert predicted.data == command("identify", "predict", table, record)["result"]
    samples = predicted.samples
    assert len(samples["error_um"]) > 1000
    assert np.array_equal(samples["error_um"], samples["measured_um"] - samples["displacement_um"]) or np.allclose(
        samples["error_um"], samples["measured_um"] - samples["displacement_um"], atol=1e-9
    )


def test_a_recording_is_replayed(tmp_path: Path) -> None:
    file = tmp_path / "run.rec"
    specgen.record(REFERENCE, file, seconds=0.2)
    found = specgen.replay(file, REFERENCE)
    assert found.passed and found["bit_equal"] and found["ticks"] == len(found.rows["tick"])
    assert found.rows["gauge"].shape == (found["ticks"], 6)
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    damaged = specgen.replay(file, REFERENCE)
    assert not damaged.passed and damaged.reason is not None and "damaged" in damaged.reason


def test_tuning_and_other_commands(tmp_path: Path) -> None:
    found = specgen.tune(REFERENCE, what="gains", evaluations=20, seconds=0.2)
    theirs = command("tune", REFERENCE, "--what", "gains", "--evaluations", 20, "--seconds", 0.2)["result"]
    assert found.data == theirs
    with pytest.raises(specgen.UsageError):
        specgen.command("chek", str(REFERENCE))


def test_what_is_learned_and_exported_is_what_the_commands_give(tmp_path: Path) -> None:
    spec = tmp_path / "learning.toml"
    (tmp_path / "records").symlink_to(REPOSITORY / "specs/records")
    spec.write_text(REFERENCE.read_text().replace("[control]\n", '[control]\ncorrection = "2 um"\n', 1))
    first, second = tmp_path / "first.json", tmp_path / "second.json"
    ours = specgen.learn(spec, passes=1, vary={"stiffness": "1%"}, output=first)
    theirs = command("learn", spec, "--passes", 1, "--vary", "stiffness=1%", "-o", second)["result"]
    assert ours.data == theirs and first.read_bytes() == second.read_bytes()
    assert specgen.learn(spec, passes=0, start=first).data == command("learn", spec, "--passes", 0, "--from", first)["result"]
    with pytest.raises(specgen.Refused, match="correction"):
        specgen.learn(REFERENCE)
    with pytest.raises(specgen.UsageError):
        specgen.learn(spec, prepare=True, start=first)
    (unit,) = specgen.export_fmu(LEGS, tmp_path / "fmu")
    assert unit.name == "legs.fmu" and unit.stat().st_size > 10_000
    module, library = specgen.export_python(LEGS, tmp_path / "python")
    script = "from controller import Controller; law = Controller(); law.step(request=1); print(law.state_digest)"
    ran = subprocess.run([sys.executable, "-c", script], cwd=module.parent, check=True, capture_output=True, text=True)
    law = specgen.Controller(library, supervised=True)
    law.step(request=1)
    assert int(ran.stdout) == law.state_digest
