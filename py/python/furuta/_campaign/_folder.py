"""The folder of a campaign: Parquet parts that appear whole or not at all, and what campaign they are of.

`_campaign.json` holds what the campaign is; `part-000000.parquet` and so on hold rows. Readers of Parquet folders
leave out names that begin with an underscore or a dot.
"""

from __future__ import annotations

import json
import os
import pathlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from furuta._campaign._error import CampaignError
from furuta._campaign._rows import Columns, stored, wider

if TYPE_CHECKING:
    from pyarrow import Table as _Table  # type: ignore

ABOUT = "_campaign.json"


def arrow() -> Any:
    """pyarrow, where it is installed."""
    try:
        import pyarrow  # type: ignore
        import pyarrow.parquet  # type: ignore
    except ImportError as e:
        raise ImportError('furuta.campaign needs pyarrow: pip install "furuta[campaign]"') from e
    return pyarrow


def _type(kind: str) -> Any:
    pa = arrow()
    if kind.startswith("list of "):
        return pa.list_(_type(kind.removeprefix("list of ")))
    simple = {"null": pa.null(), "bool": pa.bool_(), "int": pa.int64(), "float": pa.float64()}
    return simple.get(kind) or pa.string()


def schema_of(columns: Columns) -> Any:
    """The Arrow schema of these columns; a JSON column is text, marked so."""
    pa = arrow()
    marks = {"json": {"furuta": "json"}}
    fields = [pa.field(name, _type(kind), metadata=marks.get(kind)) for name, kind in columns.kinds.items()]
    return pa.schema(fields)


def kinds_of(schema: Any) -> dict[str, str]:
    """The types of a schema's columns, by name."""
    pa = arrow()

    def kind(type: Any, mark: Mapping[bytes, bytes] | None = None) -> str:
        if (mark or {}).get(b"furuta") == b"json":
            return "json"
        if pa.types.is_list(type) or pa.types.is_large_list(type):
            return f"list of {kind(type.value_type)}"
        for name, is_it in (
            ("null", pa.types.is_null),
            ("bool", pa.types.is_boolean),
            ("int", pa.types.is_int64),
            ("float", pa.types.is_float64),
            ("text", lambda of: pa.types.is_string(of) or pa.types.is_large_string(of)),
        ):
            if is_it(type):
                return name
        raise CampaignError(f"a column of a campaign cannot be of type {type}: bool_, int64, float64, string, list_")

    return {field.name: kind(field.type, field.metadata) for field in schema}


def table_of(rows: Sequence[Mapping[str, Any]], columns: Columns) -> _Table:
    """The rows as a table."""
    pa = arrow()
    schema = schema_of(columns)
    kinds = columns.kinds
    return pa.table(
        {name: [stored(row.get(name), kind) for row in rows] for name, kind in kinds.items()}, schema=schema
    )


def _warm() -> None:
    """Loads what Arrow loads with the first table (pandas, seconds of it): later, Ctrl-C would wait for it."""
    arrow().parquet.write_table(table_of([{"case": 0}], Columns()), arrow().BufferOutputStream())


def _whole(path: pathlib.Path, write: Any) -> None:
    """Writes a file beside its place and moves it there: it is there whole or not at all."""
    beside = path.with_name(f".{path.name}.tmp")
    with open(beside, "wb") as file:
        write(file)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)


class Folder:
    """The rows of a campaign on disk, or in memory alone where `path` is None. One campaign at a time holds it."""

    def __init__(self, path: pathlib.Path | None, about: Mapping[str, Any], columns: Columns) -> None:
        self.path, self.columns = path, columns
        self.tables: dict[str, Any] = {}
        """Parts by name, as they are on disk."""
        self.rows: list[Mapping[str, Any]] = []
        """Rows that are in no part yet."""
        self._lock: Any = None
        _warm()
        if path is None:
            return
        path.mkdir(parents=True, exist_ok=True)
        self._hold(path)
        try:
            self._begin(path, about)
        except BaseException:
            self.close()
            raise

    def _hold(self, path: pathlib.Path) -> None:
        try:
            import fcntl
        except ImportError:  # no such locks here: one campaign a folder is then the caller's business
            return
        self._lock = open(path / "_lock", "w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as e:
            self._lock.close()
            raise CampaignError(f"{path}: another campaign is writing there: wait for its end") from e

    def close(self) -> None:
        """Lets another campaign have the folder."""
        if self._lock is not None:
            self._lock.close()

    def _begin(self, path: pathlib.Path, about: Mapping[str, Any]) -> None:
        parts = sorted(path.glob("part-*.parquet"))
        if (path / ABOUT).exists():
            before = json.loads((path / ABOUT).read_text())
            if differs := difference(before, about):
                raise CampaignError(
                    f"{path} holds another campaign: {differs}; "
                    "take another folder, or delete this one to begin anew"
                )
        elif parts:
            raise CampaignError(f"{path} holds {parts[0].name} but no {ABOUT}: take another folder")
        text = json.dumps(dict(about), indent=1).encode()
        _whole(path / ABOUT, lambda file: file.write(text))
        pq = arrow().parquet
        for part in parts:
            table = pq.read_table(part)
            self.tables[part.name] = table
            for name, kind in kinds_of(table.schema).items():
                together = wider(self.columns.kinds.get(name, "null"), kind)
                if together is None:
                    raise CampaignError(f"{part}: column {name!r} is {kind}, and not so in the parts before")
                self.columns.kinds[name] = together
        cases = [case for table in self.tables.values() for case in table["case"].to_pylist()]
        if len(set(cases)) < len(cases):
            twice = next(case for case in cases if cases.count(case) > 1)
            raise CampaignError(f"{path} holds case {twice} twice: parts were copied there; delete the copies")
        self._same_types()

    def done(self) -> dict[int, str | None]:
        """The error, or None, by case, of the rows that are on disk."""
        return {
            case: error
            for table in self.tables.values()
            for case, error in zip(table["case"].to_pylist(), table["error"].to_pylist())
        }

    def forget(self, cases: set[int]) -> None:
        """Takes the rows of these cases out."""
        pa = arrow()
        for name, table in list(self.tables.items()):
            keep = [case not in cases for case in table["case"].to_pylist()]
            if not all(keep):
                self._write(name, table.filter(pa.array(keep)))

    def add(self, row: Mapping[str, Any]) -> None:
        """Takes a row; it is on disk after the next `flush`."""
        self.rows.append(row)

    def flush(self) -> None:
        """Writes the rows that came since the last time, as one more part."""
        if not self.rows or self.path is None:
            return
        self._same_types()
        number = 1 + max((int(name[5:-8]) for name in self.tables), default=-1)
        self._write(f"part-{number:06d}.parquet", table_of(self.rows, self.columns))
        self.rows = []

    def _write(self, name: str, table: Any) -> None:
        pq = arrow().parquet
        assert self.path is not None
        _whole(self.path / name, lambda file: pq.write_table(table, file))
        self.tables[name] = table

    def _same_types(self) -> None:
        """Gives all parts the columns of the newest: readers of the folder then find one schema."""
        schema = schema_of(self.columns)
        for name, table in list(self.tables.items()):
            if not table.schema.equals(schema):
                self._write(name, _cast(table, schema))

    def table(self) -> _Table:
        """All rows, in the order of the cases."""
        pa = arrow()
        schema = schema_of(self.columns)
        tables = [_cast(table, schema) for table in self.tables.values()]
        found = pa.concat_tables([*tables, table_of(self.rows, self.columns)])
        return found.sort_by("case").combine_chunks()


def _cast(table: Any, schema: Any) -> Any:
    """The table with the schema's columns, empty where it has none."""
    pa = arrow()
    held = {
        field.name: table[field.name].cast(field.type)
        if field.name in table.column_names
        else pa.nulls(table.num_rows, field.type)
        for field in schema
    }
    return pa.table(held, schema=schema)


def difference(before: Mapping[str, Any], now: Mapping[str, Any]) -> str | None:
    """What keeps two campaigns from being the same one; None if one goes on where the other ended.

    Cases may have been added at the end.
    """
    for what in ("format", "version of furuta", "seed"):
        if before.get(what) != now[what]:
            return f"its {what} is {before.get(what)}, not {now[what]}"
    was, work = before["work"], now["work"]
    if was != work:
        if was.get("name") != work.get("name"):
            return f"it was made by {was.get('name')}, not by {work.get('name')}"
        if was.get("source") != work.get("source"):
            return f"the code of {work.get('name')} has changed since"
        return f"what {work.get('name')} holds (arguments, defaults, enclosed variables) has changed since"
    differing = [k for k, (a, b) in enumerate(zip(before["cases"], now["cases"])) if a != b]
    if differing:
        others = f" and {len(differing) - 1} more" if len(differing) > 1 else ""
        return f"case {differing[0]}{others} of its {len(before['cases'])} cases is not the one given"
    if len(before["cases"]) > len(now["cases"]):
        return f"it has {len(before['cases'])} cases, and {len(now['cases'])} were given"
    return None


