"""A DataFrame of columns, where pandas is installed."""

from __future__ import annotations

from typing import Any


def frame(columns: dict[str, Any]) -> Any:
    """The columns as a pandas.DataFrame, one row a sample."""
    try:
        import pandas  # type: ignore
    except ImportError as e:
        raise ImportError("to_pandas needs pandas, which is not installed: pip install pandas") from e
    return pandas.DataFrame(columns)
