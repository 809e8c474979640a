"""`Recording`: a recording of a rig, from a file, a DataFrame, a dict or arrays."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from furuta._columns import columns as _columns
from furuta._frame import frame
from furuta._columns import column
from furuta._furuta import RecordingError, _read_recording, _write_data

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Recording(Mapping[str, Any]):
    """A recording: evenly sampled columns t (s), u (V), theta and alpha (rad), and others.

    u is held until the next row; alpha is measured from upright. A recording is checked as it is made, and `notices`
    says what was noticed. Every function that takes a recording takes it, and checks it again only where its arrays
    were written to since; it is a mapping from the columns' names to arrays.

    Parameters
    ----------
    data : path, pandas.DataFrame, mapping or array_like of shape (N, 4), optional
        A CSV file or MCAP log; columns by name (a DataFrame may have t as its index); an array with the columns t, u,
        theta, alpha.
    name : str, optional
        What messages call it; the file's path if not given.
    **columns : array_like, shape (N,)
        Columns by name, in place of `data` or beside it.

    Attributes
    ----------
    name : str
    notices : list of str

    Raises
    ------
    RecordingError
        A recording that cannot be used: which, where, why. Rows in messages are indices, from 0, but for files, where
        they are lines.

    Examples
    --------
    >>> import numpy as np, furuta
    >>> t = 0.002 * np.arange(1000)
    >>> recording = furuta.Recording(t=t, u=np.sin(9 * t), theta=0 * t, alpha=np.pi + 0.1 * np.sin(7 * t))
    >>> recording
    <furuta.Recording 'recording-0': 1000 samples, 1.998 s at 500 Hz; t, u, theta, alpha>
    >>> furuta.Recording(recording.to_array()) == recording
    True
    """

    name: str
    notices: list[str]

    def __init__(
        self,
        data: str | os.PathLike[str] | Mapping[str, ArrayLike] | ArrayLike | Any | None = None,
        *,
        name: str | None = None,
        **columns: ArrayLike,
    ) -> None:
        if not isinstance(name, (str, type(None))):
            raise TypeError(f"name = {name!r} must be a str or None")
        given: Any = data
        if not isinstance(data, (str, os.PathLike)):
            named = isinstance(data, Mapping) or hasattr(data, "columns")
            given = {} if data is None else _columns(data if named else np.asanyarray(data))
            if given is None:
                raise TypeError(
                    "a recording is a path, a DataFrame, a mapping of columns or an array; "
                    f"a {type(data).__name__} was given"
                )
            given = _Named(given | columns, name or getattr(data, "name", None))
        elif columns:
            raise RecordingError("a file has its columns: read it first, Recording(path), and add to that")
        found, self._columns, self.notices, self._checked = _read_recording(given)
        self.name = name or found

    def __getstate__(self) -> dict[str, Any]:
        # What was checked is made again, by whatever takes the recording, where it was copied or has come from another
        # process.
        return self.__dict__ | {"_checked": None}

    def __getitem__(self, name: str) -> Any:
        return column(self._columns, name, "a recording")

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def t(self) -> NDArray[np.float64]:
        """Time, s."""
        return self._columns["t"]

    @property
    def u(self) -> NDArray[np.float64]:
        """Command, V, held until the next row."""
        return self._columns["u"]

    @property
    def theta(self) -> NDArray[np.float64]:
        """The arm's angle, rad."""
        return self._columns["theta"]

    @property
    def alpha(self) -> NDArray[np.float64]:
        """The pendulum's angle, rad, 0 upright."""
        return self._columns["alpha"]

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.t)

    @property
    def dt(self) -> float:
        """Sample period, s: the mean of the intervals that are within half of their median.

        Time stamps of few digits, as those in single precision, round each interval to one of a few lengths; the mean
        is none of these.
        """
        intervals = np.diff(self.t)
        usual = float(np.median(intervals))
        return float(np.mean(intervals[np.abs(intervals - usual) <= 0.5 * usual]))

    @property
    def duration(self) -> float:
        """From the first to the last sample, s."""
        return float(self.t[-1] - self.t[0])

    def to_dict(self) -> dict[str, Any]:
        """The columns as a dict of arrays; copies."""
        return {name: np.array(values) for name, values in self._columns.items()}

    def to_array(self) -> NDArray[np.float64]:
        """The columns t, u, theta, alpha as an array of shape (N, 4)."""
        return np.column_stack([self.t, self.u, self.theta, self.alpha])

    def to_pandas(self) -> Any:
        """The columns as a pandas.DataFrame, one row a sample; pandas must be installed."""
        return frame(self.to_dict())

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Writes a CSV file, from which the same numbers are read again.

        A file that is there already is replaced only with `force`. A path that ends in .mcap is refused: what is
        read from such a path is a log, not CSV.
        """
        if os.fspath(path).lower().endswith(".mcap"):
            raise RecordingError(f"{os.fspath(path)}: a recording is saved as CSV; give a path that ends in .csv")
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self._columns)
        writer.writerows(zip(*map(_fields, self._columns.values())))
        _write_data(os.fspath(path), text.getvalue(), force=force)

    def plot(self, *, ax: Any = None) -> Figure:
        """Draws both angles and the command over time with matplotlib; see `furuta.plot.trajectory`."""
        from furuta import plot

        return plot.trajectory(self, ax=ax)

    def __eq__(self, other: object) -> bool:
        """Recordings are equal that have the same columns with the same numbers, whatever they are called."""
        if not isinstance(other, Recording):
            return NotImplemented
        return self.keys() == other.keys() and all(_same(self[name], other[name]) for name in self)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        extent = f"{self.samples} samples, {self.duration:g} s at {1 / self.dt:.6g} Hz"
        return f"<furuta.Recording {self.name!r}: {extent}; {', '.join(self)}>"

    def _repr_html_(self) -> str:
        from furuta import _cards

        return _cards.recording(self)


class _Named(dict[str, Any]):
    """Columns with the name that messages call them by."""

    def __init__(self, columns: Mapping[str, Any], name: str | None) -> None:
        super().__init__(columns)
        if name is not None:
            self.name = name


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return np.array_equal(a, b, equal_nan=True)
    return list(a) == list(b)


def _fields(column: Any) -> list[Any]:
    """A column's values as the csv module takes them: None, an empty field, for what is not known."""
    if not isinstance(column, np.ndarray):
        return list(column)
    return [None if value != value else value for value in column.tolist()]
