"""Soft ground for legged robots (docs/python.md): the ground itself, presses and fits of it, and the environments.

Units are SI and radians, z points up. What is wrong with an argument is raised as one ValueError, TypeError or
RuntimeError that names it."""
from . import _processor

__path__.insert(0, str(_processor.folder()))  # the compiled files for this processor

from ._ground import Batch, Ground, Map, Material, Press, Sole, Terrain, __version__, models, presets, press
from .fit import GroundFit, loading
from .live import RunningGround, ground
from .spec import attach, load_plugin
from .trials import layouts, trial

__all__ = ["Batch", "Ground", "GroundFit", "Map", "Material", "Press", "RunningGround", "Sole", "Terrain", "attach", "ground", "layouts", "load_plugin",
           "loading", "models", "presets", "press", "trial"]

try:
    import gymnasium as _gymnasium
except ImportError:  # `pip install mildground[gym]` for the environments
    pass
else:
    from .gym import register as _register

    _register()
