"""The film of the README and of the front page has the frames that its steps say."""

from itertools import pairwise

import pytest
from PIL import Image

from ..support.browser import CHROMIUM
from ..support.sources import ROOT
from .builder import module


@pytest.fixture(scope="module")
def film():
    return module("film")


def differing(file):
    """Count the frames of a film, each unlike the one before."""
    with Image.open(file) as opened:
        seen = [b""]
        for k in range(opened.n_frames):
            opened.seek(k)
            seen.append(opened.convert("RGB").tobytes())
    return sum(one != other for one, other in pairwise(seen))


def test_stored_film_is_of_these_steps(film):
    with Image.open(film.FILM) as stored:
        assert (stored.n_frames, stored.size) == (len(film.TIMES), film.FRAME)
    assert f"]({film.FILM.relative_to(ROOT)})" in (ROOT / "README.md").read_text("utf-8")


def test_film_without_browser_names_it(film, monkeypatch):
    monkeypatch.setattr(film, "CHROMIUM", None)
    with pytest.raises(SystemExit, match="chromium is not installed"):
        film.main()


@pytest.mark.nightly
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_film_is_made_again(film, tmp_path):
    made = tmp_path / "tour.webp"
    film.write(made)
    assert differing(made) == len(film.TIMES)
    assert made.stat().st_size < 1.5e6
