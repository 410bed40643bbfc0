"""Fuzzing of modelDescription.xml, aware of its structure: an FMU is read, or refused in one line that names it.

`python tests/fuzz_description.py COUNT [SEED]` runs a long campaign by hand; test_fuzz_description.py runs a sample.
"""

from __future__ import annotations

import random
import re
import sys
import tempfile
import time
import zipfile
from collections import Counter
from pathlib import Path

import numpy as np
from fmu_maker import boolean, enumeration, integer, make_fmu, real, string
from lxml import etree
from tca_cosim.errors import SceneError
from tca_cosim.fmi.archive import Archive
from tca_cosim.fmi.vectors import find_vectors
from tca_cosim.results.dataset import arrays

VALUES = (
    "", " ", "0", "1", "-1", "1.0", "1,5", "1e400", "-1e400", "NaN", "INF", "nan", "inf", "true", "True", "maybe",
    "99999999999999999999", "4294967296", "2147483648", "0x10", "1e-320", "٣", "ä", "a" * 5000, "../../etc", "/", "\\",
    "y[1]", "y[0]", "y[999999999]", "y[1,2]", "y[", "T[-1]", "y[01]", "a.b.c", "->", "K", "degC", "input", "output",
    "parameter", "local", "independent", "constant", "fixed", "discrete", "continuous", "exact", "2.0", "3.0", "1.0.1",
)  # fmt: skip
SLOW = 5.0  # [s] that reading a description of a few variables must not take, also on a loaded machine


def seed_description(folder: Path) -> bytes:
    """A description with everything in it that an FMU may declare."""
    items = '<Item name="a" value="3"/><Item name="b" value="-1"/>'
    types = f'<SimpleType name="G"><Enumeration>{items}</Enumeration></SimpleType>'
    units = '<Unit name="degC"><BaseUnit K="1" offset="273.15"/><DisplayUnit name="K"/></Unit><Unit name="bare"/>'
    variables = [
        *(real(f"y[{k}]", unit="degC", nominal=10) for k in (1, 2, 3)),
        real("u", "input", start=1.0, min=0, max=2),
        real("x", start=0.0),
        real("der(x)", "local"),
        integer("n", "parameter", start=4),
        boolean("on", "input", start="true"),
        string("text", "parameter", start="ä"),
        enumeration("gear", "parameter", start=3, declaredType="G"),
        real("M[1,1]"),
        real("M[1,2]"),
    ]
    path = make_fmu(
        folder / "seed.fmu", variables, types=types, units=units, states={"x": "der(x)"}, indicators=1,
        model_exchange={}, experiment={"stopTime": 1, "tolerance": 1e-6}, categories=["log"], platform="",
    )  # fmt: skip
    with zipfile.ZipFile(path) as archive:
        return archive.read("modelDescription.xml")


def mutated(source: bytes, rng: random.Random) -> bytes:
    """One to four changes: of attributes, of elements, sometimes of bytes."""
    root = etree.fromstring(source)
    for _ in range(rng.randint(1, 4)):
        elements = list(root.iter(etree.Element))
        element = rng.choice(elements)
        kind = rng.randrange(7)
        if kind <= 2 and element.attrib:
            element.set(rng.choice(list(element.attrib)), rng.choice(VALUES))
        elif kind == 3 and element.attrib:
            del element.attrib[rng.choice(list(element.attrib))]
        elif kind == 4 and element is not root:
            element.getparent().remove(element)
        elif kind == 5 and element is not root:
            copy = etree.fromstring(etree.tostring(element))
            rng.choice(elements).append(copy)
        else:
            other = rng.choice(elements)
            element.tag = other.tag if rng.random() < 0.5 else "Real"
    text = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    if rng.random() < 0.1:
        at = rng.randrange(len(text))
        text = text[:at] + bytes([rng.randrange(256)]) * rng.randint(0, 3) + text[at + rng.randint(0, 9) :]
    return text


def outcome(path: Path) -> str:
    """'read', or the kind of refusal. Raises AssertionError where an answer is neither."""
    begin = time.process_time()
    try:
        with Archive(path) as archive:
            find_vectors(archive.variables)
            numbers = [v for v in archive.variables.values() if v.type != "String"]
            arrays("m", numbers, np.zeros((1, len(numbers))))
        result = "read"
    except SceneError as error:
        text = str(error)
        assert text.startswith(f"{path}: "), text
        assert "\n" not in text, text
        result = re.sub(r"'.*'|\d+", "_", text.removeprefix(str(path)))[:40]
    assert time.process_time() - begin < SLOW
    return result


def campaign(count: int, seed: int, folder: Path) -> Counter[str]:
    """Outcomes of `count` mutated descriptions."""
    rng, source, outcomes = random.Random(seed), seed_description(folder), Counter[str]()
    path = folder / "fuzzed.fmu"
    for _ in range(count):
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("modelDescription.xml", mutated(source, rng))
        outcomes[outcome(path)] += 1
    return outcomes


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        for line, often in campaign(int(sys.argv[1]), int((sys.argv[2:] or [0])[0]), Path(scratch)).most_common():
            print(f"{often:8} {line}")
