"""What the site has beside the manuals of this folder: a hook of mkdocs, used by ``make docs``.

Manuals refer to each other and to files as they lie in the project, so that they can be read there;
here these references are turned to the site's pages, and what lies outside this folder is put in.
"""

from __future__ import annotations

import ast
import json
import os
import re
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[1]
ELSEWHERE = {
    "README.md": "index.md",
    "systemd/README.md": "systemd.md",
    "CHANGELOG.md": "changelog.md",
    "docs/notebook.ipynb": "notebook.md",
}
"""Files of the project that are a page under another name."""
LINK = re.compile(r"(?<=\]\()(?!https?:|#)([^)#\s]+)(#[^)\s]*)?(?=\))")
ROLE = re.compile(r":(?:attr|class|data|func|meth|mod):(?=<)")
"""Marks of another generator in docstrings; mkdocstrings leaves them as they are."""


def slug(title: str, separator: str = "-") -> str:
    """The anchor of a heading, as forges make it: links hold there and here."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", separator)


def pages() -> dict[str, str]:
    """Pages that are not in this folder, by the site's name: their text in Markdown."""
    made = {
        page: turned((ROOT / file).read_text(encoding="utf-8"), PurePosixPath(file))
        for file, page in ELSEWHERE.items()
        if file.endswith(".md")
    }
    made["notebook.md"] = notebook((ROOT / "docs/notebook.ipynb").read_text(encoding="utf-8"))
    made["reference.md"] = reference()
    return made


def turned(text: str, file: PurePosixPath) -> str:
    """Its links, which are relative to ``file`` in the project, relative to the site."""

    def one(match: re.Match[str]) -> str:
        return site_path(file.parent, match[1]) + (match[2] or "")

    return LINK.sub(one, text)


def site_path(folder: PurePosixPath, target: str) -> str:
    """Where the site has the file that ``target`` names, seen from ``folder`` of the project."""
    there = os.path.normpath(folder / target)
    if there in ELSEWHERE:
        return ELSEWHERE[there]
    if there.startswith("docs/"):
        return there.removeprefix("docs/")
    return f"files/{there}.txt"


def linked(texts: dict[str, str]) -> dict[str, Path]:
    """Files of the project outside of the manuals that they link to, by the site's path."""
    wanted = {
        match[1]
        for text in texts.values()
        for match in LINK.finditer(text)
        if match[1].startswith("files/")
    }
    return {path: ROOT / path.removeprefix("files/").removesuffix(".txt") for path in wanted}


def reference() -> str:
    """The page of the Python API: every public name, from its docstring."""
    package = ast.parse((ROOT / "onboard/__init__.py").read_text(encoding="utf-8"))
    vocabulary = (ast.get_docstring(package) or "").split("Vocabulary, ")[1].split("\n\nUnits")[0]
    # The generator reads sources: names are documented where they are defined.
    source = ast.parse((ROOT / "onboard/api/__init__.py").read_text(encoding="utf-8"))
    defined = {
        alias.name: node.module
        for node in source.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    names = dict.fromkeys(["calibrate", "explain", "match", *sorted(defined)])
    told = [
        "# Reference",
        "Every name of `import onboard`; [From Python](python.md) shows how they are used.",
        *(f"::: {defined[name]}.{name}" for name in names),
        "## Vocabulary",
        f"```text\n{vocabulary.partition(chr(10))[2].strip()}\n```",
    ]
    return "\n\n".join(told) + "\n"


def notebook(text: str) -> str:
    """The example notebook as a page: its cells, and what they showed."""
    parts = []
    for cell in json.loads(text)["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        parts += [_shown(output) for output in cell.get("outputs", [])]
    return "\n\n".join(parts) + "\n"


def _shown(output: dict[str, Any]) -> str:
    data = output.get("data", {"text/plain": output.get("text", [])})
    if "text/html" in data:
        lines = "".join(data["text/html"]).splitlines()
        inner = "\n".join(line for line in lines if line.strip())
    elif "image/png" in data:
        inner = f'<img alt="What the cell drew" src="data:image/png;base64,{data["image/png"]}">'
    else:
        plain = "".join(data["text/plain"]).replace("&", "&amp;").replace("<", "&lt;")
        # An empty line would end the block of HTML.
        inner = f"<pre><code>{plain.rstrip()}</code></pre>".replace("\n\n", "\n&#8203;\n")
    return f'<div class="shown">\n{inner}\n</div>'


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Anchors as in the project's own view."""
    config.mdx_configs.setdefault("toc", {})["slugify"] = slug
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Put in what is not in the folder."""
    from mkdocs.structure.files import File  # noqa: PLC0415 - tests do without the generator

    texts = pages()
    for name, text in texts.items():
        files.append(File.generated(config, name, content=text))
    manuals = {
        file.src_uri: turned(file.content_string, PurePosixPath("docs", file.src_uri))
        for file in files.documentation_pages()
        if file.src_uri not in texts
    }
    for name, path in linked({**texts, **manuals}).items():
        files.append(File.generated(config, name, content=path.read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Turn the links of the manuals."""
    if page.file.generated_by is not None:
        return markdown
    return turned(markdown, PurePosixPath("docs", page.file.src_uri))


def on_page_content(html: str, **_: object) -> str:
    """Take out what is another generator's."""
    return ROLE.sub("", html)
