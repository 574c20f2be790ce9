"""Pages escape every value: text, attributes and data inside a script."""

import html.parser
import json
import pathlib
import re

import numpy as np
import pytest

from evolvent.results.motion import Line, Motion
from evolvent.view import animation
from evolvent_base import pages, showing
from evolvent_base.answer import Answer, Captioned, Frame, Listing, Points, Remark, Section, Table

HOSTILE = (
    """</title></script><script>alert(1)</script>"' onload=alert(2) <img src=x onerror=alert(3)> & {{ 7 * 7 }} @DATA@"""
)
TEMPLATES = pathlib.Path(pages.__file__).parent / "templates"
OWN_TAGS = {
    "html",
    "head",
    "meta",
    "title",
    "style",
    "body",
    "main",
    "header",
    "p",
    "h1",
    "h2",
    "h3",
    "span",
    "strong",
    "section",
    "nav",
    "a",
    "table",
    "thead",
    "tbody",
    "tr",
    "th",
    "td",
    "figure",
    "figcaption",
    "img",
    "iframe",
    "div",
    "pre",
    "code",
    "dl",
    "dt",
    "dd",
    "ul",
    "ol",
    "li",
    "script",
    "form",
    "input",
    "button",
}


class Tags(html.parser.HTMLParser):
    """Tags with their attributes, the text, and the title of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.text, self.open = [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.open.append(tag)

    def handle_endtag(self, tag):
        while self.open and self.open.pop() != tag:
            pass

    def handle_data(self, data):
        self.text.append((self.open[-1] if self.open else "", data))


def check(text, scripts=0):
    """Nothing of a value has become markup."""
    page = Tags(text)
    assert {tag for tag, _ in page.tags} <= OWN_TAGS
    assert sum(tag == "script" for tag, _ in page.tags) == scripts
    for tag, attrs in page.tags:
        assert not any(name.startswith("on") for name in attrs)
        if tag == "img":
            assert attrs["src"].startswith("data:image/")
    return page


@pytest.fixture
def picture():
    return pages.picture(b"<svg/>", "svg+xml", HOSTILE)


def test_an_answer_escapes_every_text(picture):
    rows = [(HOSTILE, HOSTILE)]
    blocks = [
        HOSTILE, Table(heads=(HOSTILE, HOSTILE), rows=rows, title=HOSTILE), Listing(HOSTILE), Points([HOSTILE]),
        Remark(HOSTILE),
        Captioned(picture, HOSTILE), Frame(HOSTILE, HOSTILE, [picture]), picture,
    ]  # fmt: skip
    answer = Answer(
        title=HOSTILE, about=HOSTILE, status=(HOSTILE, True), facts=rows, heads=[HOSTILE], warnings=[HOSTILE],
        sections=[Section(title=HOSTILE, blocks=blocks), Section(title=HOSTILE, blocks=[HOSTILE], kind="warning")],
        notes=[HOSTILE], made=HOSTILE, contents=True,
    )  # fmt: skip
    page = check(showing.page(answer))
    (frame,) = (attrs for tag, attrs in page.tags if tag == "iframe")
    assert frame["srcdoc"] == frame["title"] == HOSTILE
    assert frame["sandbox"] == "allow-scripts"
    assert ("title", HOSTILE) in page.text
    check(showing.notebook(answer))


def test_an_animation_escapes_names_in_its_text_and_its_data():
    time = np.linspace(0.0, 1.0, 3)
    motion = Motion(title=HOSTILE, time=time, lines=[Line(name=HOSTILE, points=np.ones((3, 2, 3)))])
    text = animation.page(motion)[0].decode()
    page = check(text, scripts=1)
    assert ("title", HOSTILE) in page.text
    data = json.loads(re.search(r"const data = (.*);\n", text)[1])
    assert data["lines"][0]["name"] == HOSTILE
    assert not re.search("[<>&']", re.search(r"const data = (.*);\n", text)[1])


def test_a_template_that_lacks_a_value_is_an_error():
    with pytest.raises(Exception, match="'title' is undefined"):
        pages.render("token.html")


def test_no_template_switches_escaping_off():
    for path in TEMPLATES.glob("*.html"):
        assert "safe" not in path.read_text("utf-8").replace("safest", ""), path.name
        assert "autoescape" not in path.read_text("utf-8"), path.name
