"""Page of `exograv data view`: its files for a server, or one HTML file that holds everything."""

import base64
import json
import re
from dataclasses import asdict, dataclass

from exograv.model.scene import SceneDescription

from .page_files import page_files
from .view_motion import Motion

MODULES = ("vendor/three/three.min.js", "figure3d.js", "view3d.js", "view.js")
"""Modules of the page, each before those that import it."""

IMPORT = re.compile(r'from "\./([\w./]+)"')


@dataclass(frozen=True)
class ViewData:
    """Content of the page of `exograv data view`: the scene, and the motion if a recording is shown."""

    title: str
    about: str
    """Line below the title: the machine's side and the person."""

    scene: SceneDescription
    is_simulated: bool = False
    motion: Motion | None = None
    """Motion of a recording; None for a machine with sliders."""

    @property
    def element(self) -> str:
        """Element of the page that holds the content. It is no script: the strict policy of the pages allows it."""
        data = {
            "title": self.title,
            "about": self.about,
            "is_simulated": self.is_simulated,
            "motion": None if self.motion is None else asdict(self.motion),
            "scene": json.loads(self.scene.text),
        }
        text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        # A text in the data must not end the element.
        return f'<script type="application/json" id="data">{text.replace("<", chr(92) + "u003c")}</script>'


def served_page(data: ViewData) -> str:
    """Page for a server that also serves the files of all pages."""
    return page_files()["view.html"].decode().replace("</head>", f"{data.element}\n</head>")


def single_page(data: ViewData) -> str:
    """Page with style, scripts and content in one file. It loads nothing, and opens without a server."""
    files = page_files()
    page = files["view.html"].decode()
    page = page.replace('<link rel="icon" href="/files/icon.svg">\n', "")
    page = page.replace(
        '<link rel="stylesheet" href="/files/style.css">', f"<style>\n{files['style.css'].decode()}</style>"
    )
    # Modules in one file find each other by an import map, and as data: a relative path would need a server.
    addresses = {f"exograv/{name}": _address(name, files[name].decode()) for name in MODULES}
    scripts = (
        f'<script type="importmap">{json.dumps({"imports": addresses})}</script>\n{data.element}\n'
        f'<script type="module">import "exograv/{MODULES[-1]}";</script>'
    )
    return page.replace('<script type="module" src="/files/view.js"></script>', scripts)


def _address(name: str, text: str) -> str:
    folder = name.rpartition("/")[0]
    text = IMPORT.sub(lambda found: f'from "exograv/{folder + "/" if folder else ""}{found[1]}"', text)
    return f"data:text/javascript;base64,{base64.b64encode(text.encode()).decode()}"
