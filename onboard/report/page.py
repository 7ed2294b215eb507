"""A self-contained HTML document from a template, with the look of the status page.

A template extends its ``base``: :data:`PAGE` is a document, :data:`HEAD` a fragment with the
answer at the top of that document, for a place that shows results among others, as a notebook.
"""

from __future__ import annotations

import re
from importlib import resources
from typing import Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from onboard.web.page import look

PAGE: Final = "page.html.j2"
HEAD: Final = "head.html.j2"
SCRIPT: Final = "report.js"
STYLES: Final = {PAGE: "report.css", HEAD: "head.css"}


_PARTED: Final = re.compile(r"(?<=\d) (?=[%±])|(?<=±) (?=\d)")


def unparted(shown: object) -> object:
    """Words in which no line ends between a number and its per cent or its sigma."""
    if isinstance(shown, str) and not isinstance(shown, Markup):
        return _PARTED.sub("\u00a0", shown)
    return shown


def render(template: str, base: str = PAGE, **shown: object) -> str:
    """A page in UTF-8 without references to anything outside itself.

    A document has a script of ours, with which charts can be read off; it says the same without.

    Args:
        template: a file of this package, which extends ``base``.
        base: :data:`PAGE` or :data:`HEAD`.
        **shown: what the template names; text is escaped, Markup is not.
    """
    environment = Environment(
        loader=PackageLoader("onboard.report", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=unparted,
    )
    layout = resources.files("onboard.report").joinpath(STYLES[base]).read_text(encoding="utf-8")
    common = look() if base == PAGE else ""  # it is for a document of its own
    style = Markup(common + layout)  # noqa: S704  files of ours
    script = resources.files("onboard.report").joinpath(SCRIPT).read_text(encoding="utf-8")
    return environment.get_template(template).render(
        base=base,
        brief=base == HEAD,
        style=style,
        script=Markup(script),  # noqa: S704  a file of ours
        **shown,
    )
