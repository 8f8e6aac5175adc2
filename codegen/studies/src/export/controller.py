"""The controller of a spec for Python 3.8 or later, using only the standard library and the shared library beside this file.

    law = Controller()
    row = law.step(request=1, gauge=[0.0] * 6)    # omitted fields keep their values
    print(row["supervisor"] & 255, row["voltage"])    # phase: 0 disarmed, 1 arming, ...

Units: m, rad, N, V, s. A tick includes the supervisor; with ``supervised=False`` only the law runs, without supervision.
Reals are rounded to the scalar type of the controller. Groups of six words are lists.
The package `specgen` does the same with numpy arrays, a million ticks at a time.
"""

import ctypes
import pathlib
import re
import struct

LIBRARY = "@library@"
DIGEST = "@digest@"
ABI_VERSION = @abi@
# Additional words of a supervised tick, after those of the law; fields that are 32-bit integers.
SUPERVISED = @supervised@
WHOLE = @whole@


class Controller:
    """Settings and state of one controller. Only one thread may use it at a time; instances are independent."""

    def __init__(self, library=None, supervised=True):
        path = pathlib.Path(library) if library is not None else pathlib.Path(__file__).with_name(LIBRARY)
        self._library = ctypes.CDLL(str(path.resolve()))
        # Otherwise ctypes would return digests as signed 32-bit numbers.
        for digest in (self._library.specgen_state_digest, self._library.specgen_machine_digest):
            digest.restype = ctypes.c_uint64
        if self._library.specgen_abi_version() != ABI_VERSION:
            raise RuntimeError(f"{path} and this file do not match: export both again")
        about = self._about()
        if about["digest"] != DIGEST:
            raise RuntimeError(f"{path} is the controller of another spec: export both again")
        self.name, self.digest, self.version = about["name"], about["digest"], about["version"]
        self._real = ("<f", "<I") if about["scalar_bits"] == "32" else ("<d", "<Q")
        kind = "machine" if supervised else "state"
        self._step = getattr(self._library, "specgen_machine_step" if supervised else "specgen_step")
        self._reset = getattr(self._library, f"specgen_{kind}_reset")
        self._digest = getattr(self._library, f"specgen_{kind}_digest")
        names = [about[f"{way}_names"].split(",") for way in ("input", "output")]
        if supervised:
            names = [law + more for law, more in zip(names, SUPERVISED)]
        self._input, self._output = ((ctypes.c_uint64 * len(of))() for of in names)
        self.inputs, self.outputs = (_fields(of) for of in names)
        """Positions of the words of each field."""
        self.settings = _fields(about["config_names"].split(","))
        # 64-bit words, for alignment.
        self._state = (ctypes.c_uint64 * -(-int(about[f"{kind}_bytes"]) // 8))()
        self._config = (ctypes.c_uint64 * -(-int(about["config_bytes"]) // 8))()
        self._words = (ctypes.c_uint64 * len(about["config_names"].split(",")))()
        self._library.specgen_config_default(self._words)
        self._library.specgen_config_load(self._config, self._words)
        self.reset()

    def step(self, **fields):
        """One tick: sets the given input fields and returns the output fields."""
        for name, values in fields.items():
            self._put(self._input, self.inputs, name, values)
        self._step(self._config, self._state, self._input, self._output)
        return {name: self._take(self._output, name, places) for name, places in self.outputs.items()}

    def configure(self, **settings):
        """Changes settings; raises ValueError and changes nothing if one is out of its range."""
        words = type(self._words)(*self._words)
        for name, values in settings.items():
            self._put(words, self.settings, name, values)
        wrong = self._library.specgen_config_load(self._config, words)
        if wrong != 0:
            names = [name for name, places in self.settings.items() if wrong - 1 in places]
            raise ValueError(f"{names[0]} is out of its range")
        self._words = words

    def reset(self):
        """Resets the state to that at power-up; settings are kept."""
        self._reset(self._state)

    @property
    def state_digest(self):
        """Digest of the complete state."""
        return self._digest(self._state)

    def _about(self):
        text, length = ctypes.c_void_p(), ctypes.c_size_t()
        self._library.specgen_describe(ctypes.byref(text), ctypes.byref(length))
        lines = ctypes.string_at(text, length.value).decode().splitlines()
        return dict(line.split("=", 1) for line in lines)

    def _put(self, words, fields, name, values):
        if name not in fields:
            raise KeyError(f"{name}: expected one of {', '.join(fields)}")
        places = fields[name]
        values = list(values) if hasattr(values, "__iter__") else [values]
        if len(values) != len(places):
            raise ValueError(f"{name}: expected {len(places)} values, found {len(values)}")
        for place, value in zip(places, values):
            words[place] = int(value) & 0xFFFFFFFF if name in WHOLE else self._of_real(value)

    def _take(self, words, name, places):
        values = [words[place] if name in WHOLE else self._to_real(words[place]) for place in places]
        if name == "dac_code":
            values = [ctypes.c_int32(value).value for value in values]
        return values[0] if len(values) == 1 else values

    def _of_real(self, value):
        return struct.unpack(self._real[1], struct.pack(self._real[0], value))[0]

    def _to_real(self, word):
        return struct.unpack(self._real[0], struct.pack(self._real[1], word))[0]


def _fields(names):
    """Positions of words by name without index."""
    fields = {}
    for place, name in enumerate(names):
        fields.setdefault(re.sub(r"\[\d+\]$", "", name), []).append(place)
    return fields
