"""Files of any size, in bounded memory."""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any

from . import _suture
from ._arrays import limits
from ._profile import profile_text

Progress = Callable[[str, int, int], object]


def inspect_file(
    path: str | os.PathLike[str],
    *,
    profile: str | dict[str, Any] = "default",
    memory: int | str | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Diagnoses a mesh file (STL, 3MF, PLY, OFF, OBJ, AMF) of any size and writes nothing. Returns the report.

    ``memory`` bounds what the system cannot take back, 1 GiB if not given; the file may be far larger.
    """
    spool = Path(path).absolute().parent
    return json.loads(
        _suture.inspect_file(path, profile_text(profile), *limits(memory, threads), spool, progress)
    )


def repair_file(
    path: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    profile: str | dict[str, Any] = "default",
    memory: int | str | None = None,
    threads: int | None = None,
    replace: bool = False,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Repairs a mesh file (STL, 3MF, PLY, OFF, OBJ, AMF) of any size into a new file, and returns the report.

    The output has the format that its name ends in (``.stl``, ``.3mf``, ``.ply``, ``.off``, ``.obj``, ``.amf``), or else that of the
    input; ``profile={"format": "stl"}`` chooses in any case. A 3MF of another format is a package with one object. A repaired PLY, OFF or OBJ
    keeps its colours, normals, texture coordinates and materials where the output is of its format; ``report["attributes"]`` counts.

    The output appears under its name when it is complete and on the disk, whatever the outcome: look at ``report["outcome"]``. It has the same
    bytes whatever ``memory`` and ``threads`` are. The input is never written to. If there is a file of that name already, it is replaced only
    if ``replace`` is true. Where ``report["output"]`` is ``None``, there is none: no triangle was left, or the file is not good and the profile
    repairs nothing (``"inspect-only"``).
    """
    output = Path(output)
    if not replace and os.path.lexists(output):
        raise FileExistsError(f"{output} exists already; replace=True replaces it")
    if output.is_dir():
        raise IsADirectoryError(f"{output} is a folder; the output is a file")
    if output.exists() and os.path.exists(path) and output.samefile(path):
        raise FileExistsError(f"{output} is the input, which is never overwritten")
    draft = output.absolute().parent / f".{secrets.token_hex(8)}.suture{output.suffix}"
    spool = draft.parent
    try:
        text = _suture.repair_file(path, draft, profile_text(profile), *limits(memory, threads), spool, progress)
        report = json.loads(text)
        if report["output"] is not None:
            if replace:
                os.replace(draft, output)
            else:
                os.link(draft, output)
            _sync_folder(spool)
            report["output"]["path"] = str(output)
        return report
    finally:
        draft.unlink(missing_ok=True)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
