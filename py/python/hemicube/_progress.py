"""What hears of progress: a bar, or what the caller gives."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from ._errors import InputError

Progress = bool | Callable[[int, int], object] | None
Hearer = Callable[[str, int, int], None]


def hearer(progress: Progress) -> Hearer | None:
    """What long work calls with the stage, the units done and those in all."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return _Bar()
    if not callable(progress):
        raise InputError(f"progress={progress!r}: give True, or a function of (done, total)")

    def hear(_: str, done: int, total: int) -> None:
        progress(done, total)

    return hear


class _Bar:
    """One line on stderr, which goes away in the end."""

    WIDTH = 32

    def __init__(self) -> None:
        self.stage, self.began, self.shown = "", time.monotonic(), 0

    def __call__(self, stage: str, done: int, total: int) -> None:
        if stage != self.stage:
            self.stage, self.began = stage, time.monotonic()
        text = f"{stage:16}"
        if total > 0:
            share = min(done / total, 1.0)
            text += f" {'#' * round(self.WIDTH * share):{self.WIDTH}} {100 * share:3.0f} %"
            if share > 0.02:
                left = (time.monotonic() - self.began) * (1 - share) / share
                text += f"  {left:.0f} s left"
        self._show(text)

    def __del__(self) -> None:
        if self.shown:
            self._show("")
            sys.stderr.write("\r")

    def _show(self, text: str) -> None:
        sys.stderr.write("\r" + text.ljust(self.shown))
        sys.stderr.flush()
        self.shown = len(text)
