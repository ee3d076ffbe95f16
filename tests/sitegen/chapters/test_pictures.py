"""Small pictures: drawn in the state that their line names, checked against its expectation, described in words."""

from __future__ import annotations

import json
import re

import pytest

from tests.sitegen.conftest import Project

FIGURE = re.compile(r'<figure class="picture" aria-label="[^"<>]+">.*?</figure>', re.DOTALL)
pytestmark = pytest.mark.usefixtures("desk")


def picture(project: Project, attributes: str, caption: str = "C") -> str:
    """The picture's HTML with these attributes."""
    project.chapter(f"\n::picture[{caption}]{{toy {attributes}}}\n")
    project.build()
    result = FIGURE.search(project.page("second.html"))
    assert result is not None
    return result[0]


def test_a_picture_is_drawn_in_its_state_and_has_nothing_to_do(project: Project) -> None:
    first, second = picture(project, ""), picture(project, "press=go,go", "With **Go** pressed")
    assert first.count("<svg") == second.count("<svg") == 1
    assert first.partition("<figcaption>")[0].replace('"C"', "") != second.partition("<figcaption>")[0].replace(
        '"With Go pressed"', ""
    )
    assert 'aria-label="With Go pressed"' in second
    assert "<figcaption>With <strong>Go</strong> pressed</figcaption>" in second
    assert "<button" not in second
    assert "data-tape" not in second
    words = re.search(r'<p class="visually-hidden">(.+?)</p>', second)
    assert words, "who cannot see it is told"


def test_two_pictures_share_no_id(project: Project) -> None:
    project.chapter("\n::picture[A]{toy}\n\n::picture[B]{toy press=go}\n\n::figure[C]{toy id=demo}\n")
    project.build()
    ids = re.findall(r'\bid="([^"]+)"', project.page("second.html"))
    assert len(ids) == len(set(ids))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("::picture[C]{¦ty}", "unknown widget 'ty'"),
        ("::picture[C]{¦id=a}", "missing widget for the picture, as in {"),
        ("::picture[C]{toy panels=¦man}", "unknown panel 'man'; did you mean 'main'?"),
        ('::picture[C]{toy panels="main,¦man"}', "unknown panel 'man'; did you mean 'main'?"),
        ("::picture[C]{toy press=¦og}", "toy has no button 'og' to press"),
        ("::picture[C]{toy ¦controls=noise}", "toy has no control 'controls'"),
        ("::picture[C]{toy ¦id=a panels=main}", "a picture takes no id: it has no number, and no line refers to it"),
        ("::picture[C]{toy preset=¦none}", "toy has no preset 'none'"),
        ('::picture[C]{toy expect="¦presses > 1"}', "promised presses > 1, but it is 0"),
        ("::picture[It ¦fails]{toy}", "untested promise 'fails'"),
        ("¦::picture[]{toy}", "::picture has no text"),
    ],
)
def test_what_is_wrong_with_a_picture(project: Project, line: str, message: str) -> None:
    project.chapter(f"\n{line.replace('¦', '')}\n")
    (problem,) = project.problems()
    assert message in problem
    assert problem.startswith(f"content/01-second.md:8:{1 + line.index('¦')}: ")


def test_what_is_expected_holds_a_promising_caption(project: Project) -> None:
    assert picture(project, 'press=go,go expect="presses > 1"', "It rises")


def test_a_notebook_has_it_as_an_image(project: Project) -> None:
    picture(project, "press=go", "A bar")
    cells = json.loads((project.root / "site/notebooks/second.ipynb").read_text("utf-8"))["cells"]
    (own,) = [cell["source"] for cell in cells if "*A bar*" in "".join(cell["source"])]
    assert "".join(own).startswith("<img alt=")
