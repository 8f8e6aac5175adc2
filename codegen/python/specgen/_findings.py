"""What a command gives: findings, a result, or what is raised."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ._native import Error as Error


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


class Result(Mapping[str, Any]):
    """What a command found: the fields of its JSON."""

    def __init__(self, data: dict[str, Any], findings: list[Finding], reason: str | None) -> None:
        self.data = data
        self.findings = findings
        """About the spec or the record."""
        self.reason = reason
        """Why it does not pass, if it does not."""

    @property
    def passed(self) -> bool:
        """Whether it is good: what makes the command's exit code 0."""
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
    """Arguments that make no sense, or not together."""


class Unavailable(Error):
    """A tool is missing or fails, or a file cannot be written. ``cargo`` is needed only by what is built: exports, and `controller` with
    ``emitted``."""


class EndedEarly(Error):
    """A simulated run did not come to the end of its path, so that it has no figure. ``result`` has the other runs, if there are any."""

    def __init__(self, message: str, result: Result | None) -> None:
        super().__init__(message)
        self.result = result


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, with what was found until then."""

    def __init__(self, message: str, result: Result) -> None:
        super().__init__(message)
        self.result = result


def findings_of(document: dict[str, Any]) -> list[Finding]:
    """The findings of a command's document."""
    return [Finding(**finding) for finding in document["findings"]]
