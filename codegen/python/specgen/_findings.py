"""Findings, and what is raised."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from ._native import Error as Error

if TYPE_CHECKING:
    from ._commands import Result


@dataclass(frozen=True, slots=True)
class Finding:
    """What is wrong or strange in a spec or a record, where, and how to mend it."""

    code: str
    """Stable code such as ``E0402``; ``specgen.explain(code)`` has its page."""
    severity: Literal["error", "warning", "note"]
    key: str | None
    """Key of the spec, such as ``actuator.voltage[1]``."""
    file: str | None
    line: int | None
    """Counted from 1."""
    column: int | None
    """Counted from 1, in characters."""
    message: str
    help: str
    """How to mend it."""

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        return f"{self.severity}[{self.code}]: {self.message}\n  --> {place or self.key}\n   = help: {self.help}"


class Refused(Error):
    """A spec or a record is refused. The attributes are those of its first error."""

    def __init__(self, message: str, findings: list[Finding]) -> None:
        errors = [finding for finding in findings if finding.severity == "error"] or findings
        super().__init__("\n".join([message, *map(str, errors)]))
        self.findings = findings
        first = errors[0]
        self.code = first.code
        self.key = first.key
        self.file = first.file
        self.line = first.line
        self.column = first.column
        self.help = first.help


class UsageError(Error, ValueError):
    """Arguments that make no sense, or not together."""


class Unavailable(Error):
    """A tool is missing or fails, or a file cannot be written. Without ``cargo`` nothing can be built: `compile`, `identify`, `predict`
    and ``Controller`` of a library that was built elsewhere need none."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, with what was found until then."""

    def __init__(self, message: str, result: Result) -> None:
        super().__init__(message)
        self.result = result


def findings_of(document: dict[str, Any]) -> list[Finding]:
    """The findings of a command's document."""
    return [Finding(**finding) for finding in document["findings"]]
