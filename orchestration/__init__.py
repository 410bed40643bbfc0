"""Co-simulation of soft manipulators driven by twisted-and-coiled actuators: scenes, a master with rollback, results.

    import tca_cosim as tca
    result = tca.run("step", {"rod.order": 2})    # an xarray Dataset
    result.tca.plot()                             # also .animate() and .report(path)
    tca.write(result, Path("step.nc"))

Flow: scene -> master -> subsystems -> results -> charts; nothing later in it is imported by anything earlier. Modules
are loaded when something of them is used.
"""

from typing import TYPE_CHECKING

from .lazy import importer as _importer
from .visualization.registration import register as _register

if TYPE_CHECKING:
    from .api import Overrides, read, run
    from .engine import BatchResult, run_batch
    from .errors import CosimError, CouplingError, FmuWarning, Interrupted, SceneError, SceneWarning, SubsystemError
    from .results import write
    from .results.software import __version__
    from .scene import Coupling, Scene, titles
    from .stepping import Simulation
    from .studies.many_runs import run_many
    from .visualization.accessor import BodyView, GifImage, ResultAccessor

__all__ = [
    "BatchResult",
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
    "run_batch",
    "run_many",
    "titles",
    "write",
]

_HOMES = {
    **dict.fromkeys(("Overrides", "read", "run"), "api"),
    **dict.fromkeys(
        (
            "CosimError",
            "CouplingError",
            "FmuWarning",
            "Interrupted",
            "SceneError",
            "SceneWarning",
            "SubsystemError",
        ),
        "errors",
    ),
    **dict.fromkeys(("Coupling", "Scene", "titles"), "scene"),
    **dict.fromkeys(("BodyView", "GifImage", "ResultAccessor"), "visualization.accessor"),
    "__version__": "results.software",
    "run_many": "studies.many_runs",
    **dict.fromkeys(("BatchResult", "run_batch"), "engine"),
    "Simulation": "stepping",
    "write": "results",
}
if not TYPE_CHECKING:  # type checkers see the imports above, and so which names there are
    __getattr__ = _importer(__name__, _HOMES)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


_register()
