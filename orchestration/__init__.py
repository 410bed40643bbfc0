"""Co-simulation of soft manipulators driven by twisted-and-coiled actuators: scenes, a master with rollback, results.

    import orchestration as tca
    result = tca.run(tca.read("step"))       # an xarray Dataset
    tca.write(result, Path("step.nc"))

Flow: scene -> master -> subsystems -> results -> charts; nothing later in it is imported by anything earlier.
"""

from .errors import CosimError, CouplingError, SceneError, SubsystemError
from .results import write
from .scene import Coupling, Scene, read, titles
from .simulate import run

__all__ = [
    "CosimError",
    "Coupling",
    "CouplingError",
    "Scene",
    "SceneError",
    "SubsystemError",
    "read",
    "run",
    "titles",
    "write",
]
