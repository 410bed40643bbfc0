"""README and the pages of docs/: every command and script runs, every command in the text exists, every link leads
somewhere, and the site builds without a warning.

Blocks of the kinds `sh` and `python` run here, page by page in one folder; `{code-cell}` blocks run while the site is
built; `console` blocks show what a test cannot do, such as installing."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from tca_cosim.cli import app

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [page for page in PAGES if page.name != "reference.md" and "_build" not in page.parts]
FENCE = re.compile(r"^(`{3,})(\S*)[^\n]*\n(.*?)^\1\s*$", re.MULTILINE | re.DOTALL)
PLACEHOLDER = re.compile(r"^[A-Z_]+$")  # SCENE, NAME


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def blocks(page: Path) -> Iterator[tuple[str, str]]:
    """Kind and text of the fenced blocks of a page."""
    for _, kind, text in FENCE.findall(page.read_text(encoding="utf-8")):
        yield kind, text


def prose(page: Path) -> str:
    """The page without its fenced blocks."""
    return FENCE.sub("", page.read_text(encoding="utf-8"))


def commands() -> list[tuple[str, str]]:
    """Page and command of every line of a `sh` block, each command once."""
    lines = [
        (line, page) for page in PAGES for kind, text in blocks(page) if kind == "sh" for line in text.splitlines()
    ]
    first: dict[str, str] = {}
    for line, page in lines:
        first.setdefault(line, name_of(page))
    return [(page, line) for line, page in first.items() if line]


def scripts() -> list[tuple[str, str]]:
    return [(name_of(page), text) for page in PAGES for kind, text in blocks(page) if kind == "python"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a tca-cosim on its PATH that is this source tree's."""
    command = tmp_path / "bin" / "tca-cosim"
    command.parent.mkdir()
    # As pip writes it; the processes of a sweep import it too.
    start = "from tca_cosim.cli import main\n\nif __name__ == '__main__':\n    main()\n"
    command.write_text(f"#!{sys.executable}\n{start}", encoding="utf-8")
    command.chmod(0o755)
    return tmp_path


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PATH": f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"}
    return subprocess.run(
        ["bash", "-c", command], cwd=folder, env=environment, capture_output=True, text=True, timeout=600, check=False
    )


def steps(page: Path) -> list[str]:
    """Commands and scripts of a page in their order, each command once."""
    texts = []
    for kind, text in blocks(page):
        if kind == "sh":
            texts += [line for line in text.splitlines() if line and not line.startswith("make ")]
        elif kind == "python":
            texts.append(f"{sys.executable} - <<'END'\n{text}\nEND")
    return list(dict.fromkeys(texts))


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if steps(page)], ids=name_of)
def test_commands_and_scripts_of_a_page_run(page: Path, folder: Path) -> None:
    """One after the other in one folder: later ones need files of earlier ones."""
    for step in steps(page):
        done = run(step, folder)
        assert done.returncode == 0, f"{step}\n{done.stderr}"
        assert done.stdout or not step.startswith(sys.executable), step


def test_the_example_of_the_readme_has_about_ten_lines() -> None:
    (script,) = [text for page, text in scripts() if page == "README.md"]
    assert len([line for line in script.splitlines() if line]) <= 10


def test_make_targets_exist() -> None:
    pages = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    targets = set(re.findall(r"^\$? ?make (\w+)$", pages, re.MULTILINE)) | set(re.findall(r"`make (\w+)`", pages))
    assert {"demo", "test", "check", "docs"} <= targets
    declared = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert targets <= set(declared)


def test_make_demo_ends_with_the_figure() -> None:
    """make test is what runs this; the command that make demo ends with is run by another of these tests."""
    dry = subprocess.run(
        ["make", "--no-print-directory", "-n", "demo"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert dry.stdout.splitlines()[-1].endswith("tca-cosim paper")
    assert "tca-cosim paper" in [line for _, line in commands()]


# -- commands in the text


COMMANDS = typer.main.get_command(app).commands


def inline() -> list[tuple[str, str]]:
    actual = {page: re.findall(r"`tca-cosim ([^`]+)`", prose(page).replace("\n", " ")) for page in PAGES}
    return [(name_of(page), text) for page, texts in actual.items() for text in texts]


@pytest.mark.parametrize(("page", "text"), inline(), ids=[f"{page}: {text}" for page, text in inline()])
def test_command_in_the_text_exists(page: str, text: str) -> None:
    """Its name and its options do; values are not tried."""
    words = shlex.split(text)
    command = COMMANDS.get(words[0])
    if page == "CHANGELOG.md" and command is None:
        return  # a former name
    assert command, f"{page}: there is no command {words[0]}"
    options = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
    assert {word.split("=")[0] for word in words if word.startswith("-")} <= options
    if not any(PLACEHOLDER.match(word) for word in words[1:]):
        command.make_context(words[0], words[1:], resilient_parsing=True)


# -- links


def anchors(page: Path) -> set[str]:
    """Anchors of a page: its labels, and its headings as they are spelt in addresses."""
    text = prose(page)
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    slugs = {re.sub(r"[^\w -]", "", heading.lower().replace("`", "")).strip().replace(" ", "-") for heading in headings}
    return slugs | set(re.findall(r"^\(([\w-]+)\)=$", text, re.MULTILINE))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if re.match(r"https?://", target):
            assert target.startswith("https://"), target
            continue
        path, _, anchor = target.partition("#")
        linked = (page.parent / path).resolve() if path else page
        assert linked.exists(), f"{name_of(page)} links to {target}"
        if anchor:
            assert anchor in anchors(linked), f"{name_of(page)} links to {target}"


SOURCE = re.compile(r"`((?:orchestration|rod_fmu|thermal_fmu|fmus|tests|docs)/[^`\s*]*)`")


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_files_that_a_page_names_exist(page: Path) -> None:
    missing = [path for path in SOURCE.findall(prose(page)) if not (ROOT / path).exists()]
    assert not missing, f"{name_of(page)} names {', '.join(missing)}"


# -- the site


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    """Runs the cells of the tutorials and the gallery as well."""
    pytest.importorskip("myst_nb")
    build = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "-d", str(tmp_path / "trees")]
    done = subprocess.run(
        [*build, str(ROOT / "docs"), str(tmp_path / "site")], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr
    pages = list((tmp_path / "site").rglob("*.html"))
    assert len(pages) >= len([page for page in PAGES if page.is_relative_to(ROOT / "docs")])
    for page in pages:
        sources = re.findall(
            r"<(?:script|link|img)\b[^>]*(?:src|href)=\"(https?:[^\"]+)\"", page.read_text(encoding="utf-8")
        )
        assert not sources, f"{page.name} loads {sources[0]} from the network"
