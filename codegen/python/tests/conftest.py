"""Common fixtures."""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

import specgen

REPOSITORY = Path(__file__).parents[3]
REFERENCE = REPOSITORY / "specs/reference.toml"
LEGS = REPOSITORY / "specs/legs.toml"
# `cargo xtask wheel` sets it.
COMMAND = os.environ.get("SPECGEN_COMMAND", str(REPOSITORY / "target/release/specgen"))


def command(*arguments: object) -> Any:
    """The document of the command-line program."""
    line = [COMMAND, *map(str, arguments), "--json"]
    return json.loads(subprocess.run(line, stdout=subprocess.PIPE, check=False).stdout)


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The host library of the reference platform."""
    folder = tmp_path_factory.mktemp("library") / "c"
    return next(path for path in specgen.export_c(REFERENCE, folder) if path.suffix not in (".h", ".c"))
