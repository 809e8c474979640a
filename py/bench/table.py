"""The page that the comparisons end in: tables of Markdown, the machine, the versions."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import pathlib
import platform
import textwrap
from collections.abc import Iterable, Sequence

from clock import Timed, Work

# The name of a contender that does no work begins with this.
NOTHING = "an empty"
WIDTH = 120
UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns"))


@dataclasses.dataclass(frozen=True)
class Table:
    """A heading, a paragraph, a table, and remarks."""

    title: str
    about: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    remarks: Sequence[str] = ()
    # Who is faster than furuta, a sentence each.
    faster: Sequence[str] = ()


def duration(seconds: float) -> str:
    """Three digits and a unit: 1.23 ms."""
    for size, unit in UNITS:
        if seconds >= size * 0.9995 or unit == "ns":
            number = seconds / size
            digits = 2 if number < 9.995 else 1 if number < 99.95 else 0
            return f"{number:.{digits}f} {unit}"
    raise AssertionError("the last unit takes all")


def ratio(value: float) -> str:
    """Three digits: 0.85, 12.3, 805."""
    return f"{value:.2f}" if value < 9.995 else f"{value:.1f}" if value < 99.95 else f"{value:,.0f}"


def of(work: Work, timed: Sequence[Timed]) -> Table:
    """A work and its times as a table."""
    rows = [
        [
            one.name,
            duration(one.seconds),
            ratio(one.ratio),
            "" if one.error is None else f"{one.error:.0e}",
            "" if one.tolerance is None else f"{one.tolerance:.0e}",
        ]
        for one in timed
    ]
    header = ["", "processor time", "over ours", "off by", "allowed"]
    if all(one.error is None for one in timed):
        rows, header = [row[:3] for row in rows], header[:3]
    if work.count:
        rows = [[*row, f"{work.count / one.seconds:,.0f}"] for row, one in zip(rows, timed)]
        header.append("a second")
    return Table(work.title, work.about, header, rows, work.remarks, faster(work.title, timed))


def faster(title: str, timed: Sequence[Timed]) -> list[str]:
    """Who takes less than 95 % of our time, but for what does nothing."""
    return [
        f"{title}: {one.name}, {ratio(one.ratio)} of our time"
        for one in timed
        if one.ratio < 0.95 and not one.name.startswith(NOTHING)
    ]


def items(lines: Iterable[str]) -> str:
    """A list, a line each."""
    return "\n".join(textwrap.fill(f"- {line}", WIDTH, subsequent_indent="  ") for line in lines)


def markdown(table: Table) -> str:
    """A section of the page."""
    wrong = [row for row in table.rows if len(row) != len(table.header)]
    if wrong:
        raise ValueError(f"{table.title}: a row has {len(wrong[0])} cells, the header {len(table.header)}")
    cells = [table.header, ["---"] + ["---:"] * (len(table.header) - 1), *table.rows]
    lines = [" ".join(["|", " | ".join(cell.replace("|", "\\|") for cell in row), "|"]) for row in cells]
    parts = [f"## {table.title}", textwrap.fill(table.about, WIDTH), "\n".join(lines)]
    parts += [items(table.remarks)] if table.remarks else []
    return "\n\n".join(part.strip() for part in parts)


def versions(packages: Iterable[str]) -> list[tuple[str, str]]:
    """Of those that are installed; "not installed" of the others."""
    found = []
    for package in packages:
        try:
            found.append((package, importlib.metadata.version(package)))
        except importlib.metadata.PackageNotFoundError:
            found.append((package, "not installed"))
    return found


def processor() -> str:
    """Its name, and how many cores this program may use."""
    information = pathlib.Path("/proc/cpuinfo")
    names = [
        line.partition(":")[2].strip()
        for line in (information.read_text().splitlines() if information.exists() else [])
        if line.startswith("model name")
    ]
    return f"{names[0] if names else platform.processor() or platform.machine()}, {len(names) or '?'} cores"


def page(introduction: str, tables: Sequence[Table], packages: Sequence[tuple[str, str]]) -> str:
    """All of it."""
    used = Table("Versions", "What was compared.", ("package", "version"), packages)
    lines = [line for one in tables for line in one.faster]
    slower = items(lines) or "Nowhere in this run."
    parts = [introduction.strip(), f"## Where furuta is slower\n\n{slower}", *map(markdown, tables), markdown(used)]
    return "\n\n".join(parts) + "\n"
