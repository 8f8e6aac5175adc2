"""A controller on numpy arrays."""

from __future__ import annotations

import re
from collections.abc import Iterable
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native


def _dtype(words: Iterable[tuple[str, bool]]) -> np.dtype[np.void]:
    """A dtype with 8 bytes per word; indexed words form one field."""
    fields: dict[str, tuple[str, int]] = {}
    for name, real in words:
        stem = re.sub(r"\[\d+\]$", "", name)
        count = fields[stem][1] if stem in fields else 0
        fields[stem] = ("<f8" if real else "<u8", count + 1)
    return np.dtype([(name, kind) if count == 1 else (name, kind, (count,)) for name, (kind, count) in fields.items()])


class Controller:
    """The controller of the other targets, on this computer: the same inputs give the same bits.

    `controller` makes one from a spec, without a build; ``Controller(library)`` loads a library from `export_c` or an emitted
    workspace. With ``supervised``, a tick is that of the whole machine with its phases; otherwise that of the law alone, without
    supervision.

    Values are in m, rad, N, V, s. Fields have the names of the words: ``inputs.names``, ``outputs.names``. A controller can be used by
    one thread at a time; controllers of the same library are independent.
    """

    def __init__(self, library: str | PathLike[str], *, supervised: bool = False) -> None:
        self._take(_native.Library(library, supervised), supervised)

    @classmethod
    def _of_spec(cls, spec: str | PathLike[str], supervised: bool) -> Controller:
        made = cls.__new__(cls)
        made._take(_native.Library.of_spec(spec, supervised), supervised)
        return made

    def _take(self, library: _native.Library, supervised: bool) -> None:
        self._library = library
        self.name, self.digest, self.version, self.scalar_bits = self._library.about()
        self.supervised = supervised
        self.inputs = _dtype(self._library.inputs())
        """dtype of a row of inputs: ``np.zeros(1000, controller.inputs)``."""
        self.outputs = _dtype(self._library.outputs())
        """dtype of a row of outputs."""
        rows = np.zeros(1, self.inputs), np.zeros(1, self.outputs)
        self._library.bind(_words(rows[0]), _words(rows[1]))
        self.input: np.void = rows[0][0]
        """The row that `step` reads; its fields keep their values: ``controller.input["setpoint"] = pose``."""
        self.output: np.void = rows[1][0]
        """The row that `step` writes."""
        self._tick = self._library.step

    def step(self, **fields: ArrayLike) -> np.void:
        """One tick: writes the given fields to `input`, and returns `output`, which the next tick overwrites."""
        row: Any = self.input
        for name, values in fields.items():
            row[name] = values
        self._tick()
        return self.output

    def run(self, inputs: NDArray[np.void], out: NDArray[np.void] | None = None) -> NDArray[np.void]:
        """One tick for each row of ``inputs``, an array of `Controller.inputs`. Returns the rows of outputs, in ``out`` if given.

        It copies nothing and releases the interpreter. Ctrl-C takes effect between blocks of 65,536 ticks.
        """
        if out is None:
            out = np.empty(inputs.shape, self.outputs)
        if inputs.dtype != self.inputs or out.dtype != self.outputs:
            raise TypeError("expected arrays of dtype controller.inputs and controller.outputs")
        if not (inputs.flags.c_contiguous and out.flags.c_contiguous):
            raise ValueError("expected contiguous arrays")
        self._library.run(_words(inputs), _words(out))
        return out

    @property
    def settings(self) -> dict[str, float]:
        """Settings of the spec; docs/settings.md has their ranges."""
        return dict(self._library.settings())

    def configure(self, **settings: float) -> None:
        """Sets settings; others get the values of the spec. For names with an index: ``configure(**{"kp[2]": 2e6})``.

        The state is kept. Raises `Error` if a value is out of its range; the settings are then unchanged.
        """
        self._library.configure(list(settings.items()))

    def reset(self) -> None:
        """Resets the state to power-up; the settings are kept."""
        self._library.reset()

    @property
    def state_digest(self) -> int:
        """Digest of the state. Controllers with equal state have equal outputs for equal inputs."""
        return self._library.state_digest()

    def __repr__(self) -> str:
        return f"Controller({self.name}, {self.digest[:16]}{', supervised' if self.supervised else ''})"


def _words(rows: NDArray[np.void]) -> NDArray[np.uint64]:
    """The same memory as words."""
    return rows.view(np.uint64)
