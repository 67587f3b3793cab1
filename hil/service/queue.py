"""Between tasks that run at their own speed: a bounded queue that drops what is oldest, and counts it."""

from __future__ import annotations

import threading
from collections import deque
from typing import Generic, TypeVar

Queued = TypeVar("Queued")


class BoundedQueue(Generic[Queued]):
    """From one thread to another. The giver never waits: when the taker is too slow, the oldest item goes.

    >>> queue = BoundedQueue[int](2)
    >>> for k in range(3):
    ...     queue.put(k)
    >>> queue.take(), queue.dropped
    ([1, 2], 1)
    """

    def __init__(self, capacity: int) -> None:
        self.capacity, self.dropped = capacity, 0
        self._items: deque[Queued] = deque()
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._items)

    @property
    def full(self) -> bool:
        """Whether the next item would drop another."""
        return len(self._items) >= self.capacity

    def put(self, item: Queued) -> None:
        """Add an item, at once."""
        with self._lock:
            if len(self._items) >= self.capacity:
                self._items.popleft()
                self.dropped += 1
            self._items.append(item)

    def take(self, most: int | None = None) -> list[Queued]:
        """All that waits, oldest first, or the `most` oldest of it."""
        with self._lock:
            if most is None or most >= len(self._items):
                taken, self._items = list(self._items), deque()
                return taken
            return [self._items.popleft() for _ in range(most)]
