"""A good site: its pages' contents, that they are valid and safe, and that building twice gives the same bytes."""

from __future__ import annotations

import json
import os
import re
from base64 import b64encode
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

import pytest
from markupsafe import escape

from sitegen.assets.hosting import FOR_HOSTS, MAP, POLICY
from sitegen.cache.files import short_hash
from sitegen.html_reader import Tag, read
from sitegen.serve.static_files import header_rules, headers_for
from tests.sitegen.check_site import check_site
from tests.sitegen.conftest import START, Project, contents, fresh_cache, policy_of
from widgets.engine.host import Host


class Elements:
    """Collects start tags, and the text of scripts."""

    def __init__(self, source: str) -> None:
        self.tags: list[Tag] = []
        self.scripts: list[str] = []
        self._open: list[Tag] = []
        read(source, self)

    def opened(self, tag: Tag) -> None:
        self.tags.append(tag)
        self._open.append(tag)

    def closed(self, tag: Tag) -> None:
        self._open.remove(tag)

    def text(self, text: str) -> None:
        if self._open and self._open[-1].name == "script":
            self.scripts.append(text)

    def of_class(self, name: str) -> list[Mapping[str, str]]:
        return [tag.attributes for tag in self.tags if name in tag.get("class").split()]


@pytest.fixture
def sample(project: Project) -> Project:
    project.build(strict=True)
    return project


def test_every_page_is_valid_and_every_link_leads_somewhere(sample: Project) -> None:
    assert [str(p) for p in check_site(sample.site, sample.cache) if "runtime" not in p.message] == []


def test_two_builds_are_the_same_bytes(sample: Project, tmp_path: Path) -> None:
    first = contents(sample.site)
    sample.cache = fresh_cache(tmp_path / "cold")
    sample.build(strict=True)
    assert contents(sample.site) == first


def test_markup_in_titles_and_data_is_text(sample: Project) -> None:
    page = sample.page("second.html")
    assert "<script>alert" not in page
    assert "<title>The &lt;/title&gt;&lt;script&gt;" in page
    assert '<meta name="description" content="It is &lt;b&gt;not&lt;/b&gt; bold.">' in page
    assert "Noisy </script>" not in page
    result = Elements(page)
    records = [json.loads(text) for text in result.scripts if text.strip().startswith('{"record"')]
    assert len(records) == 1
    assert records[0]["frame"]["description"].startswith("</script> 0 presses")


def test_the_figure_and_its_tape(sample: Project) -> None:
    """The page holds the first frame; the tape, every prefix of the presses that the widget and its buttons record."""
    page = sample.page("second.html")
    (figure,) = Elements(page).of_class("figure")
    assert figure["id"] == "fig-demo"
    assert re.fullmatch(r"tapes/second-demo\.[0-9a-f]{10}\.js", figure["data-tape"] or "")
    script = sample.page(figure["data-tape"] or "")
    assert script.startswith('Ladder.tape("fig-demo", [')
    assert "</" not in script
    parts = "[" + script.removeprefix('Ladder.tape("fig-demo", ').removesuffix(");\n") + "]"
    drawings, entries = json.loads(parts)
    assert len(set(drawings)) == len(drawings)
    states = [(e["record"]["controls"], e["record"]["seed"], len(e["record"]["log"])) for e in entries]
    default = {"scene": "clean", "noise": 0.5, "loud": False}
    noisy = {"scene": "noisy", "noise": 0.9, "loud": False}
    assert states == [
        *((default, 40, n) for n in range(4)),
        *((noisy, 40, n) for n in range(2)),
        *(({**default, "noise": 0.25}, 40, n) for n in range(3)),
        ({**noisy, "loud": True}, 5, 0),
    ]
    assert all(drawings[entry["frame"]["panels"][0]["svg"]].startswith("<svg") for entry in entries)
    assert {panel["svg"] for entry in entries for panel in entry["frame"]["panels"]} == set(range(len(drawings)))
    assert drawings[entries[0]["frame"]["panels"][0]["svg"]] in page
    record = json.loads(next(t for t in Elements(page).scripts if '"record"' in t))
    assert record["record"] == entries[0]["record"]
    assert "svg" not in record["frame"]["panels"][0]
    assert record["spec"]["controls"]["scene"]["sets"] == {"noisy": {"noise": 0.9}}


def test_a_tape_s_frames_are_those_of_their_records(sample: Project) -> None:
    """Each entry's frame is what its record draws, and no other entry's."""
    (figure,) = Elements(sample.page("second.html")).of_class("figure")
    script = sample.page(figure["data-tape"] or "")
    drawings, entries = json.loads(f"[{script.removeprefix('Ladder.tape(').removesuffix(');' + chr(10))}]")[1:]
    host = Host(sample.widgets)
    for entry in entries:
        frame = entry["frame"]
        for panel in frame["panels"]:
            panel["svg"] = drawings[panel["svg"]]
        assert frame == json.loads(json.dumps(host.render("fig-demo", entry["record"])))


def test_what_a_figure_s_job_finds_stands_in_the_page(sample: Project) -> None:
    """Its table at the figure's settings, without timings, and its drawing, which the data omit."""
    page = sample.page("second.html")
    assert "<td>0.50</td><td>–</td>" in page
    assert "Noise &amp; &lt;more&gt; (u)" in page
    assert '<span class="key line truth dashed">One &lt;/script&gt;</span>' in page
    (data,) = (json.loads(t) for t in Elements(page).scripts if '"heading"' in t)
    assert data["rows"][0]["values"] == [0.5, None]
    assert data["caption"] == "On seed 40."
    assert "svg" not in data["panels"][0]
    assert page.count('<svg class="panel"') == 2
    job = next(tag for tag in Elements(page).tags if tag.name == "section" and tag.get("class") == "job")
    assert job.get("data-job") == "count"


def test_buttons_in_the_text(sample: Project) -> None:
    page = sample.page("second.html")
    tries = Elements(page).of_class("try")
    assert [b["data-figure"] for b in tries] == ["fig-demo", "fig-demo"]
    first = json.loads(tries[0]["data-record"] or "")
    assert (first["controls"]["noise"], first["log"]) == (0.25, [["press", "go"], ["press", "go"]])
    assert page.count('<ul class="tries">') == 1
    assert "Press <strong>go</strong> twice." in page


def test_numbers_and_references(sample: Project) -> None:
    page = sample.page("second.html")
    assert '<a href="#fig-demo">Figure 1.1</a></span> The <em>caption</em>' in page
    assert '<a class="ref" href="#eq-energy">(1.1)</a>, <a class="ref" href="#fig-demo">Figure 1.1</a>' in page
    assert 'id="eq-energy"' in page
    assert '<span class="computed">2</span> presses and\n<span class="computed">−7.250</span>.' in page
    start = sample.page("index.html")
    assert '<a class="ref" href="second.html">The &lt;/title&gt;' in start
    assert '<a href="second.html#deep">its section</a>' in start


def test_a_reference_to_another_chapter_s_figure_leads_there(project: Project) -> None:
    """It needs no page name if only one figure has that name; two elsewhere are a problem."""
    project.write("content/00-start.md", START + "\nSee :ref[fig:demo] and :ref[eq:energy].\n")
    project.build()
    assert '<a class="ref" href="second.html#fig-demo">Figure 1.1</a>' in project.page("index.html")
    assert '<a class="ref" href="second.html#eq-energy">(1.1)</a>' in project.page("index.html")
    project.write("content/02-third.md", "---\ntitle: T\nslug: third\nsummary: S\n---\n::figure[C]{toy id=demo}\n")
    pages = "content/01-second.md and content/02-third.md"
    instead = "rename one, or link with [words](second.html#fig-demo)"
    assert project.problems() == [f"content/00-start.md:9:10: ambiguous figure 'demo', in {pages}: {instead}"]
    project.write("content/00-start.md", START + "\nSee [words](second.html#fig-demo).\n")
    project.build()


def test_a_named_control_overrides_what_its_scene_brings(project: Project) -> None:
    project.chapter("::figure[C]{toy id=demo scene=noisy noise=0.3}\n")
    project.write("content/00-start.md", START.partition("Read")[0])
    project.build()
    record = json.loads(next(t for t in Elements(project.page("second.html")).scripts if '"record"' in t))["record"]
    assert record["controls"] == {"scene": "noisy", "noise": 0.3, "loud": False}


def test_reading_order_is_that_of_numbers(project: Project) -> None:
    """10 comes after 9, and 9b between them."""
    for number, slug in (("10", "ten"), ("9", "nine"), ("9b", "more")):
        project.write(f"content/{number}-{slug}.md", "---\ntitle: T\nsummary: S\n---\n")
    project.build()
    assert '<a class="next" rel="next" href="more.html">' in project.page("nine.html")
    assert '<a class="next" rel="next" href="ten.html">' in project.page("more.html")
    assert '<link rel="next"' not in project.page("nine.html"), "Firefox fetches such a page ahead, against the policy"


def test_mathematics_is_markup_without_styles(sample: Project) -> None:
    page = sample.page("second.html")
    assert page.count("<math") == 5  # in the text, a caption, an equation, a table, a note
    assert "ℝ" in page
    assert "$" not in re.sub(r"<script.*?</script>", "", page, flags=re.S)
    assert not [tag for tag in Elements(page).tags if "style" in tag.attributes]


def test_footnotes_stand_beside_their_paragraph(sample: Project) -> None:
    page = sample.page("second.html")
    block = page[page.index('<div class="noted">') :]
    assert block.index('<a href="#note-1" id="noteref-1"') < block.index('role="note" id="note-1"')
    assert block.index('id="note-1"') < block.index("<figure")
    assert page.count('id="note-1"') == 1


def test_citations_have_links_cards_and_a_bibliography(sample: Project) -> None:
    page = sample.page("second.html")
    assert ">One 2001</a>; " in page
    assert ">Two et al. 2002</a>, §3)" in page
    cards = Elements(page).of_class("card")
    assert [(c["id"], "hidden" in c) for c in cards] == [("card-one2001", True), ("card-two2002", True)]
    bibliography = sample.page("references.html")
    assert bibliography.index('id="ref-one2001"') < bibliography.index('id="ref-two2002"')
    assert "Ben Two, Cy van der Three and Di Four" in bibliography
    assert "More &amp; &lt;more&gt;?" in bibliography
    assert 'href="https://doi.org/10.1000/one"' in bibliography
    assert '<a href="second.html">' in bibliography


def test_claims_open_what_was_checked(sample: Project) -> None:
    page, checks = sample.page("second.html"), sample.page("checks-second.html")
    (mark,) = Elements(page).of_class("claim-mark")
    target = (mark["href"] or "").removeprefix("checks-second.html#")
    assert f'id="{target}"' in checks
    assert "It <em>holds</em>." in checks
    assert "What holds &amp; what &lt;does not&gt;." in checks
    assert "Not yet run on this code." in checks
    assert mark["data-outcome"] == "unknown"
    about = sample.page("checks.html")
    (row,) = re.findall(r'<tr><th scope="row"><a href="checks-second.html">.*?</tr>', about)
    assert re.findall(r"<td>(\d+)</td>", row) == ["1", "0", "0", "0", "1"]


def test_contents_ladder_and_neighbours(sample: Project) -> None:
    page = sample.page("second.html")
    assert 'class="contents"' not in page, "one section needs no list"
    assert 'rel="prev" href="index.html"' in page
    assert "Not yet written" in page
    assert 'href="index.html"' in page
    assert page.count('aria-current="page"') == 1
    sample.chapter("\n## One\n\n### In *it*\n\n## Two $x$\n")
    sample.write("content/00-start.md", START.partition("Read")[0])
    sample.build()
    page = sample.page("second.html")
    nav = page[page.index('class="contents"') :]
    assert re.findall(r'href="#([^"]*)"', nav[: nav.index("</nav>")]) == ["one", "in-it", "two-x"]
    assert "In <em>it</em>" in nav


def test_redirects_metadata_and_site_map(sample: Project) -> None:
    old = sample.page("old-second.html")
    assert '<noscript><meta http-equiv="refresh" content="0; url=second.html"></noscript>' in old
    assert '<link rel="canonical" href="https://example.org/ladder/second.html">' in old
    page = sample.page("second.html")
    assert '<link rel="canonical" href="https://example.org/ladder/second.html">' in page
    assert '<meta property="og:title" content="The &lt;/title&gt;' in page
    assert "https://example.org/issues/new?title=The%20%3C/title%3E" in page
    assert re.findall(r"<loc>(.*?)</loc>", sample.page("sitemap.xml")) == [
        "https://example.org/ladder/",
        "https://example.org/ladder/second.html",
        "https://example.org/ladder/about.html",
        "https://example.org/ladder/references.html",
        "https://example.org/ladder/glossary.html",
        "https://example.org/ladder/reference.html",
        "https://example.org/ladder/checks.html",
    ]
    assert 'name="robots" content="noindex"' in sample.page("404.html")


def test_files_of_any_editor(project: Project) -> None:
    """Carriage returns and a byte order mark change nothing, not even the places of problems."""
    project.build()
    before = project.page("second.html")
    path = project.root / "content/01-second.md"
    source = path.read_text("utf-8")
    path.write_bytes(b"\xef\xbb\xbf" + source.replace("\n", "\r\n").encode())
    project.build()
    assert project.page("second.html") == before
    path.write_bytes(path.read_bytes().replace(b"[@one2001]", b"[@no]"))
    last = len(source.splitlines())
    assert project.problems()[0].startswith(f"content/01-second.md:{last}:24: unknown reference 'no'")


def test_a_link_may_lead_to_a_state_of_a_figure(project: Project) -> None:
    project.chapter("::figure[C]{toy id=demo}\n\n[that](#fig-demo?s=eyJ9)\n")
    project.write("content/00-start.md", START.partition("Read")[0])
    project.build()
    assert '<a href="#fig-demo?s=eyJ9">that</a>' in project.page("second.html")


def test_a_chapter_off_the_ladder_counts_without_a_rung(project: Project) -> None:
    project.chapter("::figure[C]{toy id=demo}\n\nSee :ref[fig:demo].\n", "title: T\nslug: second\nsummary: S")
    project.write("content/00-start.md", START.partition("Read")[0])
    project.build()
    assert '<a class="ref" href="#fig-demo">Figure 1</a>' in project.page("second.html")


def test_code_tables_and_asides(sample: Project) -> None:
    page = sample.page("second.html")
    assert 'print(<span class="s2">"&lt;hello&gt;"</span>)' in page
    assert '<td><code translate="no">code</code></td>' in page
    assert '<div class="aside" role="note"><p>Beside the <em>point</em>.</p></div>' in page


def test_images_are_measured_copied_and_named_by_content(project: Project) -> None:
    svg = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 30 20"><path d="M0 0h9"/></svg>'
    project.write("content/My drawing.svg", svg)
    project.chapter("\n![A line](<My drawing.svg>)\n")
    project.write("content/00-start.md", START.partition("Read")[0])
    project.build()
    image = next(tag.attributes for tag in Elements(project.page("second.html")).tags if tag.name == "img")
    assert (image["alt"], image["width"], image["height"]) == ("A line", "30", "20")
    assert re.fullmatch(r"images/my-drawing\.[0-9a-f]{10}\.svg", image["src"] or "")
    assert project.page(image["src"] or "") == svg


def test_the_service_worker_knows_every_file_and_their_version(sample: Project) -> None:
    worker = sample.page("sw.js")
    files = json.loads(re.search(r"const FILES = (\[.*?\n\]);", worker, re.DOTALL)[1])  # type: ignore[index]
    site_files = {n: d for n, d in contents(sample.site).items() if n not in ("sw.js", "_headers", *FOR_HOSTS)}
    site_files = {n: d for n, d in site_files.items() if not n.startswith("notebooks/") and not n.endswith(MAP)}
    assert {name: (size, hash_) for name, size, hash_ in files} == {
        name: (len(data), "sha256-" + b64encode(sha256(data).digest()).decode()) for name, data in site_files.items()
    }
    version = re.search(r'const VERSION = "(\w+)"', worker)[1]  # type: ignore[index]
    sample.write("content/00-start.md", START + "\nMore.\n")
    sample.build()
    assert f'"{version}"' not in sample.page("sw.js")
    version = re.search(r'const VERSION = "(\w+)"', sample.page("sw.js"))[1]  # type: ignore[index]
    sample.write("templates/assets/sw.js", (sample.root / "templates/assets/sw.js").read_text("utf-8") + "// more\n")
    sample.build()
    assert f'"{version}"' not in sample.page("sw.js"), "another worker over the same files is another version"


def test_a_failed_build_leaves_the_last_good_site(sample: Project) -> None:
    (sample.site / ".gitignore").write_text("*\n")
    before = contents(sample.site)
    sample.chapter("\n:ref[nowhere]\n")
    assert sample.problems()
    assert contents(sample.site) == before
    assert [p.name for p in sample.root.iterdir() if p.name.startswith(".site")] == []
    sample.chapter("\n## Deep {#deep}\n")
    sample.build()
    assert (sample.site / ".gitignore").read_text() == "*\n"
    assert "Deep" in sample.page("second.html")


def test_an_interrupted_exchange_brings_the_old_site_back(sample: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    """With Ctrl-C between the two renames, the site is as it was, and nothing is left beside it."""
    before, rename = contents(sample.site), os.replace

    def interrupt(source: str | Path, target: str | Path) -> None:
        if Path(target) == sample.site and not Path(source).name.endswith("-old"):
            raise KeyboardInterrupt
        rename(source, target)

    monkeypatch.setattr(os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        sample.build()
    assert contents(sample.site) == before
    assert [p.name for p in sample.root.iterdir() if p.name.startswith(".site")] == []


def test_hosts_are_told_the_policy_and_what_may_be_kept(sample: Project) -> None:
    """The pages' own policy, the hashes of 404.html and of pages at old names, and a ban on framing; files with a hash
    in their name are kept for ever, others revalidated."""
    rules = header_rules(sample.site)
    page = headers_for("/second.html", rules)
    report = page["Content-Security-Policy"]
    assert re.sub(r" 'sha256-[\w+/=]+'", "", report) == f"{POLICY}; frame-ancestors 'none'"
    hashes = re.compile(r"'sha256-[\w+/=]+'")
    for name in ("404.html", "old-second.html"):
        own = hashes.findall(policy_of(sample.page(name)))
        assert own
        assert {*own} <= {*hashes.findall(report)}
    assert f'http-equiv="Content-Security-Policy" content="{escape(POLICY)}"' in sample.page("second.html")
    assert "Cache-Control" not in page
    for folder in ("assets", "images", "tapes", "runtime"):
        assert "immutable" in headers_for(f"/{folder}/x.0123456789.js", rules)["Cache-Control"]
    assert headers_for("/sw.js", rules)["Cache-Control"] == "no-cache"


def test_files_that_hosts_keep_for_ever_are_named_by_their_content(sample: Project) -> None:
    """A hash in a file's name is that of its content, so another content has another name."""
    checks = {}
    for folder in ("assets", "images", "tapes"):
        for file in (sample.site / folder).rglob("*.*"):
            match = re.search(r"[.-]([0-9a-f]{10})\.\w+$", file.name)
            assert match, file
            checks[file.name] = match[1] == short_hash(file.read_bytes())
    assert len(checks) >= 3
    assert [name for name, right in checks.items() if not right] == []
