"""The notebooks of the tutorial: pages of the site, and executed anew in place.

As a hook of mkdocs it makes a page of each notebook, from the outputs that are stored in it. As a script,
``python docs/_site/notebooks.py``, it executes them and stores what they print and draw.
"""

from __future__ import annotations

import base64
import json
import re
import tempfile
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[1] / "tutorial"
#: A page links to a notebook as it lies in the repository; the site has the page made of it.
_LINK = re.compile(r"(\]\((?!https?:)[^)\s]*)\.ipynb(?=[)#])")


def on_files(files: Any, config: Any) -> Any:
    """Add a page, and its pictures, for every notebook."""
    from mkdocs.structure.files import File

    for file in [f for f in files if f.src_uri.endswith(".ipynb")]:
        stem = file.src_uri.removesuffix(".ipynb")
        text, pictures = page_of(json.loads(file.content_string), Path(stem).name)
        files.append(File.generated(config, f"{stem}.md", content=text))
        for name, content in pictures.items():
            where = str(Path(stem).parent / name)
            files.append(File.generated(config, where, content=content))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Let links to notebooks lead to their pages; such a page offers the notebook itself."""
    text = _LINK.sub(r"\1.md", markdown)
    if (FOLDER.parent / page.file.src_uri).with_suffix(".ipynb").is_file():
        name = Path(page.file.src_uri).with_suffix(".ipynb").name
        text += f"\n\n[This page as a notebook]({name}){{ download }}\n"
    return text


def page_of(notebook: dict[str, Any], stem: str) -> tuple[str, dict[str, bytes]]:
    """Return a notebook as Markdown, and its pictures by file name."""
    parts: list[str] = []
    pictures: dict[str, bytes] = {}
    for cell in notebook["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        for output in cell["outputs"]:
            data = output.get("data", {"text/plain": output.get("text", "")})
            if "image/png" in data:
                name = f"{stem}-{len(pictures) + 1}.png"
                pictures[name] = base64.b64decode("".join(data["image/png"]))
                parts.append(f"![What the code above draws]({name})")
            elif "text/html" in data:
                parts.append(f'<div class="output">{"".join(data["text/html"])}</div>')
            else:
                parts.append(f"```text\n{''.join(data['text/plain']).rstrip()}\n```")
    return "\n\n".join(parts) + "\n", pictures


def execute(path: Path) -> Any:
    """Return a notebook as it is after a run in an empty folder, without what differs from run to run."""
    import nbformat
    from nbclient import NotebookClient

    book = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        where = {"metadata": {"path": folder}}
        NotebookClient(book, timeout=600, resources=where).execute()
    for cell in book.cells:
        cell.metadata.clear()
    book.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    return book


def main() -> None:
    """Execute every notebook and store it with its outputs."""
    import nbformat

    for path in sorted(FOLDER.glob("*.ipynb")):
        nbformat.write(execute(path), path)
        print(path)


if __name__ == "__main__":
    main()
