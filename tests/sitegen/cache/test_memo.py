"""Remembered answers: reused for the same input, computed again for any other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from sitegen.cache import memo
from sitegen.cache.memo import Remembered
from sitegen.check import rules
from sitegen.check.html import read_pages
from sitegen.runtime import reuse
from sitegen.runtime.assemble import RuntimeInfo


def test_an_answer_is_kept_for_what_was_given(tmp_path: Path) -> None:
    """The next build reuses it; another text, or another function's file, has its own answer."""
    calls: list[str] = []

    def length(text: str, name: str = "length") -> int:
        answers = Remembered(tmp_path, name)
        result = answers.answer(text, lambda: calls.append(text) or len(text))
        answers.keep()
        return int(result)

    assert [length("abc"), length("abc"), length("abcd"), length("abc", "other")] == [3, 3, 4, 3]
    assert calls == ["abc", "abcd", "abc"]


def test_what_nobody_asks_for_any_more_makes_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The oldest go first, and nothing from the last build."""
    monkeypatch.setattr(memo, "SPARE", 1)
    for build in ("ab", "cd"):
        answers = Remembered(tmp_path, "f")
        for text in build:
            answers.answer(text, text.upper)
        answers.keep()
    answers = Remembered(tmp_path, "f")
    anew: list[str] = []
    for text in "abcd":
        answers.answer(text, lambda text=text: anew.append(text))  # type: ignore[misc]
    assert anew == ["a"]


def test_faults_of_html_are_told_from_memory_and_not_of_another_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site, cache = tmp_path / "site", tmp_path / "cache"
    site.mkdir()
    page = site / "a.html"
    page.write_text("<!doctype html><title>T</title>\n<p>a</b></p>", "utf-8")
    first = rules.html_faults(read_pages(site), cache)
    assert [(p.path, p.line, p.column) for p in first] == [("site/a.html", 2, 8)]
    page.rename(site / "b.html")
    monkeypatch.setattr(rules, "html_errors", lambda source: pytest.fail("it was read again"))
    assert [p.path for p in rules.html_faults(read_pages(site), cache)] == ["site/b.html"]
    monkeypatch.undo()
    (site / "b.html").write_text("<!doctype html><title>T</title>\n<p>a</p>", "utf-8")
    assert rules.html_faults(read_pages(site), cache) == []


def test_a_runtime_is_put_together_anew_where_it_is_of_something_else_or_faulty(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same build reuses it; a damaged or missing file, or other code, does not."""
    cache, caches, runtime = tmp_path / "cache", [], reuse.assembled()

    def count(**options: Any) -> RuntimeInfo:  # tests/sitegen/runtime/test_assemble.py tests how it is put together
        caches.append(options["cache"])
        return runtime

    monkeypatch.setattr(reuse, "assemble", count)
    assert reuse.assembled(cache=cache) == runtime
    assert reuse.assembled(cache=cache) == runtime
    assert caches == [cache]
    largest = max((cache / "runtime").iterdir(), key=lambda path: path.stat().st_size)
    data = largest.read_bytes()
    largest.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    assert reuse.assembled(cache=cache) == runtime
    assert largest.read_bytes() == data
    largest.unlink()
    assert reuse.assembled(cache=cache) == runtime
    assert caches == [cache] * 3
    monkeypatch.setattr(reuse, "inputs", lambda: {"solvers/new.py": b""})
    reuse.assembled(cache=cache)
    assert caches == [cache] * 4
