"""Co-simulation of soft manipulators driven by twisted-and-coiled actuators: scenes, a master with rollback, results.

    import tca_cosim as tca
    result = tca.run("step", {"rod.order": 2})    # an xarray Dataset
    result.tca.plot()                             # also .animate() and .report(path)
    tca.write(result, Path("step.nc"))

Flow: scene -> master -> subsystems -> results -> charts; nothing later in it is imported by anything earlier. Modules
are loaded when something of them is used.
"""

from typing import TYPE_CHECKING

import lazy_loader as _lazy

from .visualization.registration import register as _register

if TYPE_CHECKING:
    from .api import Overrides, read, run
    from .engine import BatchResult, run_batch
    from .errors import CosimError, CouplingError, FmuWarning, Interrupted, SceneError, SceneWarning, SubsystemError
    from .results import write
    from .results.software import __version__
    from .scene import Coupling, Scene, titles
    from .stepping import SavedState, Simulation
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
    "SavedState",
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

_PACKAGES = [
    "benchmarks",
    "cli",
    "control",
    "cosim",
    "engine",
    "errors",
    "files",
    "fmi",
    "identification",
    "linear",
    "planning",
    "results",
    "scene",
    "simulation",
    "stepping",
    "studies",
    "verification",
    "visualization",
]

if not TYPE_CHECKING:  # type checkers see the imports above, and so which names there are
    __getattr__, __dir__, _ = _lazy.attach(
        __name__,
        submodules=_PACKAGES,
        submod_attrs={
            "api": ["Overrides", "read", "run"],
            "engine": ["BatchResult", "run_batch"],
            "errors": [
                "CosimError",
                "CouplingError",
                "FmuWarning",
                "Interrupted",
                "SceneError",
                "SceneWarning",
                "SubsystemError",
            ],
            "results": ["write"],
            "results.software": ["__version__"],
            "scene": ["Coupling", "Scene", "titles"],
            "stepping": ["SavedState", "Simulation"],
            "studies.many_runs": ["run_many"],
            "visualization.accessor": ["BodyView", "GifImage", "ResultAccessor"],
        },
    )

_register()
