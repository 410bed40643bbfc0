"""What a mutant may change: one comparison, operator, constant, condition, return, call or assignment.

Left out by rule, because no test can or should see them: docstrings, annotations, `__all__`, imports for type
checkers, the words of messages (f-strings and what `raise` says), and declarations that only guard against a mistake
of the programmer (`zip(strict=True)`, `@dataclass(frozen=True, slots=True)`).
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from types import CodeType

__all__ = ["Mutant", "count", "functions", "mutate"]

SWAPPED = {
    pair[way]: pair[1 - way]
    for pair in (
        (ast.Lt, ast.LtE),
        (ast.Gt, ast.GtE),
        (ast.Eq, ast.NotEq),
        (ast.In, ast.NotIn),
        (ast.Is, ast.IsNot),
        (ast.Add, ast.Sub),
        (ast.Mult, ast.Div),
        (ast.And, ast.Or),
    )
    for way in (0, 1)
} | {ast.Pow: ast.Mult, ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult}
OPPOSITE = {"min": "max", "max": "min", "any": "all", "all": "any"}
GUARDS = {"strict", "frozen", "slots"}  # keywords that guard against a mistake of the programmer


@dataclass(frozen=True)
class Mutant:
    """One change of a module. function: name and first line of the outermost function around it, None outside."""

    line: int
    before: str
    after: str
    tree: ast.Module
    function: tuple[str, int] | None


def left_out(tree: ast.Module) -> set[ast.AST]:
    """Return the nodes that no mutant changes."""
    skipped: set[ast.AST] = set()
    for node in ast.walk(tree):
        parts: list[ast.AST | None] = []
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            parts = [node.value]
        elif isinstance(node, (ast.AnnAssign, ast.arg)):
            parts = [node.annotation]
        elif isinstance(node, ast.FunctionDef):
            parts = [node.returns]
        elif (
            isinstance(node, (ast.Raise, ast.JoinedStr))
            or (isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__")
            or (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
            or (isinstance(node, ast.keyword) and node.arg in GUARDS)
        ):
            parts = [node]
        for part in parts:
            skipped.update(ast.walk(part) if part else ())
    return skipped


def replacements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what may stand in place of a node."""

    def changed(**fields: object) -> ast.AST:
        kept = {name: getattr(node, name) for name in node._fields}
        return type(node)(**{**kept, **fields})

    if isinstance(node, ast.Compare):
        for k, operator in enumerate(node.ops):
            if type(operator) in SWAPPED:
                yield changed(ops=[*node.ops[:k], SWAPPED[type(operator)](), *node.ops[k + 1 :]])
    elif isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign)) and type(node.op) in SWAPPED:
        yield changed(op=SWAPPED[type(node.op)]())
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub)):
        yield node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, (bool, int, float)):
        value = node.value
        yield changed(
            value=not value if isinstance(value, bool) else value + 1 if isinstance(value, int) else 2.0 * value or 1.0
        )
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in OPPOSITE:
        yield changed(func=ast.Name(OPPOSITE[node.func.id], ast.Load()))
    elif isinstance(node, ast.If):
        yield from (changed(test=ast.Constant(value)) for value in (True, False))
    elif isinstance(node, ast.IfExp):
        yield changed(body=node.orelse, orelse=node.body)
    elif isinstance(node, ast.Return) and node.value is not None and not isinstance(node.value, ast.Constant):
        yield changed(value=ast.Constant(None))
    elif (
        isinstance(node, (ast.Break, ast.Continue))
        or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call))
        or (isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Attribute))
    ):
        yield ast.Pass()


class Swap(ast.NodeTransformer):
    """Puts `new` in place of one node."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else self.generic_visit(node)


def _sites(tree: ast.Module) -> Iterator[tuple[ast.AST, ast.AST]]:
    skipped = left_out(tree)
    return ((node, new) for node in ast.walk(tree) if node not in skipped for new in replacements(node))


def count(source: str) -> int:
    """Return the number of mutants of a module."""
    return sum(1 for _ in _sites(ast.parse(source)))


def mutate(source: str, number: int) -> Mutant:
    """Return one mutant of a module."""
    tree = ast.parse(source)
    node, new = next(pair for k, pair in enumerate(_sites(tree)) if k == number)
    before = ast.unparse(node).split("\n")[0]
    around = _outermost_function(tree, node)
    changed = ast.fix_missing_locations(Swap(node, ast.copy_location(new, node)).visit(tree))
    return Mutant(node.lineno, before, ast.unparse(new).split("\n")[0], changed, around)


def _outermost_function(tree: ast.AST, node: ast.AST) -> tuple[str, int] | None:
    for child in ast.iter_child_nodes(tree):
        if isinstance(child, ast.FunctionDef):
            if any(node in ast.walk(statement) for statement in child.body):
                return child.name, min(each.lineno for each in (child, *child.decorator_list))
        elif (inner := _outermost_function(child, node)) is not None:
            return inner
    return None


def functions(tree: ast.Module, filename: str) -> dict[tuple[str, int], CodeType]:
    """Return (name, first line) -> compiled code of the functions of a module that lie in no other function."""
    codes: dict[tuple[str, int], CodeType] = {}
    waiting = [compile(tree, filename, "exec", dont_inherit=True)]
    while waiting:
        for constant in waiting.pop().co_consts:
            if isinstance(constant, CodeType):
                codes[constant.co_name, constant.co_firstlineno] = constant
                waiting.append(constant)
    return codes
