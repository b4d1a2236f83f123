"""MeshLib's own repairs one after the other, as its application offers them, to make a solid of any print file.

Close vertices are united within a tolerance relative to the model; multiple edges and degenerate faces are removed; holes are filled;
self-intersections are cut out and filled; holes that are left are filled. A step that refuses the mesh is named on standard error and
skipped.
"""

import sys

from meshlib import mrmeshpy
from shared import run

UNITE_WITHIN_DIAGONAL = 1e-5
TINY_EDGE_OF_DIAGONAL = 1e-6


def fill_holes(mesh):
    for hole in mesh.topology.findHoleRepresentiveEdges():
        settings = mrmeshpy.FillHoleParams()
        settings.metric = mrmeshpy.getUniversalMetric(mesh)
        mrmeshpy.fillHole(mesh, hole, settings)


def remove_degenerate(mesh, diagonal):
    settings = mrmeshpy.FixMeshDegeneraciesParams()
    settings.maxDeviation = UNITE_WITHIN_DIAGONAL * diagonal
    settings.tinyEdgeLength = TINY_EDGE_OF_DIAGONAL * diagonal
    settings.mode = mrmeshpy.FixMeshDegeneraciesParams.Mode.Remesh
    mrmeshpy.fixMeshDegeneracies(mesh, settings)


def resolve(mesh):
    settings = mrmeshpy.SelfIntersections.Settings()
    settings.method = mrmeshpy.SelfIntersections.Settings.Method.CutAndFill
    mrmeshpy.SelfIntersections.fix(mesh, settings)


def repair(source, target, stages):
    mesh = mrmeshpy.loadMesh(source)
    diagonal = mesh.computeBoundingBox().diagonal()
    stages.end("load")
    steps = (
        ("unite close vertices", lambda: mrmeshpy.uniteCloseVertices(mesh, UNITE_WITHIN_DIAGONAL * diagonal)),
        ("multiple edges", lambda: mrmeshpy.fixMultipleEdges(mesh)),
        ("degenerate faces", lambda: remove_degenerate(mesh, diagonal)),
        ("fill holes", lambda: fill_holes(mesh)),
        ("self-intersections", lambda: resolve(mesh)),
        ("fill holes", lambda: fill_holes(mesh)),
    )
    for name, step in steps:
        try:
            step()
        except Exception as refusal:
            print(f"{name} skipped: {refusal}", file=sys.stderr)
        stages.end(name)
    mesh.pack()
    mrmeshpy.saveMesh(mesh, target)
    stages.end("save")


run(repair)
