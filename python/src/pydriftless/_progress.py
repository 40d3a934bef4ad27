"""Progress bars, where tqdm is installed."""

from __future__ import annotations

from typing import Any


def progress_bar(wanted: bool, total: float | None, **look: Any) -> Any:
    """A bar up to ``total``, or None where none is wanted or tqdm is missing."""
    if not wanted:
        return None
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return tqdm(total=total, **look)
