"""specgen compiles a description of a piezo-driven Stewart platform to its controller.

>>> import specgen
>>> compiled = specgen.compile("platform.toml")
>>> law = compiled.controller()
>>> rows = law.run(numpy.zeros(1000, law.inputs))
>>> specgen.simulate("platform.toml", frequency=10)["motions"]

Only exports and ``controller(…, emitted=True)`` need ``cargo``; nothing else is built.
"""

from ._commands import (
    Compiled,
    Identification,
    Prediction,
    Replayed,
    Robustness,
    Simulation,
    command,
    compile,
    controller,
    explain,
    export_c,
    export_fmu,
    export_python,
    identify,
    learn,
    predict,
    record,
    replay,
    robust,
    simulate,
    tune,
)
from ._controller import Controller
from ._findings import EndedEarly, Error, Finding, Interrupted, Refused, Result, Unavailable, UsageError
from ._machine import Machine
from ._table import Table, read_table

__all__ = [
    "Compiled",
    "Controller",
    "EndedEarly",
    "Error",
    "Finding",
    "Identification",
    "Interrupted",
    "Machine",
    "Prediction",
    "Refused",
    "Replayed",
    "Result",
    "Robustness",
    "Simulation",
    "Table",
    "Unavailable",
    "UsageError",
    "command",
    "compile",
    "controller",
    "explain",
    "export_c",
    "export_fmu",
    "export_python",
    "identify",
    "learn",
    "predict",
    "read_table",
    "record",
    "replay",
    "robust",
    "simulate",
    "tune",
]
