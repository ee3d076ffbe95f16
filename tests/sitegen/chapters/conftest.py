"""A site for one chapter's tests."""

import pytest

from tests.sitegen.conftest import START, Project


@pytest.fixture
def desk(project: Project) -> Project:
    """The small site, with a first chapter that refers to no other."""
    project.write("content/00-start.md", START.partition("Read")[0])
    return project
