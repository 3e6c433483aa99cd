"""`select_box`: a person draws a box on a frame."""

from __future__ import annotations

import sys
import webbrowser
from typing import TYPE_CHECKING, Literal

from patchlock._patchlock import _select_boxes
from patchlock._types import Box

if TYPE_CHECKING:
    from patchlock._types import FrameLike

_HEIGHT = 620
"""Height of the page in a notebook, in pixels."""


def select_box(frame: FrameLike, *, channels: Literal["rgb", "bgr"] = "rgb", browser: bool = True) -> Box:
    """Shows a frame and waits until a person has drawn a box on it, with mouse, finger or keys.

    In a notebook the page is shown below the cell, if the browser runs on the machine of the kernel;
    elsewhere it is opened in the browser, and its address is printed on standard error. The page is served
    to this machine only.

    Args:
        frame: An array or a PIL image.
        channels: Channel order of a colour array: `"bgr"` for images read by OpenCV.
        browser: Whether to open a browser outside notebooks, or only to print the address.

    Returns:
        The box: x, y, w, h in pixels, counted from 0.

    Raises:
        RuntimeError: The person has cancelled.
        ValueError: The frame is invalid.
        TypeError: The frame is neither an array nor an image.
    """
    in_notebook = _in_notebook()

    def opened(address: str, once: str) -> None:
        if in_notebook:
            from IPython.display import IFrame, display

            display(IFrame(address, width="100%", height=_HEIGHT))  # type: ignore[no-untyped-call]
            return
        print(f"draw a box on the page {address}", file=sys.stderr, flush=True)
        if browser:
            webbrowser.open(once)

    boxes = _select_boxes(frame, channels, in_notebook, opened)
    return Box(*boxes[0])


def _in_notebook() -> bool:
    """Whether this is a kernel of Jupyter."""
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"
