"""CSV files of commands as arrays."""

import os
from pathlib import Path

import numpy as np
import pytest

import specgen


def test_columns_keep_their_digits_their_units_and_their_text(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    names = [f"force[{leg}]_N" for leg in range(6)]
    values = np.random.default_rng(3).standard_normal((50, 6))
    with file.open("w") as out:
        print("time_s", *names, "late_at_s", "said", sep=",", file=out)
        for row, line in enumerate(values):
            print(0.1 * row, *map(repr, map(float, line)), "" if row == 30 else row, "é #" if row else "", sep=",", file=out)
    table = specgen.read_table(file)
    assert list(table) == ["time_s", "force", "late_at_s", "said"]
    assert np.array_equal(table["force"], values) and table.units == {"force": ("N",) * 6}
    # Not a number in each row.
    assert table["late_at_s"].dtype.kind == "U" and table["late_at_s"][30] == "" and table["late_at_s"][31] == "31"
    assert list(table["said"][:2]) == ["", "é #"]


def test_a_file_of_names_alone_has_no_rows(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("time_s,pose[0],pose[1]\n")
    table = specgen.read_table(file)
    assert table["time_s"].shape == (0,) and table["pose"].shape == (0, 2)


def test_what_is_no_plain_file_is_not_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in [pipe, Path("/dev/zero")]:
        with pytest.raises(OSError, match="not a regular file"):
            specgen.read_table(path)
        with pytest.raises(specgen.Error, match="expected a regular file"):
            specgen.Controller(path)


def test_a_line_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("time_s,pose\n1,2\n3\n")
    with pytest.raises(ValueError):
        specgen.read_table(file)
