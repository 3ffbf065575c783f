"""Formulas become MathML when the site is built: pages need no script and no other machine."""

from __future__ import annotations

import html
import re
from typing import Any

from latex2mathml.converter import convert

#: What pymdownx.arithmatex leaves: \(...\) in a span, \[...\] in a div.
_INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
_DISPLAY = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)
#: A formula that is wider than a phone scrolls, like a table.
_SCROLLS = '<div style="overflow-x: auto">{}</div>'


def on_page_content(content: str, **_: Any) -> str:
    """Replace every formula of a page."""
    content = _INLINE.sub(lambda m: convert(html.unescape(m[1])), content)
    return _DISPLAY.sub(
        lambda m: _SCROLLS.format(convert(html.unescape(m[1]), display="block")), content
    )
