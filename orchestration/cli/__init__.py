"""The command line: one module per command. An error that a user can mend is one message and exit code 2."""

import os
import sys
from typing import TYPE_CHECKING

import lazy_loader as _lazy

if TYPE_CHECKING:
    from .application import app

__all__ = ["app", "main"]

if not TYPE_CHECKING:
    __getattr__, __dir__, _ = _lazy.attach(__name__, submod_attrs={"application": ["app"]})


def main() -> None:
    """Run the command of this process."""
    from .encoding import require_utf8
    from .plain import run_plain

    require_utf8()
    # The matrices of this package are small: threads of numpy's linear algebra cost more than they save. What the user
    # has set wins.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if not run_plain(sys.argv[1:]):
        from .application import app

        app()
