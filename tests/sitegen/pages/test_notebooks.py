"""Notebooks: valid, small, in plain Markdown, with self-contained pictures; and they run."""

from __future__ import annotations

import base64
import html
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import nbformat
import pytest
from nbclient import NotebookClient

from sitegen.markup.inline import BLOCK, INLINE
from sitegen.pages.notebooks import written
from tests.sitegen.check_site import check_site
from tests.sitegen.conftest import START, TOY, Project, cache_without_drawings
from widgets.drawing.picture import Picture, Readout

ROOT = Path(__file__).resolve().parents[3]
LARGEST = 400_000  # bytes
IMAGE = re.compile(r'<img alt="([^"]+)" width="[\d.]+" src="data:image/svg\+xml;base64,([^"]+)">')
OURS = re.compile(rf"::?(?:{'|'.join((*BLOCK, *INLINE))})\[|\[@|\[\^|^#.*\{{#|\$\$ \(", re.MULTILINE)


def read(path: Path) -> nbformat.NotebookNode:
    return nbformat.reads(path.read_text("utf-8"), as_version=nbformat.NO_CONVERT)


@pytest.fixture(scope="module")
def books(site: Path, pytestconfig: pytest.Config) -> dict[str, nbformat.NotebookNode]:
    """The built site's notebooks by name; with --pages, only those of the given pages."""
    pages = pytestconfig.getoption("--pages")
    paths = {path.stem: path for path in sorted((site / "notebooks").glob("*.ipynb"))}
    assert len(paths) >= 17, f"no notebooks in {site}: run `python3 build.py` first"
    return {name: read(path) for name, path in paths.items() if not pages or f"{name}.html" in pages.split(",")}


def text_of(book: nbformat.NotebookNode, kind: str = "markdown") -> str:
    return "\n\n".join(cell.source for cell in book.cells if cell.cell_type == kind)


def test_a_chapter_is_put_into_plain_markdown(project: Project) -> None:
    """Directives, citations, notes and macros are expanded; formulas and tables stay; all links are absolute."""
    project.build()
    book = read(project.site / "notebooks" / "second.ipynb")
    nbformat.validate(book)
    text = text_of(book)
    assert book.cells[0].source.startswith("# The </title><script>alert(1)</script> second\n\n*Is it")
    assert re.match(r"# %pip install registration_ladder-[\d.]+-py3-none-any\.whl$", book.cells[1].source)
    assert r"A first paragraph with $a^2 \in \mathbb{R}$ and a note.<sup>1</sup> It cites ([" in text
    assert "](https://example.org/ladder/references.html#ref-one2001)" in text
    assert "−7.250. It *holds*." in text
    assert r"\tag{1.1}" in text
    assert "> Beside the *point*." in text
    assert "> <sup>1</sup> The note, with (" in text
    figure = "[Figure 1.1](https://example.org/ladder/second.html#fig-demo)"
    assert f"- To try on the page, in {figure}: Press **go** twice." in text
    assert text.endswith(
        "- Ada One (2001). [First things](https://doi.org/10.1000/one).\n"
        "- Ben Two, Cy van der Three, Di Four (2002). [More & <more>?](https://example.org/two)"
    )
    assert not OURS.search(text)
    assert not re.search(r"\]\((?!https://)", text)
    before = (project.site / "notebooks" / "second.ipynb").read_bytes()
    project.build()
    assert (project.site / "notebooks" / "second.ipynb").read_bytes() == before
    for name, old, new in (  # it is cached by its inputs, and none is forgotten
        ("content/references.yaml", "First things", "Other things"),
        ("content/references.yaml", "year: 2001\n", "year: 2001\n  venue: Proc. A.\n"),
        ("content/site.yaml", "mathbb", "mathbf"),
        ("content/site.yaml", "A. Tester", "B. Tester"),
        ("content/01-second.md", "A first paragraph", "A paragraph"),
    ):
        project.write(name, (project.root / name).read_text("utf-8").replace(old, new))
        project.build()
        after = (project.site / "notebooks" / "second.ipynb").read_bytes()
        assert after != before, new
        before = after
    assert "(https://doi.org/10.1000/one). Proc. A.\n" in text_of(read(project.site / "notebooks" / "second.ipynb"))
    assert [str(p) for p in check_site(project.site, project.cache) if "notebook" in p.message] == []
    assert "notebooks/second.ipynb" in project.page("second.html")


def test_a_figure_is_its_pictures_its_readouts_and_its_python(project: Project) -> None:
    """The first picture has the figure's description, others their panels' labels; degrees follow their number closely,
    and what has no value yet is left out. A plot has its picture and its words; code of the chapter is a cell."""

    def draw(state: Any) -> Picture:
        picture = TOY.draw(state)
        (panel,) = picture.panels
        second = replace(panel, name="second", label="The <other> one", caption="Below it")
        readouts = (*picture.readouts, Readout("turn", "Turn", "−25", "°"), Readout("left", "Left", "–"))
        return replace(picture, panels=(panel, second), readouts=readouts)

    project.widgets["toy"] = replace(TOY, draw=draw, python=lambda state: "print(1)\n")
    project.cache = cache_without_drawings(project.cache, project.root / "cache")
    project.write("content/00-start.md", START.partition("Read")[0])
    project.chapter("\n::figure[F.]{toy id=demo}\n\n```python\nx = 1\n```\n\n::plot[Dots.]{toy-plot id=dots}\n")
    project.build()
    book = read(project.site / "notebooks" / "second.ipynb")
    text = text_of(book)
    assert "\n\nPresses: 0; Noise: 0.10 u; Turn: −25°.\n" in f"{text}\n"
    pictures = [(html.unescape(words), base64.b64decode(data).decode()) for words, data in IMAGE.findall(text)]
    assert [words for words, _ in pictures[:2]] == ["</script> 0 presses of clean with seed 40.", "The <other> one"]
    assert ["Below it" in svg for _, svg in pictures] == [False, True, False]
    assert "**[Figure 1.2](https://example.org/ladder/second.html#fig-dots).** Dots.\n\n<img " in text
    script, own = [cell.source for cell in book.cells if cell.cell_type == "code"][1:]
    assert (script.splitlines()[-1], own) == ("print(1)", "x = 1")


def test_a_caption_follows_its_leading_sentence(project: Project) -> None:
    """The bar between them is left out; those in code, in emphasis and after it are not."""
    second = (project.root / "content/01-second.md").read_text("utf-8")
    caption = "Press `a | b`, *c | d*. | Then |x| or e | f."
    project.write("content/01-second.md", second.replace("The *caption*: see :ref[eq:energy] and $x$.", caption))
    project.build()
    text = text_of(read(project.site / "notebooks" / "second.ipynb"))
    assert ").** Press `a | b`, *c | d*. Then |x| or e | f.\n" in text


def test_a_link_by_name_has_its_address(project: Project) -> None:
    """Since the line that states the address is not a block, and so is left out."""
    links = "[a][N], [`]` [b] $c$][n], [n][], [n] and <https://example.org/d>."
    second = (project.root / "content/01-second.md").read_text("utf-8")
    project.write("content/01-second.md", f"{second}\n{links}\n\n[n]: 00-start.md 'Title'\n")
    project.build()
    text = text_of(read(project.site / "notebooks" / "second.ipynb"))
    to = "(https://example.org/ladder/index.html)"
    assert f"[a]{to}, [`]` [b] $c$]{to}, [n]{to}, [n]{to} and <https://example.org/d>." in text


def test_macros_are_expanded_to_the_end(project: Project) -> None:
    """A macro may use another, whichever comes first, and may have arguments."""
    macros = {r"\Rn": r"\R^{#1}", r"\norm": r"\lVert #1 \rVert_#2"}
    site = (project.root / "content/site.yaml").read_text("utf-8")
    project.write("content/site.yaml", site + "".join(f"  '{name}': '{text}'\n" for name, text in macros.items()))
    second = (project.root / "content/01-second.md").read_text("utf-8")
    project.write("content/01-second.md", second.replace(r"$a^2 \in \R$", r"$\Rn n$, $\norm {\Rn{n}} 2$"))
    project.build()
    text = text_of(read(project.site / "notebooks" / "second.ipynb"))
    assert r"$\mathbb{R}^{n}$, $\lVert {\mathbb{R}^{{n}}} \rVert_2$" in text


def test_no_cell_no_output() -> None:
    """Code cells have neither output nor execution count, so that the bytes do not depend on a run."""
    book = json.loads(written([("markdown", "a\n"), ("code", "1 + 1\n")]))
    assert [cell["id"] for cell in book["cells"]] == ["cell-0", "cell-1"]
    assert book["cells"][1] == {**book["cells"][1], "outputs": [], "execution_count": None, "source": "1 + 1"}


def test_every_chapters_notebook_is_whole(site: Path, books: dict[str, nbformat.NotebookNode]) -> None:
    """In the built site: valid, small, without any of our own Markdown, with an even number of dollar signs."""
    for name, book in books.items():
        nbformat.validate(book)
        assert (site / "notebooks" / f"{name}.ipynb").stat().st_size < LARGEST
        text = re.sub(r"base64,[^\"]*", "", text_of(book))
        assert not OURS.search(text), name
        assert not re.search(r"&(?:amp|lt|gt|quot|#\d+);", re.sub(r"<img [^>]*>", "", text)), name
        assert text.count("$") % 2 == 0, name
        assert ("references.html#ref-" in text) == ("## References" in text), name


def test_pictures_need_nothing(books: dict[str, nbformat.NotebookNode]) -> None:
    """Each is well-formed XML, with its own rules and none of the page's variables, and has alternative text."""
    of = {name: IMAGE.findall(text_of(book)) for name, book in books.items()}
    assert [name for name, result in of.items() if len(result) < 4] == []
    pictures = [picture for result in of.values() for picture in result]
    for words, data in pictures:
        assert len(words.split()) > 1
        svg = base64.b64decode(data).decode()
        assert ElementTree.fromstring(svg).tag == "{http://www.w3.org/2000/svg}svg"
        assert set(re.findall(r"var\(--([\w-]+)\)", svg)) <= {"colour", "words", "size", "width", "s", "m", "l"}
        assert not re.search(r"url\((?!#)", svg)


def test_every_chapters_notebook_runs(
    books: dict[str, nbformat.NotebookNode], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of them in one kernel that is reset in between: each cell ends without an error, and scripts print."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    whole = nbformat.v4.new_notebook()
    for book in books.values():
        code = [cell for cell in book.cells if cell.cell_type == "code"]
        whole.cells += [nbformat.v4.new_code_cell("%reset -f"), *code]
    for i, cell in enumerate(whole.cells):
        cell.id = f"cell-{i}"
    NotebookClient(whole, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}).execute()
    scripts = [cell for cell in whole.cells if cell.source.startswith("# pip install")]
    assert len(scripts) >= len(books)
    assert all(cell.outputs and cell.outputs[0].output_type == "stream" for cell in scripts)
