"""What mkdocs does not do by itself for the guide.

Links to files outside of `docs` lead to copies of them, so that the site needs neither a server nor the network. Formulas between dollar signs,
which other viewers of Markdown set, too, become MathML, which every browser draws by itself: no script, no font, no network.
"""

import html
import posixpath
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

# Pages that stand at the root of the repository, for whoever looks there.
ROOT_PAGES = {"CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
# Blocks and spans of code, in which nothing is a link or a formula.
CODE = re.compile(r"(^ *```.*?^ *```$|`[^`\n]*`)", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"(\]\()([^)\s#:]+)(#[^)\s]*)?(\))")
BLOCK = re.compile(r"^( *)\$\$\n(.*?)\n *\$\$$", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"(?<![\\$\w])\$(?![\s$])([^$\n]+?)(?<![\s\\])\$(?![\w$])")
REPOSITORY = Path(__file__).parents[3]

formulas: list[str] = []


def outside_code(text: str, change: Any) -> str:
    """Changes all of a page but its code."""
    return "".join(part if i % 2 else change(part) for i, part in enumerate(CODE.split(text)))


def source(file: File) -> str:
    """Path of a page in the repository."""
    roots = {page: path for path, page in ROOT_PAGES.items()}
    return roots.get(file.src_uri, f"docs/{file.src_uri}")


def target(link: str, page: str) -> str:
    """Where a link of a page leads, as a path of the site's sources."""
    path = posixpath.normpath(posixpath.join(posixpath.dirname(page), link))
    if path in ROOT_PAGES:
        return ROOT_PAGES[path]
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    if path.startswith("..") or not (REPOSITORY / path).exists():
        raise PluginError(f"{page}: {link} is not in the repository")
    if (REPOSITORY / path / "README.md").is_file():
        path += "/README.md"
    return f"repository/{path}.txt"


def copy(path: str) -> bytes:
    """What the site has of a file; of a folder, the names in it."""
    original = REPOSITORY / path
    if original.is_file():
        return original.read_bytes()
    return "".join(f"{name}\n" for name in sorted(file.name for file in original.iterdir())).encode()


def on_files(files: Files, config: Any) -> Files:
    """Adds the pages at the root, and a copy of every file that a page links to."""
    for path, page in ROOT_PAGES.items():
        files.append(File.generated(config, page, abs_src_path=str(REPOSITORY / path)))
    for file in list(files.documentation_pages()):
        page = source(file)

        def add(part: str, page: str = page) -> str:
            for _, link, _, _ in LINK.findall(part):
                path = target(link, page)
                if path.startswith("repository/") and files.get_file_from_path(path) is None:
                    content = copy(path.removeprefix("repository/").removesuffix(".txt"))
                    files.append(File.generated(config, path, content=content))
            return part

        outside_code(file.content_string, add)
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links to where they lead in the site; formulas out of Markdown's way."""
    path = source(page.file)

    def moved(match: re.Match[str]) -> str:
        begin, link, anchor, end = match.groups()
        to = target(link, path)
        anchor = "" if to.startswith("repository/") else anchor or ""
        return begin + posixpath.relpath(to, posixpath.dirname(page.file.src_uri) or ".") + anchor + end

    def kept(latex: str, display: str) -> str:
        formulas.append(convert(html.unescape(latex), display=display))
        return f"FORMULA{len(formulas) - 1}ALUMROF"

    def change(part: str) -> str:
        part = LINK.sub(moved, part)
        part = BLOCK.sub(lambda m: m[1] + kept(m[2], "block"), part)
        return INLINE.sub(lambda m: kept(m[1], "inline"), part)

    return outside_code(markdown, change)


def on_page_content(html: str, **_: Any) -> str:
    """Formulas where they belong."""
    return re.sub(r"FORMULA(\d+)ALUMROF", lambda m: formulas[int(m[1])], html)
