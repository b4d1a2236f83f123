"""Meshes in memory."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _suture
from ._arrays import as_faces, as_vertices, limits, whole_number
from ._profile import profile_text
from ._result import Repaired

Progress = Callable[[str, int, int], object]


class _Given:
    """A caller's mesh, as the engine reads it."""

    def __init__(self, vertices: ArrayLike, faces: ArrayLike):
        self.vertices, self.rounding = as_vertices(vertices)
        self.faces = as_faces(faces, len(self.vertices))

    def report(self, text: str) -> dict[str, Any]:
        report = json.loads(text)
        if self.rounding is not None:
            report["rounding"] = self.rounding
        return report

    def repaired(self, arrays: tuple[Any, ...]) -> Repaired:
        vertices, faces, origin, origin_face, text = arrays
        return Repaired(vertices, faces, origin, origin_face, self.report(text))


def inspect(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    profile: str | dict[str, Any] = "default",
    memory: int | str | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Diagnoses a mesh: returns the report, with the counts of its defects, its boundary loops, and a verdict."""
    mesh = _Given(vertices, faces)
    text = _suture.inspect(mesh.vertices, mesh.faces, profile_text(profile), *limits(memory, threads), progress)
    return mesh.report(text)


def repair(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    profile: str | dict[str, Any] = "default",
    memory: int | str | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Repaired:
    """Repairs a mesh. The faces become those that the command line writes for a file of the same triangles, in the same order.

    ``vertices`` are n rows of x, y and z; float32 is what the engine works in, and is not copied if it lies row by row; anything else is
    rounded, and ``report["rounding"]`` says how far. ``faces`` are m rows of three vertices; uint32 is not copied. ``profile`` is a name of
    ``suture.PROFILES``, or a dictionary of settings. ``memory`` ("512MiB", or bytes) is what the engine may use beside the mesh; 1 GiB if not
    given. ``progress`` is called with a stage, and how much of how much is done in it, some twenty times a second at most.

    Other threads run meanwhile, and must leave the arrays alone. Ctrl-C ends the work.
    """
    mesh = _Given(vertices, faces)
    arrays = _suture.repair(mesh.vertices, mesh.faces, profile_text(profile), *limits(memory, threads), progress)
    return mesh.repaired(arrays)


def find_defects(
    vertices: ArrayLike, faces: ArrayLike, *, memory: int | str | None = None, threads: int | None = None
) -> dict[str, Any]:
    """Counts the defects of a mesh (``core/DEFECTS.md`` defines them). Self-intersections are not looked for."""
    mesh = _Given(vertices, faces)
    return json.loads(_suture.find_defects(mesh.vertices, mesh.faces, *limits(memory, threads)))


@dataclass(frozen=True, eq=False)
class Loop:
    """A boundary loop."""

    vertices: NDArray[np.uint32]
    """Its vertices in order; of several at one position, the first one. A patch that is wound this way is wound as the surface around."""

    facts: dict[str, Any]
    """``class`` (what kind of opening it is), ``rule`` (why), ``at``, ``perimeter``, ``area`` and more; ``core/REPORT.md`` describes them."""


def find_loops(
    vertices: ArrayLike, faces: ArrayLike, *, memory: int | str | None = None, threads: int | None = None
) -> list[Loop]:
    """Finds all boundary loops of a mesh, and what kinds of openings they are."""
    mesh = _Given(vertices, faces)
    found = _suture.find_loops(mesh.vertices, mesh.faces, *limits(memory, threads))
    return [Loop(way, json.loads(facts)) for way, facts in found]


@dataclass(frozen=True, eq=False)
class Intersections:
    """The self-intersections of a mesh."""

    pairs: NDArray[np.uint32] | None
    """All pairs of faces that cross or overlap, ascending; ``None`` if there are too many to be kept."""

    overlap: NDArray[np.bool_] | None
    """By pair: the faces lie in one plane and share an area."""

    counts: dict[str, Any]
    """``triangles``, ``crossing_pairs``, ``overlapping_pairs``; ``given_up`` if there were too many to be looked at."""


def find_self_intersections(
    vertices: ArrayLike, faces: ArrayLike, *, memory: int | str | None = None, threads: int | None = None
) -> Intersections:
    """Finds all pairs of faces that cross or overlap each other, beyond the corners they share. Exact."""
    mesh = _Given(vertices, faces)
    arrays, counts = _suture.find_self_intersections(mesh.vertices, mesh.faces, *limits(memory, threads))
    pairs, overlap = arrays if arrays is not None else (None, None)
    return Intersections(pairs, overlap, json.loads(counts))


def certificate(
    vertices: ArrayLike, faces: ArrayLike, *, memory: int | str | None = None, threads: int | None = None
) -> dict[str, Any]:
    """What each rule of a printable mesh finds; ``printable`` says whether all of them passed."""
    mesh = _Given(vertices, faces)
    return json.loads(_suture.certificate(mesh.vertices, mesh.faces, *limits(memory, threads)))


def fill_loops(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    only: int | None = None,
    shape: str = "fair",
    max_edges: int = 20_000,
    sheets: bool = False,
    memory: int | str | None = None,
    threads: int | None = None,
) -> Repaired:
    """Closes boundary loops, and does nothing else.

    ``only`` is a vertex: only the loop through it is closed. ``shape`` of patches is "fair" (they continue the surface around), "implicit" (the
    same by another method), or "flat" (no new vertices). Loops of more than ``max_edges`` edges stay open, and so do the rims of lone sheets,
    unless ``sheets`` is true.
    """
    mesh = _Given(vertices, faces)
    place = None
    if only is not None:
        only = whole_number(only, "a vertex", 32)
        if only >= len(mesh.vertices):
            raise ValueError(f"there is no vertex {only}; there are {len(mesh.vertices)}")
        place = mesh.vertices[only].tolist()
    how = (place, shape, whole_number(max_edges, "max_edges", 32), sheets)
    return mesh.repaired(_suture.fill(mesh.vertices, mesh.faces, how, *limits(memory, threads)))


def orient(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    by_visibility: bool = True,
    memory: int | str | None = None,
    threads: int | None = None,
) -> Repaired:
    """Turns faces, so that neighbours agree and closed surfaces enclose what is inside of them. Does nothing else."""
    mesh = _Given(vertices, faces)
    return mesh.repaired(_suture.orient(mesh.vertices, mesh.faces, by_visibility, *limits(memory, threads)))


def union(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    visible_only: bool = False,
    separate: bool = True,
    memory: int | str | None = None,
    threads: int | None = None,
) -> Repaired:
    """Makes bodies that cross one body, and removes what lies in the material of others. Does nothing else.

    ``visible_only`` removes what cannot be seen from outside, too. ``separate`` takes surfaces apart that share an edge or a vertex.
    """
    mesh = _Given(vertices, faces)
    arrays = _suture.union(mesh.vertices, mesh.faces, (visible_only, separate), *limits(memory, threads))
    return mesh.repaired(arrays)


def wrap(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    max_share: float = 1.0,
    max_move: float = 0.05,
    memory: int | str | None = None,
    threads: int | None = None,
) -> Repaired:
    """Replaces surface that bounds no solid by a closed one around the space that it encloses. Does nothing else.

    ``max_share`` bounds the share of the surface that may be replaced, ``max_move`` how far surface may lie from what replaces it, as a fraction of
    the bounding box's diagonal.
    """
    mesh = _Given(vertices, faces)
    arrays = _suture.wrap(mesh.vertices, mesh.faces, (max_share, max_move), *limits(memory, threads))
    return mesh.repaired(arrays)
