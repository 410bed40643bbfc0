"""A group of commands whose modules are imported when one of them is called.

The list of all commands takes their help from the docstrings in the files, which are parsed and not run.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Mapping
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

__all__ = ["lazy_group"]


class _Unloaded(TyperCommand):
    """A command that is known by name and file."""

    def __init__(self, name: str, package: str, module: str, panel: str) -> None:
        self._package, self._module = package, module
        super().__init__(name)
        self.panel = panel

    @cached_property
    def loaded(self) -> TyperCommand:
        """The command itself."""
        app = typer.Typer(add_completion=False, rich_markup_mode="markdown")
        app.command(self.name)(import_module(f".{self._module}", self._package).command)
        command = typer.main.get_command(app)
        assert isinstance(command, TyperCommand)
        return command

    def __getattribute__(self, name: str) -> Any:
        # Whoever looks at more than the name sees the command itself.
        if name in ("params", "callback", "help") and "panel" in vars(self):
            return getattr(self.loaded, name)
        return super().__getattribute__(name)

    def get_short_help_str(self, limit: int = 45) -> str:
        """Return the first sentence of the command's docstring."""
        file = Path(str(import_module(self._package).__file__)).with_name(f"{self._module}.py")
        tree = ast.parse(file.read_text(encoding="utf-8"))
        texts = [
            ast.get_docstring(node)
            for node in tree.body
            if isinstance(node, ast.FunctionDef) and node.name == "command"
        ]
        words = inspect.cleandoc(texts[0] or "").split("\n\n")[0].split() if texts else []
        return re.split(r"\.(?= [A-Z]|$)|; | \(", " ".join(words))[0]


def lazy_group(package: str, commands: Mapping[str, Mapping[str, str]]) -> type[TyperGroup]:
    """Return the class of a group.

    Parameters
    ----------
    package
        Package of the modules, each of which has a function `command`.
    commands
        Heading of the help -> name of a command -> its module.
    """

    class Group(TyperGroup):
        def __init__(self, **options: Any) -> None:
            own = options.pop("commands", None) or {}
            unloaded = {
                name: _Unloaded(name, package, module, panel)
                for panel, modules in commands.items()
                for name, module in modules.items()
            }
            super().__init__(commands={**unloaded, **own}, **options)

        def resolve_command(self, ctx: Any, args: list[str]) -> Any:
            name, command, rest = super().resolve_command(ctx, args)
            return name, command.loaded if isinstance(command, _Unloaded) else command, rest

        def format_commands(self, ctx: Any, formatter: Any) -> None:
            """Write the commands under their headings."""
            for panel, modules in commands.items():
                with formatter.section(panel):
                    formatter.write_dl([(name, self.commands[name].get_short_help_str()) for name in modules])

    return Group
