"""A bar that shows the progress of a render, in terminals and notebooks."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any

_WIDTH = 40


def _in_notebook() -> bool:
    try:
        from IPython import get_ipython  # type: ignore[import-not-found]
    except ImportError:
        return False
    shell = get_ipython()
    return shell is not None and hasattr(shell, "kernel")


class Bar:
    """A function of the share done that shows it; in files and pipes it shows nothing."""

    def __init__(self) -> None:
        self._start = time.monotonic()
        self._handle: Any = None
        self._in_notebook = _in_notebook()
        self._in_terminal = not self._in_notebook and sys.stderr.isatty()

    def __enter__(self) -> Bar:
        return self

    def __call__(self, share: float) -> None:
        text = f"{100 * share:3.0f} %, {time.monotonic() - self._start:.1f} s"
        if self._in_notebook:
            self._show(share, text)
        elif self._in_terminal:
            done = round(_WIDTH * share)
            sys.stderr.write(f"\r[{'#' * done}{' ' * (_WIDTH - done)}] {text} ")
            sys.stderr.flush()

    def _show(self, share: float, text: str) -> None:
        from IPython.display import HTML, display  # type: ignore[import-not-found]

        html = HTML(f'<progress value="{share:.4f}" max="1" style="width: 20em"></progress> {text}')
        if self._handle is None:
            self._handle = display(html, display_id=True)
        else:
            self._handle.update(html)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._in_terminal:
            sys.stderr.write("\n")
