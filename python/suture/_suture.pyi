"""The engine. Arrays lie row by row; what is text is JSON."""

from collections.abc import Callable
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__: list[str]
__version__: str
ORIGINS: list[str]

_Vertices = NDArray[np.float32]
_Faces = NDArray[np.uint32]
_Progress = Callable[[str, int, int], object] | None
_Path = str | PathLike[str]
_Repaired = tuple[_Vertices, _Faces, NDArray[np.uint8], NDArray[np.int64], str]

def built_in_profile(name: str) -> str: ...
def inspect(
    vertices: _Vertices, faces: _Faces, profile: str, memory: int | None, threads: int | None, progress: _Progress
) -> str: ...
def repair(
    vertices: _Vertices, faces: _Faces, profile: str, memory: int | None, threads: int | None, progress: _Progress
) -> _Repaired: ...
def inspect_file(
    input: _Path, profile: str, memory: int | None, threads: int | None, spool: _Path | None, progress: _Progress
) -> str: ...
def repair_file(
    input: _Path,
    output: _Path,
    profile: str,
    memory: int | None,
    threads: int | None,
    spool: _Path | None,
    progress: _Progress,
) -> str: ...
def find_defects(vertices: _Vertices, faces: _Faces, memory: int | None, threads: int | None) -> str: ...
def find_loops(
    vertices: _Vertices, faces: _Faces, memory: int | None, threads: int | None
) -> list[tuple[NDArray[np.uint32], str]]: ...
def find_self_intersections(
    vertices: _Vertices, faces: _Faces, memory: int | None, threads: int | None
) -> tuple[tuple[NDArray[np.uint32], NDArray[np.bool_]] | None, str]: ...
def certificate(vertices: _Vertices, faces: _Faces, memory: int | None, threads: int | None) -> str: ...
def fill(
    vertices: _Vertices,
    faces: _Faces,
    how: tuple[list[float] | None, str, int, bool],
    memory: int | None,
    threads: int | None,
) -> _Repaired: ...
def orient(
    vertices: _Vertices, faces: _Faces, by_visibility: bool, memory: int | None, threads: int | None
) -> _Repaired: ...
def union(
    vertices: _Vertices, faces: _Faces, how: tuple[bool, bool], memory: int | None, threads: int | None
) -> _Repaired: ...
def wrap(
    vertices: _Vertices, faces: _Faces, how: tuple[float, float], memory: int | None, threads: int | None
) -> _Repaired: ...
