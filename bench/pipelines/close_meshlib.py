"""MeshLib closes the holes of an otherwise sound mesh with fillHoleNicely, patches refined to the edges around them and smoothed.

The flags are its own choices for the smoothing: equal weights instead of cotangent ones, vertices weighed by the area around them.
Its naturalSmooth is left off, since it moves the vertices around the hole, which are not broken.
"""

from meshlib import mrmeshpy
from shared import edge_around_holes, read_corners, run

# Subdivision halves edges that are longer than this many edges around, so that they become about as long on average.
LONGEST_EDGE = 1.4


def close(source, target, stages, equal, area):
    edge = edge_around_holes(read_corners(source))
    mesh = mrmeshpy.loadMesh(source)
    stages.end("load")
    for hole in mesh.topology.findHoleRepresentiveEdges():
        settings = mrmeshpy.FillHoleNicelySettings()
        settings.triangulateParams.metric = mrmeshpy.getUniversalMetric(mesh)
        settings.subdivideSettings.maxEdgeLen = LONGEST_EDGE * edge
        settings.subdivideSettings.maxEdgeSplits = 100_000
        settings.smoothCurvature = True
        if equal:
            settings.smoothSettings.edgeWeights = mrmeshpy.EdgeWeights.Unit
        if area:
            settings.smoothSettings.vmass = mrmeshpy.VertexMass.NeiArea
        mrmeshpy.fillHoleNicely(mesh, hole, settings)
    stages.end("close")
    mrmeshpy.saveMesh(mesh, target)
    stages.end("save")


run(close, "equal", "area")
