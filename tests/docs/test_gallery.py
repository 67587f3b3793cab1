"""The gallery shows every picture that is drawn, and pages show only pictures that are."""

from __future__ import annotations

import re

import pytest

from tools.gallery import FOLDER, PICTURES, write

PAGES = sorted(FOLDER.parent.glob("*.md"))


def shown(text: str) -> set[str]:
    """Names of the pictures that a page shows."""
    return set(re.findall(r"\]\(pictures/(\w+)\.svg\)", text))


def test_the_gallery_shows_all_and_each_page_its_own():
    names = {picture.name for picture in PICTURES}
    assert len(names) == len(PICTURES)
    texts = {page.stem: page.read_text(encoding="utf-8") for page in PAGES}
    assert shown(texts["gallery"]) == names
    for picture in PICTURES:
        assert picture.name in shown(texts[picture.page])
    assert set().union(*map(shown, texts.values())) == names


@pytest.mark.long
def test_every_picture_is_drawn(tmp_path):
    assert all(file.stat().st_size > 5000 for file in write(tmp_path))
