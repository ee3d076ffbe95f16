"""A value that YAML reads as something else is reported as the author wrote it."""

from __future__ import annotations

import pytest

from tests.sitegen.conftest import SITE, Project


@pytest.mark.parametrize(
    ("front", "message"),
    [
        ("title: yes\nsummary: S", '2:1: title: expected text, got yes; quote it: title: "yes"'),
        (
            "title: 2026-01-01\nsummary: S",
            '2:1: title: expected text, got 2026-01-01; quote it: title: "2026-01-01"',
        ),
        ("title: T\nsummary:", "3:1: summary: expected text, got nothing"),
        ("title T\nslug: t\nsummary: S", "2:1: invalid YAML: expected 'name: value'"),
        ("title:T\n\nslug: t\nsummary: S", "2:1: invalid YAML: expected 'name: value'"),
        ("title: a: b\nslug: t", "2:9: invalid YAML: unexpected ': ': quote text that contains it"),
        ("title: T\nsummary: Step #2 of 3", "3:15: YAML reads a # after a space as the start of a comment"),
        ("title: T #2\nsummary: S", "2:10: YAML reads a # after a space as the start of a comment"),
    ],
)
def test_front_matter_is_told_as_it_was_written(project: Project, front: str, message: str) -> None:
    project.write("content/01-second.md", f"---\n{front}\n---\n\nText.\n")
    assert any(line.startswith(f"content/01-second.md:{message}") for line in project.problems())


@pytest.mark.parametrize("key", ["null", "~", "1", "0x10", "1.50", "yes", "2026-01-01", ".inf"])
def test_a_key_is_the_text_that_was_written(project: Project, key: str) -> None:
    """Though YAML reads it as nothing, a number or a date: it is reported in its own line, in its author's letters."""
    project.write("content/01-second.md", f"---\ntitle: T\nsummary: S\n{key}: v\n---\n\nText.\n")
    (message,) = [line for line in project.problems() if line.startswith("content/01-second.md")]
    assert message.startswith(f"content/01-second.md:4:1: unknown key {key!r}")


@pytest.mark.parametrize("key", ["null", "no", "on"])
def test_an_entry_may_be_named_by_any_word(project: Project, key: str) -> None:
    text = (project.root / "content/references.yaml").read_text("utf-8")
    project.write("content/references.yaml", text.replace("two2002:", f"{key}:"))
    second = (project.root / "content/01-second.md").read_text("utf-8")
    project.write("content/01-second.md", second.replace("@two2002", f"@{key}"))
    project.build()


def test_comments_and_signs_of_a_text_are_no_fault(project: Project) -> None:
    """A comment has a blank after its #; in a text, a # is in quotes, on a line of its own, or within a word."""
    front = 'title: "T #2"  #\nslug: second  # as in the address\nsummary: C#1, as it is'
    project.write("content/01-second.md", f"---\n{front}\n---\n\nText.\n")
    project.write("content/00-start.md", "---\ntitle: T\nslug: start\nsummary: |\n  Step #1.\n---\n\nText.\n")
    project.build()


def test_blanks_after_the_first_line_do_not_matter(project: Project) -> None:
    """Nor do they after the last line."""
    project.write("content/01-second.md", "--- \t\ntitle: T\nslug: second\nsummary: S\n--- \n\nText.\n")
    project.write("content/00-start.md", "---\ntitle: T\nslug: start\nsummary: S\n---\n\nText.\n")
    project.build()


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        (
            "report: not a url {nope}",
            "report: expected an address starting with https:// or mailto:, got 'not a url {nope}'",
        ),
        ("macros: {'R': '\\mathbb{R}'}", "expected '\\name': LaTeX for a macro"),
    ],
)
def test_a_wrong_setting_is_told_alone(project: Project, setting: str, message: str) -> None:
    """An invalid macro does not cause errors in formulas that are right."""
    project.write("content/00-start.md", "---\ntitle: T\nslug: start\nsummary: S\n---\n\nA rotation $R$.\n")
    project.write("content/01-second.md", "---\ntitle: T\nslug: second\nsummary: S\n---\n\nText.\n")
    name = setting.partition(":")[0]
    rest = "\n".join(line for line in SITE.splitlines() if not line.startswith((f"{name}:", "  ")))
    project.write("content/site.yaml", f"{rest}\n{setting}\n")
    messages = [line for line in project.problems() if not line.endswith("ladder")]
    assert len([line for line in messages if line.endswith(message)]) == 1
    assert all(line.startswith("content/site.yaml:") for line in messages)


def test_settings_that_are_missing_are_told_once(project: Project) -> None:
    (project.root / "content/site.yaml").unlink()
    messages = [line for line in project.problems() if line.startswith("content/site.yaml")]
    assert messages == ["content/site.yaml:0:0: missing site settings: create this file"]
