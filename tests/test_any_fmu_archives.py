"""Scenes of small foreign FMUs: copies of libraries, processes, archives as tools write them."""

from __future__ import annotations

import codecs
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
from fmu_maker import integer, real, string
from tca_cosim.errors import FmuWarning
from tca_cosim.fmi.archive import Archive, cached_archive
from tca_cosim.scene import read

# -- instances ---------------------------------------------------------------------------------------------------------

GLOBAL = "static double shared; static int instances;"
ONCE = {"canBeInstantiatedOnlyOncePerProcess": "true"}


@pytest.mark.parametrize("archive", [Archive, cached_archive])
@pytest.mark.parametrize("declared", [{}, ONCE])
def test_two_of_one_fmu_share_no_globals(
    make: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, archive: Any, declared: dict[str, str]
) -> None:
    """Also in many runs of one process, whose archives stay extracted; the library refuses a second instance."""
    refuse = 'if (instances++) { LOG(fmi2Error, "one instance per process"); free(m); return NULL; }'
    fmu = make(
        "g", [real("k", "parameter", start=1.0), real("y")], head=GLOBAL, enter="shared = real[0];",
        output="real[1] = shared;", instantiate=refuse, co_simulation=declared,
    )  # fmt: skip
    monkeypatch.chdir(tmp_path)
    for first in (3.0, 4.0):
        table = {"stop_time": 1.0, "connections": [], "fmus": {"a": fmu, "b": fmu}, "a": {"k": first}, "b": {"k": 5.0}}
        result = tca.run(read(table, archive=archive))
        assert (result["a.y"][-1], result["b.y"][-1]) == (first, 5.0)


def test_one_instance_per_process_means_another_process(make: Callable, scene: Callable) -> None:
    """All that a run needs goes through to it: values of all types, a loop with rollback, warnings, the end."""
    step = """
    real[2] = getpid();
    integer[1] = integer[0] + 1;
    snprintf(string[1], TEXT, "<%s>", string[0]);
    LOG(fmi2Warning, "careful");
    if (real[4] > 0 && t + h > 0.6) { m->reached = 0.6; m->terminated = 1; return fmi2Discard; }
    """
    numbers = [real("u", "input", start=0.0), real("y"), real("process"), real("k", "parameter", start=1.0)]
    numbers.append(real("last", "parameter", start=0.0))
    others = [integer("n", "input", start=0), integer("more"), string("text", "input", start="none"), string("shown")]
    fmu = make(
        "p", [*numbers, *others], head="#include <unistd.h>", step=step, output="real[1] = real[3] * real[0] + 1.0;",
        co_simulation=ONCE,
    )  # fmt: skip
    wires = ("a.y -> b.u", "b.y -> a.u", "a.more -> b.n", "a.shown -> b.text")
    with pytest.warns(FmuWarning, match="careful") as caught:
        result = tca.run(scene({"a": fmu, "b": fmu}, *wires, a={"k": 2.0}, b={"k": -3.0, "last": 1.0}))
    assert result["a.process"][-1] != result["b.process"][-1]
    np.testing.assert_allclose(result["a.y"][1:], 3.0 / 7.0, atol=1e-6)  # y = 2 (1 - 3 y) + 1
    assert result["b.more"].values[-1] == 2
    assert result["b.shown"].values[-1] == "<<none>>"
    assert float(result["time"][-1]) == pytest.approx(0.6)
    assert len(caught) == 2


def test_a_process_that_dies_is_an_error(make: Callable, scene: Callable) -> None:
    fmu = make(
        "p", [real("y"), real("k", "parameter", start=0.0)], step="if (real[1] > 0) abort();", co_simulation=ONCE
    )
    with pytest.raises(tca.CosimError, match=r"b: its process ended \(exit code -6\)"):
        tca.run(scene({"a": fmu, "b": fmu}, b={"k": 1.0}))


# -- files -------------------------------------------------------------------------------------------------------------


def rewritten(path: Path, target: str, change: Callable[[str, bytes], tuple[str, bytes] | None]) -> str:
    """A copy of an archive whose files went through `change`."""
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(path.with_name(target), "w") as sink:
        for name in source.namelist():
            changed = change(name, source.read(name))
            if changed is not None:
                entry = zipfile.ZipInfo("x")
                entry.filename = changed[0]
                sink.writestr(entry, changed[1])
    return target


XML = "modelDescription.xml"


def in_encoding(name: str, content: bytes, encoding: str) -> tuple[str, bytes]:
    text = content.decode().replace("UTF-8", encoding).replace('generationTool="fmu_maker"', 'generationTool="Größe"')
    return name, text.encode(encoding) if name == XML else content


READABLE: dict[str, Callable[[str, bytes], tuple[str, bytes] | None]] = {
    "backslashes": lambda name, content: (name.replace("/", "\\"), content),
    "byte-order mark": lambda name, content: (name, codecs.BOM_UTF8 + content if name == XML else content),
    "ISO-8859-1": lambda name, content: in_encoding(name, content, "ISO-8859-1") if name == XML else (name, content),
    "UTF-16": lambda name, content: in_encoding(name, content, "UTF-16") if name == XML else (name, content),
}


@pytest.mark.parametrize("kind", READABLE)
def test_archives_as_tools_write_them(make: Callable, scene: Callable, tmp_path: Path, kind: str) -> None:
    make("plain", [real("y")], output="real[0] = t;")
    file = rewritten(tmp_path / "plain.fmu", f"other {kind} ü.fmu", READABLE[kind])
    assert tca.run(scene({"a": file}))["a.y"][-1] == 1.0


REFUSED: dict[str, tuple[Callable[[str, bytes], tuple[str, bytes] | None], str]] = {
    "folder": (lambda name, content: (f"plain/{name}", content), r"it lies at plain/modelDescription.xml"),
    "32 bits": (lambda name, content: (name.replace("linux64", "linux32"), content), r"binaries for linux32; export"),
    "no library": (lambda name, content: None if name.startswith("bin") else (name, content), r"for no platform"),
    "outside": (lambda name, content: (f"../{name}" if name != XML else name, content), r"outside the folder"),
    "no XML": (lambda name, content: None if name == XML else (name, content), r"no modelDescription.xml"),
    "cut XML": (lambda name, content: (name, content[:300]), r"not a readable FMU"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_archives_that_are_refused(make: Callable, scene: Callable, tmp_path: Path, kind: str) -> None:
    make("plain", [real("y")], output="real[0] = t;")
    change, message = REFUSED[kind]
    file = rewritten(tmp_path / "plain.fmu", "other.fmu", change)
    with pytest.raises(tca.CosimError, match=rf"other.fmu.*{message}"):
        tca.run(scene({"a": file}))


def test_files_that_are_no_archives(scene: Callable, tmp_path: Path) -> None:
    (tmp_path / "text.fmu").write_text("hello")
    (tmp_path / "empty.fmu").write_bytes(b"")
    for name in ("text.fmu", "empty.fmu"):
        with pytest.raises(tca.SceneError, match=rf"{name}: not a readable FMU"):
            scene({"a": name})
    with pytest.raises(tca.SceneError, match="no FMU"):
        scene({"a": "x" * 300 + ".fmu"})


def test_resources_in_folders_of_any_name(
    make: Callable, scene: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their location is a URI; long names of FMUs do not make the folder's too long."""
    read = r"""
    char path[4096], *out = path;
    for (const char *in = m->resources + strlen("file://"); *in; out++)
      if (*in == '%') { unsigned code; sscanf(in + 1, "%2x", &code); *out = (char)code; in += 3; } else *out = *in++;
    strcpy(out, "/my file.txt");
    FILE *file = fopen(path, "r");
    if (!file) { LOG(fmi2Error, "cannot open %s", path); return NULL; }
    fscanf(file, "%lf", &memory[0]);
    fclose(file);
    """
    name = "r" * 240
    make(name, [real("y")], output="real[0] = memory[0];", instantiate=read, files={"resources/my file.txt": "42"})
    folder = tmp_path / "a folder ü%41"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    assert tca.run(scene({"a": f"{name}.fmu"}))["a.y"][-1] == 42.0
