"""Radiosity: view factors, lux and heat by radiation of meshes and models.

Lengths are metres, temperatures kelvin, fluxes W/m². A face is seen from where its corners run
counter-clockwise: that is its front.

    import hemicube as hc
    F = hc.view_factors(vertices, faces, error=1e-3)
    F.matrix                      # scipy.sparse.csr_array: F[i, j] from face i to face j
    q = F.heat(T, emissivity=0.8) # net fluxes, W/m²

    scene = hc.load("room.glb")
    light = scene.light(error=0.01)
    E, half = light.probe(points, normals)

The guide is docs/python.md of the sources.
"""

from ._errors import Error, FileError, InputError, ModelWarning, OutOfMemory
from ._hemicube import __version__
from .factors import ViewFactors, view_factors
from .heat import HeatBalance
from .models import Mesh, read
from .scene import Light, Scene, load, luminance

__all__ = [
    "Error",
    "FileError",
    "HeatBalance",
    "InputError",
    "Light",
    "Mesh",
    "ModelWarning",
    "OutOfMemory",
    "Scene",
    "ViewFactors",
    "__version__",
    "load",
    "luminance",
    "read",
    "view_factors",
]
