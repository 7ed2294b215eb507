"""A self-contained HTML document from a template, with the look of the status page."""

from __future__ import annotations

from importlib import resources

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from onboard.web.page import look


def render(template: str, **shown: object) -> str:
    """A page in UTF-8 without script and without references to anything outside itself.

    Args:
        template: a file of this package, which extends ``page.html.j2``.
        **shown: what the template names; text is escaped, Markup is not.
    """
    environment = Environment(
        loader=PackageLoader("onboard.report", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    layout = resources.files("onboard.report").joinpath("report.css").read_text(encoding="utf-8")
    style = Markup(look() + layout)  # noqa: S704  files of ours
    return environment.get_template(template).render(style=style, **shown)
