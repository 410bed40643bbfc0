"""Co-simulation of soft manipulators driven by twisted-and-coiled actuators: scenes, a master with rollback, results.

    import tca_cosim as tca
    result = tca.run("step", {"rod.order": 2})    # an xarray Dataset
    result.tca.plot()                             # also .animate() and .report(path)
    tca.write(result, Path("step.nc"))

Flow: scene -> master -> subsystems -> results -> charts; nothing later in it is imported by anything earlier.
"""

from .api import Overrides, read, run
from .errors import CosimError, CouplingError, SceneError, SceneWarning, SubsystemError
from .results import write
from .scene import Coupling, Scene, titles
from .visualization.accessor import GifImage, ResultAccessor

__all__ = [
    "CosimError",
    "Coupling",
    "CouplingError",
    "GifImage",
    "Overrides",
    "ResultAccessor",
    "Scene",
    "SceneError",
    "SceneWarning",
    "SubsystemError",
    "read",
    "run",
    "titles",
    "write",
]
