"""Checks of a built site: a good one passes, and every fault is reported at its place."""

from __future__ import annotations

import gzip
from collections.abc import Iterator
from pathlib import Path

import pytest

from sitegen.assets.hosting import source_of
from sitegen.check import rules
from sitegen.check.html import inside, read_pages
from sitegen.check.sizes import Weight, gzip_size, heaviest, page_weight, runtime_weight
from tests.sitegen.check_site import check_site

HEAD = (
    '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'\">"
    '<title>T</title><link rel="stylesheet" href="assets/a.css"><script src="assets/a.js"></script></head>\n'
)
FILES = {
    "index.html": HEAD
    + '<body data-runtime="runtime/x/" data-runtime-files=\'[{"name": "core.wasm", "size": 3}]\'>\n'
    + '<h1 id="top-1">One</h1><p id="words">Text</p><a href="two.html#here">two</a> <a href="#words">words</a>'
    + '<a href="two.html#here?s=eyJ9">a state</a> <a href="https://example.org/">elsewhere</a><a href="#top">up</a>'
    + '<svg role="img" aria-labelledby="words" viewBox="0 0 1 1"><path d="M0 0"/></svg><img src="assets/a.png" alt="">'
    + '<figure data-tape="tapes/t.js"><script type="application/json">{"a": 1}</script></figure></body></html>\n',
    "two.html": HEAD + '<body><h1 id="here">Two</h1><a href="./">one</a><math><mi>x</mi></math></body></html>\n',
    "old.html": '<!doctype html><html lang="en"><head><meta charset="utf-8">'
    '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'"><title>T</title>'
    '<meta http-equiv="refresh" content="0; url=two.html"></head><body></body></html>\n',
    "assets/a.css": "@font-face { src: url('a.woff2') } /* url(gone.png) */ p { background: url(data:image/png,) }\n",
    "assets/a.js": "// see https://example.org\nconst ns = 'http://www.w3.org/2000/svg';\n",
    "assets/a.woff2": "font",
    "assets/a.png": "image",
    "tapes/t.js": "Ladder.tape()",
    "runtime/x/core.wasm": "abc",
    "runtime/x/core.mjs": "fetch('https://example.org/never-read')",
}


@pytest.fixture(scope="module", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A cache that knows no page: from the user's, faults found by an earlier state of the code would come back."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LADDER_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def site(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, "utf-8")
    return tmp_path


def test_a_good_site_has_no_problems(site: Path) -> None:
    """Links with states, redirects, folders, data scripts, comments and namespaces all pass."""
    assert check_site(site) == []


FAULTS = [
    ("<h1", '<a href="tow.html">x</a><h1', "4:1: tow.html: missing file tow.html; did you mean 'two.html'?"),
    ("two.html#here", "two.html#hree", "two.html#hree: two.html has no anchor 'hree'; did you mean 'here'?"),
    ("#words", "#wrods", "#wrods: index.html has no anchor 'wrods'; did you mean 'words'?"),
    ("two.html#here", "/two.html", "/two.html: leads out of the site"),
    ("two.html#here", "../two.html", "../two.html: leads out of the site"),
    ('href="#words"', 'href=""', "empty address"),
    ("assets/a.png", "assets/gone.png", "assets/gone.png: missing file assets/gone.png"),
    ("assets/a.png", "https://example.org/a.png", "pages must not load from another origin"),
    ("assets/a.png", "//example.org/a.png", "pages must not load from another origin"),
    ('src="assets/a.png"', 'src="assets/a.png" srcset="assets/b.png 2x"', "missing file assets/b.png"),
    ("tapes/t.js", "tapes/u.js", "tapes/u.js: missing file tapes/u.js"),
    ("core.wasm", "gone.wasm", "runtime/x/gone.wasm: missing file runtime/x/gone.wasm"),
    ('<p id="words"', '<p id="top-1"></p><p id="words"', "duplicate id 'top-1' (first on line 4)"),
    ('labelledby="words"', 'labelledby="wordz"', "aria-labelledby: unknown id 'wordz' on this page; did you mean"),
    (' aria-labelledby="words"', "", "<svg role=img> without aria-label"),
    (' alt=""', "", "assets/a.png: image without alt"),
    ("</p>", "</b></p>", "4:45: HTML: Unexpected end tag (b)"),
    ('<p id="words">', '<p id="words" style="color: red">', "attribute 'style' on <p>: the policy blocks it"),
    ('<p id="words">', '<p id="words" onclick="x()">', "attribute 'onclick' on <p>: the policy blocks it"),
    ('type="application/json"', "", "inline <script>: the policy blocks it"),
    ("http-equiv", "name", "1:1: no Content-Security-Policy"),
    ("default-src 'none'", "script-src 'self' 'unsafe-inline'", "the policy allows 'unsafe-inline'"),
    (">two</a>", "><b> </b></a>", "4:46: empty <a>"),
    ("<p id", "<button type=button></button><p id", "empty <button>"),
    ('<p id="words">Text</p>', '<h3 id="words">Text</h3>', "expected at most <h2>, got <h3>"),
    ('<h1 id="top-1">One</h1>', '<h2 id="top-1">One</h2>', "expected at most <h1>, got <h2>"),
    ('<p id="words">Text</p>', '<h1 id="words">Text</h1>', "duplicate <h1>"),
    ('src="assets/a.png"', 'src="a.png"', "a.png: loaded from outside assets/, images/, runtime/, tapes/"),
    ('data-tape="tapes/t.js"', 'data-tape="two.html"', "two.html: loaded from outside"),
    ('id="words"', 'id="wörds"', "id 'wörds' is not plain ASCII"),
    ('id="words"', 'id="two words"', "id 'two words' is not plain ASCII"),
    ('<p id="words">', '<label for="wordz">x</label><p id="words">', "for: unknown id 'wordz'"),
    ('href="#words"', 'href="javascript:x()"', "the policy blocks it"),
    ('<p id="words">', '<video poster="gone.png"></video><p id="words">', "missing file gone.png"),
]


@pytest.mark.parametrize(("old", "new", "message"), FAULTS)
def test_a_fault_of_a_page_is_named(site: Path, old: str, new: str, message: str) -> None:
    """With the page, line, column and, if there is one, the nearest right name."""
    page = site / "index.html"
    assert old in page.read_text("utf-8")
    page.write_text(page.read_text("utf-8").replace(old, new, 1), "utf-8")
    problems = [str(problem) for problem in check_site(site)]
    assert any(message in line and line.startswith("site/index.html:") for line in problems), problems


@pytest.mark.parametrize(
    "element",
    [
        '<a href="two.html" aria-label="two"></a>',
        '<a href="two.html" aria-labelledby="words"></a>',
        '<a href="two.html" title="two"></a>',
        '<a href="two.html"><img src="assets/a.png" alt="two"></a>',
        '<a href="two.html" aria-hidden="true"></a>',
        '<a id="place"></a>',
        '<svg role="img" aria-label="two"></svg>',
        '<svg><use href="#words"/></svg>',
    ],
)
def test_what_is_named_otherwise_hidden_or_no_link_passes(site: Path, element: str) -> None:
    """An element with no text of its own may be named by an attribute or an image. One that loads a part of its own
    page loads no other file."""
    page = site / "index.html"
    page.write_text(page.read_text("utf-8").replace("</body>", f"{element}</body>"), "utf-8")
    assert check_site(site) == []


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("assets/a.css", "\n  @import 'https://example.org/x';", "assets/a.css:2:12: https://example.org/x: pages"),
        ("assets/a.css", "p { background: url(b.png) }", "site/assets/a.css:1:21: b.png: missing file assets/b.png"),
        ("assets/a.js", "\nfetch('https://example.org')", "site/assets/a.js:2:7: https://example.org: scripts must"),
        ("assets/a.js", "import('//example.org/x.js')", "//example.org: scripts must not name another origin"),
        ("assets/ä.txt", "", "file name not of ASCII"),
        ("old.html", FILES["old.html"].replace("two.html", "three.html"), "missing file three.html"),
    ],
)
def test_a_fault_of_another_file_is_named(site: Path, file: str, text: str, message: str) -> None:
    """Style sheets, scripts, names and redirects."""
    (site / file).write_text(text, "utf-8")
    problems = [str(problem) for problem in check_site(site)]
    assert any(message in line for line in problems), problems


def test_a_policy_may_name_what_stands_in_the_page(site: Path) -> None:
    """A style whose hash is in the page's policy passes; with one character more it does not."""
    style = "p { color: red }"
    page = site / "two.html"
    text = page.read_text("utf-8").replace("default-src 'none'", f"default-src 'none'; style-src {source_of(style)}", 1)
    page.write_text(text.replace("</head>", f"<style>{style}</style></head>", 1), "utf-8")
    assert check_site(site) == []
    page.write_text(page.read_text("utf-8").replace(style, f"{style} "), "utf-8")
    (problem,) = check_site(site)
    assert "inline <style>: the policy blocks it" in str(problem)


def test_all_faults_are_told_at_once(site: Path) -> None:
    """In the order of files, lines and columns."""
    page = site / "two.html"
    page.write_text(page.read_text("utf-8").replace("</body>", '<a href="a.html">a</a><a href="b.html">b</a></body>'))
    (site / "assets/a.png").unlink()
    problems = check_site(site)
    assert [p.path for p in problems] == ["site/index.html", "site/two.html", "site/two.html"]
    assert problems == sorted(problems)


def test_a_page_weighs_what_it_loads(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Page, style sheet, its font, script and image; neither the tape, nor the runtime, nor linked pages."""
    page = read_pages(site)["index.html"]
    weight = page_weight(page)
    assert set(weight.parts) == {"index.html", "assets/a.css", "assets/a.js", "assets/a.png", "assets/a.woff2"}
    assert weight.total == sum(weight.parts.values()) > 0
    assert set(runtime_weight(page).parts) == {"runtime/x/core.wasm"}
    monkeypatch.setattr(rules, "PAGE_LIMIT", weight.total - 1)
    problems = [str(problem) for problem in check_site(site)]
    assert [line.partition(" kB")[0] for line in problems] == [f"site/index.html:0:0: {weight.total / 1000:.0f}"]
    monkeypatch.setattr(rules, "PAGE_LIMIT", weight.total)
    assert check_site(site) == []


def test_a_runtime_may_weigh_so_much(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A runtime above its limit is reported once, however many pages share it; one exactly at its limit is not."""
    (site / "three.html").write_text(FILES["index.html"], "utf-8")
    weight = runtime_weight(read_pages(site)["index.html"])
    monkeypatch.setattr(rules, "RUNTIME_LIMIT", weight.total)
    assert check_site(site) == []
    monkeypatch.setattr(rules, "RUNTIME_LIMIT", weight.total - 1)
    (problem,) = check_site(site)
    words = f"its runtime has {weight.total / 1e6:.2f} MB compressed"
    assert str(problem).partition(", more")[0] == f"site/{problem.path.partition('/')[2]}:0:0: {words}"
    assert problem.path in ("site/index.html", "site/three.html")


def test_a_sheet_weighs_once_however_often_it_is_imported(site: Path) -> None:
    """Even if sheets import each other."""
    (site / "assets/a.css").write_text("@import 'b.css';", "utf-8")
    (site / "assets/b.css").write_text("@import 'a.css'; @import 'c.css';", "utf-8")
    (site / "assets/c.css").write_text("@import 'b.css';", "utf-8")
    sheets = {name for name in page_weight(read_pages(site)["two.html"]).parts if name.endswith(".css")}
    assert sheets == {"assets/a.css", "assets/b.css", "assets/c.css"}


def test_the_heaviest_is_the_one_with_the_largest_total() -> None:
    """Not the one with the most files, or with the largest file."""
    weights = [Weight("a", {"a": 5, "b": 1}), Weight("b", {"a": 4, "b": 4}), Weight("c", {"a": 2, "b": 2, "c": 2})]
    assert heaviest(weights).page == heaviest(reversed(weights)).page == "b"


def test_sizes_are_those_of_gzip_at_its_best(tmp_path: Path) -> None:
    """A file that is packed already counts as it is."""
    data = b"".join(b"%d " % (i * i) for i in range(3000))
    (tmp_path / "a.js").write_bytes(data)
    (tmp_path / "a.pack").write_bytes(gzip.compress(data, 1))
    assert gzip_size(tmp_path / "a.js") == len(gzip.compress(data, 9)) < gzip_size(tmp_path / "a.pack")
    assert gzip_size(tmp_path / "a.pack") == (tmp_path / "a.pack").stat().st_size


@pytest.mark.parametrize(
    ("address", "base", "expected"),
    [
        ("b.html#x", "a.html", ("b.html", "x")),
        ("#x%20y", "a.html", ("a.html", "x y")),
        ("../b.css", "c/a.css", ("b.css", "")),
        ("../../b", "c/a.css", ("../b", "")),
        ("./", "c/a.html", ("c/index.html", "")),
        ("mailto:x@example.org", "a.html", None),
        ("//example.org/b", "a.html", None),
    ],
)
def test_addresses_are_resolved_as_a_browser_does(address: str, base: str, expected: tuple[str, str] | None) -> None:
    """Relative to the file that contains them; addresses outside the site give None."""
    assert inside(address, base) == expected
