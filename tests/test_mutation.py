"""Mutants of small modules: what is changed, what is left out by rule, and which function holds the change."""

from __future__ import annotations

import ast

import pytest
from mutation.operators import count, functions, mutate


def changes(source: str) -> list[str]:
    return sorted(f"{mutant.before} -> {mutant.after}" for mutant in (mutate(source, k) for k in range(count(source))))


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("x = a < b", ["a < b -> a <= b"]),
        ("x = a + 2", ["2 -> 3", "a + 2 -> a - 2"]),
        ("x = 0.0", ["0.0 -> 1.0"]),
        ("x = -3.0", ["-3.0 -> 3.0", "3.0 -> 6.0"]),
        ("x = not a", ["not a -> a"]),
        ("x = min(a, b)", ["min(a, b) -> max(a, b)"]),
        ("x = a if b else c", ["a if b else c -> c if b else a"]),
        ("if a:\n    b()", ["b() -> pass", "if a: -> if False:", "if a: -> if True:"]),
        ("def f():\n    return a", ["return a -> return None"]),
        ("a.b = c", ["a.b = c -> pass"]),
        ('"""Text 1 + 1."""\nx: Literal[1] = y\n__all__ = ["a" + "b"]', []),
        ("def f(a: 1 + 1) -> 2 + 2:\n    raise ValueError(1 + 1)", []),
        ("if TYPE_CHECKING:\n    x = 1", []),
        ("zip(a, b, strict=True)", ["zip(a, b, strict=True) -> pass"]),
        ('x = f"{a + 1}"', []),
    ],
)
def test_changes(source: str, expected: list[str]) -> None:
    assert changes(source) == sorted(expected)


def test_the_outermost_function_of_a_change_is_compiled_anew() -> None:
    source = "k = 1\nclass A:\n    @staticmethod\n    def f(x=2):\n        def g():\n            return x + 3\n"
    source += "        return g()\n"
    held = {mutant.before: mutant.function for mutant in (mutate(source, k) for k in range(count(source)))}
    assert held == {
        "1": None,
        "2": None,
        "3": ("f", 3),
        "x + 3": ("f", 3),
        "return x + 3": ("f", 3),
        "return g()": ("f", 3),
    }
    [changed] = [mutant for mutant in (mutate(source, k) for k in range(count(source))) if mutant.before == "3"]
    code = functions(changed.tree, "module.py")["f", 3]
    original = functions(ast.parse(source), "module.py")["f", 3]
    assert (code.co_name, code.co_freevars, code.co_varnames) == ("f", original.co_freevars, original.co_varnames)
    names: dict[str, object] = {}
    exec(source, names)
    f = names["A"].f  # type: ignore[attr-defined]
    assert f() == 5
    f.__code__ = code
    assert f() == 6
