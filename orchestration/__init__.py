"""Co-simulation of soft manipulators driven by twisted-and-coiled actuators: scenes, a master with rollback, results.

    import tca_cosim as tca
    result = tca.run("step", {"rod.order": 2})    # an xarray Dataset
    result.tca.plot()                             # also .animate() and .report(path)
    tca.write(result, Path("step.nc"))

Flow: scene -> master -> subsystems -> results -> charts; nothing later in it is imported by anything earlier.
"""

from .api import Overrides, read, run
from .errors import CosimError, CouplingError, FmuWarning, Interrupted, SceneError, SceneWarning, SubsystemError
from .results import versions, write
from .scene import Coupling, Scene, titles
from .stepping import Simulation
from .visualization.accessor import BodyView, GifImage, ResultAccessor

__version__ = versions()["tca-cosim"]
__all__ = [
    "BodyView",
    "CosimError",
    "Coupling",
    "CouplingError",
    "FmuWarning",
    "GifImage",
    "Interrupted",
    "Overrides",
    "ResultAccessor",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Simulation",
    "SubsystemError",
    "__version__",
    "read",
    "run",
    "titles",
    "write",
]
