"""`select_box`: a person draws a box on a frame."""

from __future__ import annotations

import os
import socket
import sys
import webbrowser
from typing import TYPE_CHECKING, Literal
from urllib.parse import urlsplit

from patchlock._patchlock import _select_boxes
from patchlock._types import Box

if TYPE_CHECKING:
    from patchlock._types import FrameLike

_HEIGHT = 620
"""Height of the page in a notebook, in pixels."""


def select_box(
    frame: FrameLike,
    *,
    channels: Literal["rgb", "bgr"] = "rgb",
    browser: bool = True,
    port: int = 0,
    address: str | None = None,
) -> Box:
    """Shows a frame and waits until a person has drawn a box on it, with mouse, finger or keys.

    In a notebook the page is shown below the cell; elsewhere it is opened in the browser, and its address is
    printed on standard error. The page is served to this machine only: from another one, it is reached
    through an ssh tunnel, whose command is printed, or through a proxy, whose `address` you give.

    Args:
        frame: An array or a PIL image.
        channels: Channel order of a colour array: `"bgr"` for images read by OpenCV.
        browser: Whether to open a browser outside notebooks, or only to print the address.
        port: Port of the page; with 0 the system chooses a free one.
        address: Address at which a proxy serves the page, with `{port}` for its port, such as
            `"https://hub.example.org/user/me/proxy/{port}/"` of jupyter-server-proxy.

    Returns:
        The box: x, y, w, h in pixels, counted from 0.

    Raises:
        RuntimeError: The person has cancelled.
        ValueError: The frame or the address is invalid.
        OSError: The port is taken.
        TypeError: The frame is neither an array nor an image.
    """
    in_notebook = _in_notebook()
    host = None if address is None else _host(address)

    def opened(here: str, once: str) -> None:
        page = here if address is None else _outside(address, here)
        if in_notebook:
            from IPython.display import IFrame, display

            if address is None:
                print(f"If no page is shown, the browser is on another machine. {_tunnel(here)}", flush=True)
            display(IFrame(page, width="100%", height=_HEIGHT))  # type: ignore[no-untyped-call]
            return
        print(f"draw a box on the page {page}", file=sys.stderr, flush=True)
        if address is None and "SSH_CONNECTION" in os.environ:
            print(f"from another machine: {_tunnel(here)}", file=sys.stderr, flush=True)
        if browser and address is None:
            webbrowser.open(once)

    boxes = _select_boxes(frame, channels, in_notebook, port, host, opened)
    return Box(*boxes[0])


def _host(address: str) -> str:
    """The host of an address, with its port."""
    parts = urlsplit(address.replace("{port}", "0"))
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment:
        raise ValueError(
            f"address is {address!r}; it must be http://HOST/PATH/ or https://HOST/PATH/, with {{port}} for the"
            " port of the page"
        )
    # The port of the page may be in place of that of the host.
    return parts.netloc.rpartition(":")[0] if "{port}" in urlsplit(address).netloc else parts.netloc


def _outside(address: str, here: str) -> str:
    """The address of the page behind a proxy; `here` is that on this machine, with the token."""
    parts = urlsplit(here)
    return f"{address.replace('{port}', str(parts.port)).rstrip('/')}/#{parts.fragment}"


def _tunnel(here: str) -> str:
    """How a browser of another machine reaches the page of this one."""
    port = urlsplit(here).port
    connection = os.environ.get("SSH_CONNECTION", "").split()
    host = connection[2] if len(connection) > 2 else socket.gethostname()
    # A user of a container may have no name.
    command = f"ssh -N -L {port}:localhost:{port} {os.environ.get('USER', 'USER')}@{host}"
    return f"Run there: {command}; then open {here}. Or give the address at which a proxy serves the page."


def _in_notebook() -> bool:
    """Whether this is a kernel of Jupyter."""
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"
