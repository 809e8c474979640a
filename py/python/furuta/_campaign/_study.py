"""`study`: one study of the command line, its runs shared out by a campaign."""

from __future__ import annotations

import os
import pathlib
import tempfile
from collections.abc import Callable
from typing import Any

from furuta._campaign import campaign
from furuta._campaign._error import CampaignError
from furuta._campaign._kinds import SHARED, answers_of, lines_of
from furuta._furuta import Rig

PARTS = 32
"""Parts into which a study is cut: some for each core of a workstation or a small cluster."""


def study(
    name: str,
    rig: Rig | str | os.PathLike[str] | None = None,
    *,
    parts: int = PARTS,
    out: str | os.PathLike[str] | None = None,
    executor: Any = None,
    workers: int | None = None,
    retries: int = 2,
    progress: bool | Callable[[int, int], object] | None = None,
    **options: Any,
) -> Any:
    """`furuta study NAME`, its runs shared out over all cores of this machine, or a Ray or Dask cluster.

    The answer is that of the command, to the last digit, whatever the number of parts and workers.

    Parameters
    ----------
    name : {"swing-up", "region", "calibration"}
        Which study: the draws of "swing-up", the starts of "region", the recordings of "calibration" are shared out.
    rig : Rig, its name or the path of its file, optional
        All built-in ones if not given.
    parts : int, optional
        Into how many parts the runs are cut.
    out, executor, workers, retries, progress
        As of `furuta.campaign`: with `out`, a study that was broken off goes on.
    **options
        Those of the command: `draws=100` is `--draws 100`, `set={"motor.command_limit": 12}` is
        `--set motor.command_limit=12`. `plot="swing-up.svg"` draws.

    Returns
    -------
    dict or list of dict
        What the command prints with `--json`: one for each rig.

    Raises
    ------
    CampaignError
        A study that has no parts, or a part that no worker could compute: its error.

    Examples
    --------
    >>> import furuta
    >>> found = furuta.study("region", "shahzad2022-srv02", points=5, parts=2, workers=1)
    >>> len(found["controllers"]) > 3
    True
    """
    if name not in SHARED:
        raise CampaignError(f"the study {name!r} has no runs to share out; those that have: {', '.join(SHARED)}")
    if parts < 1:
        raise CampaignError(f"parts = {parts}: at least 1")
    case = {"study": name, "rig": rig, **options}
    drawn = {key: value for key, value in case.items() if key != "plot"}
    cases = [{**drawn, "part": f"{k}/{parts}"} for k in range(1, parts + 1)]
    table = campaign(
        "study", cases, out=out, executor=executor, workers=workers, retries=retries, again=True, progress=progress
    )
    for error in table["error"].to_pylist():
        if error is not None:
            raise CampaignError(error)
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for k, answer in enumerate(table["answer"].to_pylist()):
            path = pathlib.Path(folder) / f"part-{k}.jsonl"
            path.write_text(lines_of(answer))
            files.append(path)
        return answers_of({**case, "parts": files})
