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
    """A field of 8 bytes a word; those that come in sixes are one field."""
    fields: dict[str, tuple[str, int]] = {}
    for name, real in words:
        stem = re.sub(r"\[\d+\]$", "", name)
        count = fields[stem][1] if stem in fields else 0
        fields[stem] = ("<f8" if real else "<u8", count + 1)
    return np.dtype([(name, kind) if count == 1 else (name, kind, (count,)) for name, (kind, count) in fields.items()])


class Controller:
    """The very controller that the other targets run, on this computer: the same inputs give the same bits.

    `controller` makes one of a spec, without building anything; ``Controller(library)`` loads a library that `export_c` or an emitted
    workspace has. With ``supervised`` a tick is that of the whole machine with its phases; without, the law alone, which nothing
    watches over.

    Values are in m, rad, N, V, s. Fields are named as the words are: ``inputs.names``, ``outputs.names``. One controller is run by
    one thread at a time; others of the same library are independent of it.
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
        """What a row of inputs is: ``np.zeros(1000, controller.inputs)``."""
        self.outputs = _dtype(self._library.outputs())
        """What a row of outputs is."""
        rows = np.zeros(1, self.inputs), np.zeros(1, self.outputs)
        self._library.bind(_words(rows[0]), _words(rows[1]))
        self.input: np.void = rows[0][0]
        """The row that `step` reads; its fields keep their values: ``controller.input["setpoint"] = pose``."""
        self.output: np.void = rows[1][0]
        """The row that `step` writes."""
        self._tick = self._library.step

    def step(self, **fields: ArrayLike) -> np.void:
        """One tick: takes the fields that are given into `input`, and returns `output`, which the next tick overwrites."""
        row: Any = self.input
        for name, values in fields.items():
            row[name] = values
        self._tick()
        return self.output

    def run(self, inputs: NDArray[np.void], out: NDArray[np.void] | None = None) -> NDArray[np.void]:
        """A tick for each row of ``inputs``, an array of `Controller.inputs`; the rows of outputs, in ``out`` if it is given.

        Nothing is copied, and the interpreter is free meanwhile. Ctrl-C ends it between two blocks of 65,536 ticks.
        """
        if out is None:
            out = np.empty(inputs.shape, self.outputs)
        if inputs.dtype != self.inputs or out.dtype != self.outputs:
            raise TypeError("arrays of dtype controller.inputs and controller.outputs are expected")
        if not (inputs.flags.c_contiguous and out.flags.c_contiguous):
            raise ValueError("contiguous arrays are expected")
        self._library.run(_words(inputs), _words(out))
        return out

    @property
    def settings(self) -> dict[str, float]:
        """Settings of the spec; docs/settings.md has their ranges."""
        return dict(self._library.settings())

    def configure(self, **settings: float) -> None:
        """Takes settings, those that are not named as in the spec; names with an index: ``configure(**{"gain[2]": 1.0})``.

        The state is kept. Raises `Error` for a value out of its range; the settings in force then stay.
        """
        self._library.configure(list(settings.items()))

    def reset(self) -> None:
        """The state as at power-up; the settings are kept."""
        self._library.reset()

    @property
    def state_digest(self) -> int:
        """Digest of all that a tick hands to the next: equal where every later output is."""
        return self._library.state_digest()

    def __repr__(self) -> str:
        return f"Controller({self.name}, {self.digest[:16]}{', supervised' if self.supervised else ''})"


def _words(rows: NDArray[np.void]) -> NDArray[np.uint64]:
    """The same memory as words."""
    return rows.view(np.uint64)
