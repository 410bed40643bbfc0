"""Independent solution of a whole scene, to measure the co-simulation against.

It shares nothing with the FMUs but the scene's numbers, so the difference contains every error of both.

| part | here | in the FMUs |
|---|---|---|
| heat | quadratic triangles (scikit-fem), Radau IIA | spectral quadrilaterals, reduced, exponential integrator |
| rod at rest | shooting | polynomial strains, Newton |
| rod in motion | mixed elements (velocity, strain), Radau or DOP853 | polynomial strains, Rosenbrock and others |
| TCAs | inside the rod's equations | inside, or iterated by the master |

    from tca_cosim import read, run
    from tca_cosim.verification import reference
    scene = read("step")
    for gap in reference.compare(run(scene), reference.run(scene)):
        print(gap.name, gap.most, gap.unit)
"""

from ...results.comparison import Difference, compare
from .solve import Resolution, prepare, run

__all__ = ["Difference", "Resolution", "compare", "prepare", "run"]
