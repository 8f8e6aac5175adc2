"""The examples of docs/python.md run unchanged."""

import os
import re
import subprocess
import sys
from pathlib import Path

from conftest import REPOSITORY


def test_the_examples_run_one_after_the_other(tmp_path: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (REPOSITORY / "docs/python.md").read_text(), re.DOTALL)
    # One needs a machine: test_machine.py.
    blocks = [block for block in blocks if "Machine" not in block]
    assert len(blocks) == 4
    os.symlink(REPOSITORY / "specs", tmp_path / "specs")
    program = [sys.executable, "-W", "error", "-c", "\n".join(blocks)]
    done = subprocess.run(program, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "W0458" in done.stdout and "E0" in done.stdout and "robust: " in done.stderr
