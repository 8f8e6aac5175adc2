"""Findings, results and exceptions of commands."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ._native import Error as Error


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem of a spec or a record, its location, and a fix."""

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
    """The fix."""

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        return f"{self.severity}[{self.code}]: {self.message}\n  --> {place or self.key}\n   = help: {self.help}"


class Result(Mapping[str, Any]):
    """Result of a command: the fields of its JSON."""

    def __init__(self, data: dict[str, Any], findings: list[Finding], reason: str | None) -> None:
        self.data = data
        self.findings = findings
        """Findings about the spec or the record."""
        self.reason = reason
        """Why it does not pass, if it does not."""

    @property
    def passed(self) -> bool:
        """Whether the command's exit code is 0."""
        return self.reason is None

    def __getitem__(self, name: str) -> Any:
        return self.data[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.data)

    def __len__(self) -> int:
        return len(self.data)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self.data)}{'' if self.passed else f'; not passed: {self.reason}'})"


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
    """Invalid arguments, or an invalid combination."""


class Unavailable(Error):
    """A tool is missing or fails, or a file cannot be written. Only exports and `controller` with ``emitted`` need ``cargo``."""


class EndedEarly(Error):
    """A simulated run ended before the end of its path, so it has no score. ``result`` has the other runs, if there are any."""

    def __init__(self, message: str, result: Result | None) -> None:
        super().__init__(message)
        self.result = result


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, with the result so far."""

    def __init__(self, message: str, result: Result) -> None:
        super().__init__(message)
        self.result = result


def findings_of(document: dict[str, Any]) -> list[Finding]:
    """The findings of a command's document."""
    return [Finding(**finding) for finding in document["findings"]]
