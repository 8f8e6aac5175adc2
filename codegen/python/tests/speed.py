"""How fast `Controller` is: `run` over a million ticks beside the loop in Rust, and one call of `step`.

    cargo xtask wheel     # once
    cargo build --release --manifest-path codegen/python/Cargo.toml --example rust_loop
    target/wheel/fresh/bin/python codegen/python/tests/speed.py codegen/python/target/release/examples/rust_loop
"""

import subprocess
import sys
import tempfile
import time
import timeit
from pathlib import Path

import numpy as np

import specgen

TICKS = 1_000_000
ROUNDS = 7
REFERENCE = Path(__file__).parents[3] / "specs/reference.toml"


def main(loop: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        library = next(path for path in specgen.export_c(REFERENCE, Path(folder, "c")) if path.suffix == ".so")
        law = specgen.Controller(library)
        rows = np.zeros(TICKS, law.inputs)
        rows["gauge"] = 1e-9 * np.random.default_rng(1).standard_normal((TICKS, 6))
        rows.tofile(Path(folder, "rows"))
        out = np.empty(TICKS, law.outputs)
        ours, theirs = [], []
        # In turn, so that both see the same neighbours.
        for _ in range(ROUNDS):
            law.reset()
            begun = time.perf_counter()
            law.run(rows, out)
            ours.append(time.perf_counter() - begun)
            said = subprocess.run([loop, library, Path(folder, "rows"), "3"], capture_output=True, text=True, check=True)
            seconds, digest = said.stdout.split()
            theirs.append(float(seconds))
            assert int(digest) == law.state_digest
        print(f"run of {TICKS} ticks: {1e9 * min(ours) / TICKS:.1f} ns a tick, {min(ours) / min(theirs):.3f} of the loop in Rust")
        gauge, count = np.zeros(6), 100_000
        for name, call in [("step()", law.step), ("step(gauge=array)", lambda: law.step(gauge=gauge))]:
            fastest = min(timeit.repeat(call, number=count, repeat=ROUNDS)) / count
            print(f"{name}: {1e6 * fastest:.2f} us")


if __name__ == "__main__":
    main(sys.argv[1])
