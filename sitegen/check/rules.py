"""`check`: what can be wrong with a built site, however it was built: rules that yield problems, reported together."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import html5lib
from html5lib.constants import E as HTML_ERRORS

from sitegen.assets.css import imports, urls
from sitegen.assets.hosting import IMMUTABLE, source_of
from sitegen.cache.memo import Remembered
from sitegen.check.html import Element, Page, inside, is_foreign
from sitegen.check.sizes import PAGE_LIMIT, RUNTIME_LIMIT, page_weight, runtime_weight
from sitegen.problems import Problem, hint

FORMAT = "1"  # of remembered results; to be raised when the parsing changes
SHOWN = "site"  # how problems name the site, wherever it was built
POINTING = ("aria-controls", "aria-describedby", "aria-details", "aria-labelledby", "aria-owns", "for", "list")
DATA_SCRIPTS = ("application/json", "application/ld+json")
UNSAFE = re.compile(r"'unsafe-[\w-]+'")
# An address in a script's string; a namespace is only a name and never requested.
SCRIPT_ADDRESS = re.compile(r"""["'`](?:(?:https?|wss?):)?//(?!www\.w3\.org/)[\w.-]+\.\w+""")


def check_pages(site: Path, pages: dict[str, Page], cache: Path) -> list[Problem]:
    """All problems of a built site whose pages have been read, in order."""
    problems = html_faults(pages, cache)
    for page in pages.values():
        problems += links_lead_somewhere(page, pages)
        for rule in RULES:
            problems += rule(page)
    problems += [*styles_and_scripts_stay_home(site), *names_are_ascii(site, pages), *is_light(pages)]
    return sorted(set(problems))


def at(page: Page, element: Element, message: str) -> Problem:
    """A problem at an element."""
    return Problem(f"{SHOWN}/{page.name}", element.line, element.column, message)


def html_faults(pages: dict[str, Page], cache: Path) -> list[Problem]:
    """Pages parse without errors by the HTML standard's own algorithm; the results of each page are remembered."""
    memo = Remembered(cache, f"html-{FORMAT}-{html5lib.__version__}")
    by_page = {name: memo.answer(page.source, partial(html_errors, page.source)) for name, page in pages.items()}
    memo.keep()
    return [Problem(f"{SHOWN}/{name}", *fault) for name, faults in by_page.items() for fault in faults]


def html_errors(source: str) -> list[tuple[int, int, str]]:
    """Line, column and message of every error in a page."""
    parser = html5lib.HTMLParser(strict=False)
    parser.parse(source)
    errors = [(position, HTML_ERRORS.get(code, code), values) for position, code, values in parser.errors]
    return [(line, column, f"HTML: {words % values if values else words}") for (line, column), words, values in errors]


def ids_are_unique(page: Page) -> Iterator[Problem]:
    """No id occurs twice, and every attribute that refers to an id of the page finds it."""
    for name, elements in page.ids.items():
        for element in elements[1:]:
            yield at(page, element, f"duplicate id {name!r} (first on line {elements[0].line})")
    for element in page.elements:
        for attribute in POINTING:
            for name in element.get(attribute).split():
                if name not in page.ids:
                    yield at(page, element, f"{attribute}: unknown id {name!r} on this page{hint(name, page.ids)}")


def links_lead_somewhere(page: Page, pages: dict[str, Page]) -> Iterator[Problem]:
    """Every file and anchor of the site that is linked, loaded or redirected to exists; nothing foreign is loaded."""
    for element in page.elements:
        for address in element.loads:
            if is_foreign(address):
                yield at(page, element, f"{address}: pages must not load from another origin")
        addresses = [*element.loads, *element.links]
        addresses += [element.get("data-tape")] if element.get("data-tape") else []
        if element.name == "body" and element.get("data-runtime"):
            files = json.loads(element.get("data-runtime-files") or "[]")
            addresses += [element.get("data-runtime") + file["name"] for file in files]
        for address in addresses:
            if fault := address_fault(address, page, pages):
                yield at(page, element, f"{address}: {fault}")


def address_fault(address: str, page: Page, pages: dict[str, Page]) -> str:
    """What is wrong with an address on a page; "" for a good or a foreign one."""
    if address.lower().startswith("javascript:"):
        return "the policy blocks it"
    target = inside(address, page.name)
    if target is None:
        return ""
    file, fragment = target
    if not address:
        return "empty address"
    if file.startswith(("/", "..")):
        return "leads out of the site: use a relative address, since the site may be in any folder"
    if not (page.site / file).is_file():
        return f"missing file {file}{hint(file, pages)}"
    anchor = fragment.partition("?")[0]  # after the question mark comes a figure's state
    if anchor and anchor != "top" and file in pages and anchor not in pages[file].ids:
        return f"{file} has no anchor {anchor!r}{hint(anchor, pages[file].ids)}"
    return ""


def policy_holds(page: Page) -> Iterator[Problem]:
    """The page states its Content-Security-Policy and contains nothing that the policy would block."""
    policies = [e for e in page.elements if e.get("http-equiv").lower() == "content-security-policy"]
    if not policies:
        yield Problem(f"{SHOWN}/{page.name}", 1, 1, "no Content-Security-Policy")
    for policy in policies:
        for word in UNSAFE.findall(policy.get("content")):
            yield at(page, policy, f"the policy allows {word}")
    for element, text in page.inline:
        allowed = all(source_of(text) in policy.get("content") for policy in policies)
        if not allowed and (element.name == "style" or element.get("type") not in DATA_SCRIPTS):
            yield at(page, element, f"inline <{element.name}>: the policy blocks it")
    for element in page.elements:
        for name in element.attributes:
            if name == "style" or name.startswith("on"):
                yield at(page, element, f"attribute {name!r} on <{element.name}>: the policy blocks it")


def images_have_words(page: Page) -> Iterator[Problem]:
    """Images say what they show, or that they are decorative (alt="")."""
    for element in page.elements:
        if element.name == "img" and "alt" not in element.attributes:
            yield at(page, element, f"{element.get('src')}: image without alt")
        if element.get("role") == "img" and not (element.get("aria-label") or element.get("aria-labelledby")):
            yield at(page, element, f"<{element.name} role=img> without aria-label or aria-labelledby")


def things_have_names(page: Page) -> Iterator[Problem]:
    """Links, buttons, labels and headings contain words, or are named by an attribute."""
    for element, text in page.texts:
        has_name = text or any(element.get(name) for name in ("aria-label", "aria-labelledby", "title"))
        is_hidden = element.get("aria-hidden") == "true" or (element.name == "a" and "href" not in element.attributes)
        if not has_name and not is_hidden:
            yield at(page, element, f"empty <{element.name}>")


def headings_go_down_by_one(page: Page) -> Iterator[Problem]:
    """There is one first-level heading, before all others; below it no level is skipped."""
    headings = [element for element in page.elements if re.fullmatch("h[1-6]", element.name)]
    previous = 0
    for element in headings:
        level = int(element.name[1])
        if level == 1 and previous:
            yield at(page, element, "duplicate <h1>")
        elif level > previous + 1:
            yield at(page, element, f"expected at most <h{previous + 1}>, got <h{level}>")
        previous = level


def loaded_files_are_named_by_content(page: Page) -> Iterator[Problem]:
    """A page loads only files with a hash in their names, so that it gets those of its own build or none."""
    for element in page.elements:
        for address in [*element.loads, *([element.get("data-tape")] if element.get("data-tape") else [])]:
            target = inside(address, page.name)
            if target and target[0] != page.name and not target[0].startswith(IMMUTABLE):
                yield at(page, element, f"{address}: loaded from outside {', '.join(IMMUTABLE)}")


RULES = (
    ids_are_unique,
    policy_holds,
    images_have_words,
    things_have_names,
    headings_go_down_by_one,
    loaded_files_are_named_by_content,
)


def styles_and_scripts_stay_home(site: Path) -> Iterator[Problem]:
    """Style sheets load only existing files, scripts name no other origin; the runtime, third-party code, is
    skipped."""
    for path in sorted(site.rglob("*")):
        name = path.relative_to(site).as_posix()
        if name.startswith("runtime/") or path.suffix not in (".css", ".js", ".mjs"):
            continue
        text = path.read_text("utf-8")
        if path.suffix == ".css":
            for url in [*urls(text), *imports(text)]:
                address, position = url.address, (f"{SHOWN}/{name}", url.line, url.column)
                target = None if is_foreign(address) else inside(address, name)
                if is_foreign(address):
                    yield Problem(*position, f"{address}: pages must not load from another origin")
                elif target and not (site / target[0]).is_file():
                    yield Problem(*position, f"{address}: missing file {target[0]}")
        else:
            for match in SCRIPT_ADDRESS.finditer(text):
                message = f"{match.group()[1:]}: scripts must not name another origin"
                yield _in_text(name, text, match.start(), message)


def _in_text(name: str, text: str, offset: int, message: str) -> Problem:
    head = text[:offset]
    return Problem(f"{SHOWN}/{name}", head.count("\n") + 1, offset - head.rfind("\n"), message)


def names_are_ascii(site: Path, pages: dict[str, Page]) -> Iterator[Problem]:
    """File names and ids are plain ASCII, so that addresses read the same everywhere."""
    for path in sorted(site.rglob("*")):
        name = path.relative_to(site).as_posix()
        if not re.fullmatch(r"[A-Za-z0-9._/+-]+", name):
            yield Problem(f"{SHOWN}/{name}", 0, 0, "file name not of ASCII letters, digits and .-_+ alone")
    for page in pages.values():
        for name, elements in page.ids.items():
            if not name.isascii() or not name or " " in name:
                yield at(page, elements[0], f"id {name!r} is not plain ASCII")


def is_light(pages: dict[str, Page]) -> Iterator[Problem]:
    """The heaviest page and the runtime stay within their limits (gzip -9)."""
    for page in pages.values():
        weight = page_weight(page)
        if weight.total > PAGE_LIMIT:
            largest = ", ".join(f"{n} {s // 1000}" for n, s in sorted(weight.parts.items(), key=lambda p: -p[1])[:4])
            message = f"{weight.total / 1000:.0f} kB compressed, more than {PAGE_LIMIT / 1000:.0f} kB"
            yield Problem(f"{SHOWN}/{page.name}", 0, 0, f"{message} (most, in kB: {largest})")
    runtimes = {tuple(sorted(weight.parts.items())): weight for weight in map(runtime_weight, pages.values())}
    for weight in runtimes.values():
        if weight.total > RUNTIME_LIMIT:
            message = f"its runtime has {weight.total / 1e6:.2f} MB compressed, more than {RUNTIME_LIMIT / 1e6:.1f} MB"
            yield Problem(f"{SHOWN}/{weight.page}", 0, 0, message)
